"""What cannot be used is refused with the name of the argument and the value, and nothing crashes."""

import numpy as np
import pytest
from conftest import room_scan

import portolan

EYE3, EYE4 = np.eye(3), np.eye(4)


@pytest.mark.parametrize(
    "settings, words",
    [
        (dict(resolution=0), "resolution"),
        (dict(resolution=-1), "resolution"),
        (dict(resolution=float("nan")), "resolution"),
        (dict(resolution=0.1, truncation=0), "truncation"),
        (dict(resolution=0.1, carve_weight=2), "carve_weight"),
        (dict(resolution=0.1, weights="much"), "weights.*much"),
        (dict(resolution=0.1, sweep="spiral"), "sweep.*spiral"),
        (dict(resolution=0.1, thin=1.5), "thin.*1.5"),
        (dict(resolution=0.1, w_max=0), "w_max"),
        (dict(resolution=0.1, max_distance=0), "max_distance"),
        (dict(resolution=0.1, bounds=[0, 0, 1]), "bounds.*3 numbers"),
        (dict(resolution=0.1, bounds=[0, 0, 0, 1]), "bounds"),
        (dict(resolution=0.1, bounds=[0, 0, 1, 1], origin=[0, 0, 0]), "origin.*3-D.*bounds.*2-D"),
        (dict(resolution=0.1, occupancy=False, attenuation=False, distances=False), "at least one"),
    ],
)
def test_settings(settings, words):
    with pytest.raises(ValueError, match=words):
        portolan.Mapper(**settings)


@pytest.mark.parametrize(
    "pose, words",
    [
        ((1, 2), r"pose: .*\(2,\)"),
        (np.eye(5), r"pose: .*\(5, 5\)"),
        ((0, 0, float("nan")), "pose: .*finite"),
        ((0, 0, 0, 0, 0, 0, 0), "pose: .*quaternion"),
        (2 * EYE3, "pose: "),
        (np.zeros((4, 4)), "pose: .*last row"),
        (np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [1, 2, 3, 1]]), "transposed"),
        (np.diag([1, 1, -1, 1]), "pose: "),
        ("here", "pose: "),
        (None, "pose: must be given"),
        (np.ones((3, 3), bool), "pose: .*bool"),
    ],
)
def test_poses(pose, words):
    with pytest.raises(ValueError, match=words):
        portolan.Mapper(0.1).integrate(np.ones((1, 3)), pose)


