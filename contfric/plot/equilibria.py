"""Branches of equilibria: one state along the parameter, stable solid, unstable dashed, events marked."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from contfric.plot.appearance.names import event_label, parameter_label
from contfric.plot.appearance.save import axes_or_new, name_axes
from contfric.plot.appearance.style import (
    BLACK,
    GREY,
    LINE_WIDTH,
    NEXT_TO,
    SMALL,
    STABLE,
    TEXT,
    UNSTABLE,
    YELLOW,
    Marker,
    lighter,
    sized,
)

if TYPE_CHECKING:
    from contfric.equilibria.branch import EquilibriumBranch
    from contfric.equilibria.explore import EquilibriumDiagram

#: Marks of the events; the kind of a boundary equilibrium is not one of smooth systems, and yellow as such.
_MARKERS = {
    "SN": Marker("o", size=5.5),
    "BP": Marker("D", size=5.5),
    "H": Marker("h", size=6.5),
    "BE": Marker("X", face=YELLOW, size=6.5),
}


def plot_equilibria(
    branch: EquilibriumBranch, ax: Axes | None = None, state: str | None = None
) -> Axes:
    """Draw a branch of equilibria.

    Parameters
    ----------
    branch : EquilibriumBranch
        What is virtual is drawn thin and grey.
    ax : Axes, optional
        Where to draw, such as a row of a diagram; new axes by default.
    state : str, optional
        Name of the state; the first of the model by default.

    Examples
    --------
    >>> import contfric as cf
    >>> branch = cf.continue_equilibrium(cf.find_equilibria("belt")[0], "vb", (0.1, 1.0))
    >>> plot_equilibria(branch).get_ylabel()
    '$x$'
    """
    ax = axes_or_new(ax)
    alone = not ax.has_data()
    name = branch.model.states[0] if state is None else state
    values = branch.state(name)
    looks = list(zip(branch.stable.tolist(), branch.admissible.tolist(), strict=True))
    first = 0
    for (stable, admissible), run in groupby(looks):
        last = first + len(list(run))
        part = slice(max(0, first - 1), last)  # lines of different looks meet
        ax.plot(
            branch.values[part],
            values[part],
            linestyle=STABLE if stable else UNSTABLE,
            color=BLACK if admissible else lighter(GREY),
            linewidth=LINE_WIDTH if admissible else 0.5 * LINE_WIDTH,
            zorder=2,
            label=("stable" if stable else "unstable")
            if admissible
            else "virtual: outside of its mode",
        )
        first = last
    _draw_events(ax, branch, branch.model.states.index(name))
    name_axes(ax, parameter_label(branch.parameter), ax.get_ylabel() or parameter_label(name))
    if alone:
        _explain(ax)
    return ax


def plot_equilibrium_diagram(
    found: EquilibriumDiagram, ax: Axes | None = None, state: str | None = None
) -> Axes:
    r"""Draw all branches of equilibria on the same axes; parameters as for :func:`plot_equilibria`.

    Examples
    --------
    >>> import contfric as cf
    >>> found = cf.explore_equilibria("belt", "vb", (0.1, 1.0), values=1)
    >>> plot_equilibrium_diagram(found).get_xlabel()
    '$\\mathrm{vb}$'
    """
    new = ax is None
    ax = axes_or_new(ax)
    alone = not ax.has_data()
    if new:
        ax.set_xlim(*found.bounds)
    for branch in found.branches:
        plot_equilibria(branch, ax=ax, state=state)
    ax.set_xlabel(parameter_label(found.parameter), fontsize=sized(TEXT + 1))
    if alone:
        _explain(ax)
    return ax


def _explain(ax: Axes) -> None:
    """Write a legend next to the axes: each kind of line, and each event, once."""
    once = {text: artist for artist, text in zip(*ax.get_legend_handles_labels(), strict=True)}
    ax.legend(once.values(), once.keys(), fontsize=sized(SMALL), frameon=False, **NEXT_TO)


def _draw_events(ax: Axes, branch: EquilibriumBranch, k: int) -> None:
    for event in branch.events:
        height = float(np.asarray(event.equilibrium.state)[k])
        look = _MARKERS[event.kind.value].look()
        text = f"{event_label(event.label)}: {event.meaning}"
        (mark,) = ax.plot([event.value], [height], zorder=5, label=text, **look)
        mark.set_gid(event.label)
        ax.annotate(
            event_label(event.label),
            (event.value, height),
            xytext=(0.0, 7.0),
            textcoords="offset points",
            ha="center",
            fontsize=sized(SMALL),
        )
