"""What the tests have in common."""

import os
from pathlib import Path

import numpy as np
import pytest

import portolan

DATA = Path(os.environ.get("PORTOLAN_DATA", Path(__file__).resolve().parents[4] / "shared" / "data"))


def data(name: str) -> Path:
    """A real log; without it the test says so and skips."""
    path = DATA / name
    if not path.exists():
        message = f"SKIPPED: {name} is not in PORTOLAN_DATA ({DATA})"
        print(message)
        pytest.skip(message)
    return path


def room_scan(beams: int = 720, at: "tuple[float, float]" = (0.0, 0.0)) -> "tuple[np.ndarray, np.ndarray]":
    """Ranges and bearings of a laser in a room of 4 m x 4 m around zero."""
    bearings = -np.pi + 2 * np.pi * np.arange(beams) / beams
    c, s = np.cos(bearings), np.sin(bearings)
    with np.errstate(divide="ignore"):
        x = np.where(c > 0, (2 - at[0]) / c, np.where(c < 0, (-2 - at[0]) / c, np.inf))
        y = np.where(s > 0, (2 - at[1]) / s, np.where(s < 0, (-2 - at[1]) / s, np.inf))
    return np.minimum(x, y), bearings


def sphere_points(n: int = 20000, radius: float = 2.0) -> np.ndarray:
    """Points evenly on a sphere around zero."""
    i = np.arange(n) + 0.5
    polar, turn = np.arccos(1 - 2 * i / n), np.pi * (1 + 5**0.5) * i
    return radius * np.stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)], axis=-1)


@pytest.fixture(scope="session")
def room() -> portolan.Mapper:
    """A room of 4 m x 4 m, cells of 5 cm, seen from its middle."""
    ranges, bearings = room_scan()
    mapper = portolan.Mapper(0.05)
    stats = mapper.integrate(ranges=ranges, bearings=bearings, pose=(0, 0, 0))
    assert stats["scans"] == 1 and stats["hits"] == 720
    return mapper


@pytest.fixture(scope="session")
def ball() -> portolan.Mapper:
    """The inside of a ball of 2 m, cells of 10 cm, seen from its middle."""
    mapper = portolan.Mapper(0.1)
    mapper.integrate(sphere_points(), np.eye(4))
    return mapper
