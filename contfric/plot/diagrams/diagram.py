"""Bifurcation diagrams: branches against their parameter, with their stability and the events on them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from contfric.plot.appearance.labels import lay_out
from contfric.plot.appearance.names import full_title, parameter_label, parameters_to_show
from contfric.plot.appearance.save import (
    axes_or_new,
    figure_or_new,
    for_journal,
    legend_of,
    name_axes,
)
from contfric.plot.appearance.style import (
    BRIDGE_COLOUR,
    BRIDGE_WIDTH,
    LINE_WIDTH,
    MIRROR_WIDTH,
    NEXT_TO,
    SMALL,
    TEXT,
    UNKNOWN_WIDTH,
    greyish,
    lighter,
    row_of,
    sized,
)
from contfric.plot.diagrams.events import Mark, draw_marks, label_marks, marks_of
from contfric.plot.diagrams.inset import Inset, add_inset
from contfric.plot.diagrams.legend import handles_of
from contfric.plot.diagrams.look import LineStyle, Look
from contfric.plot.diagrams.runs import stability_runs
from contfric.plot.response import draw_overlay

if TYPE_CHECKING:
    from contfric.atlas.diagram import Diagram
    from contfric.continuation.branch import Branch
    from contfric.events.bifurcation import Bifurcation
    from contfric.models.definition import Model
    from contfric.quantities.registry import QuantityLike
    from contfric.response.sweep import Sweep

#: Width of a figure (inches) below which numbers along its axis would meet, and its parts then.
_COLUMN, _TICKS = 4.5, 5
#: Space above and below what is drawn, as a share of its height.
_MARGIN = 0.12
#: A branch that grows without bound leaves the axes this share of the range of the branches before its end.
_RESONANCE = 0.05
#: It leaves them where its values spread so many times as widely as the others.
_GROWN = 10.0
#: Ratio of a multiplier to the next smaller one above which it is without bound: between two points of a
#: branch a multiplier grows by less, and at a grazing impact it is what rounding leaves of infinity, 1e13.
_SPIKE = 1e6


def plot_branches(
    branches: Sequence[Branch], row: QuantityLike = "x_max", ax: Axes | None = None
) -> Axes:
    r"""Draw one quantity of some branches against their parameter, with their bifurcations.

    Stable parts are solid, unstable ones dashed, and they meet at the located bifurcation. Bridges,
    whose orbits have holds, are finely dotted and grey.

    Parameters
    ----------
    branches : sequence of Branch
    row : str or callable
        The quantity, as for :meth:`contfric.Branch.quantity`.
    ax : Axes, optional
        Where to draw; new axes by default. The legend stands next to these, or inside yours, there without
        the meaning of the markers.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> branch = cf.continue_orbit(orbit, "Omega", (0.4, 0.6))
    >>> plot_branches([branch], "psi").get_ylabel()
    '$\\psi$'
    """
    row_of(row, model_of(branches))  # before a figure is opened for it
    found = [b for branch in branches for b in branch.bifurcations]
    look = Look.of(branches, None, None, legend=True)
    return _plot_row(axes_or_new(ax), branches, found, row, look, outside=ax is None)


def plot_diagram_row(
    diagram: Diagram,
    row: QuantityLike = "x_max",
    ax: Axes | None = None,
    events: bool = True,
    legend: bool = True,
    overlay: Sweep | None = None,
    names: Mapping[str, str] | None = None,
    colours: Mapping[str, str] | None = None,
    linestyles: Mapping[str, LineStyle] | None = None,
    inset: Inset = False,
) -> Axes:
    """Draw one quantity of all branches of a diagram, with its bifurcations.

    Parameters
    ----------
    diagram : Diagram
    row : str or callable
        The quantity, as for :meth:`contfric.Branch.quantity`.
    ax : Axes, optional
        Where to draw; new axes by default.
    events : bool
        Whether to mark and label the bifurcations.
    legend : bool
        Whether to draw the legend.
    overlay : Sweep, optional
        Simulated points of the same parameter, drawn after the branches.
    names, colours : mapping, optional
        What branches are called in the legend, and colours of theirs, by their names.
    linestyles : mapping, optional
        Line styles of matplotlib for ``"stable"``, ``"unstable"``, ``"unknown"`` (no multipliers) and
        ``"bridge"``.
    inset : bool or (float, float)
        Whether to draw the part in which events crowd once more, larger; or which part.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> ax = plot_diagram_row(cf.explore(orbit, "Omega", (0.4, 0.6)), "psi")
    """
    row_of(row, model_of(diagram.branches))  # before a figure is opened for it
    found = diagram.bifurcations if events else ()
    look = Look.of(
        *(diagram.branches, names, colours, linestyles),
        legend=legend,
        inset=inset,
        overlay=overlay is not None,
    )
    new = axes_or_new(ax)
    new.set_xlim(*diagram.range)
    draw_overlay([new], [row], diagram.parameter, overlay)
    return _plot_row(new, diagram.branches, found, row, look, outside=ax is None)


def plot_diagram(
    diagram: Diagram,
    rows: Sequence[QuantityLike] = ("x_max", "stops", "psi"),
    fig: Figure | None = None,
    overlay: Sweep | None = None,
    title: str = "",
    *,
    legend: bool = True,
    names: Mapping[str, str] | None = None,
    colours: Mapping[str, str] | None = None,
    linestyles: Mapping[str, LineStyle] | None = None,
    inset: Inset = False,
) -> list[Axes]:
    """Draw a diagram in several rows over one parameter axis, as Figs. 4-7 of the reference.

    Parameters
    ----------
    diagram : Diagram
    rows : sequence of str or callable
        The quantities from top to bottom, as for :meth:`contfric.Branch.quantity`.
    fig : Figure, optional
        An empty figure to draw in; a new one by default.
    overlay : Sweep, optional
        Simulated points of the same parameter, drawn after the branches.
    title : str, optional
        What stands above; names of parameters become symbols. The fixed parameters by default.
    legend, names, colours, linestyles, inset : optional
        As for :func:`plot_diagram_row`.

    Returns
    -------
    list of Axes
        One for each row.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> axes = plot_diagram(cf.explore(orbit, "Omega", (0.4, 0.6)), rows=("x_max", "psi"))
    """
    looks = [row_of(row, model_of(diagram.branches)) for row in rows]
    look = Look.of(
        *(diagram.branches, names, colours, linestyles),
        legend=legend,
        inset=inset,
        overlay=overlay is not None,
    )
    fig = figure_or_new(fig, 8.4, 1.2 + 2.4 * len(rows))
    axes = list(fig.subplots(len(rows), 1, sharex=True, squeeze=False)[:, 0])
    axes[0].set_xlim(*diagram.range)
    draw_overlay(axes, rows, diagram.parameter, overlay)
    fixed = fixed_parameters(diagram.branches)
    names_of = diagram.model.parameter_names if title else ()
    text = full_title(title, names_of, fixed)
    axes[0].set_title(text, fontsize=sized(TEXT))
    marks = [
        marks_of(diagram.bifurcations, diagram.branches, row, diagram.parameter) for row in rows
    ]
    for ax, row, found in zip(axes, rows, marks, strict=True):
        draw_row(ax, diagram.branches, found, row, look)
        ax.label_outer()
    fig.align_ylabels(axes)
    if legend:
        mirrors = any(not shown.even for shown in looks)
        handles = handles_of(diagram.branches, marks[0], look, mirrors=mirrors)
        if fig.get_layout_engine() is None:
            axes[0].legend(handles=handles, fontsize=sized(SMALL), **NEXT_TO)
        else:
            legend_of(fig, handles)
    lay_out(axes[0])
    for ax, row, found in zip(axes, rows, marks, strict=True):
        _label_row(ax, diagram.branches, found, row, look)
    return axes


def fixed_parameters(branches: Sequence[Branch]) -> dict[str, float]:
    """Return the parameters that do not vary, as a title tells them."""
    if not branches:
        return {}
    first = branches[0]
    shown = first.model.mapping(first.vector)
    shown.pop(first.parameter, None)
    return parameters_to_show(shown, first.model.defaults)


def _plot_row(
    ax: Axes,
    branches: Sequence[Branch],
    events: Sequence[Bifurcation],
    row: QuantityLike,
    look: Look,
    *,
    outside: bool,
) -> Axes:
    parameter = branches[0].parameter if branches else ""
    marks = marks_of(events, branches, row, parameter)
    mirrors = not row_of(row, model_of(branches)).even
    draw_row(ax, branches, marks, row, look)
    if look.legend and outside:
        handles = handles_of(branches, marks, look, mirrors=mirrors)
        if for_journal() and isinstance(ax.figure, Figure):
            legend_of(ax.figure, handles)
        else:
            ax.legend(handles=handles, fontsize=sized(SMALL), frameon=False, **NEXT_TO)
    lay_out(ax)
    _label_row(ax, branches, marks, row, look)
    if look.legend and not outside:  # there is no space for the meaning of the markers
        handles = handles_of(branches, (), look, mirrors=mirrors)
        ax.legend(handles=handles, fontsize=sized(SMALL - 1.0), loc="best")
    return ax


def _label_row(
    ax: Axes, branches: Sequence[Branch], marks: Sequence[Mark], row: QuantityLike, look: Look
) -> None:
    """Write the labels of a row: those in an inset there."""
    inner, others = add_inset(
        ax, marks, look.inset, lambda inner: draw_row(inner, branches, marks, row, look)
    )
    label_marks(ax, others)
    if inner is not None:
        low, high = inner.get_xlim()
        label_marks(inner, [m for m in marks if low <= m.x <= high])


def model_of(branches: Sequence[Branch]) -> Model | None:
    """Return the model of some branches; None without any."""
    return branches[0].model if branches else None


def draw_row(
    ax: Axes, branches: Sequence[Branch], marks: Sequence[Mark], row: QuantityLike, look: Look
) -> None:
    """Draw one quantity of branches, with the marks of events, and name the axes."""
    label = row_of(row, model_of(branches))
    originals = {b.name for b in branches if not b.mirrored} if label.even else set()
    for branch in sorted(branches, key=lambda b: not b.mirrored):
        if branch.mirrored and branch.name in originals:
            continue  # it lies on its original
        _draw_branch(ax, branch, row, look)
    draw_marks(ax, marks)
    ax.margins(y=_MARGIN)
    if row == "multiplier":
        _cut_spikes(ax)
    else:
        _cut_resonances(ax, branches, marks)
    displacement = branches[0].model.states[0] if branches else "x"
    across = parameter_label(branches[0].parameter) if branches else None
    name_axes(ax, across, label.name(displacement))
    if branches and not np.all(np.isfinite(ax.dataLim.intervaly)):
        middle = ax.text(0.5, 0.5, "no finite value", transform=ax.transAxes, va="center")
        middle.set(ha="center", fontsize=sized(TEXT))
    if ax.figure.bbox.width / ax.figure.dpi < _COLUMN:
        ax.locator_params(axis="x", nbins=_TICKS)


def _cut_spikes(ax: Axes) -> None:
    """Let lines leave the axes where multipliers grow without bound, as at a grazing impact."""
    drawn = np.concatenate([[], *(np.asarray(line.get_ydata()) for line in ax.lines)])
    sizes = np.unique(np.maximum(drawn[np.isfinite(drawn)], 1.0))
    spikes = np.flatnonzero(sizes[1:] > _SPIKE * sizes[:-1])
    if len(spikes):
        ax.set_ylim(0.0, (1.0 + _MARGIN) * sizes[spikes[0]])


def _cut_resonances(ax: Axes, branches: Sequence[Branch], marks: Sequence[Mark]) -> None:
    """Let lines leave the axes where a branch grows without bound: events and what is farther are seen."""
    ends = [(b.values[0], b.values[-1]) for b in branches]
    at = [
        x[side]
        for x, b in zip(ends, branches, strict=True)
        for side, end in enumerate(b.ends)
        if end.reason.name == "UNBOUNDED"
    ]
    if not at:
        return
    names = {b.name for b in branches}
    x, y = np.concatenate([line.get_xydata() for line in ax.lines if line.get_gid() in names]).T
    far = np.min(np.abs(x[:, None] - at), axis=1) > _RESONANCE * np.ptp(ends)
    shown = np.concatenate([y[far & np.isfinite(y)], *(mark.y for mark in marks)])
    if not len(shown) or np.ptp(y[np.isfinite(y)]) <= _GROWN * np.ptp(shown):
        return  # what grows is not shown, such as a phase
    margin = _MARGIN * (np.ptp(shown) or 1.0)
    ax.set_ylim(shown.min() - margin, shown.max() + margin)


def _draw_branch(ax: Axes, branch: Branch, row: QuantityLike, look: Look) -> None:
    colour = BRIDGE_COLOUR if branch.bridge else look.colours[branch.name]
    if branch.mirrored:
        colour = lighter(colour, 0.3) if branch.bridge else lighter(colour)
    for run in stability_runs(branch, row):
        style = {True: "stable", False: "unstable", None: "unknown"}[run.stable]
        style = "bridge" if branch.bridge else style
        width = {"bridge": BRIDGE_WIDTH, "unknown": UNKNOWN_WIDTH}.get(
            style, MIRROR_WIDTH if branch.mirrored else LINE_WIDTH
        )
        level = 1.6 if branch.bridge else 2.0 + 0.5 * bool(run.stable)
        (line,) = ax.plot(
            *run.line,
            color=greyish(colour) if style == "unknown" else colour,
            linestyle=look.styles[style],
            linewidth=sized(width),
            solid_capstyle="butt",
            zorder=level - (0.1 if branch.bridge else 0.3) * branch.mirrored,
        )
        line.set_gid(branch.name)
