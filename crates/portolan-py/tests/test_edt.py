"""`portolan.edt` and `portolan.sdf` beside SciPy and the `edt` package, and what they refuse."""

import subprocess
import sys
import threading

import numpy as np
import pytest

import portolan

ndimage = pytest.importorskip("scipy.ndimage", reason="SciPy is not there: portolan.edt is not compared with it")
peer = pytest.importorskip("edt", reason="the edt package is not there: portolan.edt is not compared with it")

SHAPES = [(1,), (7,), (500,), (1, 1), (1, 9), (9, 1), (31, 67), (300, 5), (1, 1, 1), (2, 3, 4), (20, 33, 17), (3, 270, 4)]
SPACINGS = [None, 0.3, (1.0, 2.0, 5.0), (4.0, 4.0, 40.0), (0.7, 1.9, 0.31)]


def sampling(spacing, shape):
    return spacing[: len(shape)] if isinstance(spacing, tuple) else spacing


def each_axis(spacing, shape):
    """As the edt package wants it."""
    if spacing is None or isinstance(spacing, float):
        spacing = (spacing or 1.0,) * 3
    return spacing[: len(shape)] if len(shape) > 1 else spacing[0]


def masks(shape):
    random = np.random.default_rng(hash(shape) % 2**32)
    for density in (0.02, 0.5, 0.9, 0.999):
        yield random.random(shape) < density
    block = np.zeros(shape, bool)
    block[tuple(slice(n // 4, max(3 * n // 4, 1)) for n in shape)] = True
    yield block


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("spacing", SPACINGS)
@pytest.mark.parametrize("order", "CF")
def test_masks_are_those_of_scipy_and_of_edt(shape, spacing, order):
    for mask in masks(shape):
        mask = np.array(mask, order=order)
        got = portolan.edt(mask, sampling(spacing, shape))
        assert got.dtype == np.float32 and got.shape == shape
        assert got.flags.c_contiguous if order == "C" else got.flags.f_contiguous
        theirs = peer.edt(mask, anisotropy=each_axis(spacing, shape))
        if mask.all():
            assert np.isinf(got).all() and np.isinf(theirs).all()
            continue
        want = ndimage.distance_transform_edt(mask, sampling=sampling(spacing, shape))
        if spacing is None:
            np.testing.assert_array_equal(got, want.astype(np.float32))
            np.testing.assert_array_equal(got, theirs)
            squares = portolan.edt(mask, squared=True)
            np.testing.assert_array_equal(squares, np.rint(want**2))
            np.testing.assert_array_equal(squares, peer.edtsq(mask))
        else:
            np.testing.assert_allclose(got, want, rtol=1e-6)
            np.testing.assert_allclose(got, theirs, rtol=1e-5)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("spacing", SPACINGS)
@pytest.mark.parametrize("border", [False, True])
@pytest.mark.parametrize("order", "CF")
def test_labels_and_borders_are_those_of_edt(shape, spacing, border, order):
    random = np.random.default_rng(5)
    coarse = random.integers(0, 4, [-(-n // 5) for n in shape])
    labels = np.array(np.kron(coarse, np.ones([5] * len(shape), int))[tuple(map(slice, shape))], order=order)
    options = dict(anisotropy=each_axis(spacing, shape), black_border=border)
    for labels in (labels, (labels > 0) * 7, np.ones_like(labels)):
        labels = np.array(labels, order=order)
        exact = np.testing.assert_array_equal if spacing is None else np.testing.assert_allclose
        how = {} if spacing is None else dict(rtol=1e-5)
        exact(portolan.edt(labels, sampling(spacing, shape), border), peer.edt(labels, **options), **how)
        exact(portolan.sdf(labels, sampling(spacing, shape), border), peer.sdf(labels, **options), **how)


@pytest.mark.parametrize("dtype", "? i1 u1 i2 u2 i4 u4 i8 u8 f2 f4 f8 >i4 >u2 >f8".split())
def test_every_type_of_labels(dtype):
    random = np.random.default_rng(8)
    labels = np.kron(random.integers(0, 2 if dtype == "?" else 4, (9, 7)), np.ones((4, 4), int))
    want = peer.edt(labels)
    given = labels.astype(dtype)
    before = given.copy()
    np.testing.assert_array_equal(portolan.edt(given), want)
    np.testing.assert_array_equal(given, before)
    if np.dtype(dtype).kind == "i":
        np.testing.assert_array_equal(portolan.edt(-given), want)
    if np.dtype(dtype).kind == "f":
        np.testing.assert_array_equal(portolan.edt(np.where(labels == 0, -0.0, labels / 4).astype(dtype)), want)


def test_labels_that_differ_in_high_bits_only_are_not_one():
    labels = np.array([2**40, 2**40, 2**40 + 2**33, 2**40 + 2**33, 0])
    np.testing.assert_array_equal(portolan.edt(labels), [2, 1, 1, 1, 0])


def test_views_lists_and_subclasses():
    mask = np.random.default_rng(1).random((40, 30, 20)) < 0.9
    for view in (mask[::2, ::-1, 3:], mask.transpose(1, 0, 2), mask[:, :, 0], mask[5], mask[::-1, 0, 0]):
        np.testing.assert_array_equal(portolan.edt(view), portolan.edt(np.ascontiguousarray(view)))
    np.testing.assert_array_equal(portolan.edt([1, 1, 0]), [2, 1, 0])
    np.testing.assert_array_equal(portolan.edt(np.asmatrix(mask[0])), portolan.edt(mask[0]))
    np.testing.assert_array_equal(portolan.edt(np.ma.masked_array(mask)), portolan.edt(mask))
    mask.flags.writeable = False
    assert portolan.edt(mask).flags.writeable


@pytest.mark.parametrize("shape", [(400,), (60, 81), (30, 25, 22)])
@pytest.mark.parametrize("spacing", SPACINGS)
@pytest.mark.parametrize("order", "CF")
def test_indices_lead_to_the_nearest(shape, spacing, order):
    for mask in masks(shape):
        mask = np.array(mask, order=order)
        distance, nearest = portolan.edt(mask, sampling(spacing, shape), return_indices=True)
        assert nearest.shape == (len(shape), *shape) and nearest.dtype == np.int32
        np.testing.assert_array_equal(distance, portolan.edt(mask, sampling(spacing, shape)))
        if mask.all():
            assert (nearest == -1).all() and np.isinf(distance).all()
            continue
        want = ndimage.distance_transform_edt(mask, sampling=sampling(spacing, shape))
        assert not mask[tuple(nearest)].any()
        steps = (nearest - np.indices(shape)).T * np.asarray(each_axis(spacing, shape))
        np.testing.assert_allclose(np.sqrt((steps**2).sum(-1)).T, want, rtol=1e-6)


def test_nothing_and_all():
    for shape in [(0,), (0, 3), (3, 0), (2, 0, 2)]:
        for what in (portolan.edt, portolan.sdf):
            assert what(np.zeros(shape, bool)).shape == shape
        distance, nearest = portolan.edt(np.zeros(shape, bool), return_indices=True)
        assert distance.shape == shape and nearest.shape == (len(shape), *shape)
    assert np.isinf(portolan.edt(np.ones((3, 4), bool))).all()
    np.testing.assert_array_equal(portolan.edt(np.zeros((3, 4), bool)), np.zeros((3, 4)))
    np.testing.assert_array_equal(portolan.sdf(np.zeros(3)), [-np.inf] * 3)


def test_threads_give_the_same_bytes():
    mask = np.random.default_rng(3).random((60, 70, 80)) < 0.999
    one = portolan.edt(mask, (1, 2, 3), parallel=1)
    for parallel in (None, 0, 2, 7):
        np.testing.assert_array_equal(portolan.edt(mask, (1, 2, 3), parallel=parallel), one)
    found = []
    threads = [threading.Thread(target=lambda: found.append(portolan.edt(mask, (1, 2, 3)))) for _ in range(4)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert len(found) == 4 and all(np.array_equal(f, one) for f in found)


def test_long_lines():
    mask = np.ones((3, 70_000), bool)
    mask[0, 0] = mask[2, -1] = False
    np.testing.assert_allclose(portolan.edt(mask), ndimage.distance_transform_edt(mask), rtol=3e-7)


@pytest.mark.parametrize(
    "given, options, words",
    [
        (np.ones((2, 2, 2, 2)), {}, r"mask: .*1, 2 or 3 axes.*\(2, 2, 2, 2\)"),
        (np.float64(3), {}, r"mask: .*1, 2 or 3 axes.*\(\)"),
        (np.array([1.0, np.nan]), {}, "mask: .*NaN"),
        (np.array([1j]), {}, "mask: .*complex128"),
        (np.array(["a"]), {}, "mask: "),
        (np.array([None]), {}, "mask: .*object"),
        (np.ma.masked_array([1, 1, 0], [1, 0, 0]), {}, "mask: 1 of 3 values are masked"),
        (np.ones((2, 2)), dict(sampling=(1, 2, 3)), r"sampling: .*2 axes.*\(1, 2, 3\)"),
        (np.ones((2, 2)), dict(sampling="ab"), "sampling: "),
        (np.ones((2, 2)), dict(sampling=(1, 0)), "sampling: .*0"),
        (np.ones((2, 2)), dict(sampling=(1, -2)), "sampling: .*-2"),
        (np.ones((2, 2)), dict(sampling=np.nan), "sampling: .*NaN"),
        (np.ones((2, 2)), dict(sampling=(1e-20, 1e20)), "sampling: .*too different"),
        (np.array([1, 2, 0]), dict(return_indices=True), "return_indices: .*mask != 0"),
        (np.array([1, 1, 0]), dict(return_indices=True, black_border=True), "return_indices with black_border"),
        (np.array([1, 1, 0]), dict(return_indices=True, squared=True), "squared"),
    ],
)
def test_what_cannot_be_is_refused(given, options, words):
    with pytest.raises(ValueError, match=words):
        portolan.edt(given, **options)


def test_memory_stays():
    resource = pytest.importorskip("resource", reason="no getrusage on this system")
    mask = np.random.default_rng(3).random((30, 30, 30)) < 0.9

    def call(n):
        for _ in range(n):
            portolan.edt(mask)
            portolan.edt(mask, return_indices=True)
            portolan.sdf(np.asfortranarray(mask))
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    first = call(300)
    assert call(3000) - first < 8 << 10  # kB


def test_the_import_takes_no_numpy():
    code = "import sys, portolan; assert 'numpy' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
