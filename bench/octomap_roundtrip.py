#!/usr/bin/env python3
"""OctoMap and portolan read each other's .bt and .ot.

    cargo build --release -p portolan-cli -p portolan-io --example octree_files --bin portolan
    python3 bench/octomap_roundtrip.py --data DIR [--target target/release]

DIR is the folder of real data (maps_octomap/, lidar3d_la3dm_sim_structured/); without it only made-up trees are checked.
The interpreter needs octomap-python; with pyoctomap it checks stamped trees, too. Every check that fails is named, and the
exit status is 1.
"""
import argparse
import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import octomap

FAILED = []


def check(what, good, detail=""):
    print(f"{'ok  ' if good else 'FAIL'} {what} {detail}".rstrip())
    if not good:
        FAILED.append(what)


def cells(leaves, r):
    """Probability of every finest cell below leaves given as (centre, edge, probability)."""
    found = {}
    for center, edge, p in leaves:
        n = round(edge / r)
        first = [round(v / r - n / 2) for v in center]
        for i in range(n**3):
            found[first[0] + i % n, first[1] + i // n % n, first[2] + i // n**2] = p
    return found


def cells_of(tree):
    leaves = ((leaf.getCoordinate(), leaf.getSize(), leaf.getOccupancy()) for leaf in tree.begin_leafs())
    return cells(leaves, tree.getResolution())


def read(path):
    """As OctoMap reads it."""
    if path.suffix == ".bt":
        return octomap.OcTree(str(path).encode())
    return octomap.OcTree.read(str(path).encode())


def made(seed, resolution, **how):
    """A tree that OctoMap fused of random scans."""
    random = np.random.default_rng(seed)
    tree = octomap.OcTree(resolution)
    if how.pop("clamp", False):
        tree.setClampingThresMax(0.999)
        tree.setClampingThresMin(0.0001)
    for scan in range(6):
        points = random.normal(size=(400, 3)) * [3, 2, 1]
        tree.insertPointCloud(points, np.array([0.2 * scan, 0.1, 0.05]), **how)
    return tree


class Program:
    def __init__(self, folder):
        self.portolan, self.example = folder / "portolan", folder / "examples" / "octree_files"

    def convert(self, source, out):
        subprocess.run([self.portolan, "convert", source, out, "-q"], check=True)
        return out.read_bytes()

    def info(self, path):
        return json.loads(subprocess.run([self.portolan, "info", path, "--json"], check=True, capture_output=True).stdout)

    def query(self, path, points):
        text = "".join(f"{x:.9f},{y:.9f},{z:.9f}\n" for x, y, z in points)
        command = [self.portolan, "query", path, "--points", "-"]
        out = subprocess.run(command, input=text, check=True, capture_output=True, text=True).stdout
        return [row["occupancy"] for row in csv.DictReader(out.splitlines())]


def theirs(program, folder):
    """Files that OctoMap writes."""
    kinds = {
        "0.1 m": (1, 0.1, {}),
        "1/3 m": (2, 1 / 3, {}),
        "lazy, inner values stale": (3, 0.1, {"lazy_eval": True}),
        "discretised, other clamps": (4, 0.05, {"discretize": True, "clamp": True}),
    }
    for name, (seed, resolution, how) in kinds.items():
        tree = made(seed, resolution, **how)
        ot, bt = folder / "theirs.ot", folder / "theirs.bt"
        tree.write(str(ot).encode())
        check(f".ot -> .ot, the same bytes ({name})", program.convert(ot, folder / "ours.ot") == ot.read_bytes())
        about, n = program.info(ot), tree.getNumLeafNodes()
        check(f"leaves ({name})", about["leaves"]["total"] == n and about["inner_nodes"] == tree.size() - n, n)
        # The iterator is one object that moves on: what it stands for has to be taken out.
        some = [(np.array(leaf.getCoordinate()) + 1e-4 * resolution, leaf.getOccupancy()) for leaf in tree.begin_leafs()]
        some = some[:: max(1, n // 500)]
        ours = program.query(ot, [point for point, _ in some])
        worst = max(abs(float(p) - wanted) for p, (_, wanted) in zip(ours, some))
        check(f"probabilities ({name})", worst < 1e-7, f"{worst:.1e}")
        ours = program.convert(ot, folder / "ours.bt")
        tree.writeBinary(str(bt).encode())
        check(f".ot -> .bt, the bytes of writeBinary ({name})", ours == bt.read_bytes())
        check(f".bt -> .bt, the same bytes ({name})", program.convert(bt, folder / "ours.bt") == bt.read_bytes())
    empty = octomap.OcTree(0.1)
    for suffix, write in ((".ot", empty.write), (".bt", empty.writeBinary)):
        path = folder / f"empty{suffix}"
        write(str(path).encode())
        check(f"empty {suffix}", program.convert(path, folder / f"ours{suffix}") == path.read_bytes())
    try:
        import pyoctomap
    except ImportError:
        print("     pyoctomap is not installed: no stamped tree")
        return
    tree, path = pyoctomap.OcTreeStamped(0.1), folder / "stamped.ot"
    for x in range(40):
        tree.updateNode([0.1 * x + 0.05, 0.2, 0.3], x % 3 > 0)
    tree.write(str(path))
    check("OcTreeStamped .ot, the same bytes", program.convert(path, folder / "ours.ot") == path.read_bytes())


def ours(program, folder):
    """Files that portolan writes of maps that it fused."""
    subprocess.run([program.example, folder], check=True)
    for name in ("bytes", "floats"):
        rows = np.loadtxt(folder / f"{name}.csv", delimiter=",")
        # Cells, not leaves: our tree starts elsewhere, so that other cells share a node.
        wanted = cells(((row[:3], row[3], 1 / (1 + np.exp(-float(np.float32(row[4]))))) for row in rows), 0.1)
        tree = read(folder / f"{name}.ot")
        found = cells_of(tree)
        check(f"OctoMap reads our .ot: equal cells ({name})", found.keys() == wanted.keys(), len(wanted))
        worst = max(abs(found[k] - wanted[k]) for k in wanted if k in found)
        check(f"and equal probabilities ({name})", worst < 1e-12, f"{worst:.1e}")
        again = folder / "again.ot"
        tree.write(str(again).encode())
        check(f"and writes it as it was ({name})", again.read_bytes() == (folder / f"{name}.ot").read_bytes())
        tree.updateInnerOccupancy()
        tree.write(str(again).encode())
        check(f"its own inner values are ours ({name})", again.read_bytes() == (folder / f"{name}.ot").read_bytes())
        tree.writeBinary(str(folder / "again.bt").encode())
        good = (folder / "again.bt").read_bytes() == (folder / f"{name}.bt").read_bytes()
        check(f"its writeBinary of our .ot is our .bt ({name})", good)
        binary = read(folder / f"{name}.bt")
        about = program.info(folder / f"{name}.bt")
        counts = (binary.getNumLeafNodes(), binary.size() - binary.getNumLeafNodes())
        check(f"OctoMap reads our .bt: nodes ({name})", counts == (about["leaves"]["total"], about["inner_nodes"]), counts)
        labels = cells_of(binary)
        same = all((labels[k] > 0.5) == (wanted[k] >= 0.5) for k in wanted) and len(labels) == len(wanted)
        check(f"and labels ({name})", same)


def real(program, folder, data):
    for name in ("maps_octomap/geb079.bt", "maps_octomap/freiburg1_360.bt", "lidar3d_la3dm_sim_structured/map.bt"):
        path = data / name
        check(f"{name}: the same bytes", program.convert(path, folder / "ours.bt") == path.read_bytes())
        about = program.info(path)
        if about["class"] == "OcTree":
            tree = read(path)
            check(f"{name}: leaves", tree.getNumLeafNodes() == about["leaves"]["total"], about["leaves"])
            tree.write(str(folder / "theirs.ot").encode())
            same = program.convert(path, folder / "ours.ot") == (folder / "theirs.ot").read_bytes()
            check(f"{name}: .bt -> .ot, OctoMap's bytes", same)
        took = subprocess.run([program.example, "--time", path], check=True, capture_output=True, text=True).stdout
        print(f"     {name}: read in {took.strip()} ms")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path)
    parser.add_argument("--target", type=Path, default=Path(__file__).resolve().parent.parent / "target" / "release")
    args = parser.parse_args()
    program = Program(args.target.resolve())
    with tempfile.TemporaryDirectory() as folder:
        theirs(program, Path(folder))
        ours(program, Path(folder))
        if args.data:
            real(program, Path(folder), args.data)
    if FAILED:
        sys.exit(f"{len(FAILED)} checks failed: {', '.join(FAILED)}")


if __name__ == "__main__":
    main()
