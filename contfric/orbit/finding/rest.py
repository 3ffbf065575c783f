"""Solutions that come to rest, or creep until they do: in a mode, or where surfaces meet.

A contact may slip to one side only, a little less in each period, until it sticks. Such a motion is not
periodic, however near its returns are: its creep ``c`` a period falls with the distance ``e`` that is left.
A massless slider slips by the excess of its stretch, ``c = k e``. A mass that sticks lets go where the
excess of its load, at most like e, lasts for a time like the root of e: it gets a velocity like
``e**(3/2)``, and ``c = k e**2``. For any ``c = k e**p`` with a small c/e the ratio r of two creeps is
``1 - p c/e``, so that ``q = c/(1 - r) = e/p``; and q falls by c/p from one creep to the next, which gives p
(for p = 1 both hold for any r). What the motion comes to is an orbit of the itinerary without these slides,
at a position by e farther on: one of a continuum (:mod:`contfric.bvp.conserved`).
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.conserved import conserved
from contfric.errors import ConvergenceError
from contfric.models.definition import Model
from contfric.orbit.itinerary.one_way import only_grows
from contfric.orbit.orbit import Orbit
from contfric.simulation.simulate import Trajectory

#: A motion of which all events of a period are at one state, to rounding, is at rest if it does not move
#: within a time either.
_RESTS, _SHORT = 1e-13, 1e-1
#: Turns smaller than this (relative to 1 + the states) do not count: the solution has come to rest.
_NO_SIZE = 1e-6
#: Turns about a point: the last half of all events lie this near to each other (relative to 1 + the states),
#: and the last quarter nearer than the one before it (by 2/3, where turns shrink like 1/n).
_WOUND, _SHRINKS = 1e-3, 0.8
#: Time between events of the last quarter over that between those of the first thousandth, and of the second
#: hundredth: less than 1/100, and 1/60, by the law 1/n, times what drives them back.
_FASTER, _STILL_FASTER = 1e-2, 1e-1
#: Periods in which the number of events doubles.
_FEW = 4
#: Powers of the law of a creep, and how well two estimates of it agree where it holds.
_LEAST, _MOST, _AGREE = 0.9, 2.1, 0.1
#: Farther by this, so that the contact sticks although the distance is an estimate.
_BEYOND = 1.01


def check_rest(trajectory: Trajectory) -> None:
    """Refuse a solution that has come to rest in a mode in which something could move.

    Its rates are rounding then, and so are the events that it meets: all of a period are at one state.
    """
    model, (cycle, time, state, mode) = trajectory.model, trajectory.last
    lately = trajectory.states[trajectory.cycles >= cycle - 1]
    if not mode or not len(lately) or not np.all(np.isfinite(state)):
        return
    vector = model.vector(trajectory.params)
    ahead = model.view(vector).state(mode, time, state, _SHORT)
    apart = np.max(np.abs(np.vstack([lately, ahead[None]]) - state))
    if apart < _RESTS * (1.0 + np.max(np.abs(state))):
        raise ConvergenceError(_stays_at(trajectory), trajectory)


def _stays_at(trajectory: Trajectory) -> str:
    return (
        f"no periodic orbit: the solution comes to rest at {_place(trajectory.model, trajectory.last[2])}, "
        "and nothing moves it from there. Choose other parameters or another start (state=...)"
    )


def is_point(orbit: Orbit) -> bool:
    """Tell whether an orbit has no size: a solution that turns about the place where its surfaces meet."""
    states = np.concatenate([orbit.begins[:, 1:], orbit.ends[:, 1:]])
    return bool(np.max(np.ptp(states, axis=0)) < _NO_SIZE * (1.0 + np.max(np.abs(states))))


def winds(trajectory: Trajectory) -> bool:
    """Tell whether a solution with excitation winds into a point, in turns that shrink like 1/n.

    They take times like 1/n, too: within a time t the solution meets exp(t) events, and no period ends.
    """
    half, last = len(trajectory) // 2, 3 * len(trajectory) // 4
    before, lately = (
        np.max(np.ptp(part, axis=0))
        for part in (trajectory.states[half:last], trajectory.states[last:])
    )
    near = before < _WOUND * (1.0 + np.max(np.abs(trajectory.states[-1])))
    within = trajectory.cycles[-1] - trajectory.cycles[half] <= 1
    return bool(near and within and lately < _SHRINKS * before)


def quickens(trajectory: Trajectory, period: float) -> bool:
    """Tell whether events follow each other faster and faster without an end, within few periods.

    Turns about a place that moves take times like 1/n, as those of :func:`winds`, by a factor that changes
    with what drives them back. So the last half of all events is within few periods, and they come 60 times
    faster than at a hundredth of their number. Switches whose hysteresis falls slowly come faster, too, but
    not by so much, or not for so long.
    """
    n, begin = len(trajectory), trajectory.begin[0]
    times = np.concatenate([[begin], trajectory.cycles * period + trajectory.times])
    first, early, now = (
        float(times[stop] - times[start]) / (stop - start)
        for start, stop in ((0, n // 1000), (n // 100, n // 50), (3 * n // 4, n))
    )
    within = period <= 0.0 or times[-1] - times[n // 2] < _FEW * period
    return bool(within and now < _FASTER * first and now < _STILL_FASTER * early)


def without_an_end(trajectory: Trajectory) -> str:
    """Return what is said of a solution that switches, or strikes, without an end at a place that moves."""
    from contfric.models.deriving.phases import KEY  # which takes sympy

    lately = {surface for _, surface in trajectory.itinerary_from(-len(trajectory) // 4)}
    met = sorted(lately - {KEY})
    where = " and ".join(f"'{name}'" for name in met)
    near = _place(trajectory.model, trajectory.states[-1])
    if any(reset.surface in met for reset in trajectory.model.resets):
        return (
            f"no periodic orbit: resets at {where} follow each other faster and faster without an end, near "
            f"{near}: like 1/n, as impacts whose restitution comes to 1 at low speeds. Bound it below 1, and "
            "they come to rest"
        )
    return (
        f"no periodic orbit: the solution switches at {where} faster and faster without an end, near {near}: "
        "its rate comes to 0 with it, and no mode slides there. Leave out what delays the switch (the lag of "
        "an actuator), so that 'sliding: filippov' has its place, or switch with hysteresis"
    )


def comes_to_rest(trajectory: Trajectory) -> str:
    """Return what is said of a solution that turns about the place where its surfaces meet."""
    where = _place(trajectory.model, trajectory.states[-1])
    return (
        f"no periodic orbit: the solution comes to rest near {where}, where surfaces meet: it crosses them "
        "in smaller and smaller turns. Choose other parameters or another start (state=...)"
    )


def _place(model: Model, state: FloatArray) -> str:
    return ", ".join(f"{s} = {v:.4g}" for s, v in zip(model.states, state, strict=True))


def creeps(trajectory: Trajectory, lag: int) -> bool:
    """Tell whether the last events are those of an itinerary in which something only grows."""
    return bool(only_grows(trajectory.model, trajectory.itinerary_from(-lag)))


def beyond_creep(trajectory: Trajectory, lag: int) -> tuple[float, FloatArray] | None:
    """Return time and state after the end of a creep; None while it does not follow its law.

    Parameters
    ----------
    lag : events after which the solution nearly returns
    """
    model, itinerary = trajectory.model, trajectory.itinerary_from(-lag)
    modes = only_grows(model, itinerary)
    if len(trajectory) < 4 * lag + 1 or not modes:
        return None
    joint = next(k for k in range(1, lag + 1) if itinerary[-k][0] not in modes) + 1
    still = conserved(model, tuple(pair for pair in itinerary if pair[0] not in modes))
    at = [trajectory.states[-1 - k * lag] for k in range(5)]
    steps = [still.T @ (still @ (at[k] - at[k + 1])) for k in range(4)]
    left = _left([float(np.linalg.norm(step)) for step in steps])
    if left is None or any(steps[0] @ step <= 0.0 for step in steps):
        return None
    state = trajectory.states[-joint] + _BEYOND * left * steps[0] / np.linalg.norm(steps[0])
    return float(trajectory.times[-joint]), np.asarray(state)


def _left(creep: list[float]) -> float | None:
    """Return how far a motion still creeps by its last four creeps, the last one first; None without a law.

    Examples
    --------
    >>> round(_left([1.0, 2.0, 4.0, 8.0]), 12)  # 1/2 + 1/4 + ...
    1.0
    """
    if not all(now < before for now, before in pairwise(creep)):
        return None
    q = [now / (1.0 - now / before) for now, before in pairwise(creep)]
    powers = [creep[k + 1] / (q[k + 1] - q[k]) if q[k + 1] > q[k] else np.inf for k in range(2)]
    p = powers[0]
    if not (_LEAST < p < _MOST and abs(powers[1] - p) < _AGREE * p):
        return None
    return p * q[0] - creep[0]
