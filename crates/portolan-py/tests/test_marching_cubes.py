"""`portolan.marching_cubes` beside scikit-image, and what it refuses."""

import numpy as np
import pytest

import portolan

measure = pytest.importorskip(
    "skimage.measure", reason="scikit-image is not there: portolan.marching_cubes is not compared with it"
)


def smooth(shape, seed=0, dtype=np.float32):
    """Waves that are long beside the cells: no cube is ambiguous."""
    random = np.random.default_rng(seed)
    axes = np.meshgrid(*map(np.arange, shape), indexing="ij")
    total = np.zeros(shape)
    for _ in range(4):
        along = random.normal(size=3)
        along *= random.uniform(0.04, 0.16) / np.linalg.norm(along)
        total += np.cos(sum(k * a for k, a in zip(along, axes)) + random.uniform(0, 7))
    return total.astype(dtype)


def ball(n=24, radius=8.3):
    return (radius - np.linalg.norm(np.indices((n, n + 3, n + 5)).T - np.array([11.2, 12.1, 13.4]), axis=-1)).T.astype("f4")


def matched(ours, theirs, tolerance):
    """The vertex of ours that each of theirs is; both have as many."""
    assert ours.shape == theirs.shape
    order = lambda v: np.lexsort(np.round(v / (8 * tolerance)).T)
    a, b = ours[order(ours)], theirs[order(theirs)]
    if np.abs(a - b).max() > tolerance:
        spatial = pytest.importorskip("scipy.spatial", reason="SciPy is not there: vertices cannot be matched")
        distance, found = spatial.cKDTree(ours).query(theirs)
        assert distance.max() <= tolerance and len(set(found)) == len(ours)
        return found
    found = np.empty(len(ours), int)
    found[order(theirs)] = order(ours)
    return found


def triangles(faces):
    """Faces from their least vertex on, sorted: the same for meshes that are the same."""
    start = faces.argmin(1)
    turned = faces[np.arange(len(faces))[:, None], (start[:, None] + np.arange(3)) % 3]
    return turned[np.lexsort(turned.T[::-1])]


def area_normals(verts, faces):
    a, b, c = verts[faces].astype("f8").transpose(1, 0, 2)
    return np.cross(b - a, c - a)


@pytest.mark.parametrize("order", "CF")
@pytest.mark.parametrize("direction", ["descent", "ascent"])
@pytest.mark.parametrize("spacing", [(1, 1, 1), (0.5, 2.0, 1.25)])
@pytest.mark.parametrize("seed", range(4))
def test_it_is_the_surface_of_scikit_image(order, direction, spacing, seed):
    volume = np.array(smooth((33, 28, 41), seed), order=order)
    level = (None, 0.0, 0.31, -0.2)[seed]
    options = dict(spacing=spacing, gradient_direction=direction)
    verts, faces, normals, values = portolan.marching_cubes(volume, level, **options)
    v, f, n, w = measure.marching_cubes(volume, level, **options)
    assert [a.dtype for a in (verts, faces, normals, values)] == ["f4", "i4", "f4", "f4"]
    assert len(verts) > 500 and normals.shape == verts.shape and values.shape == (len(verts),)
    found = matched(verts, v, 2e-5)
    assert len(faces) == len(f)
    np.testing.assert_allclose(values[found], w, rtol=1e-5, atol=1e-6)
    # The same triangles but for diagonals, on the same side.
    area = np.linalg.norm(area_normals(verts, faces), axis=1).sum()
    theirs = np.linalg.norm(area_normals(v, f), axis=1).sum()
    assert abs(area / theirs - 1) < 2e-3
    inside = area_normals(verts, faces)
    want = area_normals(v, f)
    sum_at = lambda faces, normals, n: np.stack([np.bincount(faces.ravel(), np.repeat(normals[:, k], 3), n) for k in range(3)], 1)
    a, b = sum_at(faces, inside, len(verts))[found], sum_at(f, want, len(v))
    cosine = (a * b).sum(1) / (np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1))
    assert np.quantile(cosine, 0.005) > 0.9 and cosine.min() > 0
    # Normals: theirs do not heed the spacing.
    if spacing == (1, 1, 1):
        cosine = (normals[found] * n).sum(1)
        assert np.median(cosine) > 0.999 and cosine.min() > 0.8
    # 'descent' is left-handed: seen by the right hand, triangles face larger values, normals smaller ones.
    sign = -1 if direction == "descent" else 1
    along = sign * (normals[found] * a).sum(1) / np.linalg.norm(a, axis=1)
    assert np.median(along) > 0.99 and along.min() > 0.5


