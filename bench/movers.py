#!/usr/bin/env python3
"""`portolan.Movers` beside the `dufomap` wheel: what each takes out of the same scans, of what moved and of what did not.

    pip install target/wheels/portolan-*.whl dufomap
    cargo run --release -p portolan-sim --example walkers -- WALKERS [200 [0.02]]
    python3 bench/movers.py WALKERS [--sigma 0.02 0.03] [--runs 3] [--json FILE]
    python3 bench/movers.py shared/data/lidar3d_balm_hall --poses shared/data/lidar3d_balm_hall/alidarPose.csv

A folder has `velodyne/NNNNNN.bin` (float32 x, y, z, intensity), `poses.txt` (KITTI's rows, world from lidar: a `Tr` that is not the
identity is refused) and `labels/NNNNNN.label` (uint32; its low 16 bits 252 to 259 are of what moves, as in SemanticKITTI), or
binary PCD files with `--poses`, 4x4 blocks, one for every scan number. Without labels the table has what was taken out, how far the
two agree, and what was taken out although two later scans, `--apart` or more after it, have returns in the same cell of 10 cm.

Both get all scans first and are asked about every return then, in float32 points and with the same poses, one CPU and one thread each,
each run in a process of its own: constructors and files are outside of the clock, matching portolan's points to returns, too. Runs
of all take turns, seconds are medians. Memory is what a process grew by at most before it was asked. What portolan loses comes first.
"""
import argparse
import ctypes
import importlib.metadata
import json
import multiprocessing
import os
import platform
import re
import statistics
import sys
import time
from pathlib import Path

import numpy as np

from kiss_icp import points_of, poses_of

#: Voxel, d_s (meters) and d_p: the paper's and its program's; a larger voxel; those of the Python package's example; and the two of
#: fourteen that did best on the simulated walks (least of both errors, and poses off by more).
DUFOMAP = [(0.1, 0.2, 1), (0.15, 0.2, 1), (0.1, 0.1, 2), (0.1, 0.3, 1), (0.1, 0.3, 2)]
MOVING = range(252, 260)
#: Edge of the cells in which later scans confirm a return (meters).
CONFIRMED = 0.1


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scans", type=Path)
    parser.add_argument("--poses", type=Path, help="4x4 blocks, for PCD files")
    parser.add_argument("--sigma", type=float, nargs="+", default=[0.02, 0.03],
                        help="standard deviations of a pose that portolan is told (m); the first is compared")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--apart", type=int, default=10, help="scans between a return and those that confirm it")
    parser.add_argument("--json", type=Path, help="where all figures are written")
    return parser.parse_args()


def scans_of(folder, poses):
    """Points in the lidar's frame and 4x4 poses, and labels where there are any."""
    if poses:
        number = lambda file: int(re.findall(r"\d+", file.stem)[-1])
        files = sorted(folder.glob("*.pcd"), key=number)
        matrices = poses_of(poses)[[number(file) for file in files]]
        return [(np.ascontiguousarray(points_of(f)), m) for f, m in zip(files, matrices)], None
    calib = dict(line.split(":") for line in (folder / "calib.txt").read_text().splitlines())
    assert np.allclose(np.array(calib["Tr"].split(), float).reshape(3, 4), np.eye(4)[:3]), "poses of a camera"
    files = sorted((folder / "velodyne").glob("*.bin"))
    matrices = np.tile(np.eye(4), (len(files), 1, 1))
    matrices[:, :3] = np.loadtxt(folder / "poses.txt").reshape(-1, 3, 4)
    points = [np.ascontiguousarray(np.fromfile(f, "<f4").reshape(-1, 4)[:, :3]) for f in files]
    labels = [folder / "labels" / f"{f.stem}.label" for f in files]
    moves = None
    if labels[0].exists():
        moves = [np.isin(np.fromfile(f, "<u4") & 0xFFFF, list(MOVING)) for f in labels]
        assert [len(m) for m in moves] == [len(p) for p in points], "a label for each point"
    return list(zip(points, matrices)), moves


def world(points, pose):
    return points.astype(np.float64) @ pose[:3, :3].T + pose[:3, 3]


def with_portolan(scans, sigma, clocks):
    import portolan

    movers = portolan.Movers(sigma)
    clocks()
    for points, pose in scans:
        movers.look(points, pose)
    clocks()
    parts = [movers.split(points, pose) for points, pose in scans]
    clocks()
    # Returns at one place have one answer.
    key = lambda p: np.ascontiguousarray(p, np.float32).view("V12").ravel()
    taken = [~np.isin(key(points), key(rest.points)) for (points, _), (rest, _) in zip(scans, parts)]
    assert all(t.sum() == len(gone) for t, (_, gone) in zip(taken, parts)), "a return for each point"
    return taken


def with_dufomap(scans, settings, clocks):
    from dufomap import dufomap

    mapper = dufomap(*settings, num_threads=1)
    clocks()
    for points, pose in scans:
        mapper.run(points, pose, cloud_transform=True)
    clocks()
    taken = [mapper.segment(points, pose, cloud_transform=True) for points, pose in scans]
    clocks()
    return [t.astype(bool) for t in taken]


def status(what):
    return next(int(line.split()[1]) / 1024 for line in open("/proc/self/status") if line.startswith(what))


