"""Maps, contours and meshes for notebooks, and for other libraries where these are installed."""

import os
import tempfile
from typing import Any

from ._portolan import Contour, Mapper, Mesh, Occupancy


def _export(mapper: Mapper, path: str, **options: Any) -> None:
    """Writes the map in any format of ``portolan.convert``, by the ending of ``path``."""
    from . import convert

    if os.fspath(path).endswith(".portolan"):
        mapper.save(path)
        return
    with tempfile.TemporaryDirectory() as folder:
        whole = os.path.join(folder, "map.portolan")
        mapper.save(whole)
        convert(whole, path, **options)


def _to_trimesh(mesh: Mesh) -> Any:
    """A ``trimesh.Trimesh``."""
    import trimesh

    return trimesh.Trimesh(
        mesh.vertices, mesh.triangles, vertex_normals=mesh.normals, vertex_colors=mesh.colors, process=False
    )


def _to_open3d(mesh: Mesh) -> Any:
    """An ``open3d.geometry.TriangleMesh``."""
    import open3d

    made = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(mesh.vertices), open3d.utility.Vector3iVector(mesh.triangles.astype("int32"))
    )
    if mesh.normals is not None:
        made.vertex_normals = open3d.utility.Vector3dVector(mesh.normals.astype(float))
    if mesh.colors is not None:
        made.vertex_colors = open3d.utility.Vector3dVector(mesh.colors / 255)
    return made


def _to_pyvista(mesh: Mesh) -> Any:
    """A ``pyvista.PolyData``."""
    import numpy
    import pyvista

    triangles = mesh.triangles.astype(numpy.int64)
    faces = numpy.column_stack([numpy.full(len(triangles), 3), triangles])
    made = pyvista.PolyData(mesh.vertices, faces.ravel())
    if mesh.colors is not None:
        made["colors"] = mesh.colors
    return made


def attach() -> None:
    """Gives the classes of the extension what is written in Python."""
    Mapper.export = _export  # type: ignore[method-assign]
    Mesh.to_trimesh = _to_trimesh  # type: ignore[method-assign]
    Mesh.to_open3d = _to_open3d  # type: ignore[method-assign]
    Mesh.to_pyvista = _to_pyvista  # type: ignore[method-assign]
