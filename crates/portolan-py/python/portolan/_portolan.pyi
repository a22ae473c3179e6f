"""The compiled part of the package; import from `portolan`."""

from collections.abc import Callable, Sequence
from os import PathLike
from typing import Any, Literal, Optional, Union, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str

_Floats = NDArray[np.float64]
_Bytes = NDArray[np.uint8]
_Path = Union[str, PathLike[str]]
_Unknown = Literal["pessimistic", "optimistic"]

class MapFull(MemoryError):
    """A map would need more memory than it may have. What was fused before stays."""

@final
class Mapper:
    """Fuses scans into an occupancy map, signed distances and hits per meter of one lattice.

    Its dimension is that of the first scan. Its maps are taken as snapshots (`occupancy`, `tsdf`, `attenuation`, `esdf()`):
    cheap copies that share cells until they change, and that other threads may read while scans are fused.

    resolution: edge of a cell (meters).
    truncation: signed distances are kept up to here (meters); three cells where it is not given.
    w_max: clamp of a cell's weight, in observations; `inf` never forgets. 128 where it is not given.
    carve: whether free space goes into the signed distances. carve_weight: its weight against a surface's 1 (0.2).
    weights: trust in a beam: "constant", "range" (1 / range^2), "incidence" (cosine), "range-incidence".
    sweep: "cell-centre" (2-D), "march" (2-D, the textbook's), "auto" (3-D), "exact" (3-D, every ray is followed).
    occupancy, attenuation, distances: which maps are made. color: whether colors are fused where scans have them.
    max_distance: Euclidean distances are kept up to here (meters).
    thin: share of the beams through a cell that must end there to make it an obstacle where no surface is (0.145; 0: none).
    bounds: only this box is mapped, (x0, y0, x1, y1) or (x0, y0, z0, x1, y1, z1).
    origin: lower corner of cell 0; 0, or near the first scan where that is a million cells away.
    memory: bytes that the maps may take together; `MapFull` is raised beyond.
    """

    def __new__(
        cls,
        resolution: float,
        *,
        truncation: Optional[float] = None,
        w_max: Optional[float] = None,
        carve: bool = True,
        carve_weight: Optional[float] = None,
        weights: str = "constant",
        sweep: Optional[str] = None,
        occupancy: bool = True,
        attenuation: bool = True,
        distances: bool = True,
        color: bool = True,
        max_distance: float = 1.0,
        thin: Optional[float] = None,
        bounds: Optional[Sequence[float]] = None,
        origin: Optional[Sequence[float]] = None,
        memory: Optional[int] = None,
    ) -> Mapper: ...
    def integrate(
        self,
        points: Union[ArrayLike, Scan, None] = None,
        pose: Optional[ArrayLike] = None,
        *,
        ranges: Optional[ArrayLike] = None,
        bearings: Optional[ArrayLike] = None,
        elevations: Optional[ArrayLike] = None,
        depth: Optional[ArrayLike] = None,
        intrinsics: Optional[ArrayLike] = None,
        depth_scale: Optional[float] = None,
        colors: Optional[ArrayLike] = None,
        origin: Optional[ArrayLike] = None,
        min_range: Optional[float] = None,
        max_range: Optional[float] = None,
        no_return: Optional[float] = None,
        no_return_free: Optional[float] = None,
    ) -> dict[str, int]:
        """Fuses one scan, taken at `pose` (world from sensor): 4 x 4 or (x, y, z, qx, qy, qz, qw) in 3-D, 3 x 3 or (x, y, theta)
        in 2-D. Returns counts.

        The readings are one of

        points: (N, 2) or (N, 3), in the sensor's frame (meters), rays from `origin` (0 where it is not given); `colors` (N, 3)
            bytes; or a `Scan` of a log, which has its pose.
        ranges: (N,) with `bearings` (N,), a planar laser; or (rows, columns) with `bearings` (columns,) at even steps and
            `elevations` (rows,), a turning lidar. Readings of `no_return` or more are no echo, free up to `no_return_free`.
        depth: (rows, columns) along the camera's axis, with `intrinsics` (fx, fy, cx, cy) or a 3 x 3 matrix (pixels); whole
            numbers need `depth_scale` (units per meter); `colors` (rows, columns, 3) bytes. 0: no reading.

        Readings up to `min_range` are refused, those beyond `max_range` free the space up to it (meters). Values that are not
        finite are refused and counted.

        Raises `ValueError` that names the argument; `MapFull`.
        """

    def map(
        self, log: Log, *, every: int = 1, progress: Optional[Callable[[int, int], Any]] = None
    ) -> dict[str, Any]:
        """Fuses the scans of a log, in order. `progress(done, all)` is called after each. A scan that cannot be read is left out
        and counted (`unreadable`, `first_unreadable`). Ctrl-C ends it between scans; what was fused stays.
        """

    @property
    def occupancy(self) -> Optional[Occupancy]:
        """The log odds, as they are now; `None` before the first scan, or where there are none."""

    @property
    def tsdf(self) -> Optional[Tsdf]:
        """The signed distances, as they are now; `None` before the first scan, or where there are none."""

    @property
    def attenuation(self) -> Optional[Attenuation]:
        """Hits per meter, as they are now; `None` before the first scan, or where there are none."""

    def esdf(self) -> Esdf:
        """Euclidean distances to the nearest obstacle: the first call computes them, later ones what changed. Obstacles are the
        surface, and cells where something stops beams. Raises `ValueError` where there are no signed distances.
        """

    def mesh(self) -> Mesh:
        """The surface of a 3-D map, computed where it changed. Raises `ValueError` in 2-D."""

    def contour(self) -> Contour:
        """The surface of a 2-D map. Raises `ValueError` in 3-D."""

    def watch(self, cells: ArrayLike) -> None:
        """Watches these cells, (N, D) indices, and no others: each scan leaves what it did to them in `fuse_events`."""

    def fuse_events(self, cell: Optional[ArrayLike] = None) -> list[dict[str, Any]]:
        """What the last scan did to the watched cells that it observed, or to one of them: `before`, `weight_before`,
        `observation`, `weight`, `after`, `weight_after`, `gain` (meters, observations).
        """

    def copy(self) -> Mapper:
        """A copy that goes its own way; cells are shared until one of the two changes them."""

    def save(self, path: _Path) -> None:
        """Writes a `map.portolan`, as `portolan map` does. Raises `OSError`, `ValueError`."""

    def export(self, path: str, **options: Any) -> None:
        """Writes the map in any format of `portolan.convert`, by the ending of `path`."""

    @property
    def dimension(self) -> Optional[int]:
        """2 or 3; `None` until the first scan."""

    @property
    def resolution(self) -> float:
        """Edge of a cell (meters)."""

    @property
    def poses(self) -> Optional[_Floats]:
        """Poses of the fused scans, (N, 3, 3) or (N, 4, 4); `None` until the first scan."""

    @property
    def stats(self) -> dict[str, int]:
        """What all scans did so far."""

    @property
    def memory_bytes(self) -> int:
        """_Bytes that the maps hold and what is derived from them: measured."""

    def __copy__(self) -> Mapper: ...
    def __deepcopy__(self, _memo: Any, /) -> Mapper: ...
    def _repr_png_(self) -> Optional[bytes]: ...

