#!/usr/bin/env python3
"""`portolan.edt`, `portolan.sdf` and `portolan.marching_cubes` beside edt, SciPy, scikit-image and VTK, through the wheel.

    pip install target/wheels/portolan-*.whl edt scipy scikit-image vtk
    python3 bench/drop_ins.py [--threads 1] [--runs 5] [--size 256] [--only WORD] [--json FILE]

All run in this process, on as many CPUs as there are threads, each library with as many threads (SciPy and scikit-image know
one), each with as much to give as the other (VTK knows no values). Runs of all take turns. Inputs and VTK's objects are made before the clock starts; results are compared once, before.
The ratio is the median of the peer over ours. What misses its aim comes first.
"""
import argparse
import importlib.metadata
import json
import os
import platform
import statistics
import sys
import time

from about import about

AIMS = {"edt": 2, "scipy": 20, "scikit-image": 5, "vtk": 2}
#: Seconds that a call may take beside its work.
OVERHEAD = 2e-6


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--size", type=int, default=256, help="cells along each axis of a volume")
    parser.add_argument("--only", default="", help="cases whose name holds this")
    parser.add_argument("--cpu", action="store_true", help="seconds of the CPU: on a busy machine, with one thread")
    parser.add_argument("--json", help="where all seconds are written")
    return parser.parse_args()


