"""Maps, contours and meshes for notebooks, and for other libraries where these are installed."""

import os
import tempfile
from typing import Any

from ._portolan import Mapper, Mesh


def _export(self: Mapper, path: str, **options: Any) -> None:
    """Writes the map in any format of ``portolan.convert``, by the ending of ``path``."""
    from . import convert

    if os.fspath(path).endswith(".portolan"):
        self.save(path)
        return
    with tempfile.TemporaryDirectory() as folder:
        whole = os.path.join(folder, "map.portolan")
        self.save(whole)
        convert(whole, path, **options)


def _to_trimesh(self: Mesh) -> Any:
    """A ``trimesh.Trimesh``."""
    import trimesh  # type: ignore

    return trimesh.Trimesh(
        self.vertices, self.triangles, vertex_normals=self.normals, vertex_colors=self.colors, process=False
    )


def _to_open3d(self: Mesh) -> Any:
    """An ``open3d.geometry.TriangleMesh``."""
    import open3d  # type: ignore

    made = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(self.vertices), open3d.utility.Vector3iVector(self.triangles.astype("int32"))
    )
    if self.normals is not None:
        made.vertex_normals = open3d.utility.Vector3dVector(self.normals.astype(float))
    if self.colors is not None:
        made.vertex_colors = open3d.utility.Vector3dVector(self.colors / 255)
    return made


def _to_pyvista(self: Mesh) -> Any:
    """A ``pyvista.PolyData``."""
    import numpy
    import pyvista  # type: ignore

    triangles = self.triangles.astype(numpy.int64)
    faces = numpy.column_stack([numpy.full(len(triangles), 3), triangles])
    made = pyvista.PolyData(self.vertices, faces.ravel())
    if self.colors is not None:
        made["colors"] = self.colors
    return made


def attach() -> None:
    """Gives the classes of the extension what is written in Python."""
    for of, name, method in [
        (Mapper, "export", _export),
        (Mesh, "to_trimesh", _to_trimesh),
        (Mesh, "to_open3d", _to_open3d),
        (Mesh, "to_pyvista", _to_pyvista),
    ]:
        method.__name__ = name
        setattr(of, name, method)
