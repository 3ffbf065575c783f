"""Exploration: from one orbit through every event and branch point, each branch once.

A queue of starts feeds the continuation; each bifurcation that a new branch meets is matched with
those already known, and a new one puts what leaves it into the queue:

* CS: every combination of swapped stops, proposed by the transition graph;
* BP: the asymmetric branch from a symmetric one, or the symmetric branch from an asymmetric one;
* PD: the branch of twice the period, or the one of half the period from it.

A proposal is accepted when it is solved, and admissible beyond the event in one direction.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from contfric.atlas.collect import Event, collect
from contfric.atlas.diagram import Diagram
from contfric.atlas.matching import identity, on_branch, same_event, stops_distance
from contfric.continuation.branch import Branch
from contfric.continuation.events import Bifurcation, End, EndReason, Kind
from contfric.continuation.points import MOST_POINTS, Settings, settings_of
from contfric.continuation.side import Side, first_point
from contfric.continuation.switching import (
    NEARER,
    leave_branch_point,
    settings_value,
    swapped_orbits,
)
from contfric.continuation.trace import assemble, continue_orbit, trace_side
from contfric.errors import ConvergenceError, whole_number
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import polish

Progress = Callable[[str], None]

#: Kinds that leave nothing to follow: the branch itself goes on.
_PASSED = frozenset({Kind.SN, Kind.T, Kind.NS})
#: First step away from an event, in largest steps: the new word is proved close to it.
_NEAR_EVENT = 0.01
#: A branch that gets no farther than this (arclength) from the event it starts at has left it in the
#: direction in which it is not admissible.
_NOWHERE = 1e-7


@dataclass(eq=False)
class _Exploration:
    """State of one exploration."""

    settings: Settings
    max_periods: int
    max_branches: int
    max_points: int
    progress: Progress | None
    branches: list[Branch] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    waiting: deque[Event] = field(default_factory=deque)
    notes: list[str] = field(default_factory=list)
    complete: bool = True

    def say(self, text: str) -> None:
        if self.progress is not None:
            self.progress(text)

    def add(self, branch: Branch) -> None:
        """Register a branch and the events that it meets."""
        index = len(self.branches)
        self.branches.append(branch)
        self.say(f"branch {index + 1}: {branch.name}, {len(branch)} points")
        if any(end.reason is EndReason.INTERRUPTED for end in branch.ends):
            raise KeyboardInterrupt
        for bifurcation in branch.bifurcations:
            self._meet(bifurcation, index)

    def _meet(self, bifurcation: Bifurcation, index: int) -> None:
        settings = self.settings
        for event in self.events:
            if same_event(event.bifurcation, bifurcation, settings.parameter, settings.width):
                if index not in event.branches:
                    event.branches.append(index)
                return
        event = Event(bifurcation, [index])
        self.events.append(event)
        if not bifurcation.located:
            at = _where(bifurcation, settings.parameter)
            self.notes.append(f"{at}: not located (Newton fails behind this point); not followed")
        elif bifurcation.kind not in _PASSED:
            self.waiting.append(event)

    def known(self, orbit: Orbit) -> bool:
        """Tell whether an orbit lies on a branch already traced."""
        return any(on_branch(orbit, branch) for branch in self.branches)

    def ends_here(self, orbit: Orbit, event: Event) -> bool:
        """Tell whether a branch of the orbit's word already ends at an event."""
        wanted = identity(orbit)
        mirror = orbit.model.symmetry is not None
        for branch in self.branches:
            if branch.system.periods != orbit.periods or branch.system.half != orbit.system.half:
                continue
            if identity(branch[0]) != wanted:
                continue
            for end in branch.ends:
                b = end.bifurcation
                if b is not None and (
                    same_event(b, event.bifurcation, self.settings.parameter, self.settings.width)
                ):
                    return True
            for tip in (branch[0], branch[-1]):
                gap = abs(tip.params[branch.parameter] - orbit.params[branch.parameter])
                near = stops_distance(tip.stops, orbit.stops, mirror) < 1e-6
                if gap < 1e-8 * self.settings.width and near:
                    return True
        return False

    def run(self) -> None:
        """Follow every event that waits."""
        while self.waiting:
            if len(self.branches) >= self.max_branches:
                self.notes.append(f"stopped at max_branches = {self.max_branches}")
                self.complete = False
                return
            event = self.waiting.popleft()
            kind = event.bifurcation.kind
            if kind is Kind.CS:
                self._follow_crossing(event)
            elif kind is Kind.BP:
                self._follow_branch_point(event)
            elif kind is Kind.PD:
                self._follow_doubling(event)

    # ---------------------------------------------------------------- crossing-sliding

    def _follow_crossing(self, event: Event) -> None:
        for orbit, reason in swapped_orbits(event.bifurcation):
            if self.ends_here(orbit, event):
                continue
            branch = self._leave_event(orbit, event)
            at = _where(event.bifurcation, self.settings.parameter)
            if branch is None:
                self.notes.append(f"{at}: refused: {reason} (no admissible direction)")
                continue
            self.notes.append(f"{at}: accepted: {reason}: {branch.name}")
            self._add_from(branch, event)

    def _leave_event(self, orbit: Orbit, event: Event) -> Branch | None:
        """Trace away from an event, in the direction in which the orbit is admissible."""
        settings = self.settings
        start = first_point(orbit, settings)
        if start is None:
            return None
        orbit = start.orbit(orbit.system, orbit.vector, orbit.model.index_of(settings.parameter))
        for point in (start, start.reversed()):
            side = trace_side(
                orbit, point, settings, first_step=_NEAR_EVENT, progress=self.progress
            )
            if _went_somewhere(side):
                b = event.bifurcation
                first = _first_end(EndReason.CS, b, side, settings)
                return assemble(orbit, settings, side, first)
        return None

    def _add_from(self, branch: Branch, event: Event) -> None:
        index = len(self.branches)
        self.add(branch)
        if index not in event.branches:
            event.branches.append(index)

    # ---------------------------------------------------------------- branch points

    def _follow_branch_point(self, event: Event) -> None:
        bifurcation = event.bifurcation
        orbit = bifurcation.orbit
        if not orbit.system.half:
            self._follow_both_ways(orbit, event)
            return
        if not any(self.branches[i].system.half for i in event.branches):
            self._follow_both_ways(orbit, event)
        whole = orbit.as_whole()
        if any(not self.branches[i].system.half for i in event.branches):
            return
        self._follow_departure(whole, event, EndReason.BP)

    def _follow_both_ways(self, orbit: Orbit, event: Event) -> None:
        """Continue a branch through an event that it passes, from just beside it."""
        branch = _through(orbit, self.settings, self.max_points)
        if branch is None:
            self.notes.append(
                f"{_where(event.bifurcation, self.settings.parameter)}: the branch through it could "
                "not be started"
            )
            return
        if not self.known(branch[len(branch) // 2]):
            self._add_from(branch, event)

    def _follow_departure(self, orbit: Orbit, event: Event, reason: EndReason) -> None:
        """Trace the branch that leaves a branch point or a period doubling."""
        at = _where(event.bifurcation, self.settings.parameter)
        active = orbit.model.index_of(self.settings.parameter)
        for distance in NEARER:
            departure = leave_branch_point(orbit, self.settings, reason.value, distance)
            if departure is None:
                continue
            if self.known(departure.point.orbit(orbit.system, orbit.vector, active)):
                return
            side = trace_side(orbit, departure.point, self.settings, progress=self.progress)
            if _went_somewhere(side):
                first = _first_end(reason, event.bifurcation, side, self.settings)
                branch = assemble(orbit, self.settings, side, first, departure.origin)
                self._add_from(branch, event)
                return
        self.notes.append(f"{at}: the branch that leaves is not admissible")

    # ---------------------------------------------------------------- period doubling

    def _follow_doubling(self, event: Event) -> None:
        orbit = event.bifurcation.orbit
        at = _where(event.bifurcation, self.settings.parameter)
        if not any(self.branches[i].system.periods == orbit.periods for i in event.branches):
            self._follow_both_ways(orbit, event)
        if any(self.branches[i].system.periods == 2 * orbit.periods for i in event.branches):
            return
        if 2 * orbit.periods > self.max_periods:
            self.notes.append(
                f"{at}: the branch of {2 * orbit.periods} periods is not followed "
                f"(max_periods = {self.max_periods})"
            )
            return
        self._follow_departure(orbit.doubled(), event, EndReason.PD)


def explore(
    orbit: Orbit,
    parameter: str,
    range: tuple[float, float],
    *,
    max_step: float | None = None,
    stability: bool = True,
    max_periods: int = 4,
    max_branches: int = 200,
    max_points: int = MOST_POINTS,
    progress: Progress | None = None,
) -> Diagram:
    """Continue an orbit through every event and branch point that can be followed.

    Parameters
    ----------
    parameter, range, max_step, stability, max_points
        As for :func:`contfric.continue_orbit`.
    max_periods : int
        Longest orbit, in periods of the excitation, that a period doubling is followed to.
    max_branches : int
        Most branches to compute; reached, it is said in the diagram's notes.

    Returns
    -------
    Diagram
        On Ctrl-C what was found so far, with ``complete`` False.

    Raises
    ------
    ParameterError
        If the parameter, the range or the step is not valid.
    ConvergenceError
        If the orbit is not solved.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> sorted({b.name for b in cf.explore(orbit, "Omega", (0.48, 0.55)).branches})
    ['0s', '1a', '2a', '2s']
    """
    settings = settings_of(orbit, parameter, range, max_step, stability, max_points)
    if not orbit.converged:
        raise ConvergenceError(f"the orbit is not solved: {orbit.status.value}", orbit)
    whole_number("max_periods", max_periods, least=1)
    whole_number("max_branches", max_branches, least=1)
    state = _Exploration(settings, max_periods, max_branches, max_points, progress)
    try:
        state.add(
            continue_orbit(
                orbit,
                parameter,
                range,
                max_step=max_step,
                stability=stability,
                max_points=max_points,
                progress=progress,
            )
        )
        state.run()
    except KeyboardInterrupt:
        state.complete = False
        state.notes.append(EndReason.INTERRUPTED.value)
    return collect(
        orbit.model,
        settings,
        (float(range[0]), float(range[1])),
        state.branches,
        state.events,
        tuple(state.notes),
        state.complete,
    )


def _where(bifurcation: Bifurcation, parameter: str) -> str:
    return f"{bifurcation.label} at {parameter} = {bifurcation.params[parameter]:.10g}"


def _first_end(reason: EndReason, b: Bifurcation, side: Side, settings: Settings) -> End:
    """Return the end of a branch at the event that it starts from."""
    stable = None
    if settings.stability:
        stable = bool(np.all(np.abs(side.second_multipliers) < 1.0))
    here = replace(b, position=0.0, stable_before=None, stable_after=stable)
    return End(reason, f"{EndReason.START.value}: {_where(b, settings.parameter)}", here)


def _went_somewhere(side: Side) -> bool:
    return side.length > _NOWHERE


def _through(orbit: Orbit, settings: Settings, max_points: int) -> Branch | None:
    """Return the branch through an orbit at which it may be singular, from just beside it."""
    value = settings_value(orbit, settings)
    active = orbit.model.index_of(settings.parameter)
    for share in (1e-4, -1e-4, 1e-3, -1e-3):
        beside = value + share * settings.width
        if not settings.low <= beside <= settings.high:
            continue
        vector = orbit.vector.copy()
        vector[active] = beside
        solved = polish(Orbit(orbit.system, orbit.joints, vector, np.inf))
        if solved.converged and solved.admissible:
            return continue_orbit(
                solved,
                settings.parameter,
                (settings.low, settings.high),
                max_step=settings.largest,
                stability=settings.stability,
                max_points=max_points,
            )
    return None
