"""Markers and labels of the events of a diagram."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from contfric.models.definition import FloatArray
from contfric.plot.labels import Anchor, near, place_labels
from contfric.plot.protocols import BifurcationLike, BranchLike, KindLike
from contfric.plot.runs import quantity
from contfric.plot.style import MARKERS, OTHER_MARKER, event_label

#: Relative: events of one kind this near in the parameter are images of one another.
_SAME = 1e-9
#: A diagram with more tangencies than this does not label them.
MOST_TANGENCIES = 4


@dataclass(frozen=True)
class Mark:
    """One event of a row: its images (mirror images, several stops) at one parameter value."""

    kind: KindLike
    label: str
    x: float
    y: FloatArray


def marks_of(
    events: Sequence[BifurcationLike],
    branches: Sequence[BranchLike],
    attribute: str,
    parameter: str,
) -> list[Mark]:
    """Return the marks of a row, with the images of each event on all branches."""
    elsewhere = [b for branch in branches for b in branch.bifurcations]
    found: list[Mark] = []
    for event in events:
        x = event.params[parameter]
        images = [b for b in elsewhere if _coincide(b, event, parameter)]
        y = np.concatenate([quantity(b.orbit, attribute) for b in (event, *images)])
        if not any(m.label == event.label and abs(m.x - x) <= _SAME * abs(x) for m in found):
            found.append(Mark(event.kind, event.label, x, _distinct(y)))
    return found


def _coincide(a: BifurcationLike, b: BifurcationLike, parameter: str) -> bool:
    difference = abs(a.params[parameter] - b.params[parameter])
    return a.kind.value == b.kind.value and difference <= _SAME * abs(b.params[parameter])


def _distinct(values: FloatArray) -> FloatArray:
    values = np.sort(values)
    gap = np.diff(values, prepend=-np.inf)
    return np.asarray(values[gap > 1e-7 * (1.0 + np.abs(values))])


def draw_marks(ax: Axes, marks: Sequence[Mark]) -> None:
    """Mark events; the artists have the event's label as their id (``get_gid``)."""
    for mark in marks:
        look = MARKERS.get(mark.kind.value, OTHER_MARKER)
        (line,) = ax.plot(
            np.full(len(mark.y), mark.x),
            mark.y,
            linestyle="none",
            marker=look.shape,
            markersize=look.size,
            markerfacecolor=look.face,
            markeredgecolor=look.edge,
            markeredgewidth=0.8,
            zorder=4 if mark.kind.value == "T" else 5,
        )
        line.set_gid(mark.label)


def label_marks(ax: Axes, marks: Sequence[Mark]) -> None:
    """Write the label of each event once, at the highest of its images.

    Tangencies, at which nothing but the labels of the segments changes, give way to the others.
    """
    minor = [m for m in marks if m.kind.value == "T"]
    shown = [m for m in marks if m.kind.value != "T"]
    major = [_anchor(m) for m in shown]
    if len(minor) <= MOST_TANGENCIES:
        major += [a for a in map(_anchor, minor) if not near(ax, a, major)]
    place_labels(ax, major)


def _anchor(mark: Mark) -> Anchor:
    return Anchor(mark.x, float(mark.y.max()), event_label(mark.label))
