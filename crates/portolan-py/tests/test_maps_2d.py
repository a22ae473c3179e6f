"""Maps, fields and questions in 2-D, against a room of known walls."""

import numpy as np
import pytest
from conftest import room_scan

import portolan
from portolan import Status


def test_distances_are_those_to_the_walls(room):
    field = room.esdf()
    points = np.random.default_rng(1).uniform(-1.8, 1.8, (2000, 2))
    distance, gradient, status = field.distance_and_gradient(points)
    wall = 2 - np.abs(points).max(axis=1)
    known = status == Status.KNOWN
    assert known.mean() > 0.65 and set(status[~known]) <= {Status.SATURATED}
    assert np.abs(distance - wall)[known].max() < 0.02
    assert (distance[~known] > 0.95).all() and (wall >= distance - 0.02)[~known].all()
    # Shorter where two walls are equally near.
    length = np.linalg.norm(gradient[known], axis=1)
    assert (np.abs(length - 1) < 0.01).mean() > 0.9 and length.max() < 2**0.5
    assert (field.distance(points)[0] == distance).all()


def test_shapes_follow_the_points(room):
    grid = np.zeros((3, 4, 2))
    distance, status = room.esdf().distance(grid)
    assert distance.shape == status.shape == (3, 4)
    assert room.esdf().distance_and_gradient(grid)[1].shape == (3, 4, 2)
    one, status = room.occupancy.occupancy([0.5, 0.5])
    assert one.shape == () and one < 0.5 and status == Status.KNOWN
    nothing, status = room.tsdf.distance(np.zeros((0, 2)))
    assert nothing.shape == status.shape == (0,)


def test_unknown_is_never_a_number(room):
    far = [[50.0, 0.0], [np.nan, 0.0], [2.6, 2.6]]
    for values, status in [room.esdf().distance(far), room.occupancy.occupancy(far), room.tsdf.distance(far)]:
        assert np.isnan(values).all()
        assert set(status) <= {Status.UNKNOWN, Status.OUTSIDE}


def test_clearance_holds_the_distance_and_respects_the_unknown(room):
    points = np.random.default_rng(2).uniform(-1.9, 1.9, (500, 2))
    field, contour = room.esdf(), room.contour()
    lower, upper, status = field.clearance(points, unknown="optimistic")
    known = status == Status.KNOWN
    assert known.sum() > 200
    a, b = (contour.vertices[contour.segments[:, k]] for k in range(2))
    t = np.clip(((points[:, None] - a) * (b - a)).sum(axis=2) / ((b - a) ** 2).sum(axis=1), 0, 1)
    exact = np.linalg.norm(points[:, None] - a - t[..., None] * (b - a), axis=2).min(axis=1)
    assert (lower[known] <= exact[known] + 1e-9).all() and (exact[known] <= upper[known] + 1e-9).all()
    pessimistic, _, _ = field.clearance(points)
    assert (pessimistic[known] <= lower[known] + 1e-9).all()


def test_paths(room):
    field = room.esdf()
    free = field.check_path([[-1.2, 0], [1.2, 0.3]], 0.3)
    assert free and free.certified and free.cause is None and free.violation_span is None
    lower, upper = free.clearance
    assert 0.3 <= lower <= upper
    blocked = field.check_path([[0, 0], [3, 0]], 0.3)
    assert not blocked and blocked.cause == "too near" and blocked.clearance is None
    begin, end = blocked.violation_span
    assert abs(begin - 1.7) < 0.02 and end == 3.0


def test_rays_and_predicted_ranges(room):
    ranges, bearings = room_scan(101)
    directions = np.stack([np.cos(bearings), np.sin(bearings)], axis=-1)
    cast, status = room.tsdf.raycast([0.0, 0.0], 3 * directions, max_range=10)
    assert (status == Status.KNOWN).all() and np.abs(cast - ranges).max() < 0.02
    free, status = room.tsdf.raycast([0.0, 0.0], directions, max_range=1.0)
    assert (status == Status.SATURATED).all() and (free == 1).all()
    quantiles, passing = room.attenuation.predict_ranges([[0.0, 0.0]], directions, quantiles=[0.1, 0.5, 0.9])
    assert quantiles.shape == (101, 3) and (np.diff(quantiles, axis=1) >= 0).all()
    assert np.abs(quantiles[:, 1] - ranges).max() < 0.15 and (passing < 0.2).all()
    hits, status = room.attenuation.attenuation([[2.01, 0.0], [0.5, 0.5]])
    assert hits[0] > 1 and hits[1] == 0 and (status == Status.KNOWN).all()


def test_the_contour_is_the_room(room):
    contour = room.contour()
    assert abs(contour.length - 16) < 0.1 and len(contour) == len(contour.segments)
    [line] = contour.polylines()
    assert (line[0] == line[-1]).all()
    assert np.abs(np.abs(contour.vertices).max(axis=1) - 2).max() < 0.02
    ends = contour.vertices[contour.segments]
    middle, along = ends.mean(axis=1), ends[:, 1] - ends[:, 0]
    left = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    assert ((left * -middle).sum(axis=1) > 0).all(), "free space lies on the left"


