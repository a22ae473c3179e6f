"""What other libraries get."""

import numpy as np
import pytest

import portolan.plot


def test_trimesh(ball):
    pytest.importorskip("trimesh")
    mesh = ball.mesh()
    made = mesh.to_trimesh()
    assert np.allclose(made.vertices, mesh.vertices) and np.array_equal(made.faces, mesh.triangles)
    assert abs(made.area / mesh.area - 1) < 1e-5


def test_pyvista(ball):
    pytest.importorskip("pyvista")
    made = ball.mesh().to_pyvista()
    assert made.n_points == len(ball.mesh().vertices) and made.n_cells == len(ball.mesh())


def test_open3d(ball):
    pytest.importorskip("open3d")
    made = ball.mesh().to_open3d()
    assert len(made.triangles) == len(ball.mesh()) and abs(made.get_surface_area() / ball.mesh().area - 1) < 1e-4


def test_matplotlib(room, ball, tmp_path):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    for distance in [False, True]:
        ax = portolan.plot.show(room, distance=distance)
        assert len(ax.images) == 1 and len(ax.lines) == 1
        ax.figure.savefig(tmp_path / "map.png")
        matplotlib.pyplot.close("all")
    with pytest.raises(ValueError, match="2-D"):
        portolan.plot.show(ball)


def test_rerun(ball, room, tmp_path):
    rr = pytest.importorskip("rerun")
    import portolan.rerun

    rr.init("portolan_test")
    rr.save(tmp_path / "maps.rrd")
    portolan.rerun.log("ball", ball)
    portolan.rerun.log("room", room)
    with pytest.raises(ValueError, match="int"):
        portolan.rerun.log("x", 3)
    rr.disconnect()
    written = (tmp_path / "maps.rrd").read_bytes()
    assert written[:3] == b"RRF" and len(written) > 10_000
    try:
        recording = rr.dataframe.load_recording(tmp_path / "maps.rrd")
    except AttributeError:
        assert b"ball/surface" in written and b"room/surface" in written
    else:
        paths = {str(c.entity_path) for c in recording.schema().component_columns()}
        assert {"/ball/surface", "/ball/occupied", "/room/surface"} <= paths, paths