@pytest.mark.parametrize(
    "readings, words",
    [
        (dict(), "points, ranges or depth"),
        (dict(points=np.ones((2, 3)), ranges=[1]), "give one"),
        (dict(points=np.ones(3)), r"points: .*\(3,\)"),
        (dict(points=np.ones((2, 4))), r"points: .*\(2, 4\)"),
        (dict(points=np.ones((2, 2, 3))), r"points: .*\(2, 2, 3\)"),
        (dict(points=np.ones((2, 3), complex)), "points: .*complex"),
        (dict(points=[["a", "b", "c"]]), "points: "),
        (dict(points=[[1, 2, 3], [1, 2]]), "points: "),
        (dict(points=np.array([[1, 2, None]])), "points: .*object"),
        (dict(points=np.ma.masked_array(np.ones((2, 3)), mask=[[1, 0, 0], [0, 0, 0]])), "points: 1 of 6 .*masked"),
        (dict(points=np.ones((2, 3)), colors=np.zeros((3, 3), np.uint8)), r"colors: .*\(3, 3\)"),
        (dict(points=np.ones((2, 3)), colors=np.zeros((2, 3))), "colors: .*bytes.*float64"),
        (dict(points=np.ones((2, 3)), origin=[0, 0]), r"origin: .*\(2,\)"),
        (dict(points=np.ones((2, 3)), intrinsics=[1, 1, 1, 1]), "intrinsics: "),
        (dict(points=np.ones((2, 3)), min_range=3, max_range=2), "min_range"),
        (dict(points=np.ones((2, 3)), max_range=-1), "max_range.*-1"),
        (dict(points=np.ones((2, 3)), no_return=3), "no_return"),
        (dict(ranges=[1.0]), "bearings"),
        (dict(ranges=np.ones((2, 2)), bearings=[0, 1]), r"ranges: .*\(2, 2\)"),
        (dict(ranges=np.ones((2, 3)), bearings=[0, 1, 3], elevations=[1, 0]), "bearings: .*even"),
        (dict(ranges=np.ones((2, 3)), bearings=[0, 1, 2], elevations=[1, 1]), "elevations"),
        (dict(depth=np.ones((4, 4))), "intrinsics"),
        (dict(depth=np.ones((4, 4), int), intrinsics=[1, 1, 1, 1]), "depth_scale"),
        (dict(depth=np.ones((4, 4)), intrinsics=[1, 1, 1, 1], depth_scale=0), "depth_scale.*0"),
        (dict(depth=np.ones((4, 4)), intrinsics=[0, 1, 1, 1]), "depth: "),
        (dict(depth=np.ones((4, 4)), intrinsics=[[1, 2, 0], [0, 1, 0], [0, 0, 1]]), "intrinsics: .*skew"),
        (dict(depth=np.full((4, 4), 1500.0), intrinsics=[1, 1, 1, 1]), "depth: .*depth_scale"),
        (dict(ranges=np.ones(360), bearings=np.arange(360)), "bearings: .*more than a turn.*degrees"),
        (dict(depth=np.ones(4), intrinsics=[1, 1, 1, 1]), r"depth: .*\(4,\)"),
        (dict(depth=np.ones((0, 4)), intrinsics=[1, 1, 1, 1]), "depth: "),
    ],
)
def test_readings(readings, words):
    with pytest.raises(ValueError, match=words):
        portolan.Mapper(0.1).integrate(**readings, pose=EYE4)


def test_bearings_one_for_each_range():
    for bearings in [[0.0], np.zeros((2, 1))]:
        with pytest.raises(ValueError, match="bearings: .*2 bearings"):
            portolan.Mapper(0.1).integrate(ranges=[1.0, 2.0], bearings=bearings, pose=(0, 0, 0))
    with pytest.raises(ValueError, match="bearings: number 1 is NaN"):
        portolan.Mapper(0.1).integrate(ranges=[1.0, 2.0], bearings=[0.0, np.nan], pose=(0, 0, 0))


def test_dimensions_that_contradict_each_other(room, ball):
    with pytest.raises(ValueError, match="pose is 2-D and the scan 3-D"):
        portolan.Mapper(0.1).integrate(np.ones((1, 3)), (0, 0, 0))
    with pytest.raises(ValueError, match="scan is 3-D and the map 2-D"):
        room.integrate(np.ones((1, 3)), EYE4)
    with pytest.raises(ValueError, match=r"points: .*\(1, 3\).*2-D"):
        room.esdf().distance(np.ones((1, 3)))
    with pytest.raises(ValueError, match="mesh"):
        room.mesh()
    with pytest.raises(ValueError, match="contour"):
        ball.contour()
    with pytest.raises(ValueError, match="3-D.*2-D"):
        portolan.Mapper(0.1, bounds=[0, 0, 1, 1]).integrate(np.ones((1, 3)), EYE4)


def test_readings_that_are_no_numbers_are_counted_not_fused():
    mapper = portolan.Mapper(0.1)
    points = np.array([[1, 0, 0], [np.nan, 0, 0], [0, np.inf, 0], [0, 0, 0]])
    stats = mapper.integrate(points, EYE4)
    assert stats["hits"] == 1 and stats["refused_readings"] == 3
    ranges, bearings = room_scan(8)
    ranges[:3] = np.nan, np.inf, -1
    stats = portolan.Mapper(0.1).integrate(ranges=ranges, bearings=bearings, pose=(0, 0, 0))
    assert stats["hits"] == 5 and stats["refused_readings"] == 2 and stats["no_return"] == 1


