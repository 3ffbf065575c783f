"""Return maps: points against the points that follow them, with a cobweb."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from contfric.base.arrays import FloatArray
from contfric.plot.appearance.names import parameter_label
from contfric.plot.appearance.save import axes_or_new, name_axes
from contfric.plot.appearance.style import GREY, LINE_WIDTH, branch_colours, lighter

if TYPE_CHECKING:
    from contfric.response.returns import ReleaseMap, Returns

#: Size of a point: a thousand of them are told apart; and of one of a few, which would be overlooked.
_POINT, _FEW_POINT = 2.0, 7.0
#: So many different points are few: those of a periodic solution.
_FEW = 64
#: Points that agree to so many digits lie on each other in any figure.
_DIGITS = 6


def plot_returns(
    found: Returns, ax: Axes | None = None, coordinate: str | None = None, step: int = 1
) -> Axes:
    """Draw one coordinate of the points of a section against that of the point some returns before.

    Parameters
    ----------
    found : Returns
    ax : Axes, optional
        Where to draw; new axes by default.
    coordinate : str, optional
        A state, or "t", the phase; the displacement by default.
    step : int
        Returns between the two.

    Examples
    --------
    >>> import contfric as cf
    >>> found = cf.poincare("coulomb", {"Omega": 0.35, "S": 0.05}, periods=50)
    >>> plot_returns(found).get_xlabel()
    '$x_{k}$'
    """
    x, y = found.pairs(coordinate, step)
    ax = axes_or_new(ax)
    name = coordinate or found.model.states[0]
    few = len(np.unique(np.column_stack([x, y]).round(_DIGITS), axis=0)) <= _FEW
    size = _FEW_POINT if few else _POINT
    ax.plot(x, y, linestyle="none", marker=".", markersize=size, color="#1F4E79")
    _draw_diagonal(ax, np.concatenate([x, y]))
    body = parameter_label(name).strip("$")
    body = f"{{{body}}}" if "_" in body else body
    name_axes(ax, f"${body}_{{k}}$", f"${body}_{{k+{step}}}$")
    return ax


def plot_release_map(
    found: ReleaseMap, ax: Axes | None = None, start: float | None = None, count: int = 50
) -> Axes:
    """Draw the branches of a release map, and the cobweb of a start.

    Parameters
    ----------
    found : ReleaseMap
    ax : Axes, optional
        Where to draw; new axes by default.
    start : float, optional
        Phase that a cobweb begins with; none by default.
    count : int
        Releases of the cobweb.

    Examples
    --------
    >>> import contfric as cf
    >>> found = cf.release_map("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4}, count=200)
    >>> ax = plot_release_map(found, start=float(found.phases[3]))
    """
    web = None if start is None else found.cobweb(start, count)
    ax = axes_or_new(ax)
    colours = branch_colours(str(k) for k in range(len(found.branches)))
    for (x, y), colour in zip(found.branches, colours.values(), strict=True):
        marker = "." if len(x) == 1 else ""
        ax.plot(x, y, color=colour, linewidth=LINE_WIDTH, marker=marker, markersize=_POINT)
    _draw_diagonal(ax, np.array([0.0, found.period]))
    if web is not None and len(web) > 1:
        ax.plot(np.repeat(web, 2)[:-1], np.repeat(web, 2)[1:], color=GREY, linewidth=0.6)
    ax.set_xlim(0.0, found.period)
    ax.set_ylim(0.0, found.period)
    name_axes(ax, r"phase of a release, $t_{k}$", r"phase of the next release, $t_{k+1}$")
    return ax


def _draw_diagonal(ax: Axes, values: FloatArray) -> None:
    if len(values):
        ends = [float(np.nanmin(values)), float(np.nanmax(values))]
        ax.plot(ends, ends, color=lighter(GREY), linewidth=0.8, zorder=0.5)