@pytest.mark.parametrize("order", "CF")
def test_what_is_not_asked_for_is_none(order):
    volume = np.array(smooth((19, 28, 21), 5), order=order)
    whole = portolan.marching_cubes(volume, 0.1)
    for normals, values in ((True, False), (False, True), (False, False)):
        some = portolan.marching_cubes(volume, 0.1, normals=normals, values=values)
        for got, want, asked in zip(some, whole, (True, True, normals, values)):
            assert (got is None) == (not asked)
            if asked:
                np.testing.assert_array_equal(got, want)


@pytest.mark.parametrize("holes", [False, True])
@pytest.mark.parametrize("order", "CF")
def test_it_is_the_same_on_any_number_of_threads(order, holes):
    # Noise: vertices and triangles enough to be shared out.
    volume = np.array(np.random.default_rng(8).random((60, 50, 70), np.float32), order=order)
    if holes:
        volume[3, 4, 5] = np.nan
    one = portolan.marching_cubes(volume, 0.5, (1, 2, 3), parallel=1)
    assert len(one[0]) > 1 << 16 and len(one[1]) > 1 << 16
    for parallel in (None, 0, 2, 7):
        for a, b in zip(one, portolan.marching_cubes(volume, 0.5, (1, 2, 3), parallel=parallel)):
            assert a.dtype == b.dtype and np.array_equal(a.view(np.uint32), b.view(np.uint32))


def test_threads_are_a_number():
    for wrong in (-1, 1.5, "two"):
        with pytest.raises((TypeError, OverflowError)):
            portolan.marching_cubes(ball(), 0.0, parallel=wrong)


@pytest.mark.parametrize("order", "CF")
def test_a_sample_that_is_not_finite_changes_what_is_around_it_alone(order):
    volume = smooth((30, 26, 35), 7)
    holed = volume.copy()
    holed[0, 0, 0] = np.nan
    # An array with holes goes another way.
    rows = lambda v: set(map(bytes, np.concatenate([v[0], v[2], v[3][:, None]], 1)[(v[0] > 2).any(1)]))
    whole, rest = (rows(portolan.marching_cubes(np.array(v, order=order), 0.1)) for v in (volume, holed))
    assert whole == rest and len(whole) > 500


def test_a_ball_has_triangles_like_those_of_scikit_image():
    verts, faces, _, _ = portolan.marching_cubes(ball(), 0.0)
    v, f, _, _ = measure.marching_cubes(ball(), 0.0)
    found = matched(verts, v, 2e-5)
    edges = lambda t: set(map(tuple, np.sort(np.concatenate([t[:, :2], t[:, 1:], t[:, ::2]]), 1)))
    ours, theirs = edges(faces), edges(found[f])
    assert len(ours) == len(theirs) and len(ours & theirs) > 0.7 * len(ours)
    one_loop = triangles(faces)
    assert len(np.unique(one_loop, axis=0)) == len(faces)


def test_values_at_the_level_are_where_scikit_image_has_them():
    volume = np.indices((9, 8, 7))[0].astype("f4")
    verts, faces, _, _ = portolan.marching_cubes(volume, 3.0)
    v, f, _, _ = measure.marching_cubes(volume, 3.0)
    matched(verts, v, 1e-6)
    assert len(faces) == len(f) and (verts[:, 0] == 3).all()
    # A level between two float32.
    volume = np.where(np.indices((5, 5, 5))[0] < 2, np.float32(0.1), 1).astype("f4")
    with pytest.raises(ValueError, match="level: 0.1 is not among"):
        portolan.marching_cubes(volume, 0.1)


def test_normals_heed_the_spacing():
    spacing = np.array([0.5, 2.0, 1.0])
    verts, _, normals, _ = portolan.marching_cubes(ball(), 0.0, spacing)
    # The ball becomes an ellipsoid; its normals are those of x^2 / s^2.
    away = (verts / spacing - [11.2, 12.1, 13.4]) / spacing
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    assert (np.abs((away * normals).sum(1)) > 0.99).all()
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, rtol=1e-5)


