"""Volumetric mapping in 2-D and 3-D.

Range scans with known poses, fused once, into the maps that robots, renderers and people ask different questions of.

>>> import numpy as np, portolan
>>> bearings = np.radians(np.arange(-180, 180))
>>> ranges = 2 / np.maximum(abs(np.cos(bearings)), abs(np.sin(bearings)))   # a room of 4 m x 4 m
>>> mapper = portolan.Mapper(0.05)
>>> stats = mapper.integrate(ranges=ranges, bearings=bearings, pose=(0, 0, 0))
>>> distance, away, status = mapper.esdf().distance_and_gradient([[1.5, 0.02]])
>>> bool(abs(distance[0] - 0.5) < 0.01 and status[0] == portolan.Status.KNOWN)
True

Arrays of points have the shape ``(..., D)`` with D = 2 or 3, lengths are meters, angles radians, times seconds. Answers come
with an array of statuses (:class:`Status`): a value is NaN where there is none.
"""

from enum import IntEnum as _IntEnum
from os import PathLike as _PathLike
from typing import Any as _Any, Union as _Union

from ._portolan import (
    Attenuation,
    Cloud,
    Contour,
    Esdf,
    Frontier,
    Ledger,
    Log,
    MapFull,
    Mapper,
    Mesh,
    Movers,
    Occupancy,
    PathCheck,
    Scan,
    Tsdf,
    __version__,
    edt,
    load,
    marching_cubes,
    sdf,
)
from . import _portolan
from . import _show

__all__ = [
    "Attenuation",
    "BeamKind",
    "Cloud",
    "Contour",
    "Esdf",
    "Frontier",
    "Ledger",
    "Log",
    "MapFull",
    "Mapper",
    "Mesh",
    "Movers",
    "Occupancy",
    "PathCheck",
    "Scan",
    "Status",
    "Tsdf",
    "convert",
    "edt",
    "load",
    "marching_cubes",
    "open",
    "sdf",
    "__version__",
]


class Status(_IntEnum):
    """What an answer is."""

    #: Inside the map, where nothing was observed.
    UNKNOWN = 0
    #: The map knows.
    KNOWN = 1
    #: Beyond what the map maintains: at least so far.
    SATURATED = 2
    #: Outside of the map.
    OUTSIDE = 3


class BeamKind(_IntEnum):
    """What a beam measured."""

    #: A surface at its range.
    HIT = 0
    #: Nothing up to its range, where it was cut.
    MAX_RANGE = 1
    #: No echo.
    NO_RETURN = 2
    #: No information.
    DROPPED = 3
    #: The robot that carries the sensor.
    SELF_HIT = 4
    #: Something that was not there at other times.
    MOVER = 5


def _words(options: "dict[str, _Any]") -> "list[str]":
    """Options of the command line: ``max_range=20`` becomes ``--max-range=20``, ``no_deskew=True`` ``--no-deskew``."""
    words = []
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        for one in value if isinstance(value, list) else [value]:
            if one is True:
                words.append(option)
            elif isinstance(one, (tuple,)):
                words.append(f"{option}={','.join(str(v) for v in one)}")
            elif one is not None and one is not False:
                words.append(f"{option}={one}")
    return words


def open(path: "_Union[str, _PathLike[str]]", **options: _Any) -> Log:
    """Opens a log of range scans with poses: everything that ``portolan map`` reads, bags of ROS too.

    Options are those of ``portolan map`` that are about the log: ``max_range=20``, ``topic=["/scan"]``, ``poses="poses.txt"``,
    ``no_deskew=True``, ``origin=(0, 0, 1.5)``. What was guessed is in :attr:`Log.remarks`.

    Raises ``ValueError`` or ``OSError`` with file, place and value.
    """
    return _portolan.open(path, _words(options))


def convert(source: "_Union[str, _PathLike[str]]", target: "_Union[str, _PathLike[str]]", **options: _Any) -> None:
    """Converts a map, field or contour to another format, by the ending of ``target``: everything that ``portolan convert`` does.

    Options are those of the command: ``convert("kitchen", "floor.yaml", z="0.1:1.2")``.
    """
    _portolan.call(["portolan", "convert", "--quiet", str(source), str(target), *_words(options)])


_show.attach()
