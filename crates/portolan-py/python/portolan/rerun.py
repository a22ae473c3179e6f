"""Maps, meshes and scans in Rerun (https://rerun.io); needs rerun-sdk."""

from typing import Any, Union

import numpy as np

from . import Contour, Mapper, Mesh, Occupancy, Scan


def log(path: str, what: Union[Mapper, Mesh, Contour, Occupancy, Scan], **options: Any) -> None:
    """Logs something at an entity path of the current recording.

    A mapper: its mesh or contour, its occupied cells and the way of its sensor. A scan: its points, placed by its pose.
    `options` go to `rerun.log`.
    """
    import rerun as rr  # type: ignore

    if isinstance(what, Mapper):
        if what.dimension is None:
            raise ValueError("what: the mapper has no scans")
        surface: Union[Mesh, Contour] = what.mesh() if what.dimension == 3 else what.contour()
        log(f"{path}/surface", surface, **options)
        if what.occupancy is not None:
            log(f"{path}/occupied", what.occupancy, **options)
        poses = what.poses
        if poses is not None and len(poses) > 1:
            way = poses[:, :-1, -1]
            rr.log(f"{path}/way", rr.LineStrips3D([way]) if what.dimension == 3 else rr.LineStrips2D([way]), **options)
    elif isinstance(what, Mesh):
        rr.log(
            path,
            rr.Mesh3D(
                vertex_positions=what.vertices,
                triangle_indices=what.triangles,
                vertex_normals=what.normals,
                vertex_colors=what.colors,
            ),
            **options,
        )
    elif isinstance(what, Contour):
        rr.log(path, rr.LineStrips2D(what.polylines()), **options)
    elif isinstance(what, Occupancy):
        centers, _ = what.cells()
        half = np.full(centers.shape, 0.5 * what.resolution)
        if what.dimension == 3:
            rr.log(path, rr.Boxes3D(centers=centers, half_sizes=half), **options)
        else:
            rr.log(path, rr.Boxes2D(centers=centers, half_sizes=half), **options)
    elif isinstance(what, Scan):
        pose, points = what.pose, what.points
        world = points @ pose[:-1, :-1].T + pose[:-1, -1]
        rr.log(path, rr.Points3D(world) if what.dimension == 3 else rr.Points2D(world), **options)
    else:
        raise ValueError(f"what: a mapper, mesh, contour, occupancy or scan is wanted, got {type(what).__name__}")
