"""Lyapunov maps: where motions are chaotic, and how much."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch

from contfric.models.definition import FloatArray
from contfric.plot.save import axes_or_new, name_axes
from contfric.plot.style import (
    GREY,
    SMALL,
    TEXT,
    fixed_text,
    lighter,
    parameter_label,
    sized,
)

if TYPE_CHECKING:
    from contfric.chaos.map import LyapunovMap

#: Colours of positive exponents: from light to dark, so that the map reads in grey as well.
_SHADES = "magma_r"
#: Where the motion grows without bound, and where nothing was computed.
_UNBOUNDED, _MISSING = lighter(GREY, 0.35), lighter(GREY, 0.75)


def plot_lyapunov_map(lmap: LyapunovMap, ax: Axes | None = None) -> Axes:
    r"""Draw a Lyapunov map: where the largest exponent is positive beyond its error it is shaded.

    White is regular (or not decided); grey is where there is no exponent.

    Parameters
    ----------
    lmap : LyapunovMap
        Its first parameter is the horizontal axis.
    ax : Axes, optional
        Where to draw; new axes by default.

    Examples
    --------
    >>> import contfric as cf
    >>> grid = {"Omega": [0.3, 0.35, 0.4], "S": [0.05, 0.1, 0.2]}
    >>> lmap = cf.lyapunov_map("coulomb", grid, {"S0": 0.4}, periods=100)
    >>> plot_lyapunov_map(lmap).get_xlabel()
    '$\\Omega$'
    """
    ax = axes_or_new(ax)
    (first, across), (second, up) = lmap.axes.items()
    edges = edges_of(across), edges_of(up)
    _draw_ground(ax, lmap, edges)
    shown = np.ma.masked_where(~(lmap.chaotic & (lmap.values > 0.0)), lmap.values).T
    highest = float(shown.max()) if shown.count() else 1.0
    mesh = ax.pcolormesh(*edges, shown, cmap=_SHADES, vmin=0.0, vmax=highest, zorder=1.5)
    mesh.set_rasterized(True)  # a vector file of a million rectangles opens nowhere
    root = ax.figure
    if root is not None:
        bar = root.colorbar(mesh, ax=ax)
        bar.set_label(r"largest Lyapunov exponent $\lambda$", fontsize=sized(TEXT))
        bar.ax.tick_params(labelsize=sized(SMALL + 1))
    ax.set_xlim(edges[0][0], edges[0][-1])
    ax.set_ylim(edges[1][0], edges[1][-1])
    name_axes(ax, parameter_label(first), parameter_label(second))
    ax.set_title(fixed_text(lmap.params), fontsize=sized(TEXT))
    return ax


def _draw_ground(ax: Axes, lmap: LyapunovMap, edges: tuple[FloatArray, FloatArray]) -> None:
    """Mark in grey where there are no exponents, and say why."""
    handles = []
    for missing, colour in ((False, _UNBOUNDED), (True, _MISSING)):
        cells = lmap.absent(missing)
        if not cells.any():
            continue
        ground = np.ma.masked_where(~cells, np.ones(cells.shape)).T
        ax.pcolormesh(*edges, ground, cmap=ListedColormap([colour]), zorder=1.0).set_rasterized(
            True
        )
        handles.append(Patch(color=colour, label="not computed" if missing else "no exponent"))
    if handles:
        ax.legend(handles=handles, fontsize=sized(SMALL), loc="best")


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
