"""Orbits that cross a surface in some of their periods only, where a solution touches it.

At a switch of the force, or a preloaded stop, nothing rests and nothing is reset: beyond the event motion
crosses the surface and comes back. The solution at the event with a passage of no length at each of its
touches, over m periods, has those forms in which any of these are left out, if not all: without any it may
have no joint (it is smooth then, and is found by a simulation).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np

from contfric.continuation.candidates import Candidate, along_motion
from contfric.continuation.events import Bifurcation
from contfric.continuation.incident import edited_whole, vanishing
from contfric.continuation.leaving_touch import Leaving, leaving
from contfric.continuation.outcomes import Successor, outcome_at
from contfric.continuation.touching import coming_back, crossed_at, is_crossed, speeds_of_crossing
from contfric.continuation.zero_acceleration import touch_of
from contfric.errors import NotationError
from contfric.models.definition import FloatArray
from contfric.orbit.clock import clocked
from contfric.orbit.orbit import Orbit, Status
from contfric.orbit.sections import canonical, is_smooth
from contfric.orbit.slides import SHORT, time_unit
from contfric.orbit.system import EventFunction, Margin, build_system
from contfric.signature.edits import Edit

#: Most touches over all periods of an orbit of which any are left out: 2^8 combinations, up to rotation.
_MOST_TOUCHES = 8
#: Margins below count as zero, as at any event that is well located.
_LEAST = 1e-6
#: Joints this near to the end of a period (as a share of it) are those of the next one.
_NEXT = 1e-6


def partial_touches(
    bifurcation: Bifurcation, active: int, most_periods: int, copies: int
) -> Iterator[Candidate]:
    """Yield orbits of one or more periods in which a surface that an orbit touches is crossed.

    Parameters
    ----------
    active : index of the parameter that varies
    most_periods, copies : longest orbits, in periods, and in copies of the solution at the event
    """
    if bifurcation.orbit.model.autonomous or not is_crossed(bifurcation):
        return
    periods = bifurcation.outline.periods
    try:
        unit = _with_all_touches(bifurcation.orbit.as_whole(), periods)
    except NotationError as error:
        yield Candidate("a passage at each touch", None, str(error))
        return
    touches = len(_passages(unit))
    for length in range(1, min(copies, most_periods // periods) + 1):
        if touches * length > _MOST_TOUCHES:
            what = f"some of {touches * length} touches crossed"
            yield Candidate(what, None, f"more than {_MOST_TOUCHES} touches are not looked at")
            return
        orbit = _repeated(unit, length)
        for kept in _choices(touches, length):
            reason = f"{sum(kept)} of {touches * length} touches crossed"
            way = leaving(unit, kept, active) if len(unit.itinerary) == 2 else None
            yield _candidate(orbit, kept, reason, way)


def _choices(touches: int, length: int) -> Iterator[tuple[int, ...]]:
    """Yield which touches are crossed: not none, up to rotation by a period, and nothing that repeats itself.

    Examples
    --------
    >>> list(_choices(1, 2)), list(_choices(1, 1))
    ([(0, 1)], [(1,)])
    """
    for kept in product((0, 1), repeat=touches * length):
        turned = [kept[k * touches :] + kept[: k * touches] for k in range(1, length)]
        if any(kept) and all(kept < other for other in turned):
            yield kept


def _candidate(orbit: Orbit, kept: tuple[int, ...], reason: str, way: Leaving | None) -> Candidate:
    if way is not None and way.why:
        return Candidate(reason, None, way.why)
    n = len(orbit.itinerary)
    away, dropped = np.zeros(n), set()
    for k, stays in zip(_passages(orbit), kept, strict=True):
        if stays:
            away[k], away[(k + 1) % n] = speeds_of_crossing(orbit, k)
        else:
            dropped |= {k, (k + 1) % n}
    try:
        edited, moves = edited_whole(orbit, [Successor(Edit(frozenset(dropped)), {}, reason)], away)
    except NotationError as error:
        return Candidate(reason, None, str(error))
    itineraries = frozenset({edited.itinerary})
    if way is not None:
        return Candidate(reason, edited, "", way.joints, itineraries=itineraries, share=way.share)
    return Candidate(reason, edited, away=along_motion(edited, moves), itineraries=itineraries)


def _passages(whole: Orbit) -> list[int]:
    """Return the segments of no length beyond a surface that is crossed there and back."""
    lasts, n, model = whole.durations, len(whole.itinerary), whole.model
    found = []
    for k, (_, surface) in enumerate(whole.itinerary):
        before, behind = whole.itinerary[k - 1], whole.itinerary[(k + 1) % n]
        same = model.whole_mode(before[0]) == model.whole_mode(behind[0])
        short = lasts[k] < SHORT * time_unit(whole)
        touch = EventFunction(Margin.EXIT, k, surface)
        if same and short and before[1] == surface and crossed_at(whole, touch):
            found.append(k)
    return found


def _with_all_touches(whole: Orbit, periods: int) -> Orbit:
    """Return the solution at an event over its shortest period, with a passage at each touch.

    Raises
    ------
    NotationError
        If there is no such itinerary.
    """
    if is_smooth(whole.model, whole.itinerary):
        whole = _of_smooth(whole)
    passages = _passages(whole)
    if not passages:
        outcomes = [outcome_at(whole, *location) for location in vanishing(whole, _LEAST)]
        if not outcomes:
            raise NotationError("no touch is left at the event")
        whole = canonical(edited_whole(whole, outcomes)[0])
        passages = _passages(whole)
    if not passages:
        raise NotationError("what crosses the surface at the event does not come back")
    first, n = passages[0], len(whole.itinerary)
    order = [(first + j) % n for j in range(n)]
    joints = whole.begins[order].copy()
    joints[:, 0] += whole.period * (np.arange(n) >= n - first)
    length = whole.period * periods / whole.periods
    inside = int(np.sum(joints[:, 0] < joints[0, 0] + length * (1.0 - _NEXT)))
    pairs = [whole.itinerary[k] for k in order[:inside]]
    pairs[-1] = pairs[-1][0], whole.itinerary[first][1]  # it ends where the touch comes again
    return _as_orbit(whole, pairs, joints[:inside], periods)


def _of_smooth(whole: Orbit) -> Orbit:
    """Return a smooth solution with joints where it touches surfaces, twice each, and at no section."""
    model, n = whole.model, len(whole.itinerary)
    found: dict[float, tuple[FloatArray, str, str]] = {}
    for location, _ in vanishing(whole, _LEAST):
        if not crossed_at(whole, location):
            continue
        i, surface = location.segment, location.surface
        at_joint = location.margin is Margin.JOINT
        touch = whole.ends[i] if at_joint else touch_of(whole, i, surface)
        beyond = coming_back(whole, whole.itinerary[i][0], surface, touch)
        if beyond is None:
            raise NotationError(f"what passes {surface} at the event does not come back from there")
        turn = whole.period * np.floor((touch[0] - whole.begins[0, 0]) / whole.period)
        touch = touch - turn * np.eye(1, len(touch))[0]
        found[float(touch[0])] = touch, surface, beyond.mode
    if not found:
        raise NotationError("no touch is left at the event")
    mode = model.whole_mode(whole.itinerary[n - 1][0])
    touches = [found[time] for time in sorted(found)]
    ends = [surface for _, surface, _ in (*touches[1:], touches[0])]
    pairs: list[tuple[str, str]] = []
    for (_, surface, other), end in zip(touches, ends, strict=True):
        pairs += [(other, surface), (mode, end)]
    joints = np.repeat(np.array([touch for touch, *_ in touches]), 2, axis=0)
    return _as_orbit(whole, pairs, joints, whole.periods)


def _repeated(unit: Orbit, length: int) -> Orbit:
    """Return some periods of a whole orbit, one after the other, as one orbit."""
    joints = np.concatenate([unit.cycle] * length)
    joints[:, 0] += np.repeat(np.arange(length) * unit.period, len(unit.cycle))
    return _as_orbit(unit, list(unit.itinerary) * length, joints, unit.periods * length)


def _as_orbit(
    orbit: Orbit, itinerary: list[tuple[str, str]], joints: FloatArray, periods: int
) -> Orbit:
    end = float(joints[0, 0]) + orbit.period * periods / orbit.periods
    try:
        system = build_system(orbit.model, tuple(itinerary), periods)
    except ValueError as error:
        raise NotationError(str(error)) from None
    joints = clocked(orbit.model, joints, end)
    return replace(orbit, system=system, joints=joints, status=Status.CONVERGED)
