"""Checks of a diagram: restarts from its own branches, and sums of indices.

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

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from contfric.atlas.completeness.balance import Balance, IndexSum, balances, index_sums
from contfric.atlas.completeness.degenerate import (
    Degenerate,
    degenerate_events,
    joined_surely,
    unresolved,
)
from contfric.atlas.leaving.short_branches import is_short
from contfric.atlas.matching import (
    INSIDE,
    guesses,
    identity_of,
    on_branch,
    same_location,
)
from contfric.base.arrays import with_entries
from contfric.base.one_thread import one_thread
from contfric.continuation.branch import Branch
from contfric.continuation.points import LARGEST_STEP
from contfric.errors import ConvergenceError
from contfric.events.bifurcation import ACCURACY, Bifurcation, EndReason
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine

if TYPE_CHECKING:
    from contfric.atlas.diagram import Diagram, Node

#: Step of a restart, in steps of the diagram: no ratio of small whole numbers, so that no point is met again.
STEP = 0.31


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
    degenerate : events of the restart that rounding may make others of, in words
    explained : whether all that differs is at degenerate events, or joined to the branch by them alone
    """

    branch: int
    value: float
    missing: tuple[str, ...]
    extra: tuple[str, ...]
    complete: bool = True
    degenerate: tuple[str, ...] = ()
    explained: bool = False

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
class Verification:
    """What :meth:`contfric.Diagram.verify` found."""

    restarts: tuple[Restart, ...]
    balances: tuple[Balance, ...]
    sums: tuple[IndexSum, ...]
    degenerate: tuple[Degenerate, ...] = ()

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
    def degeneracies(self) -> tuple[str, ...]:
        """Events of the diagram, and of restarts that differ, that rounding may make others of."""
        others = (text for r in self.restarts if not r.same for text in r.degenerate)
        return tuple(dict.fromkeys((*map(str, self.degenerate), *others)))

    @property
    def explained(self) -> bool:
        """Whether degenerate events explain all faults: what differs is at them, or joined by them alone."""
        return all(r.same or r.explained for r in self.restarts) and all(
            b.holds or _holds(self.degenerate, b.value) for b in self.balances
        )

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
        if not self.passed:
            lines += [f"  degenerate: {text}" for text in self.degeneracies]
        if self.missing:
            low, high = self.missing[0].value, self.missing[-1].value
            lines.append(
                f"  {len(self.missing)} of {len(self.sums)} sums of indices (from {low:.6g} to {high:.6g}) "
                f"tell of orbits that no event joins to these; {self.missing[0]}: try seeds or a census"
            )
        return "\n".join(lines)


def verify(
    diagram: Diagram, restarts: int = 6, step: float = STEP, known: Sequence[Degenerate] = ()
) -> Verification:
    """Hold a diagram against restarts and sums of indices.

    Parameters
    ----------
    restarts : int
        Most branches that it is explored again from: bridges and others in turn, spread over the list.
    step : float
        Largest step of the restarts, in largest steps of the diagram.
    known : sequence of Degenerate
        Values of the parameter at which the equations are known to be degenerate, whatever the events tell.
    """
    with one_thread():
        again = tuple(_restart(diagram, i, step, known) for i in _chosen(diagram, restarts))
        sums = tuple(balances(diagram)), tuple(index_sums(diagram))
        return Verification(again, *sums, (*degenerate_events(diagram), *known))


# --------------------------------------------------------------------------------- restarts

#: Where a branch is restarted, as shares of its points: in its middle unless the equations are singular.
_SHARES = (0.5, 0.25, 0.75)


