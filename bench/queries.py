#!/usr/bin/env python3
"""Value and gradient at points beside SciPy's `map_coordinates` and Open3D's `RaycastingScene`, on one thread.

    cargo build --release -p portolan-cli --example fields
    python3 bench/queries.py [--points 20000] [--repeats 3]

The field is the distance to a ball. SciPy gives values only (`order=1` is the same interpolant as the linear one here and
must agree; `order=3` is a B-spline, its prefilter outside of the clock); four calls would be needed for a gradient.
Open3D answers from the ball's mesh, exactly, value only. `in cache`: 64^3 cells (1 MB); `in memory`: 256^3. Runs take
turns; the least of each counts. One item is a point.
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


def ball(n):
    """Distances at cell centres, in cells, to a ball in the middle; C order: the last axis is x."""
    at = np.arange(n, dtype=np.float32) + 0.5 - n / 2
    return np.sqrt(at[:, None, None] ** 2 + at[:, None] ** 2 + at**2) - np.float32(n / 4)


def points(n, count, coherent):
    rng = np.random.default_rng(1)
    if not coherent:
        return rng.uniform(2, n - 2, (count, 3))
    # Ways of a hundred points, a fifth of a cell apart: what a planner asks.
    start = rng.uniform(n * 0.25, n * 0.75, (count // 100, 1, 3))
    way = rng.normal(size=(count // 100, 1, 3))
    way *= 0.2 / np.linalg.norm(way, axis=2, keepdims=True)
    return np.clip((start + way * np.arange(100)[None, :, None]).reshape(-1, 3), 2, n - 2)


def ours(options, field_file, n, points_file, out):
    command = [OURS, "query", field_file, "--shape", n, n, n, "--points", points_file, "--repeats", 20, "--out", out]
    done = subprocess.run([str(c) for c in [*command, *options]], capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stderr)
    return min(json.loads(done.stdout)["seconds"]), np.fromfile(out, "<f8")


def peers(field, at):
    """What each is called, and a run of it that gives values."""
    found = {}
    n = field.shape[0]
    try:
        from scipy import ndimage

        where = np.ascontiguousarray((at[:, ::-1] - 0.5).T)
        wide = field.astype(np.float64)
        filtered = ndimage.spline_filter(wide, order=3)
        found["scipy order=1, value"] = lambda: ndimage.map_coordinates(wide, where, order=1)
        found["scipy order=3, value"] = lambda: ndimage.map_coordinates(filtered, where, order=3, prefilter=False)
    except ImportError as missing:
        print("scipy: not measured:", missing)
    try:
        import open3d as o3d

        mesh = o3d.t.geometry.TriangleMesh.from_legacy(
            o3d.geometry.TriangleMesh.create_sphere(n / 4, resolution=100).translate([n / 2] * 3)
        )
        scene = o3d.t.geometry.RaycastingScene(nthreads=1)
        scene.add_triangles(mesh)
        few = at[:5000].astype(np.float32)
        found["open3d, value"] = lambda: scene.compute_signed_distance(few, nthreads=1).numpy()
    except ImportError as missing:
        print("open3d: not measured:", missing)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=20_000)
    parser.add_argument("--repeats", type=int, default=3)
    args = parser.parse_args()
    if not OURS.is_file():
        sys.exit(f"{OURS}: not there; build it with cargo build --release -p portolan-cli --example fields")
    variants = {"portolan linear, value and gradient": [], "portolan cubic, value and gradient": ["--cubic"]}
    print(f"{'field':<30}{'who':<38}{'ns a point':>11}{'over linear':>13}{'largest error':>15}")
    with tempfile.TemporaryDirectory() as folder:
        field_file, points_file, out = (Path(folder) / name for name in ("field.f32", "points.f64", "values.f64"))
        for n, coherent, name in [(64, True, "in cache, ways"), (64, False, "in cache, random"), (256, True, "in memory, ways"), (256, False, "in memory, random")]:
            field = ball(n)
            field.tofile(field_file)
            at = points(n, args.points, coherent)
            at.tofile(points_file)
            truth = np.linalg.norm(at - n / 2, axis=1) - n / 4
            away = np.linalg.norm(at - n / 2, axis=1) > n / 8
            others = peers(field, at)
            times, errors, linear = {}, {}, None
            for turn in range(args.repeats):
                for who, options in variants.items():
                    seconds, got = ours(options, field_file, n, points_file, out)
                    times.setdefault(who, []).append(seconds / len(at))
                    errors[who] = abs(got - truth)[away].max()
                    linear = got if linear is None else linear
                for who, run in others.items():
                    for _ in range(1 if who.startswith("open3d") else 5):
                        start = time.perf_counter()
                        got = run()
                        times.setdefault(who, []).append((time.perf_counter() - start) / len(got))
                    errors[who] = abs(got - truth[: len(got)])[away[: len(got)]].max()
                    if "order=1" in who:
                        assert abs(got - linear).max() < 1e-5, "the same interpolant"
            base = min(times["portolan linear, value and gradient"])
            for who, seconds in times.items():
                ns = 1e9 * min(seconds)
                print(f"{name:<30}{who:<38}{ns:>11.1f}{1e-9 * ns / base:>12.1f}x{errors[who]:>15.2e}", flush=True)


if __name__ == "__main__":
    main()
