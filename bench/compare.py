#!/usr/bin/env python3
"""portolan beside its peers on the same bytes: one table of medians and ratios.

    cargo build --release -p portolan-cli --example workload
    python3 bench/compare.py --data DIR [--only occupancy depth-tsdf] [--repeats 3]

DIR holds `lidar_building/` (KITTI layout), `rgbd_building/` (7-Scenes layout, millimetres) and `grids/`. The
interpreter needs the peers (octomap-python, open3d, vtk, scikit-image, PyMCubes); those that are not installed are
named and left out. Runs of portolan and of each peer take turns, so that a machine that slows down slows both.
"""
import argparse
import json
import statistics
import subprocess
import sys
from pathlib import Path

from peers import PEERS

HERE = Path(__file__).resolve().parent
OURS = HERE.parent / "target" / "release" / "examples" / "workload"

# workload, variant of ours, resolution, peer options
ROWS = [
    ("occupancy", ["--sweep", "auto"], 0.10, []),
    ("occupancy", ["--sweep", "auto"], 0.05, []),
    ("occupancy", ["--sweep", "exact"], 0.10, []),
    ("occupancy", ["--sweep", "exact"], 0.05, []),
    ("lidar-tsdf", ["--carve"], 0.10, ["--carve"]),
    ("lidar-tsdf", ["--carve"], 0.05, ["--carve"]),
    ("lidar-tsdf", [], 0.10, []),
    ("depth-tsdf", [], 0.02, []),
    ("depth-tsdf", ["--carve"], 0.02, []),
    ("depth-tsdf", [], 0.01, []),
    ("depth-tsdf", ["--carve"], 0.01, []),
    ("surface", [], 0.0, []),
    ("query", [], 0.10, []),
]


def run(command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode != 0:
        return {"missing": (done.stderr.strip().splitlines() or ["failed"])[-1]}
    return json.loads(done.stdout.strip().splitlines()[-1])


def unit(per_item):
    return f"{1e9 * per_item:8.1f} ns" if per_item < 1e-5 else f"{1e3 * per_item:8.2f} ms"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--only", nargs="*", choices=PEERS)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--scans", type=int, default=20)
    parser.add_argument("--no-peers", action="store_true")
    args = parser.parse_args()
    if not OURS.is_file():
        sys.exit(f"{OURS}: not there; build it with cargo build --release -p portolan-cli --example workload")
    print("one item: a scan, a volume, a point; medians of", args.repeats)
    print(f"{'workload':<34}{'who':<22}{'threads':>8}{'an item':>14}{'against 1 thread':>18}{'peak':>10}")
    for workload, variant, resolution, options in ROWS:
        if args.only and workload not in args.only:
            continue
        name = " ".join([workload, *(v.strip("-") for v in variant if v != "--sweep")])
        name += f" {100 * resolution:g} cm" if resolution else ""
        peers = [] if args.no_peers else PEERS[workload]
        competitors = [("portolan", 1), ("portolan", 2)] + [(peer, 1) for peer in peers]
        times, last = {c: [] for c in competitors}, {}
        for _ in range(args.repeats):
            for who, threads in competitors:
                common = ["--data", args.data, "--resolution", resolution, "--scans", args.scans]
                common += ["--repeats", 1, "--threads", threads]
                if who == "portolan":
                    out = run([OURS, workload, *variant, *common])
                else:
                    out = run([sys.executable, HERE / "peers.py", workload, who, *options, *common])
                last[who, threads] = out
                if "seconds" in out:
                    times[who, threads].append(min(out["seconds"]) / out["per"])
        ours = statistics.median(times["portolan", 1]) if times["portolan", 1] else None
        for who, threads in competitors:
            if not times[who, threads]:
                print(f"{name:<34}{who:<22}{threads:>8}  not measured: {last[who, threads].get('missing')}")
                continue
            median = statistics.median(times[who, threads])
            ratio = f"{median / ours:.2f}x" if ours else ""
            peak = last[who, threads]["peak"] / 1e6
            print(f"{name:<34}{who:<22}{threads:>8}{unit(median):>14}{ratio:>18}{peak:>7.0f} MB", flush=True)


if __name__ == "__main__":
    main()
