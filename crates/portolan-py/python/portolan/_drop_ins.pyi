from collections.abc import Sequence
from typing import Literal, Optional, Union, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

@overload
def edt(
    mask: ArrayLike,
    sampling: Optional[Union[float, Sequence[float], NDArray[np.floating]]] = None,
    black_border: bool = False,
    *,
    return_indices: Literal[False] = False,
    squared: bool = False,
    parallel: Optional[int] = None,
) -> NDArray[np.float32]:
    """Distances of all cells to the nearest cell of another label: the exact Euclidean distance transform.

    The results of ``edt.edt``, and for masks those of ``scipy.ndimage.distance_transform_edt`` rounded to float32: bit for
    bit where all axes have a spacing of 1, squared distances up to 2**24 exact; else within a few units in the last place.

    ``mask``: 1, 2 or 3 axes, booleans, whole numbers or real ones; used in place where it is contiguous in C or Fortran order
    (the result has the same order), else copied. 0 and False are background, of distance 0; cells of one value belong
    together. **Several values are labels, as in edt**: distances end where another label begins. SciPy takes all that is not
    0 as one: pass ``mask != 0``.

    ``sampling``: distances between neighboring cells, one number or one for each axis in the order of the axes, whatever the
    order of memory; results are in its unit. ``black_border``: the array is surrounded by cells of another label.
    ``squared``: squared distances (``edt.edtsq``).

    ``return_indices``: also the indices of the nearest background cell, int32 of shape ``(mask.ndim, *mask.shape)``; of
    several that are equally near, any. Not with several labels, ``black_border`` or ``squared``.

    ``parallel``: threads at most; ``None`` and 0: all. The result is the same bytes.

    Without a cell to measure to, distances are infinite as in edt (SciPy makes some up) and indices are -1. Arrays without
    cells give arrays without cells.

    Raises ``ValueError`` for NaN, masked values, other types, more than 3 axes, spacings that are not positive and finite,
    2**32 - 1 cells or more.

    O(cells) with things near, 10 ns a cell and thread or less; 4 bytes a cell for the result and 2 to 4 on the way, 12 more
    with indices.
    """

@overload
def edt(
    mask: ArrayLike,
    sampling: Optional[Union[float, Sequence[float], NDArray[np.floating]]] = None,
    black_border: bool = False,
    *,
    return_indices: Literal[True],
    squared: bool = False,
    parallel: Optional[int] = None,
) -> tuple[NDArray[np.float32], NDArray[np.int32]]: ...
def sdf(
    mask: ArrayLike,
    sampling: Optional[Union[float, Sequence[float], NDArray[np.floating]]] = None,
    black_border: bool = False,
    *,
    parallel: Optional[int] = None,
) -> NDArray[np.float32]:
    """Distances with a sign, the results of ``edt.sdf``: those of :func:`edt` in cells with a label; in the background less
    the distance to the nearest cell with one. Nowhere 0; infinite, with its sign, where there is nothing to measure to.

    Arguments and errors as of :func:`edt`; twice its time.
    """

def marching_cubes(
    volume: ArrayLike,
    level: Optional[float] = None,
    spacing: Optional[Sequence[float]] = None,
    gradient_direction: Literal["descent", "ascent"] = "descent",
    mask: Optional[NDArray[np.bool_]] = None,
) -> tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float32], NDArray[np.float32]]:
    """The surface at which a volume crosses a level, as triangles: ``(verts, faces, normals, values)``.

    The answer of ``skimage.measure.marching_cubes``: in cubes that are not ambiguous the same vertices, up to their order and
    rounding, and as many triangles, of which some have the other diagonal.

    ``volume``: 3 axes of at least 2 samples, any real type, as float32; in place where it is float32 and contiguous in C or
    Fortran order. A cube with a sample that is not finite (or is beyond float32) has no surface: a hole. ``level``: by default
    the mean of the least and the largest finite sample. ``spacing``: distances between samples along each axis.
    ``gradient_direction``: 'descent' where what is enclosed has the larger values. ``mask``: booleans of the volume's shape;
    only cubes whose last corner is True have surface.

    ``verts`` (V, 3) float32: axis by axis, times ``spacing``. ``faces`` (F, 3) int32. ``normals`` (V, 3) float32: of length 1,
    toward smaller values, by central differences, in the coordinates of ``verts`` (scikit-image does not heed the spacing
    here). ``values`` (V,) float32: the largest difference of two samples of one cube at the vertex.

    Samples of exactly the level make vertices in one place and triangles without area, as they do there. There is no
    ``step_size``, ``method`` or ``allow_degenerate``.

    Raises ``ValueError`` for what cannot be, and for a level beyond the values; ``RuntimeError`` where there is no surface.

    O(samples); on all cores (``RAYON_NUM_THREADS``).
    """
