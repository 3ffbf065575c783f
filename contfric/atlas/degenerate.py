"""Events of a diagram that are degenerate as far as rounding can tell: there a diagram has no one answer.

Each test uses the located events alone. A study with such an event may give another diagram from another
start; differences are reported together with the event.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from contfric.atlas.matching import stops_distance
from contfric.continuation.branch import Branch
from contfric.continuation.families.continuum import is_continuum
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


def degenerate_events(diagram: Diagram) -> Iterator[str]:
    """Yield what is degenerate, in words: two events in one location, alike or at both ends of a branch.

    And two conditions at once.
    """
    parameter, width = diagram.parameter, diagram.width
    values = sorted(
        (b for b in diagram.bifurcations if b.kind is not Kind.T), key=lambda b: b.params[parameter]
    )
    for a, b in pairwise(values):
        gap = b.params[parameter] - a.params[parameter]
        if gap <= (a.accuracy + b.accuracy) * width and _alike(a, b):
            yield f"{a.label} and {b.label} at {a.params[parameter]:.10g}: not to be told apart"
    for branch in diagram.branches:
        if not branch.mirrored and unresolved(branch, width):
            location = f"{branch.name} at {branch.values[0]:.10g}"
            yield f"{location}: {parameter} changes by less along it than its ends are known to"
    for b in values:
        if b.kind in _SMOOTH and float(np.min(b.orbit.margins, initial=np.inf)) < _SECOND:
            yield f"{b.label} at {b.params[parameter]:.10g}: a margin vanishes there, too"


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
    return len(ends) == 2 and bool(np.ptp(branch.values) < known)
