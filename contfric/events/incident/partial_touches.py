r"""Orbits that cross a surface in some of their periods only, where a solution touches it.

At a switch of the force, or a preloaded stop, nothing rests and nothing is reset: beyond the event motion
crosses the surface and comes back. The solution at the event with a passage of no length at each of its
touches, over m periods, has those forms in which any of these are left out, if not all: without any it may
have no joint (it is smooth then, and is found by a simulation).

In which direction they leave the event is known to first order. Let a solution of period P touch the
surface at a time t and stay in one mode otherwise. Disturbed, its height is largest at ``t + r``; a passage
begins at ``t + r - w`` and lasts ``2 w c/c'`` (c, c' the curvatures of the height before and beyond). It
changes the state by ``J w``, where ``J = 2 c/c' (F' - F)`` is a jump of the rates, and so by more than what
the surface is passed by, which is of the order of w^2. Over m periods, with disturbances ``d_j`` of the
state at the touches and s of the parameter,

    d_(j+1) = M (d_j + J w_j) + b s,        g d_j + h s = 0 at each passage,

with the gradient g of the height, its derivative h by the parameter, and the map M of a period with its
derivative b. Up to a factor this has one solution. Orbits leave along it where all w are positive, and the
height is on its own side at all other touches.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.system import EventFunction, Margin, build_system
from contfric.errors import NotationError
from contfric.events.bifurcation import Bifurcation
from contfric.events.incident.candidates import Candidate, along_motion
from contfric.events.incident.incident import edited_whole, vanishing
from contfric.events.local.touching import (
    coming_back,
    crossed_at,
    is_crossed,
    second_rate,
    speeds_of_crossing,
)
from contfric.events.local.zero_acceleration import touch_of
from contfric.events.outcomes.outcomes import Successor, outcome_at
from contfric.orbit.canonical.sections import canonical, is_smooth
from contfric.orbit.canonical.slides import SHORT, time_unit
from contfric.orbit.clock import clocked
from contfric.orbit.orbit import Orbit, Status
from contfric.signature.edits import Edit

#: Most touches over all periods of an orbit of which any are left out: 2^8 combinations, up to rotation.
_MOST_TOUCHES = 8
#: Margins below count as zero, as at any event that is well located.
_LEAST = 1e-6
#: Joints this near to the end of a period (as a share of it) are those of the next one.
_NEXT = 1e-6
#: Relative step of the differences for derivatives by the parameter: for a guess half of the digits will do.
_STEP = 1e-6
#: Singular values below this, relative to the largest, are zero; then more than one direction is possible.
_ZERO = 1e-9


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
        before, following = whole.itinerary[k - 1], whole.itinerary[(k + 1) % n]
        same = model.whole_mode(before[0]) == model.whole_mode(following[0])
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


class Leaving(NamedTuple):
    """How joints and the parameter move; else ``why`` no such orbit exists."""

    joints: FloatArray
    share: float
    why: str = ""


def leaving(unit: Orbit, kept: Sequence[int], active: int) -> Leaving | None:
    """Return the direction in which orbits leave with passages at some touches; None if it is not known.

    Parameters
    ----------
    unit : the solution at the event over a period: a passage of no length, and one other segment
    kept : for each period, whether its touch is a passage
    active : index of the parameter
    """
    (beyond, surface), (mode, _) = unit.itinerary
    model, view, n, m = unit.model, unit.flow, len(unit.model.states), len(kept)
    time, state, period = float(unit.begins[1, 0]), unit.begins[1, 1:], unit.period
    ahead, back = _moved(unit, active, 1.0), _moved(unit, active, -1.0)
    apart = float(ahead[active] - back[active])
    views = model.view(ahead), model.view(back)
    longer = (views[0].period - views[1].period) / apart * unit.periods
    observable = model.surface_by_name[surface].observable
    high = _difference([v.height(surface, time, state) for v in views]) / apart
    fast = _difference([v.rate(mode, observable, time, state) for v in views]) / apart
    gradient = view.gradient(observable, time, state)[1:]
    speed = view.rate_gradient(mode, observable, time, state, 0)[1 : 1 + n]
    flow = view.jacobian(mode, time, state, period, active)
    turn, by_parameter = flow[:, 1 : 1 + n], flow[:, -1] + flow[:, 1 + n] * longer
    own, other = (view.jacobian(name, time, state, 0.0)[:, 1 + n] for name in (mode, beyond))
    bends = second_rate(unit, mode, surface, time, state)
    lasts = 2.0 * bends / second_rate(unit, beyond, surface, time, state)
    jump = lasts * (other - own)
    rows = np.zeros((m * n + sum(kept), m * n + 1 + m))  # unknown: all d, s, all w
    for j in range(m):
        here, there = slice(j * n, (j + 1) * n), slice((j + 1) % m * n, ((j + 1) % m + 1) * n)
        rows[here, here] += turn
        rows[here, there] -= np.eye(n)
        rows[here, m * n] = by_parameter
        rows[here, m * n + 1 + j] = turn @ jump
    passages = [j for j in range(m) if kept[j]]
    for row, j in enumerate(passages, start=m * n):
        rows[row, j * n : (j + 1) * n], rows[row, m * n] = gradient, high
    columns = [*range(m * n + 1), *(m * n + 1 + j for j in passages)]
    _, sizes, right = np.linalg.svd(rows[:, columns])
    if sizes[-1] < _ZERO * sizes[0]:
        return None
    found = right[-1] * np.sign(np.sum(right[-1, m * n + 1 :]))
    moves, share, widths = found[: m * n].reshape(m, n), float(found[m * n]), found[m * n + 1 :]
    inside = -np.sign(
        second_rate(unit, mode, surface, time, state)
    )  # a touch from below is a maximum
    heights = [inside * (gradient @ moves[j] + high * share) for j in range(m) if not kept[j]]
    if np.any(widths <= 0.0) or any(height > 0.0 for height in heights):
        return Leaving(np.empty(0), 0.0, "to first order it crosses no or another touch")
    joints = []
    for j, w in zip(passages, widths.tolist(), strict=True):
        begins = -float(speed @ moves[j] + fast * share) / bends - w
        met = moves[j] + begins * own
        joints += [[begins, *met], [begins + w * lasts, *(met + w * lasts * other)]]
    return Leaving(np.array(joints), share)


def _difference(values: Sequence[float]) -> float:
    return values[0] - values[1]


def _moved(unit: Orbit, active: int, sign: float) -> FloatArray:
    vector = unit.vector.copy()
    vector[active] += sign * _STEP * unit.model.size_of(active, float(vector[active]))
    return vector
