"""How mapping one log scales over workers: what one machine measures, and what follows for more.

    python3 bench/scaling.py LOG [--resolution 0.1] [--portolan target/release/portolan] [--record FILE]

Each part of 1, 2, 4 and 8 is mapped by itself with `map --shard I/N --threads 1` and merged two by two with `merge --map-only`. From the
processor time of these runs and the sizes of their files follows the time of N workers: each maps its part, then half of the workers merge
what two sent, a quarter merges these, and so on. Beyond 8 parts the size of a part is extended by the power law of the last two, and what
does not get less with the part (starting, opening the log) stays. Assumed: a worker has one such processor and its part of the log on its
disk, and sends its result at the given rate.
"""
import argparse
import json
import math
import os
import resource
import shutil
import subprocess
import tempfile
from pathlib import Path

from about import about


def run(*words):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([str(word) for word in words], check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measured(args, folder):
    rows = []
    for parts in [1, 2, 4, 8]:
        outs, mapping = [], []
        for i in range(1, parts + 1):
            out = folder / f"{parts}-{i}"
            mapping.append(
                run(args.portolan, "map", args.log, "--resolution", args.resolution, "--shard", f"{i}/{parts}",
                    "--threads", 1, "--quiet", "--out", out)
            )
            outs.append(out)
        size = lambda out: (out / "map.portolan").stat().st_size
        row = {"parts": parts, "mapping": max(mapping), "part": max(map(size, outs)), "merges": []}
        while len(outs) > 1:
            merged, seconds = [], []
            for pair in zip(outs[::2], outs[1::2]):
                out = folder / f"{pair[0].name}+"
                seconds.append(run(args.portolan, "merge", *pair, "--map-only", "--quiet", "--out", out))
                merged.append(out)
            row["merges"].append({"seconds": max(seconds), "bytes": max(sum(map(size, pair)) for pair in zip(outs[::2], outs[1::2]))})
            outs = merged
        row["whole"] = size(outs[0])
        rows.append(row)
    same = {row["whole"] for row in rows}
    assert len(same) == 1, "the maps differ in size"
    maps = {(folder / f"{p}-1{'+' * k}" / "map.portolan").read_bytes() for k, p in enumerate([1, 2, 4, 8])}
    assert len(maps) == 1, "the maps differ"
    return rows


def model(rows, log_bytes, rate):
    by_parts = {row["parts"]: row for row in rows}
    # Mapping a part takes a constant and a share: by least squares over what was measured.
    shares, times = [1 / row["parts"] for row in rows], [row["mapping"] for row in rows]
    mean = lambda values: sum(values) / len(values)
    slope = sum((s - mean(shares)) * (t - mean(times)) for s, t in zip(shares, times)) / sum((s - mean(shares)) ** 2 for s in shares)
    start = max(mean(times) - slope * mean(shares), 0)
    power = math.log2(by_parts[4]["part"] / by_parts[8]["part"])
    part = lambda n: by_parts[n]["part"] if n in by_parts else by_parts[8]["part"] * (8 / n) ** power
    merges = [merge for row in rows for merge in row["merges"]]
    per_byte = sum(m["seconds"] for m in merges) / sum(m["bytes"] for m in merges)
    table = []
    for workers in [1, 8, 64, 512]:
        mapping = start + slope / workers
        merging, sending, moved, n = 0.0, 0.0, 0.0, workers
        while n > 1:
            merging += per_byte * 2 * part(n)
            sending += part(n) / rate
            moved += n / 2 * part(n)
            n //= 2
        total = mapping + merging + sending
        table.append({
            "workers": workers, "mapping": mapping, "merging": merging, "sending": sending, "total": total,
            "moved": moved, "part": part(workers), "log": log_bytes / workers,
        })
    return {"start": start, "slope": slope, "power": power, "merge_per_gb": per_byte * 1e9, "table": table}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", type=Path)
    parser.add_argument("--resolution", type=float, default=0.1)
    parser.add_argument("--portolan", default="target/release/portolan")
    parser.add_argument("--rate", type=float, default=125e6, help="bytes a second between workers (a gigabit)")
    parser.add_argument("--record", type=Path)
    args = parser.parse_args()
    load = os.getloadavg()
    folder = Path(tempfile.mkdtemp(prefix="scaling-"))
    try:
        rows = measured(args, folder)
    finally:
        shutil.rmtree(folder)
    files = [args.log] if args.log.is_file() else [file for file in args.log.rglob("*") if file.is_file()]
    found = model(rows, sum(file.stat().st_size for file in files), args.rate)
    print("| parts | mapping one (s) | a part (MB) | merges, level by level (s) |\n|---|---|---|---|")
    for row in rows:
        merges = ", ".join(f"{merge['seconds']:.2f}" for merge in row["merges"]) or "none"
        print(f"| {row['parts']} | {row['mapping']:.2f} | {row['part'] / 1e6:.2f} | {merges} |")
    one = found["table"][0]["total"]
    print("\n| workers | mapping (s) | merging (s) | sending (s) | in all (s) | speed-up | moved (MB) | log for each (MB) |\n|---|---|---|---|---|---|---|---|")
    for row in found["table"]:
        print(
            f"| {row['workers']} | {row['mapping']:.2f} | {row['merging']:.2f} | {row['sending']:.2f} | {row['total']:.2f} "
            f"| {one / row['total']:.1f} | {row['moved'] / 1e6:.1f} | {row['log'] / 1e6:.1f} |"
        )
    print(
        f"\nmapping a part takes {found['start']:.2f} s and {found['slope']:.1f} s times its share; merging {found['merge_per_gb']:.1f} s for "
        f"a gigabyte; a part of N shrinks as N^-{found['power']:.2f} beyond 8"
    )
    if args.record:
        args.record.write_text(json.dumps({"run": about(load), "log": args.log.name, "resolution": args.resolution, "rows": rows, **found}, indent=1) + "\n")


if __name__ == "__main__":
    main()
