#!/usr/bin/env python3
"""portolan beside its peers on the same bytes: one table of medians and ratios, losses first.

    pip install ./crates/portolan-py
    python3 bench/make_data.py DIR
    python3 bench/compare.py --data DIR [--only occupancy depth-tsdf] [--repeats 3] [--json docs/record/FILE.json]

The interpreter needs
portolan's wheel and the peers (octomap-python, open3d, vtk, scikit-image, PyMCubes); those that are not installed are
named and left out. Runs of portolan and of each peer take turns, each in its own process, so that a machine that slows down
slows both; constructors are outside of the clock. On a busy machine `--cpu` takes seconds of the CPU, of one thread only. The JSON has all seconds, versions, commit and machine.
"""
import argparse
import json
import os
import statistics
import subprocess
import sys
from pathlib import Path

from about import about
from peers import PEERS

HERE = Path(__file__).resolve().parent

# workload, variants of ours, resolution, peer options
ROWS = [
    ("occupancy", [["--sweep", "auto"], ["--sweep", "exact"]], 0.10, []),
    ("occupancy", [["--sweep", "auto"], ["--sweep", "exact"]], 0.05, []),
    ("lidar-tsdf", [["--carve"]], 0.10, ["--carve"]),
    ("lidar-tsdf", [["--carve"]], 0.05, ["--carve"]),
    ("lidar-tsdf", [[]], 0.10, []),
    ("depth-tsdf", [[], ["--carve"]], 0.02, []),
    ("depth-tsdf", [[], ["--carve"]], 0.01, []),
    ("surface", [[]], 0.0, []),
    ("surface-normals", [[]], 0.0, []),
    ("surface-mesh", [[]], 0.0, []),
    ("query", [[]], 0.10, []),
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
    parser.add_argument("--cpu", action="store_true", help="seconds of the CPU, and one thread only: on a busy machine")
    parser.add_argument("--no-peers", action="store_true")
    parser.add_argument("--json", type=Path, help="where everything that was measured is written")
    args = parser.parse_args()
    load = os.getloadavg()
    clock = "seconds of the CPU" if args.cpu else "wall clock"
    print(f"one item: a scan, a volume, a point; {clock}, medians of {args.repeats}")
    print(f"{'workload':<34}{'who':<26}{'threads':>8}{'an item':>14}{'spread':>8}{'against':>10}{'peak':>10}")
    rows = []
    for workload, variants, resolution, options in ROWS:
        if args.only and workload not in args.only:
            continue
        ours = [("portolan", tuple(variant), threads) for variant in variants for threads in ([1] if args.cpu else [1, 2])]
        peers = [] if args.no_peers else [(peer, tuple(options), 1) for peer in PEERS[workload]]
        times, last = {c: [] for c in ours + peers}, {}
        for _ in range(args.repeats):
            for competitor in times:
                who, words, threads = competitor
                common = ["--data", args.data, "--resolution", resolution, "--scans", args.scans]
                common += ["--repeats", 1, "--threads", threads] + (["--cpu"] if args.cpu else [])
                out = run([sys.executable, HERE / "peers.py", workload, who, *words, *common])
                last[competitor] = out
                if "seconds" in out:
                    times[competitor].append(min(out["seconds"]) / out["per"])
                print(".", end="", file=sys.stderr, flush=True)
        for variant in variants:
            name = " ".join([workload, *(v.strip("-") for v in variant if v != "--sweep")])
            name += f" {100 * resolution:g} cm" if resolution else ""
            one = times["portolan", tuple(variant), 1]
            for competitor in [c for c in ours if c[1] == tuple(variant)] + peers:
                who, _, threads = competitor
                row = {"name": name, "who": who, "threads": threads, **last[competitor], "seconds": times[competitor]}
                if times[competitor] and one:
                    row["median"] = statistics.median(times[competitor])
                    row["ratio"] = row["median"] / statistics.median(one)
                rows.append(row)
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
        asked = {"clock": clock, "repeats": args.repeats, "scans": args.scans}
        # A line for each row.
        lines = ",\n".join("  " + json.dumps(row) for row in rows)
        args.json.write_text(f'{{"about": {json.dumps(about(load) | asked)},\n "rows": [\n{lines}\n ]}}\n')


if __name__ == "__main__":
    main()