@pytest.mark.parametrize("order", "CF")
@pytest.mark.parametrize("mask_order", "CF")
def test_masks_are_those_of_scikit_image(order, mask_order):
    volume = np.array(smooth((30, 26, 35), 7), order=order)
    random = np.random.default_rng(2)
    blocks = np.kron(random.random((6, 6, 7)) < 0.6, np.ones((5, 5, 5), bool))[:30, :26, :35]
    for mask in (blocks, random.random(volume.shape) < 0.8):
        mask = np.array(mask, order=mask_order)
        verts, faces, _, values = portolan.marching_cubes(volume, 0.1, mask=mask)
        v, f, _, w = measure.marching_cubes(volume, 0.1, mask=mask)
        found = matched(verts, v, 2e-5)
        assert len(faces) == len(f) and len(faces) > 100
        np.testing.assert_allclose(values[found], w, rtol=1e-5, atol=1e-6)
    with pytest.raises(RuntimeError, match="no surface"):
        portolan.marching_cubes(volume, 0.1, mask=np.zeros(volume.shape, bool))


@pytest.mark.parametrize("dtype", ["f2", "f8", "i2", "u1", ">f4", "?"])
def test_every_type_of_values(dtype):
    volume = (smooth((20, 21, 22), 3) * 30 + 60).astype("u1")
    volume = volume > 60 if dtype == "?" else volume.astype(dtype)
    level = 0.5 if dtype == "?" else 60.5
    verts, faces, _, _ = portolan.marching_cubes(volume, level)
    v, f, _, _ = measure.marching_cubes(volume.astype("f4"), level)
    if dtype != "?":
        matched(verts, v, 2e-5)
    assert abs(len(faces) / len(f) - 1) < 0.01
    for view in (volume[::2], volume[:, ::-1], volume.transpose(1, 2, 0)):
        for a, b in zip(portolan.marching_cubes(view, level), portolan.marching_cubes(np.ascontiguousarray(view), level)):
            np.testing.assert_array_equal(a, b)


def test_what_is_not_finite_is_a_hole():
    volume = np.indices((20, 20, 20))[0].astype("f4") - 9.5
    volume[5:15, 5, 5] = np.nan
    volume[9, 12, 12] = np.inf
    verts, faces, normals, values = portolan.marching_cubes(volume)
    assert len(faces) == 2 * (19 * 19 - 2 * 4)
    assert all(np.isfinite(a).all() for a in (verts, normals, values))
    with pytest.raises(ValueError, match="volume: no value is finite"):
        portolan.marching_cubes(np.full((3, 3, 3), np.nan))


@pytest.mark.parametrize(
    "change, words",
    [
        (dict(volume=np.zeros((3, 3))), r"volume: .*3 axes.*\(3, 3\)"),
        (dict(volume=np.zeros((3, 1, 3))), r"volume: at least 2.*\(3, 1, 3\)"),
        (dict(volume=np.zeros((3, 0, 3))), r"volume: at least 2.*\(3, 0, 3\)"),
        (dict(volume=np.zeros((3, 3, 3), complex)), "volume: .*complex128"),
        (dict(volume=np.ma.masked_less(ball(), -3)), "volume: .* are masked"),
        (dict(level=1e9), "level: 1000000000 is not among the values of the volume, -15.* to 7.8"),
        (dict(level=np.nan), "level: must be finite, got NaN"),
        (dict(spacing=(1, 0, 1)), "spacing: .*got 0"),
        (dict(spacing=(1, 1, np.inf)), "spacing: .*got inf"),
        (dict(gradient_direction="up"), "gradient_direction: .*up"),
        (dict(mask=np.ones((3, 3, 3), bool)), r"mask: shape \(3, 3, 3\)"),
        (dict(mask=np.ones(ball().shape)), "mask: .*booleans"),
    ],
)
def test_what_cannot_be_is_refused(change, words):
    with pytest.raises(ValueError, match=words):
        portolan.marching_cubes(**{"volume": ball(), "level": 0.0, **change})


def test_flat_volumes_have_no_surface():
    with pytest.raises(RuntimeError, match="no surface"):
        portolan.marching_cubes(np.ones((4, 4, 4)), 1.0)