def test_frontiers_are_where_the_known_ends():
    ranges, bearings = room_scan()
    open_side = np.abs(bearings) < 0.4
    mapper = portolan.Mapper(0.05)
    mapper.integrate(ranges=np.where(open_side, 9.0, ranges), bearings=bearings, pose=(0, 0, 0), max_range=3.0)
    frontiers = mapper.tsdf.frontiers(min_cells=5)
    first = frontiers[0]
    assert abs(first.middle[0] - 3) < 0.2 and first.normal[0] > 0.8 and len(first) == len(first.cells) > 20
    assert [len(f) for f in frontiers] == sorted((len(f) for f in frontiers), reverse=True)


def test_events_are_the_filter():
    ranges, bearings = room_scan()
    mapper = portolan.Mapper(0.05)
    cell = [39, 0]  # Before the wall at x = 2.
    mapper.watch([cell, [0, 0]])
    for k in range(3):
        mapper.integrate(ranges=ranges, bearings=bearings, pose=(0, 0, 0))
        [event] = mapper.fuse_events(cell)
        assert event["cell"] == cell and abs(event["observation"] - 0.025) < 1e-3
        assert event["weight_before"] == k and abs(event["gain"] - 1 / (k + 1)) < 1e-6
        assert abs(event["after"] - 0.025) < 1e-3
    assert len(mapper.fuse_events()) == 2


def test_snapshots_do_not_change_and_copies_go_their_own_way(room):
    mapper = room.copy()
    before, tsdf = mapper.occupancy, mapper.tsdf
    point = [[1.0, 0.0]]
    value, distance = before.occupancy(point)[0], tsdf.distance([[1.9, 0.0]])[0]
    wall = np.full(720, 1.0)
    for _ in range(20):
        mapper.integrate(ranges=wall, bearings=room_scan()[1], pose=(0, 0, 0))
    assert before.occupancy(point)[0] == value and tsdf.distance([[1.9, 0.0]])[0] == distance
    assert mapper.occupancy.occupancy([[1.01, 0.0]])[0] > 0.5
    assert room.occupancy.occupancy([[1.01, 0.0]])[0] < 0.5 and room.stats["scans"] == 1


def test_poses_are_read_in_every_form():
    ranges, bearings = room_scan(at=(0.5, 0.25))
    angle = 0.3
    c, s = np.cos(angle), np.sin(angle)
    matrix = np.array([[c, -s, 0.5], [s, c, 0.25], [0, 0, 1]])
    fields = []
    for pose in [(0.5, 0.25, angle), matrix, matrix.tolist(), np.asfortranarray(matrix)]:
        mapper = portolan.Mapper(0.05)
        mapper.integrate(ranges=ranges, bearings=bearings - angle, pose=pose)
        assert np.allclose(mapper.poses[0], matrix)
        fields.append(mapper.esdf().to_array()["distance"])
    for field in fields[1:]:
        assert np.array_equal(field, fields[0], equal_nan=True)


def test_points_and_ranges_are_one_scan():
    ranges, bearings = room_scan()
    points = ranges[:, None] * np.stack([np.cos(bearings), np.sin(bearings)], axis=-1)
    maps = []
    for how in [dict(points=points), dict(ranges=ranges, bearings=bearings)]:
        mapper = portolan.Mapper(0.05)
        mapper.integrate(**how, pose=(0, 0, 0))
        maps.append(mapper.occupancy)
    probes = np.random.default_rng(3).uniform(-2.2, 2.2, (1000, 2))
    a, b = (m.occupancy(probes)[0] for m in maps)
    assert (np.isnan(a) == np.isnan(b)).mean() > 0.99
    # A limit of range is a limit for points, too.
    near = portolan.Mapper(0.05)
    stats = near.integrate(points, (0, 0, 0), max_range=1.0)
    assert stats["hits"] == 0 and stats["max_range"] == 720


def test_saved_and_read_again(room, tmp_path):
    path = tmp_path / "map.portolan"
    room.save(path)
    again = portolan.load(path)
    assert again.dimension == 2 and again.resolution == 0.05 and len(again.poses) == 1
    points = np.random.default_rng(4).uniform(-2.3, 2.3, (3000, 2))
    for ask in [
        lambda m: m.occupancy.occupancy(points)[0],
        lambda m: m.tsdf.distance(points)[0],
        lambda m: m.attenuation.attenuation(points)[0],
    ]:
        assert np.array_equal(ask(room), ask(again), equal_nan=True)
    # Its array has a corner of its own, and so places that are rounded otherwise.
    assert np.allclose(room.esdf().distance(points)[0], again.esdf().distance(points)[0], atol=1e-6, equal_nan=True)
    ranges, bearings = room_scan(at=(30.0, 0.0))
    again.integrate(ranges=np.full(720, 1.0), bearings=bearings, pose=(30, 0, 0))
    assert again.occupancy.occupancy([[31.01, 0.0]])[0] > 0.5, "a map that was read grows"
    again.save(path)
    assert "2 scans" in repr(portolan.load(path))


@pytest.mark.parametrize("name", ["m.yaml", "m.bin", "m.npz", "m.geojson", "m.svg", "m.mcap", "m.portolan"])
def test_every_format_of_convert(room, tmp_path, name):
    room.export(str(tmp_path / name))
    assert (tmp_path / name).stat().st_size > 100


def test_pictures(room):
    assert room._repr_png_()[:8] == b"\x89PNG\r\n\x1a\n" and len(room._repr_png_()) > 2000
    assert room.contour()._repr_svg_().startswith("<svg")
