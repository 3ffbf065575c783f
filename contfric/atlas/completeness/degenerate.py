"""Events of a diagram that are degenerate as far as rounding can tell: there a diagram has no one answer.

Each test uses the located events alone. A study with such an event may give another diagram from another
start. Differences are explained by the event if they are at it, or joined to the start by it alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from contfric.atlas.matching import stops_distance
from contfric.continuation.branch import Branch
from contfric.continuation.families.continuum import is_continuum
from contfric.continuation.locating.sliding import ROUGHLY_REACHED
from contfric.events.bifurcation import Bifurcation, Kind

if TYPE_CHECKING:
    from contfric.atlas.diagram import Diagram

#: Solutions this near to each other (one may have a hold more) may be taken for one where their parameters
#: cannot be told apart.
_ALIKE = 1e-3
#: A margin this small at a smooth event: the branch that leaves it, along which margins change in proportion
#: to the distance, ends before its parameter has changed by the rounding of one (the square of this).
_SECOND = 1e-6
_SMOOTH = frozenset({Kind.SN, Kind.BP, Kind.PD})


@dataclass(frozen=True)
class Degenerate:
    """A degenerate event in words, and the values of the parameter between which it is."""

    text: str
    low: float
    high: float

    def holds(self, value: float) -> bool:
        """Tell whether an event at a value may be this one."""
        return self.low <= value <= self.high

    def __str__(self) -> str:
        return self.text


def degenerate_events(diagram: Diagram) -> Iterator[Degenerate]:
    """Yield what is degenerate: two events in one location, alike or at both ends of a branch.

    And two conditions at once. An event that is not located is no excuse: it would be one everywhere.
    """
    parameter, width = diagram.parameter, diagram.width
    values = sorted(
        (b for b in diagram.bifurcations if b.kind is not Kind.T and _is_known(b)),
        key=lambda b: b.params[parameter],
    )

    def located(text: str, *events: Bifurcation) -> Degenerate:
        there = [b.params[parameter] for b in events]
        known = sum(b.accuracy for b in events) * width
        return Degenerate(text, min(there) - known, max(there) + known)

    for a, b in pairwise(values):
        gap = b.params[parameter] - a.params[parameter]
        if gap <= (a.accuracy + b.accuracy) * width and _alike(a, b):
            text = f"{a.label} and {b.label} at {a.params[parameter]:.10g}: not to be told apart"
            yield located(text, a, b)
    for branch in diagram.branches:
        if not branch.mirrored and unresolved(branch, width):
            location = f"{branch.name} at {branch.values[0]:.10g}"
            text = f"{location}: {parameter} changes by less along it than its ends are known to"
            yield located(text, *(e.bifurcation for e in branch.ends if e.bifurcation is not None))
    for b in values:
        if b.kind in _SMOOTH and float(np.min(b.orbit.margins, initial=np.inf)) < _SECOND:
            yield located(
                f"{b.label} at {b.params[parameter]:.10g}: a margin vanishes there, too", b
            )


def joined_surely(
    diagram: Diagram, first: int, degenerate: Iterable[Degenerate]
) -> tuple[tuple[Bifurcation, ...], tuple[Branch, ...]]:
    """Return the events and branches that are joined to a branch by events of which none is degenerate.

    Every exploration from that branch has them, up to symmetry.
    """
    import networkx as nx

    # the image of a branch is listed after it
    own = [i - int(branch.mirrored) for i, branch in enumerate(diagram.branches)]
    known = tuple(degenerate)
    graph: nx.Graph[int] = nx.Graph()
    nodes = [
        (node.bifurcation, [own[i] for i in node.branches])
        for node in diagram.nodes
        if not any(d.holds(node.bifurcation.params[diagram.parameter]) for d in known)
    ]
    graph.add_node(own[first])
    for _, branches in nodes:
        nx.add_path(graph, branches)
    reached = nx.node_connected_component(graph, own[first])
    events = tuple(event for event, branches in nodes if branches[0] in reached)
    return events, tuple(diagram.branches[i] for i in sorted(reached))


def _alike(a: Bifurcation, b: Bifurcation) -> bool:
    """Tell whether the solutions at two events may be taken for one, run through as often as it takes.

    Slides one after the other are compared: sequences of the same passages in another order are told apart.
    Where one solution has more slides than the other, some of them are left out; what has no order of its
    slides is compared by its stops.
    """
    one, other = a.outline, b.outline
    both = math.lcm(one.periods, other.periods)
    few, many = sorted((one.repeated(both), other.repeated(both)), key=lambda o: len(o.starts))
    if len(few.starts) == len(many.starts):
        return few.apart(many) < _ALIKE
    if few.ordered and math.isfinite(few.cycle):
        return few.is_part_of(many, _ALIKE)
    return stops_distance(a.orbit.stops, b.orbit.stops, mirror=True) < _ALIKE


def unresolved(branch: Branch, width: float) -> bool:
    """Tell whether the parameter changes along a branch by less than its two ends are known to.

    A continuum at one value is known to be one, and is compared as such.
    """
    if is_continuum(branch):
        return False
    ends = [end.bifurcation for end in branch.ends if end.bifurcation is not None]
    known = sum(b.accuracy for b in ends) * width
    located = len(ends) == 2 and all(map(_is_known, ends))
    return located and bool(np.ptp(branch.values) < known)


def _is_known(event: Bifurcation) -> bool:
    """Tell whether the location of an event is known at all."""
    return event.accuracy <= ROUGHLY_REACHED
