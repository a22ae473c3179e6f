"""Maps, fields and questions in 3-D, against a ball of known radius."""

import numpy as np
import pytest
from conftest import sphere_points

import portolan
from portolan import Status


def test_distances_are_those_to_the_ball(ball):
    points = np.random.default_rng(1).uniform(-1.1, 1.1, (2000, 3))
    distance, gradient, status = ball.esdf().distance_and_gradient(points)
    want = 2 - np.linalg.norm(points, axis=1)
    known = status == Status.KNOWN
    assert known.sum() > 500 and np.abs(distance - want)[known].max() < 0.05
    outward = -points / np.linalg.norm(points, axis=1)[:, None]
    assert np.median((gradient * outward).sum(axis=1)[known]) > 0.98


def test_the_mesh_is_the_ball(ball):
    mesh = ball.mesh()
    radius = np.linalg.norm(mesh.vertices, axis=1)
    assert np.abs(radius - 2).max() < 0.03 and abs(mesh.area / (16 * np.pi) - 1) < 0.03
    assert mesh.triangles.max() < len(mesh.vertices) and mesh.triangles.dtype == np.uint32
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    assert ((normal * -a).sum(axis=1) > 0).mean() > 0.999, "triangles face free space"
    assert ((mesh.normals * -mesh.vertices).sum(axis=1) > 0).all() and mesh.colors is None
    assert mesh._repr_png_()[:4] == b"\x89PNG" and ball._repr_png_()[:4] == b"\x89PNG"


def test_depth_images_in_every_unit():
    camera = (300.0, 300.0, 79.5, 59.5)
    colors = np.zeros((120, 160, 3), np.uint8)
    colors[..., 0] = 200
    pose = np.eye(4)
    maps = []
    for depth, options in [
        (np.full((120, 160), 1.5), {}),
        (np.full((120, 160), 1.5, np.float32), {"depth_scale": 1}),
        (np.full((120, 160), 1500, np.uint16), {"depth_scale": 1000}),
        (np.asfortranarray(np.full((120, 160), 1500, ">u2")), {"depth_scale": 1000}),
    ]:
        mapper = portolan.Mapper(0.02)
        matrix = np.array([[300.0, 0, 79.5], [0, 300.0, 59.5], [0, 0, 1]]) if depth.dtype == np.uint16 else camera
        mapper.integrate(depth=depth, intrinsics=matrix, colors=colors, pose=pose, **options)
        maps.append(mapper)
    for mapper in maps:
        z = mapper.mesh().vertices[:, 2]
        assert len(z) > 100 and np.abs(z - 1.5).max() < 1e-3
        assert (mapper.mesh().colors[:, 0] > 190).all()
    color, status = maps[0].tsdf.color([[0.0, 0.0, 1.5], [0.0, 0.0, 0.5]])
    assert color[0, 0] == 200 and status.tolist() == [Status.KNOWN, Status.UNKNOWN]


def test_rings_of_a_lidar_either_way_up():
    bearings = -np.pi + 2 * np.pi * np.arange(360) / 360
    elevations = np.radians(np.linspace(15, -15, 16))
    ranges = np.full((16, 360), 3.0)
    fields = []
    for up in [False, True]:
        mapper = portolan.Mapper(0.1)
        e, r = (elevations[::-1], ranges[::-1]) if up else (elevations, ranges)
        mapper.integrate(ranges=r, bearings=bearings, elevations=e, pose=(0, 0, 1, 0, 0, 0, 1))
        fields.append(mapper.mesh().vertices)
    assert np.array_equal(fields[0], fields[1])
    assert np.abs(np.linalg.norm(fields[0] - [0, 0, 1], axis=1) - 3).max() < 0.1


def test_points_of_any_type_are_the_same_map():
    points = sphere_points(4000).astype(np.float32)
    given = [
        points,
        points.astype(float),
        points.astype(">f4"),
        np.asfortranarray(points),
        np.repeat(points, 2, axis=0)[::2],
        points.tolist(),
        np.ma.masked_array(points, mask=False),
    ]
    maps = []
    for p in given:
        mapper = portolan.Mapper(0.2)
        mapper.integrate(p, np.eye(4))
        maps.append(mapper.mesh().vertices)
    for vertices in maps[1:]:
        assert np.array_equal(vertices, maps[0])


def test_saved_and_read_again(ball, tmp_path):
    ball.save(tmp_path / "map.portolan")
    again = portolan.load(tmp_path)
    points = np.random.default_rng(5).uniform(-2.3, 2.3, (3000, 3))
    for ask in [
        lambda m: m.occupancy.occupancy(points)[0],
        lambda m: m.tsdf.distance(points)[0],
        lambda m: m.attenuation.attenuation(points)[0],
        lambda m: m.esdf().distance(points)[0],
    ]:
        assert np.array_equal(ask(ball), ask(again), equal_nan=True)
    assert np.array_equal(ball.mesh().vertices, again.mesh().vertices)


@pytest.mark.parametrize("name", ["m.ply", "m.glb", "m.obj", "m.bt", "m.ot", "m.bin", "m.npz", "m.mcap"])
def test_every_format_of_convert(ball, tmp_path, name):
    ball.export(str(tmp_path / name))
    assert (tmp_path / name).stat().st_size > 100


def test_slabs_need_a_word_and_options_pass(ball, tmp_path):
    with pytest.raises(ValueError, match="--z"):
        ball.export(str(tmp_path / "floor.yaml"))
    ball.export(str(tmp_path / "floor.yaml"), z="-0.5:0.5", unknown="pessimistic")
    assert (tmp_path / "floor.pgm").exists()


def test_cells_and_clouds(ball):
    centers, values = ball.occupancy.cells()
    assert (values >= 0.5).all() and np.abs(np.linalg.norm(centers, axis=1) - 2).max() < 0.2
    every, _ = ball.occupancy.cells(least=0.0)
    assert len(every) == ball.occupancy.observed_cells > len(centers)
    cloud = portolan.Cloud(centers)
    assert len(cloud) == len(centers) and np.array_equal(cloud.points, centers)
    probes = np.random.default_rng(6).uniform(-2, 2, (50, 3))
    want = np.linalg.norm(probes[:, None] - centers[None], axis=2).min(axis=1)
    assert np.allclose(cloud.nearest_distance(probes), want, atol=1e-12)


def test_esdf_as_an_array(ball):
    field = ball.esdf()
    box = field.to_array([-1, -1, -1, 1, 1, 1])
    assert box["distance"].shape == box["status"].shape and box["distance"].ndim == 3
    z, y, x = 3, 5, 7
    center = box["origin"] + (np.array([x, y, z]) + 0.5) * box["resolution"]
    assert abs(box["distance"][z, y, x] - field.distance(center)[0]) < 1e-6
