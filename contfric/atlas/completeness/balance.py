"""Sums of fixed-point indices in a diagram: near every event, and over all orbits of one period.

The index is that of :mod:`contfric.orbit.index`. Both sums are told by topology; one that is not as it must
be says that something is not in the diagram.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from contfric.atlas.leaving.short_branches import is_short
from contfric.atlas.matching import ROUNDING, guesses, same_event, same_location
from contfric.base.arrays import with_entries
from contfric.bvp.conserved import conserved
from contfric.bvp.margins import EventFunction
from contfric.continuation.branch import Branch
from contfric.continuation.families.continuum import is_continuum
from contfric.continuation.half_branch import first_point
from contfric.continuation.points import settings_of
from contfric.errors import ContfricError, number_and
from contfric.events.accumulating import accumulates
from contfric.events.bifurcation import Bifurcation, EndReason, Kind
from contfric.events.incident.unit import unit_of
from contfric.events.local.touching import leads_elsewhere
from contfric.orbit.index import index_at_infinity, index_of
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine
from contfric.simulation.dense import stretches
from contfric.simulation.simulate import simulate

if TYPE_CHECKING:
    from contfric.atlas.diagram import Diagram, Node

#: Points this near to an event (in accuracies of its place) are on no side of it.
_NEARBY = 10.0
#: Arclength from an event, in sizes of the orbit, below which a multiplier may be 1 but for rounding.
_BLURRED = 1e-4
#: Values of the parameter between two neighbouring events at which indices are summed.
_SHARES = (0.381966, 0.618034)
#: Events nearer than this share of the range have nothing between them that could be told from them.
_APART = 1e-6
#: Where rest is tried near an event, relative to the range: beyond the accuracy of the event.
_REST_BESIDE = 1e-4
#: Events of a trial of rest, of which a solution has some in each period, and its length in periods: no whole
#: number, so that what moves is elsewhere at its end.
_EVENTS, _TRIED = 20, 2.3
#: What changes by less is at rest: at the event slides are as long as the third root of rounding, and that
#: far from it the shortest go ten times this far. And the share of a period that is no time: where nothing
#: jumps slides go no farther than that just beyond the event, but last longer.
_STILL, _NO_TIME = 1e-7, 1e-4


@dataclass(frozen=True)
class Balance:
    """Sums of indices on both sides of an event, for orbits of some periods.

    Attributes
    ----------
    event : index of the node
    label, value : its name, and its place
    periods : length of the orbits, in periods
    below, above : sums of the indices; None where one has no sign
    """

    event: int
    label: str
    value: float
    periods: int
    below: int | None
    above: int | None

    @property
    def holds(self) -> bool:
        """Whether both sums agree (or one cannot be told)."""
        return self.below is None or self.above is None or self.below == self.above

    def __str__(self) -> str:
        return (
            f"{self.label} at {self.value:.10g}, orbits of {number_and(self.periods, 'period')}: "
            f"{self.below} below, {self.above} above"
        )


@dataclass(frozen=True)
class IndexSum:
    """The sum of the indices of all orbits of one period at a parameter value, and what it should be."""

    value: float
    found: int | None
    wanted: int

    @property
    def holds(self) -> bool:
        """Whether it is what it should be (or cannot be told)."""
        return self.found is None or self.found == self.wanted

    def __str__(self) -> str:
        return (
            f"at {self.value:.10g} the indices of all orbits of one period add up to "
            f"{self.found}, not {self.wanted}"
        )


def balances(diagram: Diagram) -> Iterator[Balance]:
    """Yield the sums of indices near every event that is no tangency.

    Events at the two ends of a continuum are one location, and so are those whose parameters are not to be
    told apart: all that leaves them is summed together.
    """
    width = diagram.width
    for number, node in enumerate(diagram.nodes):
        b = node.bifurcation
        if node.mirrored or b.kind in (Kind.T, Kind.NS) or not b.located:
            continue
        value, slack = b.params[diagram.parameter], _NEARBY * b.accuracy * width
        if not diagram.range[0] + slack < value < diagram.range[1] - slack:
            continue
        if b.orbit.model.autonomous:
            continue
        nodes, slack = _joined(diagram, number)
        # a doubling that is joined has a shorter unit than what ends next to it
        units = (diagram.nodes[joined].bifurcation.orbit.as_whole() for joined in nodes)
        families = [
            found
            for joined in nodes
            for found in _families(diagram, diagram.nodes[joined], value, slack)
        ]
        # a graze is known to the root of rounding, and may not show that its solution repeats itself
        lengths = [*(unit_of(whole).periods for whole in units), *(o.periods for _, o in families)]
        period = math.gcd(*lengths)
        most = min(diagram.settings.copies, diagram.settings.max_periods // period)
        for times in range(1, most + 1):
            below, above = (_sum(families, side, period, times * period) for side in (-1, 1))
            rest = _ended(diagram, node, EndReason.REST)  # the mass stays at rest for ever
            if rest is not None and below is not None and above is not None:
                distance = _REST_BESIDE * width
                below += _rests(rest, diagram.parameter, value - distance)
                above += _rests(rest, diagram.parameter, value + distance)
            events = [diagram.nodes[joined].bifurcation for joined in nodes]
            if any(leads_elsewhere(e.orbit, test) for e in events for test in e.tests):
                below = above = None
            walls = [t for e in events for t in e.tests if t.surface in e.orbit.model.fixed_sides]
            if walls or any(accumulates(e) for e in events):
                below = above = None  # incomplete chatter: beyond it branches are infinitely many
            lost = any(_frees(e.orbit, test) for e in events for test in e.tests)
            if lost or _ended(diagram, node, EndReason.SHAKEDOWN) is not None:
                below = above = None  # beyond it orbits have another offset, each of a continuum
            yield Balance(number, b.label, value, times * period, below, above)


def _frees(orbit: Orbit, test: EventFunction) -> bool:
    """Tell whether a solution that goes beyond an event does not keep what its orbit conserves."""
    kept, model = len(orbit.system.layout.conserved), orbit.model
    if not kept:
        return False
    mode = model.whole_mode(orbit.itinerary[test.segment][0])
    targets = {
        t for d in model.domains_of(mode) for t in model.targets.get((d.name, test.surface), ())
    }
    return any(
        len(conserved(model, (*orbit.itinerary, (model.domain_by_name[t].mode, test.surface))))
        < kept
        for t in targets
    )


def _ended(diagram: Diagram, node: Node, reason: EndReason) -> Orbit | None:
    """Return the orbit at an event at which a branch ends for a reason; None where none does."""
    for i in node.branches:
        for end in diagram.branches[i].ends:
            if end.reason is reason and end.bifurcation is not None:
                here, b = end.bifurcation.params[diagram.parameter], node.bifurcation
                if here == b.params[diagram.parameter]:
                    return end.bifurcation.orbit
    return None


def _rests(orbit: Orbit, parameter: str, value: float) -> bool:
    """Tell whether the mass can stay at rest for ever, where it comes to rest at an event nearby.

    All locations in which it can are one set that attracts what is near it: its index is 1.
    """
    params = {**orbit.params, parameter: value}
    model, (time, *state) = orbit.model, orbit.cycle[0]
    try:
        run = simulate(model, params, state=state, time=float(time), periods=_TRIED, events=_EVENTS)
    except ContfricError:  # no such state there, or a value outside of the limits
        return False
    still = bool(np.abs(np.array([*run.states, run.last[2]]) - state).max() < _STILL)
    modes = [mode for mode, _ in run.itinerary]
    lasting = (part for part in stretches(run) if part.duration >= _NO_TIME * orbit.period)
    stays = all(model.is_at_rest(part.mode) for part in lasting)
    sliding = all(model.mode_by_name[mode].sliding for mode in modes)
    rests = bool(run.last[3]) and model.is_at_rest(run.last[3])
    return (stays and rests) or (sliding and (still or all(map(model.is_at_rest, modes))))


def _joined(diagram: Diagram, number: int) -> tuple[list[int], float]:
    """Return a node with those that have the same location, and how near to it orbits are on no side of it.

    Those that agree to their accuracies, and those that parts of branches join to them on which there is no
    orbit on either side: continua, and parts along which the parameter changes by less than it is known to.
    """
    b, width = diagram.nodes[number].bifurcation, diagram.width
    found = [number]
    for k, node in enumerate(diagram.nodes):
        if k == number or node.mirrored:
            continue
        if same_location(node.bifurcation, b, diagram.parameter, width, ROUNDING):
            found.append(k)
    slack = _slack(diagram, found)
    value = b.params[diagram.parameter]
    for known in found:  # grows
        for i in diagram.nodes[known].branches:
            for pair in _flat_parts(diagram, i, value, slack):
                found += [k for k in pair if known in pair and k not in found]
    return found, _slack(diagram, found)


def _slack(diagram: Diagram, nodes: list[int]) -> float:
    """Return how near to events orbits are on no side of them."""
    return max(_NEARBY * diagram.nodes[k].bifurcation.accuracy * diagram.width for k in nodes)


def _flat_parts(diagram: Diagram, i: int, value: float, slack: float) -> Iterator[tuple[int, int]]:
    """Yield the pairs of nodes between which a branch leaves a value by no more than the slack."""
    branch = diagram.branches[i]
    continuum = is_continuum(branch)
    locations = sorted(
        (position, k)
        for k, node in enumerate(diagram.nodes)
        if i in node.branches and node.bifurcation.kind is not Kind.T
        for position in _positions(diagram, node, branch)
    )
    for (a, one), (b, other) in pairwise(locations):
        ends = (diagram.nodes[k].bifurcation.params[diagram.parameter] for k in (one, other))
        part = (*ends, *branch.values[(branch.arc >= a) & (branch.arc <= b)])
        if continuum or np.abs(np.subtract(part, value)).max() <= slack:
            yield one, other


def _families(
    diagram: Diagram, node: Node, value: float, slack: float
) -> Iterator[tuple[int, Orbit]]:
    """Yield (side, orbit) for each half-branch that meets an event."""
    for i in node.branches:
        branch = diagram.branches[i]
        if is_continuum(branch):
            continue
        for position in _positions(diagram, node, branch):
            for way in (-1, 1):
                found = _nearby_orbit(branch, position, way, value, slack, diagram.width)
                if found is not None:
                    yield found


def _positions(diagram: Diagram, node: Node, branch: Branch) -> list[float]:
    """Return the locations along a branch at which it meets an event."""
    b = node.bifurcation
    images = (b, b.mirror()) if branch.mirrored and b.orbit.model.symmetry is not None else (b,)
    return [
        _position(branch, e)
        for e in branch.bifurcations
        if any(same_event(e, image, diagram.parameter, diagram.width) for image in images)
    ]


def _position(branch: Branch, event: Bifurcation) -> float:
    if branch.ends[0].bifurcation is event:
        return float(branch.arc[0])
    return float(branch.arc[-1]) if branch.ends[1].bifurcation is event else event.position


def _nearby_orbit(
    branch: Branch, position: float, way: int, value: float, slack: float, width: float
) -> tuple[int, Orbit] | None:
    """Return an orbit of a branch on one side of an event, before the branch meets the next one."""
    others = [(_position(branch, e), e) for e in branch.bifurcations if e.kind is not Kind.T]
    ahead = [pair for pair in others if (pair[0] - position) * way > 0.0]
    reach, following = min(
        ahead, key=lambda pair: abs(pair[0] - position), default=(np.inf * way, None)
    )
    between = ((branch.arc - position) * way > 0.0) & ((reach - branch.arc) * way > 0.0)
    far = between & (np.abs(branch.values - value) > slack)
    if np.any(far):
        away = np.abs(branch.arc - position)
        told = far & (away > _BLURRED * (1.0 + float(np.abs(branch[0].joints[:, 1:]).max())))
        k = int(min(np.flatnonzero(told if np.any(told) else far), key=away.__getitem__))
        return int(np.sign(branch.values[k] - value)), branch[k]
    if following is None:
        return None
    onward = following.params[branch.parameter] - value
    if is_short(branch):  # nothing is solved on it: a point is on the side on which the branch ends
        inner = np.flatnonzero(between & (abs(onward) > slack))
        return (int(np.sign(onward)), branch[int(inner[inner.size // 2])]) if inner.size else None
    # in the middle of what is beyond the slack, where the parameter goes on to the next event
    share = 0.5 * (1.0 + slack / abs(onward)) if abs(onward) > slack else 0.5
    solved = _solved_at(branch, position + share * (reach - position), width)
    gap = 0.0 if solved is None else solved.params[branch.parameter] - value
    # up to an event that is beyond the slack a branch is on its side, however short it is
    gap = onward if abs(onward) > slack >= abs(gap) else gap
    return None if solved is None or abs(gap) <= slack else (int(np.sign(gap)), solved)


def _solved_at(branch: Branch, arc: float, width: float) -> Orbit | None:
    """Return the orbit at a location of a branch: solved normal to the chord, for a fold may be near.

    Normal in the product in which its arclength is measured, that of the whole range: in that of a narrow
    branch the parameter is all, and along the chord of a sharp bend it says nothing of the arclength.
    """
    arcs, values, _, _ = branch.nodes
    k = int(np.clip(np.searchsorted(arcs, arc), 1, len(arcs) - 1))
    length = float(arcs[k] - arcs[k - 1])
    if not length > 0.0:
        return None
    one, guess, other = (branch.between(float(a)) for a in (arcs[k - 1], arc, arcs[k]))
    low, high = float(branch.values.min()), float(branch.values.max())
    rounding = 1e-9 * branch.model.size_of(branch.model.index_of(branch.parameter), low)
    around = low - rounding, high + rounding
    own = settings_of(branch[0], branch.parameter, around, None, False, 2)
    settings = replace(own, width=width)
    chord = (other.joints - one.joints) / length
    point = first_point(guess, settings, chord, float(values[k] - values[k - 1]) / length)
    active = branch.model.index_of(branch.parameter)
    return None if point is None else point.orbit(branch, active)


def _sum(
    families: list[tuple[int, Orbit]], side: int, shortest_period: int, periods: int
) -> int | None:
    total = 0
    for where, orbit in families:
        if where != side or periods % orbit.periods:
            continue
        index = index_of(orbit, periods // orbit.periods)
        if index is None:
            return None
        total += index * (orbit.periods // shortest_period)
    return total


def index_sums(diagram: Diagram) -> Iterator[IndexSum]:
    """Yield the sums of the indices of all orbits of one period, between the events."""
    if not diagram.settings.bridges or diagram.settings.stop_at:  # branches end before events
        return
    low, high = _covered(diagram)
    locations = sorted({low, high, *(b.params[diagram.parameter] for b in diagram.bifurcations)})
    for a, b in pairwise(locations):
        if b - a < _APART * diagram.width:
            continue
        for share in _SHARES:
            value = a + share * (b - a)
            wanted = _wanted(diagram, value)
            if wanted is not None:
                yield IndexSum(value, _sum_at(diagram, value), wanted)


def _covered(diagram: Diagram) -> tuple[float, float]:
    """Return the range within the limits of the model."""
    values = [v for branch in diagram.branches for v in (branch.values.min(), branch.values.max())]
    return max(diagram.range[0], min(values)), min(diagram.range[1], max(values))


def _wanted(diagram: Diagram, value: float) -> int | None:
    vector = with_entries(
        diagram.branches[0].vector, diagram.model.index_of(diagram.parameter), value
    )
    return index_at_infinity(diagram.model, vector)


def _sum_at(diagram: Diagram, value: float) -> int | None:
    rests = (_ended(diagram, node, EndReason.REST) for node in diagram.nodes)
    resting = (orbit for orbit in rests if orbit is not None)
    total = int(any(_rests(orbit, diagram.parameter, value) for orbit in resting))
    for branch in diagram.branches:
        if branch.system.periods != 1:
            continue
        for orbit in orbits_at(branch, value):
            index = index_of(orbit)
            if index is None or len(orbit.system.layout.conserved):
                return None  # one of a continuum, which has an index as a whole
            total += index
    return total


def orbits_at(branch: Branch, value: float) -> Iterator[Orbit]:
    """Yield the orbits of a branch at a parameter value, solved there: one for each time it takes it."""
    vector = with_entries(branch.vector, branch.model.index_of(branch.parameter), value)
    for location, guess in guesses(branch, vector, value):
        solved = refine(guess, damped=False)
        nearest = int(np.argmin(np.abs(branch.arc - location)))
        yield solved if solved.converged else branch[nearest]
