"""Tests whether two orbits, or two events, are the same up to rotation and mirror image."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.system import Itinerary
from contfric.continuation.branch import Branch
from contfric.continuation.families.continuum import is_continuum
from contfric.events.bifurcation import ACCURACY, TERMINAL, Bifurcation, Kind
from contfric.models.definition import Model
from contfric.orbit.canonical.slides import modulo
from contfric.orbit.itinerary.itineraries import mirror_pairs, whole_of
from contfric.orbit.orbit import Orbit, Status
from contfric.orbit.solve import ended_at_surfaces, refine
from contfric.signature import ReducedItinerary, canonical_itinerary

#: Events whose parameters agree to their accuracy and whose solutions agree to this are one.
SAME_SOLUTION = 1e-4
#: Orbits solved at the same parameter are one if their stops agree to this (relative to 1 + their size).
_SAME_ORBIT = 1e-8
#: Names of one and the same event, those that say more first.
_TELLING = {
    kind: rank for rank, kind in enumerate((Kind.GS, Kind.AS, Kind.SS, Kind.CS, Kind.SN, Kind.BP))
}
#: Parameters of one event, relative to the range, that differ by rounding alone; and how many of its own
#: accuracies (it is known to that on either branch) they may differ by.
ROUNDING, _TWICE = 1e-11, 2.0
#: Where a branch is looked for on another one, as shares of its length.
INSIDE = (0.5, 0.381966, 0.618034, 0.2, 0.8)
#: Events this far apart (relative to the range) are two, however badly they are known: how well that is
#: need not be computed.
_APART = 0.05


def identity(orbit: Orbit) -> frozenset[ReducedItinerary]:
    """Return the orbit's reduced itinerary and its mirror image, canonical."""
    return _images(orbit.model, orbit.itinerary)


def identity_of(branch: Branch) -> frozenset[ReducedItinerary]:
    """Return the identity of the orbits of a branch."""
    system = branch.system
    return _images(system.model, whole_of(system.model, system.itinerary, system.half))


@cache
def _images(model: Model, itinerary: Itinerary) -> frozenset[ReducedItinerary]:
    itineraries = {canonical_itinerary(itinerary, model)}
    if model.symmetry is not None:
        itineraries.add(canonical_itinerary(mirror_pairs(model, itinerary), model))
    return frozenset(itineraries)


def distance(a: FloatArray, b: FloatArray) -> float:
    """Return the Hausdorff distance of two sets of numbers."""
    if not len(a) or not len(b):  # no stops at all: alike, or not at all
        return 0.0 if len(a) == len(b) else np.inf
    gaps = np.abs(a[:, None] - b[None, :])
    return float(max(gaps.min(axis=1).max(), gaps.min(axis=0).max()))


def part_distance(a: FloatArray, b: FloatArray, cycle: float | None = None) -> float:
    """Return how far the one of two sets of numbers that is nearer to be a part of the other is from it.

    With a ``cycle`` they are numbers on a circle.

    Examples
    --------
    >>> part_distance(np.array([0.0, 1.0]), np.array([0.0, 1.0, 5.0]))
    0.0
    """
    if not len(a) or not len(b):
        return 0.0
    gaps = np.abs(a[:, None] - b[None, :])
    if cycle is not None:
        gaps = modulo(gaps, cycle)
    return float(min(gaps.min(axis=1).max(), gaps.min(axis=0).max()))


def stops_apart(a: Orbit, b: Orbit) -> float:
    """Return the distance of the stops of two orbits, of which one may have more; angles modulo a turn."""
    return part_distance(a.stops, b.stops, 2.0 * np.pi if 0 in a.model.angles else None)


def stops_distance(a: FloatArray, b: FloatArray, mirror: bool) -> float:
    """Return the distance of two sets of stops, mirrored if that is nearer."""
    return min(distance(a, b), distance(-a, b)) if mirror else distance(a, b)


def same_event(a: Bifurcation, b: Bifurcation, parameter: str, width: float) -> bool:
    """Tell whether two branches have met the same event (or its mirror image), by how well it is known."""
    return same_kind(a, b) and same_location(a, b, parameter, width, ROUNDING)


def same_location(
    a: Bifurcation, b: Bifurcation, parameter: str, width: float, least: float = ACCURACY
) -> bool:
    """Tell whether two events have the same parameters and the same solution (or its mirror image).

    Parameters
    ----------
    least : parameters this near (relative to the range) are the same, however well they are known
    """
    gap = abs(a.params[parameter] - b.params[parameter]) / width
    if gap > _APART or not a.outline.apart(b.outline) < SAME_SOLUTION:
        return False
    # accuracies are asked for last: they cost
    return gap <= least or gap <= _TWICE * max(a.accuracy, b.accuracy)


