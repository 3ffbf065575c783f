"""Markers and labels of the events of a diagram."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from contfric.base.arrays import FloatArray
from contfric.plot.appearance.labels import Anchor, near, place_labels
from contfric.plot.appearance.names import event_label
from contfric.plot.appearance.style import MARKERS, OTHER_MARKER, sized
from contfric.plot.diagrams.runs import counted, quantity

if TYPE_CHECKING:
    from contfric.continuation.branch import Branch
    from contfric.events.bifurcation import Bifurcation, Kind
    from contfric.quantities.registry import QuantityLike

#: Relative: events of one kind this near in the parameter are images of one another.
_SAME = 1e-9
#: Extrema of the orbits of one event agree to this: an event near a singular point, where a branch is
#: vertical, is located to about 1e-6.
_SAME_SOLUTION = 1e-5
#: A diagram with more tangencies than this does not label them; nor does it label the events that lie on
#: bridges only if there are more of those.
MOST_TANGENCIES, MOST_ON_BRIDGES = 4, 4
#: Size of the marks that lie on bridges only.
_SMALLER = 0.6


@dataclass(frozen=True)
class Mark:
    """One event of a row: its images (mirror images, several stops) at one parameter value.

    ``on_bridges`` tells whether it lies on bridges only, ``meaning`` what the legend says of it.
    """

    kind: Kind
    label: str
    x: float
    y: FloatArray
    on_bridges: bool = False
    meaning: str = ""


def marks_of(
    events: Sequence[Bifurcation], branches: Sequence[Branch], row: QuantityLike, parameter: str
) -> list[Mark]:
    """Return the marks of a row, with the images of each event on all branches.

    An event at which a bridge meets a branch is one event, with the label that it has there.
    """
    bridges = [b for branch in branches if branch.bridge for b in branch.bifurcations]
    regular = [b for branch in branches if not branch.bridge for b in branch.bifurcations]
    found: list[Mark] = []
    for event in events:
        x = event.params[parameter]
        there = [b for b in regular if _coincide(b, event, parameter)]
        images = [*there, *(b for b in bridges if _coincide(b, event, parameter))]
        y = np.concatenate(
            [
                *(quantity(b.orbit, row) for b in (event, *images)),
                *(_at_end(branch, b, row) for b in (event, *images) for branch in branches),
            ]
        )
        y = y[np.isfinite(y)]
        if not len(y):
            continue
        label = event.label if event in there or not there else there[0].label
        if not any(m.label == label and abs(m.x - x) <= _SAME * abs(x) for m in found):
            only = bool(images) and not there
            found.append(Mark(event.kind, label, x, _distinct(y), only, event.meaning))
    return found


def _at_end(branch: Branch, event: Bifurcation, row: QuantityLike) -> FloatArray:
    """Return a quantity of a branch that ends at an event, where it has another one than the event's orbit.

    That is so for an orbit of more periods, and for multipliers, which jump there.
    """
    for side, end in enumerate(branch.ends):
        if end.bifurcation is not event:
            continue
        if row == "multiplier":
            return np.asarray(quantity(branch, row)[-side])
        if branch.system.periods > event.orbit.periods:
            return counted(branch, event, quantity(event.orbit, row), quantity(branch, row)[-side])
    return np.empty(0)


def _coincide(a: Bifurcation, b: Bifurcation, parameter: str) -> bool:
    """Tell whether two located events are one, or mirror images of one another."""
    difference = abs(a.params[parameter] - b.params[parameter])
    if a.kind.value != b.kind.value or difference > _SAME * abs(b.params[parameter]):
        return False
    if a.orbit is b.orbit:
        return True
    spans = [np.array([o.x_max, o.x_min]) for o in (a.orbit, b.orbit)]
    gaps = (spans[0] - spans[1], spans[0] + spans[1][::-1])
    return any(bool(np.all(np.abs(gap) <= _SAME_SOLUTION)) for gap in gaps)


def _distinct(values: FloatArray) -> FloatArray:
    values = np.sort(values)
    gap = np.diff(values, prepend=-np.inf)
    return np.asarray(values[gap > 1e-7 * (1.0 + np.abs(values))])


def draw_marks(ax: Axes, marks: Sequence[Mark]) -> None:
    """Mark events; the artists have the event's label as their id (``get_gid``)."""
    for mark in marks:
        marker = MARKERS.get(mark.kind.value, OTHER_MARKER)
        look = marker.look()
        if mark.on_bridges:
            look |= {"markersize": sized(_SMALLER * marker.size), "markeredgewidth": 0.5}
        (line,) = ax.plot(
            np.full(len(mark.y), mark.x),
            mark.y,
            zorder=4 if mark.kind.value == "T" or mark.on_bridges else 5,
            **look,
        )
        line.set_gid(mark.label)


def draw_event(ax: Axes, event: Bifurcation, place: tuple[float, float]) -> None:
    """Mark an event at a place of a graph."""
    look = MARKERS.get(event.kind.value, OTHER_MARKER)
    ax.plot(
        *place,
        marker=look.shape,
        markersize=sized(look.size + 1.0),
        markerfacecolor=look.face,
        markeredgecolor=look.edge,
        zorder=3,
    )


def label_marks(ax: Axes, marks: Sequence[Mark]) -> None:
    """Write the label of each event once, at the highest of its images.

    Events that lie on bridges only, and tangencies, at which nothing but the labels of the segments
    changes, give way to the others; a tangency of a bridge has no label.
    """
    tangencies = [m for m in marks if m.kind.value == "T" and not m.on_bridges]
    on_bridges = [m for m in marks if m.kind.value != "T" and m.on_bridges]
    shown = [_anchor(m) for m in marks if m.kind.value != "T" and not m.on_bridges]
    for minor, most in ((on_bridges, MOST_ON_BRIDGES), (tangencies, MOST_TANGENCIES)):
        if len(minor) <= most:
            shown += [a for a in map(_anchor, minor) if not near(ax, a, shown)]
    place_labels(ax, shown)


def _anchor(mark: Mark) -> Anchor:
    return Anchor(mark.x, float(mark.y.max()), event_label(mark.label))
