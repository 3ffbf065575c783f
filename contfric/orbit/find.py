"""From a simulation to a periodic orbit: identify the signature, detect the period, refine by Newton."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np
from numpy.typing import ArrayLike

from contfric.errors import ConvergenceError, function_of, real_number, whole_number
from contfric.models import ModelSource, Parameters
from contfric.models.definition import FloatArray, Model
from contfric.models.tied import tied
from contfric.orbit.aperiodic import (
    MOST,
    MOST_PERIODS,
    affordable,
    goes_on,
    goes_round,
    left_region,
    moves_on,
    out_of_range,
    stays,
    why_none,
)
from contfric.orbit.clock import clocked
from contfric.orbit.kept_positions import Places
from contfric.orbit.orbit import Orbit, Status
from contfric.orbit.repetition import shortest
from contfric.orbit.rest import beyond_creep, check_rest, comes_to_rest, creeps, is_point, winds
from contfric.orbit.sections import is_smooth, loops, without_sections
from contfric.orbit.simulation import SimulationEnd, Trajectory, go_on, simulate
from contfric.orbit.sizes import warn_of_sizes
from contfric.orbit.solve import centred, refine_with_symmetry
from contfric.orbit.system import build_system
from contfric.orbit.time_scale import clock_period, time_scale
from contfric.remember.journal import remembered
from contfric.signature.cyclic import primitive_length

#: Most events of a cycle that is looked for: 64 periods of an orbit with 32 joints.
_MOST_EVENTS = 2048
#: A return nearer than this (nondimensional) is worth a Newton solve.
_NEAR = 1e-2
#: A return nearer than this is periodic to the resolution of a simulation.
_EXACT = 1e-9
#: A motion whose returns shrink by less than this from one to the next takes hundreds of periods more. Its
#: series, and the place of its end, are those of the orbit to this share: it is still some way off.
_SLOW, _SERIES = 0.9, 0.2
#: A solution that returns this near and still does not converge creeps along a continuum of orbits.
_CREEPING = 1e-5
#: Periods to follow before the first look, and how much longer before each next one.
_FIRST, _LONGER = 200, 4
#: Events without excitation after which is looked, too: the unit of time need not be that of the motion.
_FIRST_EVENTS = 5_000
_MOST_EVENTS_AT_ONCE = 10_000_000
#: Events with excitation after which is looked whether they are turns about a point.
_TURNS = 100_000
#: Share of the time of the first half of these that the second half takes if they do not come faster.
_STEADY = 0.5
#: An orbit that a solution converges to attracts; beyond rounding its multipliers cannot exceed 1.
_ATTRACTS = 1.0 + 1e-6


def find_orbit(
    model: ModelSource,
    params: Parameters | None = None,
    periods: int | None = None,
    *,
    state: ArrayLike | None = None,
    time: float = 0.0,
    at: Mapping[str, float] | None = None,
    longest: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> Orbit:
    """Simulate until the solution repeats itself, identify its signature and solve for it.

    Parameters
    ----------
    model, params : the model (its name, file or class) and its parameters; defaults fill in
    periods : int, optional
        Period wanted, in periods of the excitation; by default any from 1 to 64.
    state, time : initial condition; by default displaced from rest
    at : where contacts rest that never slip along the orbit, such as ``{"brake": 0.12}``; by default where
        the model's file says (``at``), else where the simulation leaves them
    longest : int, optional
        Periods to simulate before the solution is called aperiodic; by default 50,000, or fewer (not below
        1,000) where it has many states and meets many events.
    progress : called with one line of text now and then, where it takes long

    Returns
    -------
    Orbit
        Solved to rounding, in the units of the model. ``joints``, shape (N, 1 + n), has the start time and
        state of each segment of its itinerary (of one half, if it is symmetric); ``multipliers`` has
        shape (n,).

    Raises
    ------
    AperiodicError
        If no period up to 64 is found; ``result`` is the trajectory's last part.
    ConvergenceError
        If the mass stays stuck, or the period found is not the one wanted.
    ParameterError
        If a contact slips along the orbit, or cannot rest where ``at`` says.

    Examples
    --------
    >>> import contfric as cf
    >>> cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4}).name
    '1a'
    """
    model, params = tied(model, params)
    if periods is not None:
        periods = whole_number("periods", periods, least=1, most=MOST_PERIODS)
    if longest is not None:
        longest = whole_number("longest", longest, least=1)
    function_of("progress", progress)
    checked, time = model.check_params(params), real_number("time", time)
    places = Places(model, checked, at)
    begun = places.begin(state)
    found = places.put(
        _wanted(_settled(model, checked, begun, time, longest, progress=progress), periods)
    )
    warn_of_sizes(found)
    return found


def simulated_orbit(
    model: Model, params: dict[str, float], state: FloatArray, time: float, longest: int
) -> Orbit:
    """Return the orbit that the solution from a state converges to, wherever its contacts rest."""
    return _settled(model, params, state, time, longest)


@remembered()
def _settled(
    model: Model,
    params: dict[str, float],
    state: ArrayLike | None,
    time: float,
    longest: int | None,
    *,
    progress: Callable[[str], None] | None = None,
) -> Orbit:
    """Return the orbit that a solution converges to."""
    span, done, events = _FIRST, 0, 0
    most = MOST if longest is None else longest

    def heard(text: str) -> None:
        if progress is not None:
            progress(f"simulating: {done} periods without an orbit, then {text}")

    unit, clock = time_scale(model), clock_period(model, model.vector(params))

    def simulated(events: int) -> Trajectory:
        """Follow the solution from its start, to a time and not to an event where that is gone on with."""
        asked = span * unit / clock
        return simulate(
            model, params, state=state, time=time, periods=asked, events=events, progress=heard
        )

    trajectory = simulated(_FIRST_EVENTS if model.autonomous else _TURNS)
    if trajectory.end is SimulationEnd.EVENTS:
        if not model.autonomous and winds(trajectory):
            raise ConvergenceError(comes_to_rest(trajectory), trajectory)
        if model.autonomous and _is_steady(trajectory):
            unit = float(trajectory.last[1] - trajectory.begin[0]) / span
        trajectory = simulated(_MOST_EVENTS_AT_ONCE)
    if trajectory.end is SimulationEnd.CHATTER and not model.chatters:
        from contfric.models.chatter import with_chatter  # which takes sympy

        resting = with_chatter(model)
        if resting is not None:
            return _settled(resting, params, state, time, longest, progress=progress)
    while True:
        check_rest(trajectory)
        divided = _divided_by_phase(trajectory)
        if divided is not None:
            return _settled(divided, params, state, time, longest, progress=progress)
        _check_motion(trajectory)
        done, events = done + span, events + len(trajectory)
        if longest is None:
            most = min(most, affordable(model, done, events))
        orbit = _read_off(trajectory, final=done >= most)
        if orbit is not None and model.autonomous and is_point(orbit):
            raise ConvergenceError(comes_to_rest(trajectory), trajectory)
        if orbit is not None:
            return orbit
        if done >= most:
            slow = next((r for r in recurrences(trajectory) if r[2] < _CREEPING), None)
            raise why_none(trajectory, done, slow, compared=longest is None)
        if why := goes_round(trajectory, done):
            raise ConvergenceError(why, trajectory)
        behind = _after_creep(trajectory)
        if behind is not None:
            time, state = behind
            trajectory = simulated(_MOST_EVENTS_AT_ONCE)
            continue
        span = min(span * _LONGER, most - done)
        heard(f"{span} more")
        trajectory = go_on(trajectory, span * unit, heard)


def _divided_by_phase(trajectory: Trajectory) -> Model | None:
    """Return the model with a section where a solution stays in a mode without one; or None."""
    model = trajectory.model
    held = trajectory.end is SimulationEnd.HELD
    if not (held or trajectory.end is SimulationEnd.QUIET):
        return None
    stays = moves_on(trajectory) if model.autonomous else held or not moves_on(trajectory)
    if not stays:
        return None
    from contfric.models.phases import with_phase  # which reads the model again

    return with_phase(model, model.whole_mode(trajectory.last[3]))


def _after_creep(trajectory: Trajectory) -> tuple[float, FloatArray] | None:
    """Return time and state where a motion that creeps to one side will have come to; None if it does not."""
    lag = next((lag for lag, _, _ in recurrences(trajectory)), 0)
    return beyond_creep(trajectory, lag) if lag else None


def _is_steady(trajectory: Trajectory) -> bool:
    """Tell whether events do not come faster and faster: then the unit of time is too long for the motion.

    A converter in seconds switches a million times in 200 of them.
    """
    begin, middle = trajectory.begin[0], float(trajectory.times[len(trajectory) // 2])
    return float(trajectory.times[-1]) - middle > _STEADY * (middle - begin)


def _wanted(orbit: Orbit, periods: int | None) -> Orbit:
    if periods is not None and orbit.periods != periods:
        raise ConvergenceError(
            f"the solution converges to an orbit of {orbit.periods} period(s), not {periods}: "
            f"ask for periods={orbit.periods}, or start elsewhere (state=...)",
            orbit,
        )
    return orbit


def _walls_met(trajectory: Trajectory) -> list[str]:
    """Return the walls that a solution is on where it ends."""
    model, (_, time, state, _) = trajectory.model, trajectory.last
    flow = model.view(model.vector(trajectory.params))
    size = _EXACT * (1.0 + float(np.max(np.abs(state))))
    walls = dict.fromkeys(reset.surface for reset in model.resets)
    return [wall for wall in walls if abs(flow.height(wall, time, state)) < size]


def _check_motion(trajectory: Trajectory) -> None:
    looks = {SimulationEnd.QUIET: goes_on, SimulationEnd.IMPOSSIBLE: left_region}
    if trajectory.end in looks and (why := looks[trajectory.end](trajectory)):
        raise ConvergenceError(f"no periodic orbit: {why}", trajectory)
    if trajectory.end not in (SimulationEnd.EVENTS, SimulationEnd.TIME):
        why, mode = trajectory.end.value, trajectory.last[3]
        if trajectory.end is SimulationEnd.HELD and mode:
            why = stays(trajectory)
        missing = trajectory.end is SimulationEnd.IMPOSSIBLE
        if missing and (rest := trajectory.model.chatter_by_mode.get(mode)):
            raise ConvergenceError(
                f"no periodic orbit: the solution rests on '{rest.surface}' where a reset acts that does not "
                "throw it off, which is not offered. Start elsewhere (state=...), or write what a clock "
                "drives as a function of t",
                trajectory,
            )
        if missing and len(walls := _walls_met(trajectory)) > 1:
            raise ConvergenceError(
                f"no periodic orbit: {' and '.join(map(repr, walls))} are hit at the same time, which is not "
                "offered: set one of them back a little (by a thousandth), or start elsewhere (state=...)",
                trajectory,
            )
        says = "; `contfric check` says where no mode follows" if missing else ""
        why += out_of_range(trajectory)
        raise ConvergenceError(
            f"no periodic orbit: {why}. Choose other parameters or another start{says}",
            trajectory,
        )


def _read_off(trajectory: Trajectory, final: bool) -> Orbit | None:
    """Return the orbit that the end of a trajectory has converged to, if it has.

    A return that is not yet exact may belong to an orbit that repels, near an attractor of longer
    period; longer simulation tells. Only at the final look are multipliers asked instead, and where the
    solution creeps towards the orbit as slowly as they say.
    """
    for lag, turns, mismatch in recurrences(trajectory):
        if creeps(trajectory, lag):  # near an orbit of another itinerary
            return None
        if mismatch > _EXACT and not final:
            return _crept_to(trajectory, lag, turns)
        orbit = _orbit_of_lag(trajectory, lag, turns)
        if orbit is None:
            continue
        solved = refine_with_symmetry(shortest(refine_with_symmetry(orbit)))
        if solved.converged and solved.admissible and (mismatch <= _EXACT or _attracts(solved)):
            return solved
        if mismatch <= _EXACT and not solved.converged:
            # the simulation repeats itself but the system is singular: one orbit of a continuum
            return centred(
                Orbit(orbit.system, orbit.joints, orbit.vector, mismatch, Status.CONVERGED)
            )
    return None


def _crept_to(trajectory: Trajectory, lag: int, turns: int) -> Orbit | None:
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
    orbit = _orbit_of_lag(trajectory, lag, turns)
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


def _orbit_of_lag(trajectory: Trajectory, lag: int, turns: int) -> Orbit | None:
    """Return the last ``lag`` events as an unsolved orbit."""
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
