#!/usr/bin/env python3
"""portolan beside its peers on the same bytes: one table of medians and ratios, losses first.

    pip install ./crates/portolan-py
    python3 bench/compare.py --data DIR [--only occupancy depth-tsdf] [--repeats 3] [--json docs/record/FILE.json]

DIR holds `lidar_building/` (KITTI layout), `rgbd_building/` (7-Scenes layout, millimetres) and `grids/`. The interpreter needs
portolan's wheel and the peers (octomap-python, open3d, vtk, scikit-image, PyMCubes); those that are not installed are
named and left out. Runs of portolan and of each peer take turns, each in its own process, so that a machine that slows down
slows both; constructors are outside of the clock. The JSON has all seconds, versions, commit and machine.
"""
import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
from pathlib import Path

from peers import PEERS

HERE = Path(__file__).resolve().parent

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
    parser.add_argument("--json", type=Path, help="where everything that was measured is written")
    args = parser.parse_args()
    print("one item: a scan, a volume, a point; medians of", args.repeats)
    print(f"{'workload':<34}{'who':<26}{'threads':>8}{'an item':>14}{'spread':>8}{'against':>10}{'peak':>10}")
    rows = []
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
                ours = [*variant] if who == "portolan" else [*options]
                out = run([sys.executable, HERE / "peers.py", workload, who, *ours, *common])
                last[who, threads] = out
                if "seconds" in out:
                    times[who, threads].append(min(out["seconds"]) / out["per"])
        ours = statistics.median(times["portolan", 1]) if times["portolan", 1] else None
        for who, threads in competitors:
            row = {"name": name, "who": who, "threads": threads, **last[who, threads], "seconds": times[who, threads]}
            if times[who, threads] and ours:
                row["median"] = statistics.median(times[who, threads])
                row["ratio"] = row["median"] / ours
            rows.append(row)
            print(".", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    # The nearest to us, and those ahead of us, come first.
    best = {name: min((r["ratio"] for r in rows if r["name"] == name and r["who"] != "portolan" and "ratio" in r), default=9e9)
            for name in {r["name"] for r in rows}}
    for row in sorted(rows, key=lambda r: (best[r["name"]], r["name"])):
        name, who, threads = row["name"], row["who"], row["threads"]
        if "median" not in row:
            print(f"{name:<34}{who:<22}{threads:>8}  not measured: {row.get('missing')}")
            continue
        spread = (max(row["seconds"]) - min(row["seconds"])) / row["median"]
        peak = row["peak"] / 1e6
        print(f"{name:<34}{who + ' ' + str(row['version']):<26}{threads:>8}{unit(row['median']):>14}{100 * spread:>6.0f} %{row['ratio']:>9.2f}x{peak:>7.0f} MB")
    if args.json:
        commit = subprocess.run(["git", "-C", HERE, "rev-parse", "HEAD"], capture_output=True, text=True).stdout.strip()
        cpu = next((l.split(":")[1].strip() for l in open("/proc/cpuinfo") if l.startswith("model name")), platform.processor())
        about = {"commit": commit, "cpu": cpu, "cores": os.cpu_count(), "python": platform.python_version(), "load": os.getloadavg()}
        args.json.write_text(json.dumps({"about": about, "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
