"""Logs: scans as arrays, and the same map as the command line makes, bit for bit."""

import json
import subprocess
import sys

import numpy as np
import pytest
from conftest import data

import portolan
from portolan import BeamKind


def command_line(*words):
    done = subprocess.run([sys.executable, "-m", "portolan", *map(str, words)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def same_cells(ours, theirs, centers):
    for ask in [
        lambda m: m.occupancy.occupancy(centers),
        lambda m: m.tsdf.distance(centers),
        lambda m: m.attenuation.attenuation(centers),
    ]:
        (a, status_a), (b, status_b) = ask(ours), ask(theirs)
        known = (status_a == 1) | (status_a == 2)
        assert known.sum() > 1000
        assert np.array_equal(a[known], b[known]), ask


def test_a_2d_log_is_the_map_of_the_command_line(tmp_path):
    path = data("lidar2d_carmen/intel-corrected.log.gz")
    command_line("map", path, "--resolution", 0.1, "--every", 20, "--out", tmp_path)
    theirs = portolan.load(tmp_path)
    log = portolan.open(path, every=20)
    assert log.dimension == 2 and len(log) > 10
    grid = theirs.esdf().to_array()
    # The same lattice, to the last bit.
    ours = portolan.Mapper(0.1, origin=grid["origin"])
    seen = []
    stats = ours.map(log, progress=lambda done, all: seen.append((done, all)))
    assert stats["unreadable"] == 0 and seen[-1] == (len(log), len(log))
    rows, columns = grid["distance"].shape
    x = grid["origin"][0] + (np.arange(columns) + 0.5) * 0.1
    y = grid["origin"][1] + (np.arange(rows) + 0.5) * 0.1
    same_cells(ours, theirs, np.stack(np.meshgrid(x, y), axis=-1))


def test_a_3d_log_is_the_map_of_the_command_line(tmp_path):
    path = data("rgbd_redkitchen")
    command_line("map", path, "--resolution", 0.05, "--every", 60, "--out", tmp_path)
    theirs = portolan.load(tmp_path)
    log = portolan.open(path, every=60)
    ours = portolan.Mapper(0.05)
    ours.map(log)
    centers, _ = theirs.occupancy.cells(least=0.0)
    same_cells(ours, theirs, centers)
    assert np.array_equal(ours.mesh().vertices, theirs.mesh().vertices)
    assert np.array_equal(ours.mesh().colors, theirs.mesh().colors)


def test_what_a_mapper_does_not_say_stays_in_the_file(tmp_path):
    path = data("lidar2d_carmen/intel-corrected.log.gz")
    command_line("map", path, "--resolution", 0.1, "--every", 50, "--max-range", 7, "--out", tmp_path)
    first = command_line("info", tmp_path, "--json")
    portolan.load(tmp_path).save(tmp_path / "again.portolan")
    again = command_line("info", tmp_path / "again.portolan", "--json")
    settings = [json.loads(text)["settings"] for text in (first, again)]
    assert settings[0]["max_range"] == settings[1]["max_range"] == 7
    assert settings[0]["truncation"] == settings[1]["truncation"] and settings[0]["maps"] == settings[1]["maps"]


def test_scans_are_arrays():
    log = portolan.open(data("lidar2d_carmen/intel-corrected.log.gz"), max_range=20)
    scan = log[3]
    assert scan.ranges.shape == scan.bearings.shape == scan.kinds.shape == (180,)
    hits = scan.kinds == BeamKind.HIT
    assert len(scan.points) == hits.sum() and (scan.ranges[hits] <= 20).all()
    direction = np.stack([np.cos(scan.bearings), np.sin(scan.bearings)], axis=-1)
    assert np.allclose(scan.points, (scan.ranges[:, None] * direction)[hits])
    assert scan.pose.shape == (3, 3) and scan.dimension == 2 and scan.depth is None
    assert log[-1].time >= log[0].time and sum(1 for _ in log) == len(log)
    with pytest.raises(IndexError):
        log[len(log)]
    # A scan goes into any mapper, by itself or with another pose.
    mapper = portolan.Mapper(0.1)
    mapper.integrate(scan)
    mapper.integrate(scan, pose=(5, 5, 0))
    assert np.allclose(mapper.poses[1][:2, 2], [5, 5]) and np.allclose(mapper.poses[0], scan.pose)


def test_images_are_arrays():
    log = portolan.open(data("rgbd_redkitchen"))
    scan = log[0]
    assert scan.depth.shape == (480, 640) and scan.colors.shape == (480, 640, 3) and scan.ranges is None
    fx, fy, cx, cy = scan.intrinsics
    v, u = np.nonzero(scan.depth > 0)
    z = scan.depth[v, u].astype(float)
    want = np.stack([(u - cx) / fx * z, (v - cy) / fy * z, z], axis=-1)
    assert np.allclose(scan.points, want, atol=1e-6)
    again = portolan.Mapper(0.05)
    again.integrate(depth=scan.depth, intrinsics=scan.intrinsics, pose=scan.pose)
    whole = portolan.Mapper(0.05)
    whole.integrate(scan)
    assert np.array_equal(again.mesh().vertices, whole.mesh().vertices)


def test_bags_are_logs():
    folder = data("ros_bags")
    bags = [p for p in sorted(folder.rglob("*")) if p.suffix in (".bag", ".mcap", ".db3")]
    assert bags
    log = portolan.open(bags[0])
    assert len(log) > 0 and log.remarks and log[0].pose.shape in [(3, 3), (4, 4)]


def test_points_without_rays_make_occupancy_alone():
    surveys = sorted(data("e57_las_ptx").glob("*.la[sz]"))
    log = portolan.open(surveys[0])
    assert log.points_only
    with pytest.raises(ValueError, match="occupancy map alone"):
        portolan.Mapper(1.0).map(log)
    mapper = portolan.Mapper(1.0, distances=False, attenuation=False)
    assert mapper.map(log)["hits"] > 0 and len(mapper.occupancy.cells()[0]) > 0


def test_an_interrupt_keeps_what_was_fused():
    log = portolan.open(data("lidar2d_carmen/intel-corrected.log.gz"))
    mapper = portolan.Mapper(0.1)

    def stop(done, all):
        if done == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mapper.map(log, progress=stop)
    assert mapper.stats["scans"] == 5