def same_kind(a: Bifurcation, b: Bifurcation) -> bool:
    """Tell whether two events may be one by what branches call them.

    What is a grazing for one itinerary may be a stop at the boundary of rest for another: the sliding events
    are compared by their motions alone. A symmetric bridge may turn where an asymmetric one leaves it, and
    where it turns with one passage alone orbits of several periods end on it.
    """
    if a.kind is b.kind or (a.kind in TERMINAL and b.kind in TERMINAL):
        return True
    held = bool(a.orbit.system.holds) and bool(b.orbit.system.holds)
    return held and {a.kind, b.kind} <= {Kind.SN, Kind.BP, Kind.PD}


def telling_kind(kinds: Iterable[Kind]) -> Kind:
    """Return the name of an event that branches have different names for: how its stick is born.

    Examples
    --------
    >>> telling_kind([Kind.CS, Kind.GS]).value
    'GS'
    """
    return min(kinds, key=lambda kind: _TELLING.get(kind, len(_TELLING)))


def _in_family(orbit: Orbit, branch: Branch, mirror: bool) -> bool:
    """Tell whether an orbit is one of a continuum: as near to one of its points as they are to each other."""
    value = orbit.params[branch.parameter]
    size = orbit.model.size_of(orbit.model.index_of(branch.parameter), value)
    if abs(value - branch.values[0]) > _SAME_ORBIT * size:
        return False
    stops = [point.stops for point in branch]
    apart = max(stops_distance(a, b, False) for a, b in pairwise(stops))
    return min(stops_distance(orbit.stops, there, mirror) for there in stops) <= apart


def on_branch(orbit: Orbit, branch: Branch) -> bool:
    """Tell whether an orbit (or its mirror image) lies on a branch.

    Where the branch passes the orbit's parameter it is solved there and compared. The stops may be the same
    in another order, or after holds of other lengths: the solutions are compared as well.
    """
    if orbit.periods != branch.system.periods or orbit.system.half != branch.system.half:
        return False
    if identity(orbit) != identity_of(branch):
        return False
    value = orbit.params[branch.parameter]
    mirror = orbit.model.symmetry is not None
    if is_continuum(branch):
        return _in_family(orbit, branch, mirror)
    for _, guess in guesses(branch, orbit.vector, value):
        solved = refine(guess, damped=False)
        if solved.status is Status.NOT_FINITE:  # a neuron that blows up just above its threshold
            solved = refine(ended_at_surfaces(guess), damped=False)
        same = _SAME_ORBIT * (1.0 + float(np.abs(orbit.stops).max(initial=0.0)))
        alike = solved.converged and stops_distance(orbit.stops, solved.stops, mirror) < same
        if alike and orbit.outline.apart(solved.outline) < SAME_SOLUTION:
            return True
    return False


def inner_orbit(branch: Branch) -> Orbit:
    """Return the orbit of a branch nearest to the middle of its arclength: points crowd at a singular end.

    It is one that Newton's method finds again if there is any: where rounding of the equations is more than
    what ends the iteration, as it may be next to a touch, no orbit is recognised.
    """
    length = branch.arc[-1] - branch.arc[0]
    offsets = (np.abs(branch.arc - branch.arc[0] - share * length) for share in INSIDE)
    first, *others = (branch[int(np.argmin(offset))] for offset in offsets)
    found = (orbit for orbit in (first, *others) if refine(orbit, damped=False).converged)
    return next(found, first)


def guesses(branch: Branch, vector: FloatArray, value: float) -> Iterator[tuple[float, Orbit]]:
    """Yield guesses for the orbits of a branch at a value, and their locations, one each time it takes it.

    By interpolation between its points, and the branch points and folds between them: near a fold it is a
    parabola.
    """
    arc, values, events, _ = branch.nodes
    folds = [k >= 0 and branch.bifurcations[k].kind is Kind.SN for k in events]
    ahead = values - value
    for k in np.flatnonzero(ahead[:-1] * ahead[1:] <= 0.0):
        rise = values[k + 1] - values[k]
        share = 0.0 if rise == 0.0 else -ahead[k] / rise
        if folds[k + 1]:
            share = 1.0 - max(0.0, 1.0 - share) ** 0.5
        elif folds[k]:
            share = max(0.0, share) ** 0.5
        location = float(arc[k] + share * (arc[k + 1] - arc[k]))
        yield location, replace(branch.between(location), vector=vector)
