"""The rows of a diagram: branches with their stability, bridges, and marks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from matplotlib.axes import Axes

from contfric.plot.events import Mark, draw_marks
from contfric.plot.look import Look
from contfric.plot.names import parameter_label
from contfric.plot.runs import stability_runs
from contfric.plot.save import name_axes
from contfric.plot.style import (
    BRIDGE_COLOUR,
    BRIDGE_WIDTH,
    LINE_WIDTH,
    MIRROR_WIDTH,
    UNKNOWN_WIDTH,
    greyish,
    lighter,
    row_of,
    sized,
)

if TYPE_CHECKING:
    from contfric.continuation.branch import Branch
    from contfric.models.definition import Model
    from contfric.quantities.registry import QuantityLike

#: Width of a figure (inches) below which numbers along its axis would meet, and its parts then.
_COLUMN, _TICKS = 4.5, 5


def model_of(branches: Sequence[Branch]) -> Model | None:
    """Return the model of some branches; None without any."""
    return branches[0].model if branches else None


def draw_row(
    ax: Axes, branches: Sequence[Branch], marks: Sequence[Mark], row: QuantityLike, look: Look
) -> None:
    """Draw one quantity of branches, with the marks of events, and name the axes."""
    label = row_of(row, model_of(branches))
    twins = {b.name for b in branches if not b.mirrored} if label.even else set()
    for branch in sorted(branches, key=lambda b: not b.mirrored):
        if branch.mirrored and branch.name in twins:
            continue  # it lies on its original
        if branch.bridge:
            _draw_bridge(ax, branch, row, look)
        else:
            _draw_branch(ax, branch, row, look)
    draw_marks(ax, marks)
    ax.margins(y=0.12)
    displacement = branches[0].model.states[0] if branches else "x"
    across = parameter_label(branches[0].parameter) if branches else None
    name_axes(ax, across, label.name(displacement))
    if ax.figure.bbox.width / ax.figure.dpi < _COLUMN:
        ax.locator_params(axis="x", nbins=_TICKS)


def _draw_branch(ax: Axes, branch: Branch, row: QuantityLike, look: Look) -> None:
    width = MIRROR_WIDTH if branch.mirrored else LINE_WIDTH
    colour = look.colours[branch.name]
    colour = lighter(colour) if branch.mirrored else colour
    for run in stability_runs(branch, row):
        known = run.stable is not None
        lines = ax.plot(
            *run.line,
            color=colour if known else greyish(colour),
            linestyle=look.styles[
                "unknown" if not known else "stable" if run.stable else "unstable"
            ],
            linewidth=sized(width if known else UNKNOWN_WIDTH),
            solid_capstyle="butt",
            zorder=2.0 + 0.5 * bool(run.stable) - 0.3 * branch.mirrored,
        )
        for line in lines:
            line.set_gid(branch.name)


def _draw_bridge(ax: Axes, branch: Branch, row: QuantityLike, look: Look) -> None:
    for run in stability_runs(branch, row):
        lines = ax.plot(
            *run.line,
            color=lighter(BRIDGE_COLOUR, 0.3) if branch.mirrored else BRIDGE_COLOUR,
            linestyle=look.styles["bridge"],
            linewidth=sized(BRIDGE_WIDTH),
            zorder=1.6 - 0.1 * branch.mirrored,
        )
        for line in lines:
            line.set_gid(branch.name)
