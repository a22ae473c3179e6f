"""Pictures of 2-D maps with matplotlib."""

from typing import Any, Optional

import numpy as np

from . import Mapper


def show(mapper: Mapper, ax: Optional[Any] = None, *, distance: bool = False) -> Any:
    """Draws a 2-D map: occupancy (or Euclidean distances), contour, and the way of the sensor. Returns the axes.

    Needs matplotlib. Raises `ValueError` for a 3-D map, or one without scans.
    """
    import matplotlib.pyplot as plt  # type: ignore

    if mapper.dimension != 2:
        raise ValueError(f"mapper: a 2-D map is wanted, this one is {mapper.dimension or 'without scans'}")
    ax = ax if ax is not None else plt.gca()
    field = mapper.esdf().to_array()
    (rows, columns), (x, y), r = field["distance"].shape, field["origin"], field["resolution"]
    extent = (x, x + columns * r, y, y + rows * r)
    if distance:
        shown = ax.imshow(field["distance"], origin="lower", extent=extent, cmap="viridis")
        ax.figure.colorbar(shown, ax=ax, label="distance (m)")
    else:
        occupancy = mapper.occupancy
        centers = np.stack(
            np.meshgrid(x + (np.arange(columns) + 0.5) * r, y + (np.arange(rows) + 0.5) * r), axis=-1
        )
        values = occupancy.occupancy(centers)[0] if occupancy is not None else np.full((rows, columns), np.nan)
        ax.imshow(values, origin="lower", extent=extent, cmap="gray_r", vmin=0, vmax=1)
    for line in mapper.contour().polylines():
        ax.plot(line[:, 0], line[:, 1], color="#7b2d8b", linewidth=1)
    poses = mapper.poses
    if poses is not None and len(poses) > 1:
        ax.plot(poses[:, 0, 2], poses[:, 1, 2], color="#2c7fb8", linewidth=1)
    ax.set_aspect("equal")
    ax.set_xlabel("x (m)")
    ax.set_ylabel("y (m)")
    return ax
