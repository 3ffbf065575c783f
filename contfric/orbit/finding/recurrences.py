"""Near returns of a simulated solution to where it ends: the orbit that it has come to, or approaches."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.system import build_system
from contfric.orbit.canonical.repetition import shortest
from contfric.orbit.canonical.section_crossings import loops
from contfric.orbit.canonical.sections import is_smooth, without_sections
from contfric.orbit.clock import clocked
from contfric.orbit.finding.aperiodic import MOST_PERIODS
from contfric.orbit.finding.rest import creeps
from contfric.orbit.orbit import Orbit, Status
from contfric.orbit.solve import centred, refine_with_symmetry
from contfric.signature.cyclic import primitive_length
from contfric.simulation.simulate import Trajectory

#: Most events of a cycle that is looked for: 64 periods of an orbit with 32 joints.
_MOST_EVENTS = 2048
#: A return nearer than this (nondimensional) is worth a Newton solve.
_NEAR = 1e-2
#: A return nearer than this is periodic to the resolution of a simulation.
EXACT = 1e-9
#: A motion whose returns shrink by less than this from one to the next takes hundreds of periods more. Its
#: series, and the place of its end, are those of the orbit to this share: it is still some way off.
_SLOW, _SERIES = 0.9, 0.2
#: An orbit that a solution converges to attracts; beyond rounding its multipliers cannot exceed 1.
_ATTRACTS = 1.0 + 1e-6


def orbit_come_to(trajectory: Trajectory, final: bool) -> Orbit | None:
    """Return the orbit that the end of a trajectory has converged to, if it has.

    A return that is not yet exact may belong to an orbit that repels, near an attractor of longer
    period; longer simulation tells. Only at the final look are multipliers asked instead, and where the
    solution creeps towards the orbit as slowly as they say.
    """
    for lag, turns, mismatch in recurrences(trajectory):
        if creeps(trajectory, lag):  # near an orbit of another itinerary
            return None
        if mismatch > EXACT and not final:
            return _approached(trajectory, lag, turns)
        orbit = _cycle_of(trajectory, lag, turns)
        if orbit is None:
            continue
        solved = refine_with_symmetry(shortest(refine_with_symmetry(orbit)))
        if solved.converged and solved.admissible and (mismatch <= EXACT or _attracts(solved)):
            return solved
        if mismatch <= EXACT and not solved.converged:
            # the simulation repeats itself but the system is singular: one orbit of a continuum
            return centred(
                Orbit(orbit.system, orbit.joints, orbit.vector, mismatch, Status.CONVERGED)
            )
    return None


def _approached(trajectory: Trajectory, lag: int, turns: int) -> Orbit | None:
    """Return the orbit that a solution approaches by a geometric series of small steps; None if it does not.

    Under strong damping a displacement decays within ``2 zeta``, thousands of periods. Three returns give the
    ratio of the series and with it the place of its end: an orbit that Newton's method finds there, and
    that attracts, is what the solution comes to.
    """
    if len(trajectory) < 2 * lag + 1:
        return None
    a, b, c = (trajectory.states[-1 - k * lag] for k in (2, 1, 0))
    before, step = b - a, c - b
    ratio = float(before @ step) / float(before @ before) if np.any(before) else 0.0
    if not _SLOW < ratio < 1.0 or not np.linalg.norm(
        step - ratio * before
    ) < _SERIES * np.linalg.norm(step):
        return None
    orbit = _cycle_of(trajectory, lag, turns)
    solved = None if orbit is None else refine_with_symmetry(shortest(refine_with_symmetry(orbit)))
    if solved is None or not (solved.converged and solved.admissible and _attracts(solved)):
        return None
    left = ratio / (1.0 - ratio) * step
    ends = np.concatenate([solved.ends[:, 1:], *_images(solved)])
    missed = np.min(np.linalg.norm(ends - (c + left), axis=1))
    return solved if missed < _SERIES * np.linalg.norm(left) else None


def _images(orbit: Orbit) -> list[FloatArray]:
    """Return the joints of the second half of an orbit that is solved on its half."""
    symmetry = orbit.model.symmetry
    return [] if symmetry is None else [orbit.ends[:, 1:] @ symmetry.array().T]


def _attracts(orbit: Orbit) -> bool:
    return bool(np.all(np.abs(orbit.multipliers) <= _ATTRACTS))


def recurrences(trajectory: Trajectory) -> Iterator[tuple[int, int, float]]:
    """Yield (events, periods, mismatch) of near returns of the last event, shortest first."""
    model = trajectory.model
    count = len(trajectory)
    if count < 2:
        return
    vector = model.vector(trajectory.params)
    period = model.view(vector).period
    joints = np.column_stack([trajectory.modes, trajectory.exits])
    for lag in range(1, count // 2):
        turns = int(trajectory.cycles[-1] - trajectory.cycles[-1 - lag])
        slip = float(trajectory.times[-1] - trajectory.times[-1 - lag])
        if period > 0.0:
            extra = round(slip / period)
            turns, slip = turns + extra, slip - extra * period
        if model.autonomous:  # any time may pass
            turns, slip = 1, 0.0
        if turns > MOST_PERIODS or lag > _MOST_EVENTS:
            return
        gap = float(np.max(np.abs(trajectory.states[-1] - trajectory.states[-1 - lag])))
        mismatch = gap + abs(slip)
        if turns < 1 or mismatch > _NEAR:
            continue
        if np.array_equal(joints[-lag:], joints[-2 * lag : -lag]):
            yield lag, turns, mismatch


def _cycle_of(trajectory: Trajectory, lag: int, turns: int) -> Orbit | None:
    """Return the last ``lag`` events as an orbit that is not solved."""
    model = trajectory.model
    vector = model.vector(trajectory.params)
    period = model.view(vector).period
    first = len(trajectory) - 1 - lag
    cycles = trajectory.cycles[first:-1] - trajectory.cycles[first]
    joints = np.column_stack(
        [trajectory.times[first:-1] + cycles * period, trajectory.states[first:-1]]
    )
    itinerary, end = trajectory.itinerary_from(first + 1), float(trajectory.times[-1])
    if not model.autonomous:
        end = float(joints[0, 0]) + turns * period
    smooth = is_smooth(model, itinerary)
    if model.autonomous and smooth:
        turns = loops(model, itinerary, joints, end, vector)
    itinerary, joints, end = without_sections(model, itinerary, joints, end, vector, turns)
    if model.autonomous and not smooth:
        turns = len(itinerary) // primitive_length(itinerary)
    joints = clocked(model, joints, end)
    try:
        system = build_system(model, itinerary, turns)
    except ValueError:
        return None
    return Orbit(system, joints, vector, np.inf, Status.NOT_CONVERGED)
