"""Evidence that adds up, through Python."""

import copy
import pickle
import subprocess
import sys

import numpy as np
import pytest

import portolan
from conftest import data, room_scan, sphere_points


def add(ledger, i, move="add", at=None):
    ranges, bearings = room_scan(at=(0.1 * i, 0.05 * i))
    pose = (0.1 * i, 0.05 * i, 0.0) if at is None else at
    return getattr(ledger, move)("room", i, ranges=ranges, bearings=bearings, pose=pose)


def fused(which, **settings):
    ledger = portolan.Ledger(0.1, **settings)
    for i in which:
        assert add(ledger, i)["scans"] == 1
    return ledger


def test_any_split_and_any_order():
    whole = fused(range(6))
    merged = fused([4, 1])
    merged.merge(fused([5, 0]))
    merged.merge(fused([3, 2]))
    assert merged == whole and merged.to_bytes() == whole.to_bytes()
    assert merged.scans == [("room", i) for i in range(6)] and len(merged) == 6
    merged.take_out(fused([1, 5]))
    assert merged == fused([0, 2, 3, 4]) and merged != whole
    ranges, bearings = room_scan(at=(0.2, 0.1))
    merged.subtract("room", 2, ranges=ranges, bearings=bearings)
    assert merged.to_bytes() == fused([0, 3, 4]).to_bytes()


def test_scans_move():
    ledger = fused(range(4))
    add(ledger, 2, "repose", at=(0.3, 0.3, 0.1))
    moved = fused([0, 1, 3])
    add(moved, 2, at=(0.3, 0.3, 0.1))
    assert ledger.to_bytes() == moved.to_bytes() != fused(range(4)).to_bytes()
    add(ledger, 2, "repose", at=(0.2, 0.1, 0.0))
    assert ledger == fused(range(4))


def test_3d_copies_pickles_and_files(tmp_path):
    ledger = portolan.Ledger(0.2)
    ledger.add("ball", 0, sphere_points(5000), np.eye(4))
    kept = copy.copy(ledger)
    ledger.add("ball", 1, sphere_points(5000), (0.1, 0, 0, 0, 0, 0, 1))
    assert len(kept) == 1 and len(ledger) == 2 and ledger.dimension == 3
    assert pickle.loads(pickle.dumps(ledger)) == ledger
    assert portolan.Ledger.from_bytes(ledger.to_bytes()) == ledger
    ledger.save(tmp_path / "map.portolan")
    assert portolan.Ledger.load(tmp_path).to_bytes() == ledger.to_bytes()
    # The other commands and the mapper read it like any map.
    mapper = portolan.load(tmp_path / "map.portolan")
    ours = ledger.mapper()
    assert mapper.mesh().vertices.tobytes() == ours.mesh().vertices.tobytes()
    distance, status = ours.esdf().distance([[0, 0, 1.5]])
    assert status[0] == portolan.Status.KNOWN and abs(distance[0] - 0.5) < 0.1
    assert ours.poses.shape == (2, 4, 4)


def test_colors_add_up():
    points = sphere_points(5000)
    red, blue = (np.tile(np.uint8([c]), (len(points), 1)) for c in ([250, 10, 0], [0, 10, 250]))

    def ball(which, **settings):
        ledger = portolan.Ledger(0.2, **settings)
        for i, colors in which:
            ledger.add("ball", i, points, np.eye(4), colors=colors)
        return ledger

    both = ball([(0, red), (1, blue)])
    merged = ball([(1, blue)])
    merged.merge(ball([(0, red)]))
    assert merged.to_bytes() == both.to_bytes() and portolan.Ledger.from_bytes(both.to_bytes()) == both
    colors = both.mapper().mesh().colors
    assert len(colors) and np.abs(colors.astype(int) - [125, 10, 125]).max() <= 1
    with pytest.raises(ValueError, match="other readings"):
        both.subtract("ball", 1, points, colors=red)
    both.subtract("ball", 1, points, colors=blue)
    assert np.abs(both.mapper().mesh().colors.astype(int) - [250, 10, 0]).max() <= 1
    assert ball([(0, red)], color=False).mapper().mesh().colors is None


def test_slips_are_told():
    ledger = fused([0, 1])
    before = ledger.to_bytes()
    for wrong, part in [
        (lambda: add(ledger, 1), "in the map already"),
        (lambda: add(ledger, 5, "repose"), "is not in the map"),
        (lambda: ledger.subtract("room", 1, ranges=np.ones(720), bearings=room_scan()[1]), "other readings"),
        (lambda: ledger.merge(fused([1])), "in the map already"),
        (lambda: ledger.take_out(fused([3])), "is not in the map"),
        (lambda: ledger.merge(fused([3], carve_weight=0.5)), "free space"),
        (lambda: ledger.add("room", 9, ranges=np.ones(3), bearings=[0, 1, 2]), "pose"),
        (lambda: ledger.add("ball", 0, sphere_points(100), np.eye(4)), "3-D"),
        (lambda: ledger.add("room", 9, ranges=np.ones(3), bearings=[0, 1, 2], pose=(np.nan, 0, 0)), "not finite"),
        (lambda: portolan.Ledger.from_bytes(b"no map"), "PORTOLAN"),
        (lambda: portolan.Ledger.from_bytes(before[: len(before) // 2]), "cut off"),
    ]:
        with pytest.raises(ValueError, match=part):
            wrong()
    with pytest.raises(TypeError, match="range"):
        ledger.add("room", 9, range=np.ones(3), bearings=[0, 1, 2], pose=(0, 0, 0))
    with pytest.raises(OSError):
        portolan.Ledger.load("/nowhere/map.portolan")
    assert ledger.to_bytes() == before
    assert portolan.Ledger(0.1) == portolan.Ledger(0.1)


def test_no_room(tmp_path):
    ledger = portolan.Ledger(0.05, memory=20_000)
    with pytest.raises(portolan.MapFull):
        add(ledger, 0)
    assert len(ledger) == 0
    mapper = portolan.Mapper(0.1)
    mapper.integrate(ranges=room_scan()[0], bearings=room_scan()[1], pose=(0, 0, 0))
    mapper.save(tmp_path / "map.portolan")
    with pytest.raises(ValueError, match="do not add up"):
        portolan.Ledger.load(tmp_path)


def test_the_program_adds_the_same_sums(tmp_path):
    path = data("lidar2d_carmen") / "intel-corrected.log.gz"
    log = portolan.open(path, every=10)
    ledger = portolan.Ledger(0.1)
    half = len(log) // 2
    ledger.map(log, range(half))
    rest = portolan.Ledger(0.1)
    rest.map(log, range(half, len(log)))
    ledger.merge(rest)
    command = [sys.executable, "-m", "portolan", "map", str(path), "--resolution", "0.1", "--every", "10", "--ledger"]
    subprocess.run([*command, "--quiet", "--out", str(tmp_path)], check=True)
    assert portolan.Ledger.load(tmp_path) == ledger
