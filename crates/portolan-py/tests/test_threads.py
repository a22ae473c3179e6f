"""Threads, interrupts, memory, and what importing and calling cost."""

import resource
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from conftest import room_scan

import portolan


def test_snapshots_are_read_while_scans_are_fused():
    ranges, bearings = room_scan()
    mapper = portolan.Mapper(0.05)
    mapper.integrate(ranges=ranges, bearings=bearings, pose=(0, 0, 0))
    occupancy, field = mapper.occupancy, mapper.esdf()
    points = np.random.default_rng(1).uniform(-2, 2, (5000, 2))
    want = occupancy.occupancy(points)[0], field.distance(points)[0]
    wrong, stop = [], threading.Event()

    def read():
        while not stop.is_set():
            got = occupancy.occupancy(points)[0], field.distance(points)[0]
            if not all(np.array_equal(a, b, equal_nan=True) for a, b in zip(got, want)):
                wrong.append(got)

    readers = [threading.Thread(target=read) for _ in range(3)]
    for reader in readers:
        reader.start()
    for k in range(100):
        mapper.integrate(ranges=ranges, bearings=bearings, pose=(0.01 * k, 0, 0))
        mapper.esdf()
    stop.set()
    for reader in readers:
        reader.join()
    assert not wrong and mapper.stats["scans"] == 101


def test_several_threads_fuse_into_one_map():
    ranges, bearings = room_scan()
    mapper = portolan.Mapper(0.05)
    threads = [
        threading.Thread(
            target=lambda: [mapper.integrate(ranges=ranges, bearings=bearings, pose=(0, 0, 0)) for _ in range(20)]
        )
        for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert mapper.stats["scans"] == 80


def test_other_threads_run_while_a_call_works():
    points = np.random.default_rng(2).uniform(-30, 30, (400_000, 3)).astype(np.float32)
    mapper = portolan.Mapper(0.1, sweep="exact")
    ticks, done = [], threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.001)

    ticker = threading.Thread(target=tick)
    ticker.start()
    start = time.perf_counter()
    mapper.integrate(points, np.eye(4))
    took = time.perf_counter() - start
    done.set()
    ticker.join()
    inside = [t for t in ticks if start < t < start + took]
    assert took > 0.05 and len(inside) > 5, (took, len(inside))


def test_ctrl_c_ends_a_long_call():
    program = """
import numpy as np, portolan, sys, threading, time, os, signal
# Also where whoever started the tests ignores it, as shells do for what they run in the background.
signal.signal(signal.SIGINT, signal.default_int_handler)
b = np.linspace(-3, 3, 400)
mapper = portolan.Mapper(0.05)
mapper.integrate(ranges=np.full(400, 2.0), bearings=b, pose=(0, 0, 0))
field, points = mapper.esdf(), np.zeros((200_000_000 // 8, 2))
threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
try:
    while True:
        field.clearance(points)
except KeyboardInterrupt:
    print("interrupted")
"""
    start = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120)
    assert done.stdout.strip() == "interrupted", done
    assert time.perf_counter() - start < 60


def test_memory_stays_the_same():
    ranges, bearings = room_scan(90)
    mapper = portolan.Mapper(0.1)
    points = np.zeros((64, 2))

    def calls(n):
        for _ in range(n):
            mapper.integrate(ranges=ranges, bearings=bearings, pose=(0, 0, 0))
            mapper.occupancy.occupancy(points)
            field = mapper.esdf()
            field.distance_and_gradient(points)
            field.clearance(points)
            mapper.tsdf.raycast([0, 0], points + 1)
            mapper.copy()
            try:
                field.distance(np.zeros((2, 5)))
            except ValueError:
                pass

    calls(500)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    calls(10_000)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown < 8 << 10, f"{grown} KiB more after 10,000 rounds of calls"


def test_importing_brings_no_numpy_and_is_fast():
    program = "import sys, time; t = time.perf_counter(); import portolan; print(time.perf_counter() - t, 'numpy' in sys.modules)"
    runs = [subprocess.run([sys.executable, "-c", program], capture_output=True, text=True) for _ in range(5)]
    seconds = [float(run.stdout.split()[0]) for run in runs]
    assert {run.stdout.split()[1] for run in runs} == {"False"}
    print(f"import portolan: {1e3 * min(seconds):.0f} ms")


def test_the_command_line_is_inside():
    for command in [["portolan"], [sys.executable, "-m", "portolan"]]:
        if command == ["portolan"]:
            from pathlib import Path

            command = [str(Path(sys.executable).parent / "portolan")]
        done = subprocess.run([*command, "--version"], capture_output=True, text=True)
        assert done.returncode == 0 and done.stdout.strip() == f"portolan {portolan.__version__}", done
        bad = subprocess.run([*command, "info", "/none"], capture_output=True, text=True)
        assert bad.returncode == 1 and bad.stderr.startswith("portolan: "), bad
        wrong = subprocess.run([*command, "map"], capture_output=True, text=True)
        assert wrong.returncode == 2, wrong


def test_ctrl_c_ends_the_command_line(tmp_path):
    studio = subprocess.Popen([sys.executable, "-m", "portolan", "studio", "--port", "0"], stdout=subprocess.PIPE)
    studio.stdout.readline()
    studio.send_signal(signal.SIGINT)
    studio.wait(timeout=20)


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_the_same_map_for_any_number_of_threads(threads, tmp_path):
    program = f"""
import numpy as np, portolan
from pathlib import Path
rng = np.random.default_rng(7)
mapper = portolan.Mapper(0.1)
for k in range(5):
    d = rng.normal(size=(20000, 3))
    mapper.integrate(3 * d / np.linalg.norm(d, axis=1)[:, None], (0.1 * k, 0, 0, 0, 0, 0, 1))
mapper.save({str(tmp_path / "map.portolan")!r})
"""
    import hashlib
    import os

    subprocess.run([sys.executable, "-c", program], check=True, env={**os.environ, "RAYON_NUM_THREADS": str(threads)})
    digest = hashlib.sha256((tmp_path / "map.portolan").read_bytes()).hexdigest()
    first = test_the_same_map_for_any_number_of_threads.__dict__.setdefault("digest", digest)
    assert digest == first