@final
class Movers:
    """What moved, told from what stands still: space that half of the looks found open, with all its neighbors, is no wall.

    Look at all scans first, then split each: `split` gives the scan without the returns of people, doors and chairs, which frees
    the space up to them, and these returns. Cells have an edge of five times `pose_sigma`, the standard deviation of the error of
    a pose along a line (meters). `memory`: bytes that the counts may take.
    """

    def __new__(cls, pose_sigma: float = 0.03, *, memory: Optional[int] = None) -> Movers: ...
    def look(
        self,
        scan: Union[ArrayLike, Scan, None] = None,
        pose: Optional[ArrayLike] = None,
        **readings: Any,
    ) -> None:
        """Looks at a scan: a `Scan` of a log, points, or `ranges`, `depth` and so on as in `Mapper.integrate`. Raises `ValueError`,
        `MapFull`.
        """

    def split(
        self,
        scan: Union[ArrayLike, Scan, None] = None,
        pose: Optional[ArrayLike] = None,
        **readings: Any,
    ) -> tuple[Scan, _Floats]:
        """The scan without what moved, for `Mapper.integrate` and `Ledger.add`, and the points that moved, (N, D) in the world
        (meters). Nothing moved before a scan was looked at. Raises `ValueError`.
        """

@final
class Ledger:
    """Evidence that adds up: sums of whole numbers, and the list of the scans in them.

    Any split of scans, any order, any number of processes: equal ledgers, and equal bytes. Scans are taken out again, or
    moved to other poses, exactly. Nothing is forgotten by itself. Scans are known by the name of their
    log and their number in it. Arguments are those of `Mapper`.
    """

    def __new__(
        cls,
        resolution: float,
        *,
        truncation: Optional[float] = None,
        carve: bool = True,
        carve_weight: Optional[float] = None,
        weights: str = "constant",
        sweep: Optional[str] = None,
        occupancy: bool = True,
        attenuation: bool = True,
        distances: bool = True,
        color: bool = True,
        max_distance: float = 1.0,
        thin: Optional[float] = None,
        bounds: Optional[Sequence[float]] = None,
        origin: Optional[Sequence[float]] = None,
        memory: Optional[int] = None,
    ) -> Ledger: ...
    def add(
        self,
        log: str,
        index: int,
        scan: Union[ArrayLike, Scan, None] = None,
        pose: Optional[ArrayLike] = None,
        **readings: Any,
    ) -> dict[str, int]:
        """Adds a scan: a `Scan` of a log, which has its pose, points, or `ranges`, `depth` and so on as in `Mapper.integrate`. Wholly
        or not at all. Raises `ValueError` where the scan is there already; `MapFull`.
        """

    def subtract(
        self, log: str, index: int, scan: Union[ArrayLike, Scan, None] = None, **readings: Any
    ) -> dict[str, int]:
        """Takes a scan away, as if it had never been added. Raises `ValueError` where it is not there, or was another one."""

    def repose(
        self,
        log: str,
        index: int,
        scan: Union[ArrayLike, Scan, None] = None,
        pose: Optional[ArrayLike] = None,
        **readings: Any,
    ) -> dict[str, int]:
        """Moves a scan to another pose, as if it had been added there. Raises as `subtract` and `add`."""

    def map(
        self,
        log: Log,
        indices: Optional[Sequence[int]] = None,
        *,
        progress: Optional[Callable[[int, int], Any]] = None,
    ) -> dict[str, Any]:
        """Adds the scans of a log with these indices, or all. As `Mapper.map`."""

    def merge(self, other: Ledger) -> None:
        """Adds another ledger. Raises `ValueError` where settings or lattices differ, or a scan is in both."""

    def take_out(self, other: Ledger) -> None:
        """Takes another ledger out, as if its scans had never been added. Raises `ValueError` where one is not there."""

    def mapper(self) -> Mapper:
        """The maps that follow from the sums, which answer all questions. What is fused into them is not added here."""

    @property
    def scans(self) -> list[tuple[str, int]]:
        """Log and number of each scan, in order."""

    def save(self, path: _Path) -> None:
        """Writes a `map.portolan`, which `portolan merge` and all other commands read. Raises `OSError`, `ValueError`."""

    def to_bytes(self) -> bytes:
        """The content of its file. Equal ledgers have equal bytes. Pickling uses it."""

    @staticmethod
    def from_bytes(content: bytes, *, memory: Optional[int] = None) -> Ledger:
        """A ledger of the content of its file. Raises `ValueError`."""

    @staticmethod
    def load(path: _Path, *, memory: Optional[int] = None) -> Ledger:
        """Reads a `map.portolan` of sums, or the one in a folder. Raises `OSError`, `ValueError`."""

    def copy(self) -> Ledger:
        """A copy that goes its own way; cells are shared until one of the two changes them."""

    def __copy__(self) -> Ledger: ...
    def __deepcopy__(self, _memo: Any) -> Ledger: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __len__(self) -> int: ...
    @property
    def dimension(self) -> Optional[int]:
        """2 or 3; `None` until the first scan."""

    @property
    def resolution(self) -> float:
        """Edge of a cell (meters)."""

    @property
    def memory_bytes(self) -> int:
        """Bytes that the sums hold: measured."""

