"""What a diagram is held against: restarts from its own branches, and sums of indices.

* **Restart.** Explored again from any of its branches, with another step, a diagram has the same events and
branches.
* **Balance.** At every event, for every number of periods, the indices of the families below and above it
have the same sum
  (:mod:`contfric.orbit.index`).
* **Sum.** At every parameter value the indices of all orbits of one period have the sum that the motion at
large amplitudes
  gives. Where they have not, something is not in the diagram: another component, which seeds or a census
  find.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from contfric.atlas.matching import on_branch, same_event, same_place
from contfric.continuation.branch import Branch
from contfric.continuation.events import Bifurcation, Kind
from contfric.continuation.incident import unit_of
from contfric.continuation.points import LARGEST_STEP
from contfric.orbit.index import index_at_infinity, index_of
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import polish

if TYPE_CHECKING:
    from contfric.atlas.diagram import Diagram, Node

#: Step of a restart, in steps of the diagram: no ratio of small whole numbers, so that no point is met again.
STEP = 0.31
#: Points this near to an event (in accuracies of its place) are on no side of it.
_BESIDE = 10.0
#: Values of the parameter between two neighbouring events at which indices are summed.
_SHARES = (0.381966, 0.618034)
#: Events nearer than this share of the range have nothing between them that could be told from them.
_APART = 1e-6


@dataclass(frozen=True)
class Restart:
    """A diagram explored again from one of its branches, and what differs.

    Attributes
    ----------
    branch : index of the branch
    value : parameter value of the orbit that it was started from
    missing : what the diagram has and the restart has not, in words
    extra : what the restart has and the diagram has not
    complete : whether the restart was run to its end
    """

    branch: int
    value: float
    missing: tuple[str, ...]
    extra: tuple[str, ...]
    complete: bool = True

    @property
    def same(self) -> bool:
        """Whether nothing differs."""
        return not (self.missing or self.extra)

    def __str__(self) -> str:
        where = f"restart from branch {self.branch + 1} at {self.value:.6g}"
        if self.same:
            return f"{where}: the same"
        parts = [f"without {text}" for text in self.missing] + [
            f"with {text}" for text in self.extra
        ]
        return f"{where}: " + "; ".join(parts)


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
            f"{self.label} at {self.value:.10g}, orbits of {self.periods} period(s): "
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


@dataclass(frozen=True)
class Verification:
    """What :meth:`contfric.Diagram.verify` found."""

    restarts: tuple[Restart, ...]
    balances: tuple[Balance, ...]
    sums: tuple[IndexSum, ...]

    @property
    def same(self) -> bool:
        """Whether every restart gave the same diagram."""
        return all(restart.same for restart in self.restarts)

    @property
    def passed(self) -> bool:
        """Whether every restart gave the same, and the indices balance at every event."""
        return self.same and all(balance.holds for balance in self.balances)

    @property
    def faults(self) -> tuple[str, ...]:
        """What does not hold, a line each."""
        parts = [str(r) for r in self.restarts if not r.same]
        return (*parts, *(f"unbalanced: {b}" for b in self.balances if not b.holds))

    @property
    def missing(self) -> tuple[IndexSum, ...]:
        """Where the orbits of one period are not all: no event joins the others to these.

        There seeds (:class:`contfric.Seeds`) or a census (:func:`contfric.census`) find them.
        """
        return tuple(s for s in self.sums if not s.holds)

    def __str__(self) -> str:
        told = sum(b.below is not None and b.above is not None for b in self.balances)
        head = (
            f"{len(self.restarts)} restarts, {told} balances of indices: "
            f"{'nothing differs' if self.passed else f'{len(self.faults)} faults'}"
        )
        lines = [head, *(f"  {fault}" for fault in self.faults)]
        if self.missing:
            low, high = self.missing[0].value, self.missing[-1].value
            lines.append(
                f"  {len(self.missing)} of {len(self.sums)} sums of indices (from {low:.6g} to {high:.6g}) "
                f"tell of orbits that no event joins to these; {self.missing[0]}: try seeds or a census"
            )
        return "\n".join(lines)


def verify(diagram: Diagram, restarts: int = 6, step: float = STEP) -> Verification:
    """Hold a diagram against restarts and sums of indices.

    Parameters
    ----------
    restarts : int
        Most branches that it is explored again from: bridges and others in turn, spread over the list.
    step : float
        Largest step of the restarts, in largest steps of the diagram.
    """
    again = tuple(_restart(diagram, i, step) for i in _chosen(diagram, restarts))
    return Verification(again, tuple(balances(diagram)), tuple(index_sums(diagram)))


# --------------------------------------------------------------------------------- restarts


def _chosen(diagram: Diagram, most: int) -> list[int]:
    """Return the branches to restart from: spread over the bridges and over the others."""
    own = [i for i, b in enumerate(diagram.branches) if not b.mirrored and len(b) > 1]
    bridges = [i for i in own if diagram.branches[i].bridge]
    others = [i for i in own if not diagram.branches[i].bridge]
    few = min(len(bridges), most // 2)
    return sorted([*_spread(bridges, few), *_spread(others, most - few)])


def _spread(places: list[int], most: int) -> list[int]:
    if len(places) <= most:
        return places
    return [places[k] for k in np.unique(np.linspace(0, len(places) - 1, max(most, 0)).astype(int))]


def _restart(diagram: Diagram, i: int, step: float) -> Restart:
    from contfric.atlas.explore import explore

    asked = diagram.settings
    branch = diagram.branches[i]
    start = branch[len(branch) // 2]
    again = explore(
        start,
        diagram.parameter,
        diagram.range,
        max_step=step * (asked.max_step or branch.model.max_step or LARGEST_STEP),
        stability=asked.stability,
        bridges=asked.bridges,
        max_periods=asked.max_periods,
        copies=asked.copies,
        max_branches=asked.max_branches,
        max_points=max(asked.max_points, int(asked.max_points / step)),
    )
    value = start.params[diagram.parameter]
    return Restart(
        i,
        value,
        tuple(differences(diagram, again)),
        tuple(differences(again, diagram)),
        again.complete,
    )


def differences(one: Diagram, other: Diagram) -> Iterator[str]:
    """Yield what a diagram has and another one has not, in words: events, then branches up to symmetry."""
    width = one.range[1] - one.range[0]
    for event in one.bifurcations:
        if not any(_same_bifurcation(event, b, one.parameter, width) for b in other.bifurcations):
            yield f"{event.label} at {one.parameter} = {event.params[one.parameter]:.12g}"
    for branch in one.branches:
        if not branch.mirrored and not any(
            _covers(other_branch, branch) for other_branch in other.branches
        ):
            low, high = branch.values.min(), branch.values.max()
            yield f"branch {branch.name} from {low:.10g} to {high:.10g}"


def _same_bifurcation(a: Bifurcation, b: Bifurcation, parameter: str, width: float) -> bool:
    return a.kind is b.kind and same_place(a, b, parameter, width)


def _covers(known: Branch, branch: Branch) -> bool:
    """Tell whether a branch lies on another one: some point in its middle does."""
    if known.mirrored or known.system.periods != branch.system.periods:
        return False
    count = len(branch)
    return any(
        on_branch(branch[k], known) for k in sorted({count // 2, count // 3, (2 * count) // 3})
    )


# ------------------------------------------------------------------------- sums of indices


def balances(diagram: Diagram) -> Iterator[Balance]:
    """Yield the sums of indices beside every event that is no tangency."""
    width = diagram.range[1] - diagram.range[0]
    for number, node in enumerate(diagram.nodes):
        b = node.bifurcation
        if node.mirrored or b.kind in (Kind.T, Kind.NS) or not b.located:
            continue
        value, slack = b.params[diagram.parameter], _BESIDE * b.accuracy * width
        if not diagram.range[0] + slack < value < diagram.range[1] - slack:
            continue
        period = unit_of(b.orbit.as_whole()).periods if not b.orbit.model.autonomous else 0
        if period == 0:
            continue
        families = list(_families(diagram, node, value, slack))
        most = min(diagram.settings.copies, diagram.settings.max_periods // period)
        for times in range(1, most + 1):
            below, above = (_sum(families, side, period, times * period) for side in (-1, 1))
            yield Balance(number, b.label, value, times * period, below, above)


def _families(
    diagram: Diagram, node: Node, value: float, slack: float
) -> Iterator[tuple[int, Orbit]]:
    """Yield (side, orbit) for each half-branch that meets an event."""
    for i in node.branches:
        branch = diagram.branches[i]
        for position, event in _positions(diagram, node, branch):
            for way in (-1, 1):
                found = _beside(branch, position, event, way, value, slack)
                if found is not None:
                    yield found


def _positions(diagram: Diagram, node: Node, branch: Branch) -> list[tuple[float, Bifurcation]]:
    """Return the places along a branch at which it meets an event, and the event as the branch has it."""
    width = diagram.range[1] - diagram.range[0]
    b = node.bifurcation
    images = (b, b.mirror()) if branch.mirrored and b.orbit.model.symmetry is not None else (b,)
    return [
        (_position(branch, e), e)
        for e in branch.bifurcations
        if any(same_event(e, image, diagram.parameter, width) for image in images)
    ]


def _position(branch: Branch, event: Bifurcation) -> float:
    if branch.ends[0].bifurcation is event:
        return float(branch.arc[0])
    return float(branch.arc[-1]) if branch.ends[1].bifurcation is event else event.position


def _beside(
    branch: Branch, position: float, event: Bifurcation, way: int, value: float, slack: float
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
        k = int(min(np.flatnonzero(far), key=lambda j: abs(branch.arc[j] - position)))
        return int(np.sign(branch.values[k] - value)), branch[k]
    if following is None or following.orbit.joints.shape != event.orbit.joints.shape:
        return None
    middle = replace(
        event.orbit,
        joints=0.5 * (event.orbit.joints + following.orbit.joints),
        vector=0.5 * (event.orbit.vector + following.orbit.vector),
    )
    solved = polish(middle, damped=False)
    gap = solved.params[branch.parameter] - value
    return (int(np.sign(gap)), solved) if solved.converged and abs(gap) > slack else None


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
    if not diagram.settings.bridges:
        return
    low, high = _covered(diagram)
    places = sorted({low, high, *(b.params[diagram.parameter] for b in diagram.bifurcations)})
    width = diagram.range[1] - diagram.range[0]
    for a, b in pairwise(places):
        if b - a < _APART * width:
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
    vector = diagram.branches[0].vector.copy()
    vector[diagram.model.index_of(diagram.parameter)] = value
    return index_at_infinity(diagram.model, vector)


def _sum_at(diagram: Diagram, value: float) -> int | None:
    total = 0
    for branch in diagram.branches:
        if branch.system.periods != 1:
            continue
        for orbit in orbits_at(branch, value):
            index = index_of(orbit)
            if index is None:
                return None
            total += index
    return total


def orbits_at(branch: Branch, value: float) -> Iterator[Orbit]:
    """Yield the orbits of a branch at a parameter value, solved there: one for each time it takes it."""
    ahead = branch.values - value
    vector = branch.vector.copy()
    vector[branch.model.index_of(branch.parameter)] = value
    for k in np.flatnonzero(ahead[:-1] * ahead[1:] < 0.0):
        share = ahead[k] / (ahead[k] - ahead[k + 1])
        joints = branch.joints[k] + share * (branch.joints[k + 1] - branch.joints[k])
        solved = polish(Orbit(branch.system, joints, vector, np.inf), damped=False)
        nearest = int(k) if share < 0.5 else int(k) + 1
        yield solved if solved.converged else branch[nearest]
