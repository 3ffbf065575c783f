"""Basins of attraction: each in a colour, and the orbits at the phase of the starts."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain, repeat
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import Normal, Stroke

from contfric.plot.appearance.cells import draw_cells
from contfric.plot.appearance.names import parameter_label
from contfric.plot.appearance.save import axes_or_new, name_axes
from contfric.plot.appearance.style import GREY, NEXT_TO, SMALL, branch_colours, lighter, sized

if TYPE_CHECKING:
    from contfric.response.basins import Basins
    from contfric.response.stable_set import StableSet

#: What converges to no orbit: from black (chaos) to white.
_OTHERS = ("#222222", "#8A8A8A", "#C8C8C8", "#E6E6E6")
#: How an orbit is marked.
_ORBIT: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "color": "white",
    "markeredgecolor": "black",
    "markersize": 5,
}
#: How an orbit without excitation is drawn, and at how many times.
_CYCLE: dict[str, Any] = {
    "color": "white",
    "lw": 1.2,
    "path_effects": [Stroke(linewidth=2.4, foreground="black"), Normal()],
}
_ALONG = 400
#: Id of the legend of basins, which a stable set over them adds its lines to.
_LEGEND = "basins"
#: What a legend says of starts without a solution.
_NONE = {"no_solution": "no solution starts there"}


def plot_basins(found: Basins, ax: Axes | None = None) -> Axes:
    """Draw basins of attraction.

    Parameters
    ----------
    found : Basins
        Its first state is the horizontal axis.
    ax : Axes, optional
        Where to draw; new axes by default.

    Examples
    --------
    >>> import contfric as cf
    >>> grid = {"x": np.linspace(-2, 2, 8), "v": np.linspace(-1, 1, 8)}
    >>> found = cf.basins("coulomb", grid, {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> plot_basins(found).get_xlabel()
    '$x$'
    """
    ax = axes_or_new(ax)
    first, second = found.axes
    colours = _shown(found)
    shades, most = ListedColormap(colours or [GREY]), max(1, len(colours)) - 0.5
    number = np.ma.masked_less(found.of_share, 0)
    draw_cells(ax, found.axes, number, cmap=shades, vmin=-0.5, vmax=most)
    _draw_orbits(ax, found, first, second)
    names = [f"{_NONE.get(s.name, s.name)}: {s.share:.1%}" for s in found.shares]
    shown = zip(colours, names, strict=True)
    handles: list[Artist] = [Patch(color=colour, label=name) for colour, name in shown]
    if found.orbits:
        autonomous = found.model.autonomous
        label = "the orbits" if autonomous else "the orbits, once a period"
        handles.append(Line2D([], [], **(_CYCLE if autonomous else _ORBIT), label=label))
    if found.missing:
        handles.append(Line2D([], [], ls="", label=f"{found.missing} starts not computed"))
    _explain(ax, handles)
    name_axes(ax, parameter_label(first), parameter_label(second))
    return ax


def _explain(ax: Axes, handles: Sequence[Artist]) -> None:
    """Write the legend next to the axes; basins and stable sets over each other have one."""
    legend = ax.legend(handles=handles, fontsize=sized(SMALL), frameon=False, **NEXT_TO)
    legend.set_gid(_LEGEND)


def _shown(found: Basins) -> list[str]:
    """Return the colours of the shares, in their order."""
    orbits = [lighter(colour, 0.35) for colour in branch_colours(found.names).values()]
    others = chain(_OTHERS, repeat(_OTHERS[-1]))
    return [orbits[s.orbit] if s.orbit >= 0 else next(others) for s in found.shares]


def _draw_orbits(ax: Axes, found: Basins, first: str, second: str) -> None:
    """Mark where the orbits are at the phase of the starts, once a period; without excitation draw them."""
    names = found.model.states
    i, j = names.index(first), names.index(second)
    for orbit in found.orbits:
        if found.model.autonomous:
            shares, look = np.arange(_ALONG + 1) / _ALONG, _CYCLE
        else:
            shares, look = (found.at["phase"] + np.arange(orbit.periods)) / orbit.periods, _ORBIT
        times = np.asarray(shares * orbit.period)
        states = np.array([orbit.state(float(t)) for t in times])
        ax.plot(states[:, i], states[:, j], **look)


def plot_stable_set(found: StableSet, ax: Axes | None = None) -> Axes:
    """Draw a stable set and its orbit in the plane of the two states.

    Parameters
    ----------
    found : StableSet
    ax : Axes, optional
        Where to draw, such as the axes of basins; new axes by default.
    """
    ax = axes_or_new(ax)
    before, alone = ax.get_legend(), not ax.has_data()
    first, second = found.orbit.model.states
    name = f"stable set of {found.orbit.name}"
    for half, breaks in zip(found.states, found.breaks, strict=True):
        for part in np.split(half, breaks):
            (line,) = ax.plot(*part.T, color="black", lw=1.0, gid=name)
    (mark,) = ax.plot(*found.states[0][0], "s", color="white", mec="black", ms=5)
    line.set_label("stable set")
    mark.set_label(f"{found.orbit.name}, unstable")
    if alone:
        _explain(ax, [line, mark])
    elif before is not None and before.get_gid() == _LEGEND:
        others = [h for h in before.legend_handles if h is not None]
        known = {h.get_label() for h in others}
        _explain(ax, [*others, *(h for h in (line, mark) if h.get_label() not in known)])
    if not ax.get_xlabel():
        name_axes(ax, parameter_label(first), parameter_label(second))
    return ax
