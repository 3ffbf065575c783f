"""Lyapunov maps: where solutions are chaotic, and how much."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch

from contfric.plot.appearance.cells import draw_cells
from contfric.plot.appearance.names import parameter_label
from contfric.plot.appearance.save import axes_or_new, name_axes, title_axes
from contfric.plot.appearance.style import GREY, SMALL, TEXT, lighter, sized

if TYPE_CHECKING:
    from contfric.chaos.map import LyapunovMap

#: Colours of positive exponents: from light to dark, so that the map reads in grey as well.
_SHADES = "magma_r"
#: Where the solution grows without bound, and where nothing was computed.
_UNBOUNDED, _MISSING = lighter(GREY, 0.35), lighter(GREY, 0.75)


def plot_lyapunov_map(lmap: LyapunovMap, ax: Axes | None = None) -> Axes:
    r"""Draw a Lyapunov map: where the largest exponent is positive beyond its error it is shaded.

    White is where no exponent is positive beyond its error (periodic, quasi-periodic, or undecided); grey is
    where there is no exponent. The legend, below the axes, says so.

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
    _draw_ground(ax, lmap)
    shown = np.ma.masked_where(~(lmap.chaotic & (lmap.values > 0.0)), lmap.values)
    highest = float(shown.max()) if shown.count() else 1.0
    mesh = draw_cells(ax, lmap.axes, shown, cmap=_SHADES, vmin=0.0, vmax=highest, zorder=1.5)
    root = ax.figure
    if root is not None:
        bar = root.colorbar(mesh, ax=ax)
        bar.set_label(
            r"largest Lyapunov exponent $\lambda$ (per unit of time)", fontsize=sized(TEXT)
        )
        bar.ax.tick_params(labelsize=sized(SMALL + 1))
    name_axes(ax, *map(parameter_label, lmap.axes))
    title_axes(ax, lmap.model, lmap.params)
    return ax


def _draw_ground(ax: Axes, lmap: LyapunovMap) -> None:
    """Mark in grey where there are no exponents, and say why."""
    handles = [
        Patch(facecolor="white", edgecolor=GREY, linewidth=0.5, label="no positive exponent")
    ]
    for missing, colour in ((False, _UNBOUNDED), (True, _MISSING)):
        cells = lmap.absent(missing)
        if not cells.any():
            continue
        ground = np.ma.masked_where(~cells, np.ones(cells.shape))
        draw_cells(ax, lmap.axes, ground, cmap=ListedColormap([colour]), zorder=1.0)
        handles.append(Patch(color=colour, label="not computed" if missing else "no exponent"))
    ax.legend(
        handles=handles,
        fontsize=sized(SMALL),
        loc="upper center",
        bbox_to_anchor=(0.5, -0.12),
        ncol=len(handles),
        frameon=False,
    )