def _chosen(diagram: Diagram, most: int) -> list[int]:
    """Return the branches to restart from: spread over the bridges and over the others."""
    own = [i for i, b in enumerate(diagram.branches) if not b.mirrored and len(b) > 1]
    bridges = [i for i in own if diagram.branches[i].bridge]
    others = [i for i in own if not diagram.branches[i].bridge]
    few = min(len(bridges), most // 2)
    return sorted([*_spread(bridges, few), *_spread(others, most - few)])


def _spread(locations: list[int], most: int) -> list[int]:
    if len(locations) <= most:
        return locations
    return [
        locations[k]
        for k in np.unique(np.linspace(0, len(locations) - 1, max(most, 0)).astype(int))
    ]


def _restart(diagram: Diagram, i: int, step: float, known: Sequence[Degenerate]) -> Restart:
    branch, refused = diagram.branches[i], ""
    for start in _starts(branch):
        value = start.params[diagram.parameter]
        try:
            again = _explored(diagram, start, step)
        except ConvergenceError as error:  # it is singular just there
            refused = refused or f"any continuation: {error}"
            continue
        more, less = tuple(differences(again, diagram)), tuple(differences(diagram, again))
        if not (less or more):
            return Restart(i, value, less, more, again.complete)
        own = (*degenerate_events(again), *known)
        explained = _holds(known, value) or not _told_apart(diagram, i, again, own)
        return Restart(i, value, less, more, again.complete, tuple(map(str, own)), explained)
    return Restart(i, value, (refused,), (), explained=_holds(known, value))


def _holds(known: Sequence[Degenerate], value: float) -> bool:
    """Tell whether a value of the parameter is one at which the equations are known to be degenerate."""
    return any(degenerate.holds(value) for degenerate in known)


def _told_apart(
    diagram: Diagram, i: int, again: Diagram, degenerate: tuple[Degenerate, ...]
) -> bool:
    """Tell whether a diagram and its restart from a branch differ in what no degenerate event explains.

    A pair that is not to be told apart in one of them may be one event, or none, in the other one.
    """
    known = (*degenerate, *degenerate_events(diagram))
    for one, first, other in ((diagram, i, again), (again, 0, diagram)):
        events, branches = joined_surely(one, first, known)
        if any(_lacks_event(other, b, one) for b in events):
            return True
        if any(_lacks_branch(other, branch, one) for branch in branches):
            return True
    return False


def _starts(branch: Branch) -> Iterator[Orbit]:
    """Yield the orbits of a branch that it is restarted from, in turn.

    Where its period grows without bound most of its points are at one value of the parameter, and cannot
    be told from each other: then the first of them is in the middle of the values.
    """
    if _grows(branch):
        middle = 0.5 * (branch.values.min() + branch.values.max())
        yield branch[int(np.argmin(np.abs(branch.values - middle)))]
    yield from (_inside(branch, share) for share in _SHARES)


def _grows(branch: Branch) -> bool:
    """Tell whether the period of a branch grows without bound at one of its ends."""
    return any(end.reason is EndReason.PERIOD for end in branch.ends)


def _inside(branch: Branch, share: float) -> Orbit:
    """Return an orbit of a branch between its ends."""
    k = int(share * len(branch))
    if 0 < k < len(branch) - 1:
        return branch[k]
    return refine(branch.between(share * float(branch.arc[-1])), damped=False)


def _explored(diagram: Diagram, start: Orbit, step: float) -> Diagram:
    """Explore a diagram again from one of its orbits, with a share of its largest step."""
    from contfric.atlas.explore import explore

    asked = diagram.settings
    again = explore(
        start,
        diagram.parameter,
        diagram.range,
        max_step=step * (asked.max_step or start.model.max_step or LARGEST_STEP),
        stability=asked.stability,
        bridges=asked.bridges,
        max_periods=asked.max_periods,
        copies=asked.copies,
        max_branches=asked.max_branches,
        max_points=max(asked.max_points, int(asked.max_points / step)),
        stop_at=dict(asked.stop_at),
    )
    if EndReason.INTERRUPTED.value in again.notes:  # what is missing differs in nothing
        raise KeyboardInterrupt
    return again


def differences(one: Diagram, other: Diagram) -> Iterator[str]:
    """Yield what a diagram has and another one has not, in words: events, then branches up to symmetry."""
    for event in one.bifurcations:
        if _lacks_event(other, event, one):
            yield f"{event.label} at {one.parameter} = {event.params[one.parameter]:.12g}"
    for branch in one.branches:
        if not branch.mirrored and _lacks_branch(other, branch, one):
            low, high = branch.values.min(), branch.values.max()
            yield f"branch {branch.name} from {low:.10g} to {high:.10g}"


def _lacks_event(diagram: Diagram, event: Bifurcation, one: Diagram) -> bool:
    """Tell whether a diagram has not an event of another one."""
    return not any(
        _same_bifurcation(event, b, one.parameter, one.width) for b in diagram.bifurcations
    ) and not any(_is_at(event, node, diagram) for node in diagram.events)


def _lacks_branch(diagram: Diagram, branch: Branch, one: Diagram) -> bool:
    """Tell whether a diagram has not a branch of another one."""
    return not any(
        _covers(known, branch) or _as_narrow(known, branch, one) for known in diagram.branches
    )


def _same_bifurcation(a: Bifurcation, b: Bifurcation, parameter: str, width: float) -> bool:
    return a.kind is b.kind and same_location(a, b, parameter, width)


def _is_at(event: Bifurcation, node: Node, diagram: Diagram) -> bool:
    """Tell whether an event is that of a node as another of its branches has it.

    Where a reset is met together with a surface, the motions of the branches that meet there differ by what
    it maps: the node has that of the branch that came first.
    """
    parameter, width = diagram.parameter, diagram.width
    value = node.bifurcation.params[parameter]
    if node.bifurcation.kind is not event.kind:
        return False
    return any(
        abs(b.params[parameter] - value) <= ACCURACY * width
        and same_location(event, b, parameter, width)
        for i in node.branches
        for b in diagram.branches[i].bifurcations
    )


def _covers(known: Branch, branch: Branch) -> bool:
    """Tell whether a branch lies on another one: some point in its middle does."""
    if known.mirrored or known.system.periods != branch.system.periods:
        return False
    # by arclength: near a vertex at which Newton fails there may be a thousand points
    length = float(branch.arc[-1])
    locations = (int(np.searchsorted(branch.arc, share * length)) for share in INSIDE)
    along = (branch[k] for k in locations if 0 < k < len(branch) - 1)
    inside = (_inside(branch, share) for share in INSIDE)
    ways = along, inside, _starts(branch), _at_inner_values(branch)
    # most points of a period that grows without bound are at one value, where each would be compared with all
    orbits = chain(*(ways[::-1] if _grows(branch) else ways))
    return any(on_branch(orbit, known) for orbit in orbits if orbit.converged)


def _at_inner_values(branch: Branch) -> Iterator[Orbit]:
    """Yield orbits of a branch, solved at values of its parameter in the middle of its range.

    Where most of its length is at nearly one value, its points are not determined by that.
    """
    low, width = float(branch.values.min()), float(np.ptp(branch.values))
    active = branch.model.index_of(branch.parameter)
    for value in (low + share * width for share in INSIDE):
        vector = with_entries(branch.vector, active, value)
        yield from (refine(guess, damped=False) for _, guess in guesses(branch, vector, value))


def _as_narrow(known: Branch, branch: Branch, diagram: Diagram) -> bool:
    """Tell whether two branches of one itinerary have the same two ends, and no width that is known.

    On these no value of the parameter is known to be a value of both; nor are orbits solved on short ones.
    """
    width = diagram.width
    if known.mirrored or not all(unresolved(b, width) or is_short(b) for b in (branch, known)):
        return False
    if known.system.half != branch.system.half or identity_of(known) != identity_of(branch):
        return False
    ends, others = (
        [end.bifurcation for end in b.ends if end.bifurcation is not None] for b in (branch, known)
    )
    return any(
        all(
            _same_bifurcation(a, b, diagram.parameter, width)
            for a, b in zip(ends, way, strict=True)
        )
        for way in (others, others[::-1])
    )