def rooms(np, n):
    """What is free: walls every 80 cells with doors, pillars, floor and ceiling."""
    z, y, x = np.indices((n,) * 3, dtype=np.int32)
    door = (np.minimum(abs(x % 80 - 40), abs(y % 80 - 40)) < 10) & (z < n // 2)
    pillar = (x % 80 - 20) ** 2 + (y % 80 - 60) ** 2 < 16
    return ~((((x % 80 < 3) | (y % 80 < 3)) & ~door) | pillar | (z < 2) | (z + 2 >= n))


def distance_cases(np, portolan, n, threads):
    import edt
    from scipy import ndimage

    random = np.random.default_rng(0)
    volume, plane = (n,) * 3, (16 * n,) * 2
    hall = np.zeros(volume, bool)
    hall[1:-1, 1:-1, 1:-1] = True
    masks = {
        f"edt, rooms {n}^3": rooms(np, n),
        f"edt, hall {n}^3": hall,
        f"edt, 1 of 1000 set {n}^3": random.random(volume, np.float32) > 0.001,
        f"edt, 1 of 1000 set {16 * n}^2": random.random(plane, np.float32) > 0.001,
    }
    for name, mask in masks.items():
        yield name, {
            "portolan": lambda mask=mask: portolan.edt(mask, parallel=threads),
            "edt": lambda mask=mask: edt.edt(mask, parallel=threads),
            "scipy": lambda mask=mask: ndimage.distance_transform_edt(mask),
        }
    mask = next(iter(masks.values()))
    yield f"edt, spacing (4, 4, 40), rooms {n}^3", {
        "portolan": lambda: portolan.edt(mask, (40, 4, 4), parallel=threads),
        "edt": lambda: edt.edt(mask, anisotropy=(40, 4, 4), parallel=threads),
        "scipy": lambda: ndimage.distance_transform_edt(mask, sampling=(40, 4, 4)),
    }
    yield f"edt, indices, rooms {n}^3", {
        "portolan": lambda: portolan.edt(mask, return_indices=True, parallel=threads),
        "scipy": lambda: ndimage.distance_transform_edt(mask, return_indices=True),
    }
    yield f"sdf, rooms {n}^3", {
        "portolan": lambda: portolan.sdf(mask, parallel=threads),
        "edt": lambda: edt.sdf(mask, parallel=threads),
    }
    coarse = random.integers(0, 50, (n // 16,) * 3, np.uint32)
    labels = coarse.repeat(16, 0).repeat(16, 1).repeat(16, 2)
    yield f"edt, 50 labels uint32 {n}^3", {
        "portolan": lambda: portolan.edt(labels, parallel=threads),
        "edt": lambda: edt.edt(labels, parallel=threads),
    }


def surface_cases(np, portolan, n, threads):
    from skimage import measure

    x, y, z = np.meshgrid(*[np.linspace(0, 8 * np.pi, n, dtype=np.float32)] * 3, indexing="ij")
    gyroid = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    ball = np.float32(4 * np.pi) - np.sqrt((x - 4 * np.pi) ** 2 + (y - 4 * np.pi) ** 2 + (z - 4 * np.pi) ** 2)
    for name, volume in {"gyroid": gyroid, "ball": ball}.items():
        volume = np.ascontiguousarray(volume)
        ours = lambda volume=volume, **options: portolan.marching_cubes(volume, 0.1, **options)[:2]
        yield f"marching_cubes, {name} {n}^3", {
            "portolan": ours,
            "scikit-image": lambda volume=volume: measure.marching_cubes(volume, 0.1)[:2],
        }
        # Each with as much as the peer gives.
        edges = flying_edges(volume, threads)
        for what, options in {"normals": dict(values=False), "mesh alone": dict(normals=False, values=False)}.items():
            if edges:
                yield f"marching_cubes, {name} {n}^3, {what}", {
                    "portolan": lambda ours=ours, options=options: ours(**options),
                    "vtk": edges[what],
                }


def flying_edges(volume, threads):
    try:
        import vtk
        from vtk.util import numpy_support
    except ImportError as missing:
        print("vtk: not measured:", missing)
        return {}
    vtk.vtkSMPTools.SetBackend("STDThread" if threads > 1 else "Sequential")
    vtk.vtkSMPTools.Initialize(threads)
    image = vtk.vtkImageData()
    image.SetDimensions(*volume.shape[::-1])
    image.GetPointData().SetScalars(numpy_support.numpy_to_vtk(volume.ravel(), deep=0))
    found = {}
    for name, normals in (("normals", True), ("mesh alone", False)):
        edges = vtk.vtkFlyingEdges3D()
        edges.SetInputData(image)
        edges.SetValue(0, 0.1)
        edges.ComputeGradientsOff()
        edges.SetComputeNormals(normals)
        edges.ComputeScalarsOff()

        def run(edges=edges, image=image):
            edges.Modified()
            edges.Update()
            out = edges.GetOutput()
            return range(out.GetNumberOfPoints()), range(out.GetNumberOfPolys())

        found[name] = run
    return found


def compare(np, case, results):
    """Equal distances; as many vertices, and triangles."""
    ours = results["portolan"]
    for who, theirs in results.items():
        if who == "portolan":
            continue
        if case.startswith("marching_cubes"):
            for what, a, b in zip(("vertices", "triangles"), ours, theirs):
                if len(a) != len(b):
                    print(f"{case}: {len(a)} {what}, {who} has {len(b)}")
        else:
            if isinstance(ours, tuple):
                a, b = ours[0], theirs[0]
            else:
                a, b = ours, theirs
            assert np.allclose(a, b, rtol=1e-5), f"{case}: not what {who} has"


def measured(cases, runs, np, clock):
    for case, who in cases:
        seconds = {name: [] for name in who}
        compare(np, case, {name: run() for name, run in who.items()})
        for turn in range(runs):
            for name, run in who.items():
                if name in ("scipy", "scikit-image") and turn >= 3 and seconds[name][0] > 1:
                    continue  # slow, and far away
                start = clock()
                result = run()
                seconds[name].append(clock() - start)
                del result  # not on the clock
        print(".", end="", flush=True)
        yield case, seconds


def overhead(np, portolan):
    """Seconds for one call with next to nothing to do; the least of some hundred rounds."""
    import edt
    from skimage import measure

    nothing, mask, volume = np.zeros((0, 4), bool), np.eye(4, dtype=bool), np.indices((3, 3, 3))[0].astype("f4")
    out = {}
    for name, calls in {
        "edt, no cells": [lambda: portolan.edt(nothing), lambda: edt.edt(nothing)],
        "edt, 4 x 4": [lambda: portolan.edt(mask), lambda: edt.edt(mask)],
        "marching_cubes, 3 x 3 x 3": [
            lambda: portolan.marching_cubes(volume, 0.5),
            lambda: measure.marching_cubes(volume, 0.5),
        ],
    }.items():
        out[name] = []
        for run, count in zip(calls, (100, 10)):
            rounds = []
            for _ in range(200):
                start = time.perf_counter()
                for _ in range(count):
                    run()
                rounds.append((time.perf_counter() - start) / count)
            out[name] += [min(rounds), statistics.median(rounds)]
    return out


def main():
    args = arguments()
    load = os.getloadavg()
    cpus = sorted(os.sched_getaffinity(0))[: args.threads]
    os.sched_setaffinity(0, cpus)
    os.environ["RAYON_NUM_THREADS"] = str(args.threads)
    for name in ("OMP", "OPENBLAS", "MKL"):
        os.environ[f"{name}_NUM_THREADS"] = str(args.threads)
    import numpy as np
    import portolan

    versions = {"python": platform.python_version(), "portolan": portolan.__version__}
    for package in ("numpy", "edt", "scipy", "scikit-image", "vtk"):
        try:
            versions[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            versions[package] = "missing"
    print(", ".join(f"{name} {version}" for name, version in versions.items()))
    print(
        f"{args.threads} thread(s) on {len(cpus)} CPU(s), load {os.getloadavg()[0]:.1f}, {args.runs} runs in turns, "
        f"{'seconds of the CPU' if args.cpu else 'wall clock'}"
    )
    n = args.size
    cases = [
        (case, who)
        for make in (distance_cases, surface_cases)
        for case, who in make(np, portolan, n, args.threads)
        if args.only in case
    ]
    clock = time.process_time if args.cpu else time.perf_counter
    all_seconds = dict(measured(cases, args.runs, np, clock))
    rows = []
    for case, seconds in all_seconds.items():
        median = {name: statistics.median(all_of) for name, all_of in seconds.items()}
        for name in seconds:
            if name == "portolan":
                continue
            aim = AIMS[name.split(",")[0]]
            ratio = median[name] / median["portolan"]
            rows.append((ratio >= aim, ratio / aim, case, name, ratio, aim, seconds))
    rows.sort(key=lambda row: row[:2])
    spread = lambda s: f"{1e3 * statistics.median(s):9.1f} ({1e3 * min(s):.1f} to {1e3 * max(s):.1f})"
    print(f"\n\n{'case':<44}{'peer':<17}{'over ours':>10}{'aim':>5}         ours, ms: median (all){'theirs':>22}")
    for met, _, case, name, ratio, aim, seconds in rows:
        mark = "" if met else "  MISSED"
        print(f"{case:<44}{name:<17}{ratio:9.1f}x{aim:>4}x{mark:<8}  {spread(seconds['portolan']):<28}{spread(seconds[name])}")
    calls = overhead(np, portolan)
    for name, (least, median, theirs, _) in calls.items():
        mark = "" if least < OVERHEAD else "  MISSED"
        aim = f"aim {1e6 * OVERHEAD:.0f}; the peer's {1e6 * theirs:.1f} at least"
        print(f"one call, {name}: {1e6 * least:.2f} us at least, {1e6 * median:.2f} us median ({aim}){mark}")
    if args.json:
        with open(args.json, "w") as file:
            asked = {name: value for name, value in vars(args).items() if name != "json"}
            # A line for each case.
            lines = ",\n".join(f"  {json.dumps(case)}: {json.dumps(seconds)}" for case, seconds in all_seconds.items())
            head = {"about": about(load), "versions": versions, "arguments": asked, "calls": calls}
            file.write(f'{json.dumps(head, indent=1)[:-2]},\n "seconds": {{\n{lines}\n }}\n}}\n')


if __name__ == "__main__":
    sys.exit(main())
