"""The same answers as OctoMap on the same points."""

import numpy as np
import pytest
from conftest import sphere_points

import portolan


def test_occupancy_is_octomaps():
    octomap = pytest.importorskip("octomap")
    rng = np.random.default_rng(8)
    tree = octomap.OcTree(0.1)
    mapper = portolan.Mapper(0.1, distances=False, attenuation=False, sweep="exact")
    for k in range(3):
        origin = np.array([0.03 + 0.2 * k, 0.01, 0.02])
        points = sphere_points(8000) * rng.uniform(0.9, 1.1, (8000, 1))
        tree.insertPointCloud(points, origin, -1.0)
        mapper.integrate(points, np.eye(4), origin=origin)
    probes = (np.floor(rng.uniform(-23, 23, (4000, 3))) + 0.5) * 0.1
    ours, _ = mapper.occupancy.occupancy(probes)
    theirs = np.full(len(probes), np.nan)
    for i, p in enumerate(probes):
        try:
            theirs[i] = tree.search(p).getOccupancy()
        except octomap.NullPointerException:
            pass
    assert np.array_equal(np.isnan(ours), np.isnan(theirs)) or (np.isnan(ours) == np.isnan(theirs)).mean() > 0.995
    both = ~np.isnan(ours) & ~np.isnan(theirs)
    assert both.sum() > 500
    # A byte of log odds against a float, and rays that touch a corner.
    assert (np.abs(ours - theirs)[both] < 0.02).mean() > 0.99
