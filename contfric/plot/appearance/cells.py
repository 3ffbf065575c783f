"""Values on a grid of two parameters or states, a coloured cell each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh

from contfric.base.arrays import FloatArray


def draw_cells(ax: Axes, axes: Mapping[str, FloatArray], values: Any, **look: Any) -> QuadMesh:
    """Draw values of shape (across, up) around the points of a grid, and set the limits of the axes."""
    across, up = (edges_of(centres) for centres in axes.values())
    mesh = ax.pcolormesh(across, up, values.T, **look)
    mesh.set_rasterized(True)  # a vector file of a million rectangles opens nowhere
    ax.set_xlim(across[0], across[-1])
    ax.set_ylim(up[0], up[-1])
    return mesh


def edges_of(centres: FloatArray) -> FloatArray:
    """Return the edges of cells around their centres.

    Examples
    --------
    >>> edges_of(np.array([1.0, 2.0, 4.0])).tolist()
    [0.5, 1.5, 3.0, 5.0]
    """
    if len(centres) == 1:
        half = 0.5 * abs(float(centres[0])) or 0.5
        return np.array([centres[0] - half, centres[0] + half])
    between = 0.5 * (centres[1:] + centres[:-1])
    first, last = 2.0 * centres[0] - between[0], 2.0 * centres[-1] - between[-1]
    return np.concatenate([[first], between, [last]])
