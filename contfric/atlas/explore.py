"""Exploration: from one orbit through every event and branch point, each branch once.

A queue of starts feeds the continuation; each bifurcation that a new branch meets is matched with
those already known, and a new one puts what leaves it into the queue (:mod:`contfric.atlas.follow`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from typing import Any

import numpy as np

from contfric.atlas.collect import collect
from contfric.atlas.diagram import Asked, Diagram
from contfric.atlas.exploration import Exploration, Progress
from contfric.atlas.follow import follow
from contfric.atlas.leaving.departures import foresee_departures
from contfric.atlas.leaving.short_branches import begins_at_short
from contfric.atlas.leaving.trace_away import settings_for
from contfric.atlas.shared_rests import shared_rest
from contfric.atlas.starts.one_mode import with_section
from contfric.atlas.starts.seeds import Seeds, attractors
from contfric.base.attributes import altered
from contfric.base.one_thread import one_thread
from contfric.continuation.branch import Branch
from contfric.continuation.points import MOST_POINTS, Settings, settings_of
from contfric.continuation.singular_points.vertices import symmetrised
from contfric.continuation.trace import continue_orbit, follow_orbit
from contfric.errors import ConvergenceError, checked_range, function_of, truth, whole_number
from contfric.events.bifurcation import EndReason
from contfric.orbit.canonical.repetition import shortest
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine
from contfric.remember.advance import in_advance

#: Longest orbits, in periods, that doublings are followed to by default: two doublings.
MOST_PERIODS = 4
#: Largest ``max_periods`` and ``copies`` that are taken: at each sliding event outcomes are combined over so
#: many periods, and a cascade of doublings has ten generations by then.
LONGEST = 1024


def explore(
    orbit: Orbit,
    parameter: str,
    range: tuple[float, float],
    *,
    max_step: float | None = None,
    stability: bool = True,
    bridges: bool = True,
    max_periods: int | None = None,
    copies: int | None = None,
    max_branches: int = 200,
    max_points: int = MOST_POINTS,
    stop_at: Mapping[Any, float] | None = None,
    seeds: Seeds | None = None,
    progress: Progress | None = None,
) -> Diagram:
    """Continue an orbit through every event and branch point that can be followed.

    Parameters
    ----------
    parameter, range, max_step, stability, max_points, stop_at
        As for :func:`contfric.continue_orbit`.
    bridges : bool
        Whether the jumps of the flow (SS, AS, GS) are bridged by orbits with holds; without them
        branches end there.
    max_periods : int, optional
        Longest orbits, in periods of the excitation (at most 1024): the diagram is the connected component,
        through events, of all orbits whose shortest period is at most this. A start of longer period raises
        it, and ``diagram.notes`` says so. By default period doublings are followed to 4 periods, with one
        copy.
    copies : int, optional
        At a sliding event orbits of so many times the shortest period of the motion are tried: it has several
        outcomes, and each period may have its own. ``max_periods`` if that is given, else 1; a branch that
        arrives with more raises it. Between the ends of a bridge there may be many such orbits
        (period adding).
    max_branches : int
        Largest number of branches; if it is reached, the diagram's notes say so.
    seeds : Seeds, optional
        Simulations whose attractors start new branches where they lie on none that is known.

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
    ['0s', '1a', '1a, 7seg, 1hold', '2a', '2s']
    """
    settings = settings_of(orbit, parameter, range, max_step, stability, max_points, stop_at)
    if not orbit.converged:
        raise ConvergenceError(f"the orbit is not solved: {orbit.status.value}", orbit)
    if copies is not None:
        whole_number("copies", copies, least=1, most=LONGEST)
    if max_periods is not None:
        whole_number("max_periods", max_periods, least=1, most=LONGEST)
    whole_number("max_branches", max_branches, least=1)
    function_of("progress", progress)
    bridges, seeds = truth("bridges", bridges), Seeds.given(seeds)
    orbit = shortest(orbit)
    again = copies or (max(max_periods, orbit.periods) if max_periods else 1)
    most = max(max_periods or MOST_PERIODS, orbit.periods)
    asked = Asked(
        max_step, stability, bridges, most, again, max_branches, max_points, settings.stop_at
    )
    raised = f"max_periods raised to {most}: the start has that many periods"
    notes = [raised] if orbit.periods > (max_periods or MOST_PERIODS) else []
    ends = checked_range(parameter, range)
    found = _explored(orbit, settings, ends, asked, seeds, progress, notes)
    divided = with_section(orbit, found.loose_ends) if found.complete else None
    if divided is None:
        return found
    settings = settings_of(divided, parameter, range, max_step, stability, max_points, stop_at)
    return _explored(divided, settings, ends, asked, seeds, progress, notes)


def _explored(
    orbit: Orbit,
    settings: Settings,
    ends: tuple[float, float],
    asked: Asked,
    seeds: Seeds | None,
    progress: Progress | None,
    notes: Sequence[str],
) -> Diagram:
    """Return the diagram that is reached from an orbit between the ends of a range."""
    # multipliers are asked for also where the start itself is on a bridge
    settings = altered(settings, stability=asked.stability, copies=asked.copies, up_to_mirror=True)
    limits = asked.max_periods, asked.copies, asked.max_branches, asked.bridges
    state = Exploration(settings, *limits, progress)
    state.notes += notes
    with one_thread():
        # tables that grow as modes are visited belong to one thread
        with nullcontext() if orbit.model.composed else in_advance():
            _follow_from(state, orbit, seeds)
        return collect(
            orbit.model,
            settings,
            ends,
            state.branches,
            state.events,
            tuple(state.notes),
            state.complete,
            altered(asked, max_periods=state.max_periods, copies=state.copies),
        )


def _follow_from(state: Exploration, orbit: Orbit, seeds: Seeds | None) -> None:
    """Follow all that is reached from the start and from the attractors, until Ctrl-C."""
    try:
        state.add(_first_branch(state, orbit))
        _follow_all(state)
        if seeds is not None:
            _follow_seeds(state, orbit, seeds)
        for event in tuple(state.events):
            begins_at_short(state, event)
    except KeyboardInterrupt:
        state.complete = False
        state.notes.append(EndReason.INTERRUPTED.value)


def _first_branch(state: Exploration, orbit: Orbit) -> Branch:
    """Return the branch through the start; of a continuum the one through its symmetric orbit."""
    settings = settings_for(orbit, state.settings)
    try:
        return follow_orbit(orbit, settings, state.progress, keep=True)
    except ConvergenceError:
        middle = symmetrised(orbit.as_whole(), np.inf)
        solved = None if middle is None else refine(middle)
        if solved is None or not (solved.converged and solved.admissible):
            raise
    state.notes.append("the start is one of a continuum of orbits: the symmetric one is continued")
    return follow_orbit(solved, settings, state.progress, keep=True)


def _follow_seeds(state: Exploration, orbit: Orbit, seeds: Seeds) -> None:
    """Continue from every attractor that lies on no known branch."""
    settings = state.settings
    bounds = settings.low, settings.high
    found = attractors(
        orbit.model,
        orbit.vector,
        settings.parameter,
        bounds,
        seeds,
        state.max_periods,
        state.progress,
    )
    for attractor in found:
        if state.known(attractor) is not None:
            continue
        try:
            branch = continue_orbit(
                attractor,
                settings.parameter,
                bounds,
                max_step=settings.largest,
                stability=settings.stability,
                max_points=settings.most_points,
                stop_at=dict(settings.stop_at),
            )
        except ConvergenceError as error:  # one orbit of a continuum
            state.notes.append(f"seed at {attractor.params[settings.parameter]:.6g}: {error}")
            continue
        state.add(branch)
        _follow_all(state)
        if not state.complete:
            return


def _follow_all(state: Exploration) -> None:
    """Follow every event that waits."""
    while state.waiting:
        if len(state.branches) >= state.max_branches:
            state.notes.append(f"stopped at max_branches = {state.max_branches}")
            rest = shared_rest(state.branches)
            state.notes += [] if rest is None else [str(rest)]
            state.complete = False
            return
        event = state.waiting.popleft()
        foresee_departures(state, event)
        follow(state, event)