def test_huge_values_end(ball):
    far = np.array([[1e300, 0, 0], [-1e30, 1e18, 3]])
    assert np.isnan(ball.esdf().distance(far)[0]).all()
    # Points further than can be searched are refused or counted, and end soon.
    mapper = portolan.Mapper(0.1, memory=1 << 26)
    try:
        mapper.integrate(np.array([[1e12, 0, 0], [1.0, 0, 0]]), EYE4)
    except (ValueError, MemoryError):
        pass
    assert mapper.memory_bytes < 1 << 28


def test_memory_that_is_limited():
    mapper = portolan.Mapper(0.01, memory=100_000)
    ranges, bearings = room_scan(2000)
    with pytest.raises(portolan.MapFull, match="memory|bytes|limit"):
        for _ in range(3):
            mapper.integrate(ranges=ranges, bearings=bearings, pose=(0, 0, 0))
    assert issubclass(portolan.MapFull, MemoryError)


def test_nothing_fused_yet(tmp_path):
    mapper = portolan.Mapper(0.1)
    assert mapper.dimension is None and mapper.occupancy is None and mapper.poses is None
    for ask in [mapper.esdf, mapper.mesh, mapper.contour, lambda: mapper.save(tmp_path / "map.portolan")]:
        with pytest.raises(ValueError, match="nothing was fused"):
            ask()
    assert not list(tmp_path.iterdir())


def test_files(tmp_path):
    with pytest.raises(OSError):
        portolan.load(tmp_path / "none.portolan")
    bad = tmp_path / "bad.portolan"
    bad.write_bytes(b"PORTOLAN" + bytes(50))
    with pytest.raises((ValueError, OSError), match="bad.portolan"):
        portolan.load(bad)
    with pytest.raises((ValueError, OSError), match="none.log"):
        portolan.open(tmp_path / "none.log")
    (tmp_path / "text.txt").write_text("no log\n")
    with pytest.raises(ValueError, match="text.txt"):
        portolan.open(tmp_path / "text.txt")
    with pytest.raises(ValueError, match="colour"):
        portolan.open(tmp_path / "text.txt", colour="red")
    with pytest.raises((ValueError, OSError), match="none.portolan"):
        portolan.convert(tmp_path / "none.portolan", tmp_path / "x.npz")


def test_paths_and_rays(room):
    field = room.esdf()
    with pytest.raises(ValueError, match="clearance.*-1"):
        field.check_path([[0, 0], [1, 0]], -1)
    with pytest.raises(ValueError, match="unknown.*maybe"):
        field.check_path([[0, 0], [1, 0]], 0.1, unknown="maybe")
    with pytest.raises(ValueError, match="waypoints"):
        field.check_path(np.zeros((0, 2)), 0.1)
    with pytest.raises(ValueError, match="waypoints"):
        field.check_path([[0, np.nan], [1, 0]], 0.1)
    with pytest.raises(ValueError, match="origins"):
        room.tsdf.raycast(np.zeros((2, 2)), np.ones((3, 2)))
    with pytest.raises(ValueError, match="max_range.*inf"):
        room.tsdf.raycast([0, 0], [1, 0], max_range=float("inf"))
    with pytest.raises(ValueError, match="quantiles.*2"):
        room.attenuation.predict_ranges([0, 0], [1, 0], quantiles=[2])
    zero, status = room.tsdf.raycast([0.0, 0.0], [[0.0, 0.0], [np.nan, 1.0]])
    assert np.isnan(zero).all() and (status == portolan.Status.OUTSIDE).all()
    with pytest.raises(ValueError, match="points: 1 of 2"):
        portolan.Cloud([[0, 0], [np.inf, 0]])
    with pytest.raises(ValueError, match="cells.*0.5"):
        room.copy().watch([[0.5, 1]])