@final
class Occupancy:
    """Log odds of being occupied, a snapshot."""

    def occupancy(self, points: ArrayLike) -> tuple[_Floats, _Bytes]:
        """Probability of being occupied of the cells that hold the points (..., D), and statuses. One look-up each."""

    def cells(self, least: float = 0.5) -> tuple[_Floats, _Floats]:
        """Centers (N, D) of the cells that are occupied with at least this probability, and their probabilities (N,)."""

    @property
    def dimension(self) -> int: ...
    @property
    def resolution(self) -> float:
        """Edge of a cell (meters)."""

    @property
    def observed_cells(self) -> int: ...
    @property
    def memory_bytes(self) -> int: ...

@final
class Tsdf:
    """Signed distances along rays, up to the truncation, positive in free space; a snapshot."""

    def distance(self, points: ArrayLike) -> tuple[_Floats, _Bytes]:
        """Estimates of the cells that hold the points (..., D), in meters, and statuses: saturated at the truncation. Measured
        along rays, not Euclidean: for clearance see `Esdf`.
        """

    def raycast(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        max_range: float = 100.0,
        unknown_tolerance: float = 0.0,
        blind: float = 0.0,
    ) -> tuple[_Floats, _Bytes]:
        """Ranges at which rays (world, directions of any length) meet the surface, and statuses: known, a hit; saturated, free
        up to `max_range`; unknown, it entered unknown space; outside, it left the map. One origin, or one each. O(length).

        Unknown space of up to `unknown_tolerance` meters is crossed, and ignored up to `blind` meters from the origin.
        """

    def color(self, points: ArrayLike) -> tuple[_Bytes, _Bytes]:
        """Colors (..., 3) of the cells that hold the points, and statuses: unknown where no color was seen."""

    def frontiers(self, min_cells: int = 10) -> list[Frontier]:
        """The borders of the unknown of at least so many cells, largest first (Yamauchi 1997)."""

    @property
    def dimension(self) -> int: ...
    @property
    def resolution(self) -> float:
        """Edge of a cell (meters)."""

    @property
    def truncation(self) -> float:
        """Distances are kept up to here (meters)."""

    @property
    def observed_cells(self) -> int: ...
    @property
    def memory_bytes(self) -> int: ...

