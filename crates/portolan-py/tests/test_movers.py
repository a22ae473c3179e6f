"""What moved: looks, splits, and the maps without."""

import numpy as np
import pytest

import portolan

BEARINGS = np.radians(np.arange(720) / 2 - 180)
ROOM = 3 / np.maximum(np.abs(np.cos(BEARINGS)), np.abs(np.sin(BEARINGS)))
WALKED = np.where(np.abs(BEARINGS) < 0.1, 1.5, ROOM)
POSE = (0.0, 0.0, 0.0)


def looked(walked=3, empty=7):
    movers = portolan.Movers(0.02)
    for ranges in [ROOM] * empty + [WALKED] * walked:
        movers.look(ranges=ranges, bearings=BEARINGS, pose=POSE)
    return movers


def test_what_moved_is_taken_out_and_listed():
    movers = looked()
    rest, gone = movers.split(ranges=WALKED, bearings=BEARINGS, pose=POSE)
    assert gone.shape == (23, 2) and np.all(np.abs(np.linalg.norm(gone, axis=1) - 1.5) < 1e-9)
    assert np.sum(rest.kinds == portolan.BeamKind.MOVER) == 23
    assert np.sum(rest.kinds == portolan.BeamKind.HIT) == 720 - 23
    still, none = movers.split(ranges=ROOM, bearings=BEARINGS, pose=POSE)
    assert len(none) == 0 and np.all(still.kinds == portolan.BeamKind.HIT)
    mapper = portolan.Mapper(0.05)
    counts = mapper.integrate(rest)
    assert counts["movers"] == 23 and counts["hits"] == 720 - 23
    # Free up to where it was, and nothing is there.
    assert mapper.occupancy.occupancy([[1.0, 0.0]])[0][0] < 0.5
    assert not mapper.occupancy.occupancy([[1.52, 0.0]])[0][0] > 0.5


def test_what_is_always_there_stays():
    movers = looked(walked=10, empty=0)
    assert len(movers.split(ranges=WALKED, bearings=BEARINGS, pose=POSE)[1]) == 0
    # Nothing was looked at.
    assert len(portolan.Movers().split(ranges=WALKED, bearings=BEARINGS, pose=POSE)[1]) == 0


def test_points_in_3d():
    azimuth, elevation = np.meshgrid(np.radians(np.arange(0, 360, 0.5)), np.radians(np.arange(-20, 21, 1.0)))
    d = np.stack([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], -1)
    empty = 3 * d.reshape(-1, 3)
    near = np.where((np.abs(azimuth) < 0.3) & (np.abs(elevation) < 0.2), 1.5, 3.0)
    walked = (near[..., None] * d).reshape(-1, 3)
    movers = portolan.Movers()
    for points in [empty, empty, walked]:
        movers.look(points, np.eye(4))
    rest, gone = movers.split(walked, np.eye(4))
    assert len(gone) > 0.9 * np.sum(near < 2) and np.all(np.linalg.norm(gone, axis=1) < 1.6)
    assert len(rest.points) == len(walked) - len(gone)


def test_bad_calls():
    for sigma in [0, -1, np.nan, np.inf]:
        with pytest.raises(ValueError, match="pose_sigma"):
            portolan.Movers(sigma)
    movers = looked()
    with pytest.raises(ValueError, match="3-D"):
        movers.look([[1.0, 0, 0]], np.eye(4))
    with pytest.raises(ValueError, match="pose"):
        movers.look(ranges=ROOM, bearings=BEARINGS)
    with pytest.raises(TypeError, match="no such argument"):
        movers.split(ranges=ROOM, bearing=BEARINGS, pose=POSE)
    with pytest.raises(portolan.MapFull):
        portolan.Movers(memory=1000).look(ranges=ROOM, bearings=BEARINGS, pose=POSE)
    # It is as before.
    assert len(movers.split(ranges=WALKED, bearings=BEARINGS, pose=POSE)[1]) == 23
