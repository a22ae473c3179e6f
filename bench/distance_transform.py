#!/usr/bin/env python3
"""The distance transform of masks beside the `edt` wheel and SciPy, on one thread: results are compared, and must be equal.

    cargo build --release -p portolan-cli --example fields
    python3 bench/distance_transform.py [--data DIR] [--repeats 3]

DIR may hold `grids/w3_*_u8.npy` (0: obstacle); without it masks are made here. Runs of all take turns; the least of each
counts. One item is a cell.
"""
import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

OURS = Path(__file__).resolve().parent.parent / "target" / "release" / "examples" / "fields"
VARIANTS = {
    "portolan": [],
    "portolan, nearest": ["--nearest"],
    "portolan, 20 cells": ["--within", "20"],
    "portolan, 20 cells, nearest": ["--within", "20", "--nearest"],
}


def rooms(n):
    """Walls every 80 cells with doors, pillars, floor and ceiling."""
    z, y, x = np.indices((n,) * 3, dtype=np.int32)
    door = (np.minimum(abs(x % 80 - 40), abs(y % 80 - 40)) < 10) & (z < n // 2)
    pillar = (x % 80 - 20) ** 2 + (y % 80 - 60) ** 2 < 16
    return (((x % 80 < 3) | (y % 80 < 3)) & ~door) | pillar | (z < 2) | (z + 2 >= n)


def hall(n):
    """All is free but the outermost cells."""
    mask = np.ones((n,) * 3, bool)
    mask[1:-1, 1:-1, 1:-1] = False
    return mask


def masks(data):
    for n in (128, 256):
        yield f"rooms {n}^3", lambda n=n: rooms(n)
        yield f"empty hall {n}^3", lambda n=n: hall(n)
    if data:
        for file in sorted((data / "grids").glob("w3_*_u8.npy")):
            yield file.stem[3:-3], lambda file=file: np.load(file) == 0


def ours(options, mask_file, shape, out):
    command = [OURS, "mask", mask_file, "--shape", *map(str, reversed(shape)), "--repeats", "3", "--out", out, *options]
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stderr)
    return min(json.loads(done.stdout)["seconds"]), np.fromfile(out, "<f4").reshape(shape)


def peers():
    found = {}
    try:
        import edt

        found["edt"] = lambda free: edt.edtsq(free, parallel=1)
    except ImportError as missing:
        print("edt: not measured:", missing)
    try:
        from scipy import ndimage

        found["scipy"] = ndimage.distance_transform_edt
    except ImportError as missing:
        print("scipy: not measured:", missing)
    return found


def check(name, want, got):
    """Equal to the last bit inside of the bound; beyond it infinite."""
    if "20 cells" in name:
        within = want <= 400
        assert np.array_equal(got[within], want[within]) and np.isinf(got[~within]).all(), name
    elif name == "scipy":
        # It gives distances in f64.
        assert np.array_equal(np.rint(got * got), want.astype(np.float64)), name
    else:
        assert np.array_equal(got, want), f"{name}: {np.count_nonzero(got != want)} cells differ"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--only", help="masks whose name holds this")
    args = parser.parse_args()
    if not OURS.is_file():
        sys.exit(f"{OURS}: not there; build it with cargo build --release -p portolan-cli --example fields")
    others = peers()
    print(f"{'mask':<26}{'who':<30}{'ns a cell':>10}{'edt over it':>14}{'scipy over it':>14}")
    with tempfile.TemporaryDirectory() as folder:
        mask_file, out = Path(folder) / "mask.u8", Path(folder) / "squared.f32"
        for name, make in masks(args.data):
            if args.only and args.only not in name:
                continue
            mask = np.ascontiguousarray(make())
            mask.view(np.uint8).tofile(mask_file)
            free = ~mask
            times, want = {}, None
            for turn in range(args.repeats):
                for who, options in VARIANTS.items():
                    seconds, got = ours(options, mask_file, mask.shape, out)
                    times.setdefault(who, []).append(seconds)
                    if turn == 0:
                        want = got if want is None else want
                        check(who, want, got)
                for who, run in others.items():
                    if who == "scipy" and turn > 0:
                        continue  # slow, and far away
                    for _ in range(1 if who == "scipy" else 3):
                        start = time.perf_counter()
                        got = run(free)
                        times.setdefault(who, []).append(time.perf_counter() - start)
                    if turn == 0:
                        check(who, want, got)
            least = {who: 1e9 * min(seconds) / mask.size for who, seconds in times.items()}
            for who, ns in least.items():
                ratios = [f"{least[peer] / ns:13.1f}x" if peer in least else f"{'':>14}" for peer in ("edt", "scipy")]
                print(f"{name:<26}{who:<30}{ns:>10.2f}{''.join(ratios)}", flush=True)


if __name__ == "__main__":
    main()
