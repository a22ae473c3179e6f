"""A log in parts: the bytes of the log in one."""

import math
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import portolan.cluster
from conftest import DATA


def room(path, scans=24):
    """A CARMEN log of a lap in a room of 6 m x 4 m."""
    lines = []
    for i in range(scans):
        x, y, theta = 3 + math.cos(0.3 * i), 2 + 0.8 * math.sin(0.3 * i), 0.3 * i
        ranges = []
        for b in range(180):
            a = theta + math.radians(b - 90)
            c, s = math.cos(a), math.sin(a)
            to = lambda p, d, far: (far - p) / d if d > 1e-12 else -p / d if d < -1e-12 else math.inf
            ranges.append(f"{min(to(x, c, 6), to(y, s, 4)):.3f}")
        pose = f"{x:.4f} {y:.4f} {theta:.5f}"
        lines.append(f"FLASER 180 {' '.join(ranges)} {pose} {pose} {0.1 * i:.2f} host {0.1 * i:.2f}\n")
    path.write_text("".join(lines))
    return path


def serial(log, out, *options):
    portolan._portolan.call(["portolan", "map", str(log), "--ledger", "--quiet", f"--out={out}", *options])
    return (Path(out) / "map.portolan").read_bytes()


@pytest.mark.parametrize("parts", [1, 2, 5])
def test_parts_on_processes(tmp_path, parts):
    log = room(tmp_path / "room.log")
    seen = []
    portolan.cluster.map(
        log, tmp_path / "out", resolution=0.1, parts=parts, max_range=5.0, progress=lambda done, all: seen.append((done, all))
    )
    whole = serial(log, tmp_path / "whole", "--resolution=0.1", "--max-range=5.0")
    assert (tmp_path / "out" / "map.portolan").read_bytes() == whole
    assert (tmp_path / "out" / "contour.geojson").read_bytes() == (tmp_path / "whole" / "contour.geojson").read_bytes()
    assert seen[-1] == (2 * parts - 1, 2 * parts - 1)
    with pytest.raises(ValueError, match="overwrite=True"):
        portolan.cluster.map(log, tmp_path / "out", resolution=0.2, parts=parts)
    assert (tmp_path / "out" / "map.portolan").read_bytes() == whole
    portolan.cluster.map(log, tmp_path / "out", resolution=0.2, parts=parts, overwrite=True)
    assert (tmp_path / "out" / "map.portolan").read_bytes() != whole


def test_what_goes_wrong_is_said(tmp_path):
    with pytest.raises(ValueError, match="nothing.log"):
        portolan.cluster.map(tmp_path / "nothing.log", tmp_path / "out", resolution=0.1, parts=2)
    log = room(tmp_path / "room.log", 4)
    with pytest.raises(ValueError, match="shard"):
        portolan.cluster.map(log, tmp_path / "out", resolution=0.1, shard="1/2")
    with pytest.raises(ValueError, match="parts"):
        portolan.cluster.map(log, tmp_path / "out", resolution=0.1, parts=0)
    with pytest.raises(ValueError, match="resolution"):
        portolan.cluster.map(log, tmp_path / "out", resolution=-1, parts=2)
    assert not (tmp_path / "out").exists()


def children(of):
    """Processes below one, where the system lists them."""
    below, todo = [], [of]
    while todo:
        parent = todo.pop()
        for task in Path(f"/proc/{parent}/task").glob("*/children"):
            try:
                found = [int(pid) for pid in task.read_text().split()]
            except OSError:
                continue
            below += found
            todo += found
    return below


def kill_a_worker(stop, killed):
    """Kills the first process that works on a part."""
    while not stop.is_set() and not killed:
        for pid in children(os.getpid()):
            try:
                words = Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")
                parent = int(Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[1])
                if b"map" in words and any(w.startswith(b"--shard=") for w in words):
                    os.kill(parent, signal.SIGKILL)
                    os.kill(pid, signal.SIGKILL)
                    killed.append(parent)
                    return
            except (OSError, IndexError, ValueError):
                continue
        time.sleep(0.02)


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="no list of processes to find a worker in")
def test_ray_loses_a_worker_and_not_a_byte(tmp_path):
    pytest.importorskip("ray", reason="Ray is not installed (pip install ray)")
    hall = DATA / "lidar3d_balm_hall"
    if not hall.exists():
        log, options, more = room(tmp_path / "room.log", 200), ["--resolution=0.02"], {"resolution": 0.02}
    else:
        log, options = hall, ["--resolution=0.2", "--every=2", "--maps=tsdf"]
        more = {"resolution": 0.2, "every": 2, "maps": "tsdf"}
    whole = serial(log, tmp_path / "whole", *options)
    os.environ["RAY_raylet_start_wait_time_s"] = "240"
    os.environ["RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO"] = "0"
    import ray

    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, object_store_memory=200_000_000)
    try:
        stop, killed = threading.Event(), []
        killer = threading.Thread(target=kill_a_worker, args=(stop, killed))
        killer.start()
        try:
            portolan.cluster.map(log, tmp_path / "out", parts=4, ray=True, **more)
        finally:
            stop.set()
            killer.join()
    finally:
        ray.shutdown()
    assert killed, "no worker was found to be killed"
    assert (tmp_path / "out" / "map.portolan").read_bytes() == whole


def test_ray_is_asked_for_by_name():
    code = "import sys; sys.modules['ray'] = None; import portolan.cluster; portolan.cluster._Ray(True, 1)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 1 and "pip install ray" in done.stderr
