#!/usr/bin/env python3
"""One workload by portolan's wheel or by one of its peers: prints one JSON line. `compare.py` calls it; by hand: peers.py WORKLOAD PEER --data DIR.

Only the peer's own library calls are inside the clock, and its constructors and what they allocate beforehand are not. What it reads is what portolan reads: KITTI folders, 7-Scenes
folders, npy volumes.
"""
import argparse
import json
import os
import resource
import sys
import time
from pathlib import Path

PEERS = {
    "occupancy": ["octomap", "octomap-discretized"],
    "lidar-tsdf": ["vdbfusion"],
    "depth-tsdf": ["open3d"],
    # With normals and values, with normals, and the mesh alone: each beside what gives as much.
    "surface": ["scikit-image"],
    "surface-normals": ["flying-edges"],
    "surface-mesh": ["flying-edges", "pymcubes"],
    "query": ["octomap"],
}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("workload", choices=PEERS)
    parser.add_argument("peer")
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--resolution", type=float, default=0.1)
    parser.add_argument("--scans", type=int, default=20)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--cpu", action="store_true", help="seconds of the CPU")
    parser.add_argument("--carve", action="store_true")
    parser.add_argument("--sweep", choices=["auto", "exact"], default="auto")
    return parser.parse_args()


def kitti(folder, scans):
    import numpy as np

    rows = np.loadtxt(folder / "poses.txt")[:scans]
    for i, row in enumerate(rows):
        pose = row.reshape(3, 4)
        points = np.fromfile(folder / "velodyne" / f"{i:06d}.bin", "<f4").reshape(-1, 4)[:, :3].astype(np.float64)
        yield np.ascontiguousarray(points @ pose[:, :3].T + pose[:, 3]), np.ascontiguousarray(pose[:, 3])


def seven_scenes(folder, scans):
    import cv2
    import numpy as np

    for depth in sorted(folder.glob("*.depth.png"))[:scans]:
        pose = np.loadtxt(str(depth).replace(".depth.png", ".pose.txt"))
        yield cv2.imread(str(depth), cv2.IMREAD_UNCHANGED), pose


def posed(folder, scans):
    """Points in the sensor's frame and poses, which is what portolan takes."""
    import numpy as np

    rows = np.loadtxt(folder / "poses.txt")[:scans]
    for i, row in enumerate(rows):
        points = np.fromfile(folder / "velodyne" / f"{i:06d}.bin", "<f4").reshape(-1, 4)[:, :3].astype(np.float64)
        yield np.ascontiguousarray(points), np.vstack([row.reshape(3, 4), [0, 0, 0, 1]])


def mapper_of(args, **maps):
    import portolan

    kinds = {"occupancy": False, "attenuation": False, "distances": False, "color": False} | maps
    sweep = "exact" if args.sweep == "exact" else "auto"
    return lambda: portolan.Mapper(args.resolution, sweep=sweep, carve=args.carve, **kinds)


def fuse(mapper, scans):
    for points, pose in scans:
        mapper.integrate(points, pose)
    return mapper


def octomap_tree(args):
    import octomap

    return octomap.OcTree(args.resolution)


def insert(tree, scans, discretize):
    for points, origin in scans:
        tree.insertPointCloud(points, origin, -1.0, False, discretize)
    return tree


def occupancy(args):
    if args.peer == "portolan":
        scans = list(posed(args.data / "lidar_building", args.scans))
        return len(scans), mapper_of(args, occupancy=True), lambda m: fuse(m, scans), size_of
    scans = list(kitti(args.data / "lidar_building", args.scans))
    run = lambda tree: insert(tree, scans, args.peer == "octomap-discretized")
    return len(scans), lambda: octomap_tree(args), run, lambda tree: {"nodes": tree.size(), "bytes": tree.memoryUsage()}


def size_of(mapper):
    return {"bytes": mapper.memory_bytes}


def lidar_tsdf(args):
    import numpy as np

    if args.peer == "portolan":
        scans = list(posed(args.data / "lidar_building", args.scans))
        return len(scans), mapper_of(args, distances=True), lambda m: fuse(m, scans), size_of
    import vdbfusion

    scans = list(kitti(args.data / "lidar_building", args.scans))
    poses = []
    for _, origin in scans:
        pose = np.eye(4)
        pose[:3, 3] = origin
        poses.append(pose)

    def make():
        return vdbfusion.VDBVolume(args.resolution, 3 * args.resolution, args.carve)

    def run(volume):
        for (points, _), pose in zip(scans, poses):
            volume.integrate(points, pose)
        return volume

    return len(scans), make, run, lambda volume: {}