@final
class Frontier:
    """Connected free cells that border on unknown space."""

    @property
    def cells(self) -> NDArray[np.int32]:
        """Indices of the cells, (N, D)."""

    @property
    def middle(self) -> _Floats:
        """Center of the cell nearest to their mean (world): a goal for a robot."""

    @property
    def centroid(self) -> _Floats:
        """Mean of the cell centers (world). Of a curved frontier it may lie in a wall."""

    @property
    def normal(self) -> Optional[_Floats]:
        """Unit direction from free to unknown space; `None` where its faces cancel out."""

    def __len__(self) -> int: ...

@final
class Esdf:
    """Euclidean distances to the nearest obstacle, negative behind surfaces; a snapshot."""

    def distance(self, points: ArrayLike) -> tuple[_Floats, _Bytes]:
        """Distances at the points (..., D), in meters, and statuses: saturated at `max_distance`. One interpolation each."""

    def distance_and_gradient(self, points: ArrayLike) -> tuple[_Floats, _Floats, _Bytes]:
        """Distances, gradients (..., D) that point away from the nearest obstacle, and statuses."""

    def clearance(self, points: ArrayLike, *, unknown: _Unknown = "pessimistic") -> tuple[_Floats, _Floats, _Bytes]:
        """Certified bounds, lower and upper (meters), of the distance to the nearest obstacle, and statuses. Negative inside of
        obstacles. Space that was never observed is an obstacle, unless `unknown="optimistic"`. Saturated: only `lower` says
        something.
        """

    def check_path(
        self, waypoints: ArrayLike, clearance: float, *, unknown: _Unknown = "pessimistic", tolerance: float = 1e-3
    ) -> PathCheck:
        """Whether every point of the straight lines between the waypoints (N, D) has the clearance demanded (meters), by
        conservative advancement (Mirtich 1996).
        """

    def to_array(self, bounds: Optional[ArrayLike] = None) -> dict[str, Any]:
        """The field, or a box of it (x0, y0[, z0], x1, y1[, z1]): `distance` and `status` with x along the last axis, `origin`
        (lower corner of the first cell), `resolution`. At most 2^28 cells. NaN where nothing is known.
        """

    @property
    def dimension(self) -> int: ...
    @property
    def resolution(self) -> float:
        """Edge of a cell (meters)."""

    @property
    def max_distance(self) -> float:
        """Distances are kept up to here (meters)."""

    @property
    def memory_bytes(self) -> int: ...