def child(work, scans, settings, pipe):
    os.sched_setaffinity(0, [min(os.sched_getaffinity(0))])
    stamps = []

    def clocks():
        if not stamps:
            ctypes.CDLL(None).malloc_trim(0)
            Path("/proc/self/clear_refs").write_text("5")
            stamps.append(status("VmRSS"))
        stamps.append((time.perf_counter(), time.process_time()))
        if len(stamps) == 3:
            stamps.append(status("VmHWM"))

    taken = work(scans, settings, clocks)
    rss, start, looked, most, done = stamps
    wall, cpu = ([looked[k] - start[k], done[k] - looked[k]] for k in (0, 1))
    pipe.send((taken, {"wall_s": wall, "cpu_s": cpu, "grew_mib": most - rss}))


def run(work, scans, settings):
    ours, theirs = multiprocessing.Pipe(duplex=False)
    process = multiprocessing.get_context("fork").Process(target=child, args=(work, scans, settings, theirs))
    process.start()
    theirs.close()
    result = ours.recv()
    process.join()
    return result


def confirmed(scans, apart):
    """Of each return whether two scans, `apart` or more after it, have returns in its cell."""
    cells = [np.floor(world(*scan) / CONFIRMED).astype(np.int64) @ [1, 1 << 20, 1 << 40] for scan in scans]
    visits = np.concatenate([np.unique(c) for c in cells])
    by = np.concatenate([np.full(len(np.unique(c)), i) for i, c in enumerate(cells)])
    order = np.lexsort((by, visits))
    visits, by = visits[order], by[order]
    # Of each cell the last scan but one that has a return there.
    ends = np.flatnonzero(np.append(visits[1:] != visits[:-1], True))
    last_but_one = np.where((ends > 0) & (visits[ends - 1] == visits[ends]), by[ends - 1], -1)
    return [last_but_one[np.searchsorted(visits[ends], c)] >= i + apart for i, c in enumerate(cells)]


def share(a, b):
    return 100.0 * np.count_nonzero(a) / max(np.size(b), 1)


def main():
    args = arguments()
    for name in ("RAYON", "OMP", "OPENBLAS", "MKL", "TBB"):
        os.environ[f"{name}_NUM_THREADS"] = "1"
    scans, moves = scans_of(args.scans, args.poses)
    total = sum(len(points) for points, _ in scans)
    versions = {p: importlib.metadata.version(p) for p in ("portolan", "dufomap", "numpy")}
    versions = {"python": platform.python_version(), **versions}
    print(", ".join(f"{name} {version}" for name, version in versions.items()))
    moving = None if moves is None else np.concatenate(moves)
    known = "no labels" if moves is None else f"{np.count_nonzero(moving):,} of what moves"
    print(f"{len(scans)} scans, {total:,} returns, {known}; one thread on one CPU, load {os.getloadavg()[0]:.1f}, {args.runs} runs in turns")
    who = {f"portolan, sigma {s} m": (with_portolan, s) for s in args.sigma}
    who |= {f"dufomap, voxel {v} m, d_s {s} m, d_p {p}": (with_dufomap, (v, s, p)) for v, s, p in DUFOMAP}
    times, taken = {name: [] for name in who}, {}
    for _ in range(args.runs):
        for name, (work, settings) in who.items():
            labels, figures = run(work, scans, settings)
            labels = np.concatenate(labels)
            assert np.array_equal(taken.setdefault(name, labels), labels), f"{name}: another answer"
            times[name].append(figures)
            print(".", end="", flush=True)
    print()

    sure = np.concatenate(confirmed(scans, args.apart))
    rows = {}
    for name, labels in taken.items():
        median = lambda key: statistics.median(sum(t[key]) for t in times[name])
        row = {"removed": share(labels, labels)}
        if moves is None:
            row["removed, confirmed"] = share(labels & sure, labels)
        else:
            row["moved"] = share(labels[moving], labels[moving])
            row["static"] = share(labels[~moving], labels[~moving])
        row |= {"s": median("wall_s"), "cpu s": median("cpu_s")}
        row["MiB"] = statistics.median(t["grew_mib"] for t in times[name])
        rows[name] = row

    ours = next(iter(rows))
    most = {"moved"}
    lost = []
    for name, row in rows.items():
        for what in row if name.startswith("dufomap") else ():
            a, b = rows[ours][what], row[what]
            if what not in ("removed", "cpu s") and (a < b if what in most else a > b):
                lost.append(f"  {what}: {a:.3f}, {name} {b:.3f}")
    print(f"{ours} loses:", *(lost or ["  nothing"]), sep="\n")
    # Those of whom little is kept, or many are lost, first.
    badness = lambda row: row["static"] + 100 - row["moved"] if moves is not None else row["removed, confirmed"]
    print(f"\n{'':<44}" + "".join(f"{what:>20}" for what in rows[ours]) + "   (shares in %)")
    for name, row in sorted(rows.items(), key=lambda r: -badness(r[1])):
        print(f"{name:<44}" + "".join(f"{value:20.3f}" for value in row.values()))
    agree = {}
    for name, labels in taken.items():
        if name != ours:
            count = lambda which: int(np.count_nonzero(which))
            both, either = count(labels & taken[ours]), count(labels | taken[ours])
            only = [count(labels & ~taken[ours]), count(taken[ours] & ~labels)]
            agree[name] = {"both": both, "only it": only[0], "only portolan": only[1], "both of either": float(both / max(either, 1))}
            print(f"{name} and {ours}: both {both:,}, it alone {only[0]:,}, portolan alone {only[1]:,}")
    if args.json:
        found = {"versions": versions, "scans": len(scans), "returns": total, "load": os.getloadavg()[0], "runs": args.runs}
        found |= {"moving": None if moves is None else int(np.count_nonzero(moving)), "apart": args.apart, "sigma": args.sigma}
        found |= {"confirmed": share(sure, sure), "rows": rows, "agree": agree, "times": times}
        args.json.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    sys.exit(main())
