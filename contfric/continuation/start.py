"""The first point of a branch: not at an event, and with a unique tangent."""

from __future__ import annotations

import numpy as np

from contfric.bvp.linear import null_space
from contfric.continuation.families.continuum import LEVEL, in_continuum
from contfric.continuation.half_branch import first_point
from contfric.continuation.points import EXTRA, Point, Settings, next_to
from contfric.continuation.singular_points.vertices import symmetrised
from contfric.errors import ConvergenceError
from contfric.orbit.canonical.sections import canonical
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine
from contfric.signature.holds import is_hold

#: Tests of the events that have a multiplier 1 or -1, the first ones.
_LINEAR = 3
#: Farthest (joints) that a start lies from its mirror image to be asked whether rounding tells them apart.
_NEARLY_SYMMETRIC = 1e-6
#: Rounding of the equations of an orbit: some fifty units of its states.
_ROUNDING = 1e-14
#: Share of its level by which rounding leaves the end of a segment open, above which Newton's method fails.
_UNKNOWN = 1e-4
#: What a solved orbit may still be moved by (relative): the root of rounding, next to a fold, and some more.
_MOVED = 1e-6
#: Where a start is looked for that is at no event, relative to the range: in the first steps from it.
_BESIDE_START = (1.3e-3, -1.3e-3)


def start_of(orbit: Orbit, settings: Settings) -> tuple[Orbit, Point]:
    """Return the orbit that a branch is traced from, and its point; near an event where it is at one.

    Raises
    ------
    ConvergenceError
        If the orbit has no unique continuation.
    """
    orbit = _as_symmetric(canonical(orbit).as_half())
    start = first_point(orbit, settings)
    moved = start is None or _is_elsewhere(start, orbit)
    if moved:
        start = _along_null(orbit, settings) or start
    at_event = start is not None and (moved or _is_at_event(start, settings))
    if start is None or (
        at_event and in_continuum(orbit, orbit.model.index_of(settings.parameter))
    ):
        why = _why(orbit, settings)
        raise ConvergenceError(f"the orbit has no unique continuation: {why}", orbit)
    return _off_events(orbit, start, settings)


def _along_null(orbit: Orbit, settings: Settings) -> Point | None:
    """Return the point where the parameter tells no orbits apart: at a fold, in a continuum at one value."""
    active = orbit.model.index_of(settings.parameter)
    vectors, slopes = null_space(orbit.system, orbit.joints, orbit.vector, active)
    return first_point(orbit, settings, vectors[0], slopes[0]) if len(vectors) == 1 else None


def _is_elsewhere(start: Point, orbit: Orbit) -> bool:
    """Tell whether Newton's method has moved a solved orbit: it may where a multiplier is 1 (a centre)."""
    largest = 1.0 + float(np.abs(orbit.joints).max())
    return float(np.abs(start.joints - orbit.joints).max()) > _MOVED * largest


def _as_symmetric(orbit: Orbit) -> Orbit:
    """Return the symmetric orbit, on its half, where rounding does not tell an orbit from it.

    With a multiplier mu near 1 an orbit is known to rounding over 1 - mu along the null vector of 1 - M.
    Traced on its whole period it would be a branch twice, once as its own mirror image.
    """
    part = symmetrised(orbit, _NEARLY_SYMMETRIC)
    if part is None or orbit.system.holds:
        return orbit
    solved = refine(part)
    away = np.abs(orbit.turn_multipliers - 1.0).min(initial=1.0)
    gap = np.abs(solved.cycle - orbit.joints).max() if solved.converged else np.inf
    return solved if gap * away < _ROUNDING else orbit


def _why(orbit: Orbit, settings: Settings) -> str:
    """Return why an orbit has no unique continuation, and what to do."""
    if in_continuum(orbit, orbit.model.index_of(settings.parameter)):
        one_of = f"it is one of a continuum of orbits, at each {settings.parameter} near it, too"
        if orbit.model.autonomous:
            return f"{one_of}, as around a centre: continue in what damps or drives them"
        return (
            f"{one_of}. Continue the symmetric one of them, or vary what makes them a continuum (the "
            "damping, the frequency)"
        )
    return too_fast(orbit) or (
        "the equations are singular there (a bifurcation). Move the parameter a little and solve again"
    )


def too_fast(orbit: Orbit) -> str:
    """Return which segment ends so fast that rounding of its duration decides where; nothing if none does.

    By eps T |h'| the observable h of its end is unknown, for a duration T: a neuron that blows up,
    V' = exp(V), and is cut far up.
    """
    model, view = orbit.model, orbit.model.view(orbit.vector)
    for (mode, surface), begin, end in zip(orbit.itinerary, orbit.begins, orbit.ends, strict=True):
        if is_hold(surface):
            continue  # it ends when its time is over
        rate = abs(view.rate(mode, model.surface_by_name[surface].observable, end[0], end[1:]))
        lost = rate * np.finfo(float).eps * abs(end[0] - begin[0])
        if lost > _UNKNOWN * (1.0 + abs(view.level(surface))):
            return (
                f"'{mode}' comes to '{surface}' at a rate of {rate:.1g}: rounding of the time is {lost:.1g} "
                "of its observable. Move the surface to where the solution is slower: a neuron that "
                "blows up is at any height at nearly the same time"
            )
    return ""


def _off_events(orbit: Orbit, start: Point, settings: Settings) -> tuple[Orbit, Point]:
    """Return a start at which no smooth event happens: the same, or one near it.

    An event is seen where a test changes sign, and at the event itself its sign is rounding. Where it is
    rounding near the start, too, orbits are continua, and the start is as good as any.
    """
    if not _is_at_event(start, settings):
        return orbit, start
    guesses = (next_to(orbit, settings, share) for share in _BESIDE_START)
    for near in (refine(guess) for guess in guesses if guess is not None):
        point = first_point(near, settings) if near.converged and near.admissible else None
        if point is not None and not _is_at_event(point, settings):
            return near, point
    return orbit, start


def _is_at_event(point: Point, settings: Settings) -> bool:
    """Tell whether the slope, chi(1) or chi(-1) is zero to rounding.

    (The product of a pair of multipliers is 1 wherever nothing is dissipated between events.)
    """
    tests = point.tests[len(point.tests) - EXTRA :][: _LINEAR if settings.stability else 1]
    return bool(np.any(np.abs(tests[np.isfinite(tests)]) < LEVEL))