@final
class PathCheck:
    """Whether a path is certified, and if not, where and why. True where it is."""

    @property
    def certified(self) -> bool: ...
    @property
    def clearance(self) -> Optional[tuple[float, float]]:
        """Bounds of the least clearance along a certified path (meters); else `None`."""

    @property
    def narrowest(self) -> Optional[float]:
        """Where a certified path is narrowest (meters along it); else `None`."""

    @property
    def violation_span(self) -> Optional[tuple[float, float]]:
        """The first part that is not certified, from and to (meters along the path); `None` where all is."""

    @property
    def cause(self) -> Optional[str]:
        """"too near", "unknown", "outside" or "undecided"; `None` where all is certified."""

    def __bool__(self) -> bool: ...

@final
class Attenuation:
    """Hits of beams over the length of all in a cell: what a renderer calls density (Schaefer, Luft, Burgard 2017)."""

    def attenuation(self, points: ArrayLike) -> tuple[_Floats, _Bytes]:
        """Hits per meter (1/m) of the cells that hold the points (..., D), and statuses."""

    def predict_ranges(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        max_range: float = 100.0,
        quantiles: Sequence[float] = ...,
    ) -> tuple[_Floats, _Floats]:
        """Quantiles (..., Q) of the range that a sensor would read along rays (meters; NaN where fewer beams end; the median
        where none are asked for), and the share of beams that pass all up to `max_range`. One origin, or one each. O(length).
        """

    @property
    def dimension(self) -> int: ...
    @property
    def resolution(self) -> float:
        """Edge of a cell (meters)."""

    @property
    def memory_bytes(self) -> int: ...

@final
class Cloud:
    """Points (..., D) under a k-d tree. Raises `ValueError` where one is not finite."""

    def __new__(cls, points: ArrayLike) -> Cloud: ...
    def nearest_distance(self, points: ArrayLike) -> _Floats:
        """Distances from the points (..., D) to the nearest of the cloud (meters); NaN where the cloud is empty."""

    @property
    def points(self) -> _Floats: ...
    @property
    def dimension(self) -> int: ...
    @property
    def memory_bytes(self) -> int: ...
    def __len__(self) -> int: ...

@final
class Mesh:
    """Triangles with shared vertices; normals point to free space."""

    @property
    def vertices(self) -> _Floats:
        """Positions (N, 3) (world, meters)."""

    @property
    def triangles(self) -> NDArray[np.uint32]:
        """Triples of vertex indices, counter-clockwise seen from free space."""

    @property
    def normals(self) -> Optional[NDArray[np.float32]]:
        """Unit normals of the vertices; zero where undefined."""

    @property
    def colors(self) -> Optional[_Bytes]:
        """Red, green and blue of the vertices; `None` where there are none."""

    @property
    def area(self) -> float:
        """Area of all triangles (square meters)."""

    def to_trimesh(self) -> Any:
        """A `trimesh.Trimesh`; needs trimesh."""

    def to_open3d(self) -> Any:
        """An `open3d.geometry.TriangleMesh`; needs open3d."""

    def to_pyvista(self) -> Any:
        """A `pyvista.PolyData`; needs pyvista."""

    def __len__(self) -> int: ...
    def _repr_png_(self) -> Optional[bytes]: ...

@final
class Contour:
    """Segments with shared vertices; free space lies on the left of every segment."""

    @property
    def vertices(self) -> _Floats:
        """Positions (N, 2) (world, meters)."""

    @property
    def segments(self) -> NDArray[np.uint32]:
        """Pairs of vertex indices."""

    def polylines(self) -> list[_Floats]:
        """The lines that the segments make, (N, 2) each; closed ones repeat their first point."""

    @property
    def length(self) -> float:
        """Length of all segments (meters)."""

    def __len__(self) -> int: ...
    def _repr_svg_(self) -> str: ...

