#!/usr/bin/env python3
"""KISS-ICP's poses mapped: scans without poses go through KISS-ICP, what it leaves is mapped, and the map is compared with that of
the poses that the log has.

    cargo build --release -p portolan-cli
    python3 bench/kiss_icp.py SCANS --poses FILE [--resolution 0.1] [--target target/release] [--venv DIR] [--work DIR]

SCANS is a folder of binary PCD files with x, y, z first (`lidar3d_balm_hall`), FILE its poses as 4x4 blocks, one for every
scan number. KISS-ICP is taken from PyPI into a virtual environment of its own (--venv, made where it is missing). The interpreter
needs numpy.
"""
import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

import numpy as np

VERSION = "kiss-icp==1.3.0"


def run(command, **more):
    print("$", " ".join(map(str, command)), flush=True)
    return subprocess.run(list(map(str, command)), check=True, **more)


def pipeline(folder):
    """The program of KISS-ICP in its environment."""
    program = folder / "bin" / "kiss_icp_pipeline"
    if not program.exists():
        venv.create(folder, with_pip=True)
        run([folder / "bin" / "pip", "install", "--quiet", VERSION])
    return program


def points_of(path):
    """x, y, z of a binary PCD of 32-bit floats."""
    data = path.read_bytes()
    end = data.index(b"DATA binary\n") + len(b"DATA binary\n")
    head = dict(line.split(" ", 1) for line in data[:end].decode().splitlines() if " " in line)
    sizes = list(map(int, head["SIZE"].split()))
    assert set(sizes) == {4} and head["FIELDS"].startswith("x y z"), f"{path}: give x y z first, of 4 bytes each"
    values = np.frombuffer(data[end:], np.float32, int(head["POINTS"]) * len(sizes)).reshape(-1, len(sizes))
    xyz = values[:, :3]
    return xyz[np.isfinite(xyz).all(axis=1) & (np.abs(xyz).sum(axis=1) > 0)]


def poses_of(path):
    """4x4 matrices; a stamp in the corner is taken out."""
    numbers = [float(word) for word in re.split(r"[,\s]+", path.read_text()) if word]
    poses = np.array(numbers).reshape(-1, 4, 4)
    poses[:, 3, 3] = 1.0
    return poses


def write_kitti(path, poses):
    path.write_text("".join(" ".join(f"{v:.9e}" for v in pose[:3].ravel()) + "\n" for pose in poses))


def aligned(estimated, given):
    """Positions of the estimate, moved rigidly onto the given ones (Umeyama without scale)."""
    a, b = estimated[:, :3, 3], given[:, :3, 3]
    u, _, vt = np.linalg.svd((b - b.mean(0)).T @ (a - a.mean(0)))
    turn = u @ np.diag([1, 1, np.linalg.det(u) * np.linalg.det(vt)]) @ vt
    return (a - a.mean(0)) @ turn.T + b.mean(0)


def main():
    parse = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parse.add_argument("scans", type=Path)
    parse.add_argument("--poses", type=Path, required=True)
    parse.add_argument("--resolution", default="0.1")
    parse.add_argument("--target", type=Path, default=Path("target/release"))
    parse.add_argument("--venv", type=Path, default=Path("target/kiss-icp"))
    parse.add_argument("--work", type=Path)
    arguments = parse.parse_args()
    work = arguments.work or Path(tempfile.mkdtemp())
    scans = work / "scans"
    scans.mkdir(parents=True, exist_ok=True)

    files = sorted(arguments.scans.glob("*.pcd"), key=lambda f: int(re.findall(r"\d+", f.stem)[-1]))
    given = poses_of(arguments.poses)[[int(re.findall(r"\d+", f.stem)[-1]) for f in files]]
    # Both trajectories begin where the first scan was taken.
    given = np.linalg.inv(given[0]) @ given
    for i, file in enumerate(files):
        xyz = points_of(file)
        np.hstack([xyz, np.zeros((len(xyz), 1), np.float32)]).astype("<f4").tofile(scans / f"{i:06}.bin")
    print(f"{len(files)} scans")

    results = work / "results"
    run([pipeline(arguments.venv), scans], env={**os.environ, "kiss_icp_out_dir": str(results)})
    left = sorted(results.glob("*/*_poses.npy")) + sorted(results.glob("*/*_kitti.txt"))
    print("left:", ", ".join(sorted({f.name for f in results.glob("*/*") if f.is_file()})))
    estimate = next(f for f in reversed(left) if f.name.endswith("_kitti.txt"))
    estimated = np.loadtxt(estimate).reshape(-1, 3, 4)
    off = np.linalg.norm(aligned(estimated, given) - given[:, :3, 3], axis=1)
    path = np.linalg.norm(np.diff(given[:, :3, 3], axis=0), axis=1).sum()
    print(f"trajectory: {path:.1f} m, off by {np.sqrt((off**2).mean()):.3f} m (RMS, aligned), at most {off.max():.3f} m")

    portolan = arguments.target / "portolan"
    write_kitti(work / "given.txt", given)
    for name, poses in [("given", work / "given.txt"), ("kiss", estimate)]:
        run([portolan, "map", scans, "--poses", poses, "--resolution", arguments.resolution, "--hold-out", 10,
             "--overwrite", "--out", work / name, "--quiet"])
        found = run([portolan, "eval", work / name, "--scans", scans, "--poses", poses, "--json"], capture_output=True)
        print(name, "held-out scans:", json.dumps(json.loads(found.stdout)))
    found = run([portolan, "eval", work / "kiss", "--reference", work / "given" / "mesh.ply", "--json"],
                capture_output=True)
    print("kiss against given:", json.dumps(json.loads(found.stdout)))


if __name__ == "__main__":
    sys.exit(main())