def depth_tsdf(args):
    import numpy as np

    if args.peer == "portolan":
        frames = list(seven_scenes(args.data / "rgbd_building", args.scans))
        camera = np.loadtxt(args.data / "rgbd_building" / "camera-intrinsics.txt")

        def run(mapper):
            for depth, pose in frames:
                mapper.integrate(depth=depth, depth_scale=1000, intrinsics=camera, pose=pose, max_range=8.0)
            return mapper

        return len(frames), mapper_of(args, distances=True), run, size_of
    import open3d as o3d

    core, folder = o3d.core, args.data / "rgbd_building"
    intrinsics = core.Tensor(np.loadtxt(folder / "camera-intrinsics.txt"))
    frames = [
        (o3d.t.geometry.Image(core.Tensor(depth)), core.Tensor(np.linalg.inv(pose)))
        for depth, pose in seven_scenes(folder, args.scans)
    ]

    # Room for as many blocks as there will be: 0.4 s of clearing it are not a frame's.
    def make():
        return o3d.t.geometry.VoxelBlockGrid(
            ("tsdf", "weight"), (core.float32, core.float32), ((1), (1)), args.resolution, 8, 200_000
        )

    def run(grid):
        for image, camera_from_world in frames:
            blocks = grid.compute_unique_block_coordinates(image, intrinsics, camera_from_world, 1000.0, 8.0, 4.0)
            grid.integrate(blocks, image, intrinsics, camera_from_world, 1000.0, 8.0, 4.0)
        return grid

    return len(frames), make, run, lambda grid: {"blocks": int(grid.hashmap().size())}


def surface(args):
    import numpy as np

    volume = np.load(args.data / "grids" / "w4_gyroid_256_f32.npy")
    if args.peer == "portolan":
        import portolan

        want = {"normals": args.workload != "surface-mesh", "values": args.workload == "surface"}
        make, run = lambda: None, lambda _: portolan.marching_cubes(volume, 0.0, **want)
        count = lambda r: len(r[1])
    elif args.peer == "scikit-image":
        from skimage import measure

        make, run = lambda: None, lambda _: measure.marching_cubes(volume, 0.0)[:2]
        count = lambda r: len(r[1])
    elif args.peer == "pymcubes":
        import mcubes

        make, run = lambda: None, lambda _: mcubes.marching_cubes(volume, 0.0)
        count = lambda r: len(r[1])
    else:
        import vtk
        from vtk.util import numpy_support

        if args.threads > 1:
            vtk.vtkSMPTools.SetBackend("STDThread")
            vtk.vtkSMPTools.Initialize(args.threads)
        image = vtk.vtkImageData()
        image.SetDimensions(*volume.shape[::-1])
        image.GetPointData().SetScalars(numpy_support.numpy_to_vtk(volume.ravel(), deep=0))

        def make():
            edges = vtk.vtkFlyingEdges3D()
            edges.SetInputData(image)
            edges.SetValue(0, 0.0)
            edges.ComputeGradientsOff()
            edges.SetComputeNormals(args.workload == "surface-normals")
            edges.ComputeScalarsOff()
            return edges

        def run(edges):
            edges.Update()
            return edges.GetOutput()

        count = lambda r: r.GetNumberOfPolys()
    return 1, make, run, lambda result: {"triangles": count(result)}


def query(args):
    import numpy as np

    points = np.fromfile(args.data / "grids" / "w5_queries_1e6x3.f32", "<f4").reshape(-1, 3).astype(np.float64)
    if args.peer == "portolan":
        map = fuse(mapper_of(args, occupancy=True)(), posed(args.data / "lidar_building", args.scans)).occupancy
        known = lambda result: {"known": int((result[1] == 1).sum())}
        return len(points), lambda: None, lambda _: map.occupancy(points), known
    tree = insert(octomap_tree(args), kitti(args.data / "lidar_building", args.scans), True)
    return len(points), lambda: None, lambda _: tree.getLabels(points), lambda labels: {"known": int((np.asarray(labels) >= 0).sum())}


def version(peer):
    from importlib import metadata

    package = {"octomap": "octomap-python", "flying": "vtk"}.get(peer.split("-")[0], peer)
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def main():
    args = arguments()
    if args.threads == 1:
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
        for name in ("OMP", "OPENBLAS", "MKL", "NUMEXPR"):
            os.environ[f"{name}_NUM_THREADS"] = "1"
    os.environ["RAYON_NUM_THREADS"] = str(args.threads)
    try:
        workload = "surface" if args.workload.startswith("surface") else args.workload
        per, make, run, describe = globals()[workload.replace("-", "_")](args)
    except ImportError as missing:
        print(json.dumps({"missing": str(missing)}))
        return
    clock = time.process_time if args.cpu else time.perf_counter
    seconds, result = [], None
    for _ in range(args.repeats):
        result = None  # the last run's memory is not this one's
        made = make()
        start = clock()
        result = run(made)
        seconds.append(clock() - start)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    print(json.dumps({"seconds": seconds, "per": per, "peak": peak, "version": version(args.peer), **describe(result)}))


if __name__ == "__main__":
    sys.exit(main())