@final
class Log:
    """A log of range scans with poses: `len(log)`, `log[i]`, `for scan in log`. Scans are read when they are asked for."""

    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> Scan: ...
    @property
    def dimension(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def format(self) -> str: ...
    @property
    def points_only(self) -> bool:
        """Whether its points are used without rays: they do not say where they were seen from, or it was asked for."""

    @property
    def remarks(self) -> list[str]:
        """What was chosen, taken for granted and noticed in reading it, a sentence each."""

@final
class Scan:
    """A scan of a log: readings in the sensor's frame, with the limits of range applied."""

    @property
    def time(self) -> Optional[float]:
        """Seconds of the log's clock; `None` where it has none."""

    @property
    def pose(self) -> _Floats:
        """World from sensor, (3, 3) or (4, 4)."""

    @property
    def points(self) -> _Floats:
        """The surfaces that were hit, (N, D) in the sensor's frame (meters)."""

    @property
    def ranges(self) -> Optional[_Floats]:
        """Range of each beam of a planar laser (N,), or of a lidar's rings (rows, columns); else `None`."""

    @property
    def bearings(self) -> Optional[_Floats]:
        """Bearing of each beam of a planar laser (radians); else `None`."""

    @property
    def kinds(self) -> Optional[_Bytes]:
        """`BeamKind` of each beam of a planar laser; else `None`."""

    @property
    def depth(self) -> Optional[NDArray[np.float32]]:
        """Depth of each pixel of a camera (meters), 0 where nothing is known; else `None`."""

    @property
    def intrinsics(self) -> Optional[tuple[float, float, float, float]]:
        """(fx, fy, cx, cy) of a camera (pixels); else `None`."""

    @property
    def colors(self) -> Optional[_Bytes]:
        """Red, green and blue of each pixel or point; `None` where there are none."""

    @property
    def dimension(self) -> int: ...

def load(path: _Path, *, memory: Optional[int] = None) -> Mapper:
    """Reads a `map.portolan`, or the one in a folder, as a mapper that goes on with it. `memory`: bytes that its maps may take.
    Of a map of sums, the maps that follow from them: what is fused then forgets nothing, and is saved as clamped cells, without the
    list of scans; `Ledger.load` goes on with the sums.

    Raises `OSError`, `ValueError`.
    """

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

@overload
def marching_cubes(
    volume: ArrayLike,
    level: Optional[float] = None,
    spacing: Optional[Sequence[float]] = None,
    gradient_direction: Literal["descent", "ascent"] = "descent",
    mask: Optional[NDArray[np.bool_]] = None,
    *,
    normals: Literal[True] = True,
    values: Literal[True] = True,
    parallel: Optional[int] = None,
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
    here). ``values`` (V,) float32: the largest difference of two samples of one cube at the vertex. ``normals=False`` and
    ``values=False``: ``None`` in their place, half the time without both.

    Samples of exactly the level make vertices in one place and triangles without area, as they do there. There is no
    ``step_size``, ``method`` or ``allow_degenerate``.

    Raises ``ValueError`` for what cannot be, and for a level beyond the values; ``RuntimeError`` where there is no surface.

    ``parallel``: threads at most; ``None`` and 0: all (``RAYON_NUM_THREADS``). The result is the same bytes.

    O(samples), and some 40 to 120 ns a vertex and thread. Some 10 bytes a vertex on the way
    beside the result; some 50 where a sample is not finite, or with ``mask``.
    """

@overload
def marching_cubes(
    volume: ArrayLike,
    level: Optional[float] = None,
    spacing: Optional[Sequence[float]] = None,
    gradient_direction: Literal["descent", "ascent"] = "descent",
    mask: Optional[NDArray[np.bool_]] = None,
    *,
    normals: bool = True,
    values: bool = True,
    parallel: Optional[int] = None,
) -> tuple[
    NDArray[np.float32], NDArray[np.int32], Optional[NDArray[np.float32]], Optional[NDArray[np.float32]]
]: ...
def open(path: _Path, options: Sequence[str]) -> Log: ...
def run(words: Sequence[str]) -> int: ...
def call(words: Sequence[str]) -> None: ...
