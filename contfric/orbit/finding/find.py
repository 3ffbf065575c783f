"""From a simulation to a periodic orbit: identify the signature, detect the period, refine by Newton."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from contfric.base.arrays import FloatArray
from contfric.errors import ConvergenceError, function_of, number_and, real_number, whole_number
from contfric.models import ModelSource, Parameters
from contfric.models.definition import Model
from contfric.models.tied import tied
from contfric.orbit.finding.aperiodic import (
    MOST,
    MOST_PERIODS,
    affordable,
    drifts,
    goes_on,
    goes_round,
    left_region,
    moves_on,
    out_of_range,
    outgrown,
    stays,
    why_none,
)
from contfric.orbit.finding.recurrences import EXACT, orbit_come_to, recurrences
from contfric.orbit.finding.rest import (
    beyond_creep,
    check_rest,
    comes_to_rest,
    is_point,
    quickens,
    winds,
    without_an_end,
)
from contfric.orbit.finding.simultaneous import in_order
from contfric.orbit.finding.sizes import sizes_told, warn_of_hits_together, warn_of_sizes
from contfric.orbit.orbit import Orbit
from contfric.orbit.positions.kept import Places
from contfric.remember.journal import remembered
from contfric.simulation.simulate import SimulationEnd, Trajectory, go_on, simulate
from contfric.simulation.time_scale import clock_period, time_scale

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
    with sizes_told():
        found = simulated_orbit(model, checked, begun, time, longest, progress=progress)
    found = places.put(_wanted(found, periods))
    warn_of_sizes(found)
    warn_of_hits_together(found)
    return found


@remembered()
def simulated_orbit(
    model: Model,
    params: dict[str, float],
    state: ArrayLike | None,
    time: float,
    longest: int | None,
    *,
    progress: Callable[[str], None] | None = None,
) -> Orbit:
    """Return the orbit that the solution from a state converges to, wherever its contacts rest."""
    search = _Search(model, params, state, time, longest, progress)
    trajectory = search.begin()
    if trajectory.end is SimulationEnd.CHATTER and not model.chatters:
        from contfric.models.shorthand.chatter import with_chatter  # which takes sympy

        resting = with_chatter(model)
        if resting is not None:
            return simulated_orbit(resting, params, state, time, longest, progress=progress)
    while True:
        check_rest(trajectory)
        divided = _divided_by_phase(trajectory)
        if divided is not None:
            state, time = search.state, search.time
            return simulated_orbit(divided, params, state, time, longest, progress=progress)
        _check_motion(trajectory)
        orbit = search.orbit_of(trajectory)
        if orbit is not None:
            return orbit
        trajectory = search.longer(trajectory)


@dataclass(eq=False)
class _Search:
    """A simulation that is made longer until its solution has come to an orbit.

    Attributes
    ----------
    span : units of time that are simulated at once
    done, events : units of time and events that have been simulated
    """

    model: Model
    params: dict[str, float]
    state: ArrayLike | None
    time: float
    longest: int | None
    progress: Callable[[str], None] | None
    span: int = _FIRST
    done: int = 0
    events: int = 0

    def __post_init__(self) -> None:
        self.most = MOST if self.longest is None else self.longest
        self.unit = time_scale(self.model)

    def begin(self) -> Trajectory:
        """Return the first stretch, in a unit of time in which something happens."""
        autonomous = self.model.autonomous
        trajectory = self._simulated(_FIRST_EVENTS if autonomous else _TURNS)
        if trajectory.end is not SimulationEnd.EVENTS:
            return trajectory
        if autonomous and _is_steady(trajectory):
            self.unit = float(trajectory.last[1] - trajectory.begin[0]) / self.span
            return self._simulated(_MOST_EVENTS_AT_ONCE)
        if autonomous:
            trajectory = self._simulated(_TURNS)
            if trajectory.end is not SimulationEnd.EVENTS:
                return trajectory
        if winds(trajectory):
            raise ConvergenceError(comes_to_rest(trajectory), trajectory)
        if quickens(trajectory, self.model.view(self.model.vector(self.params)).period):
            raise ConvergenceError(without_an_end(trajectory), trajectory)
        return self._simulated(_MOST_EVENTS_AT_ONCE)

    def _simulated(self, events: int) -> Trajectory:
        """Follow the solution from its start, to a time and not to an event where that is gone on with."""
        clock = clock_period(self.model, self.model.vector(self.params))
        return simulate(
            self.model,
            self.params,
            state=self.state,
            time=self.time,
            periods=self.span * self.unit / clock,
            events=events,
            progress=self._say,
        )

    def _say(self, text: str) -> None:
        if self.progress is not None:
            self.progress(f"simulating: {self.done} periods without an orbit, then {text}")

    def orbit_of(self, trajectory: Trajectory) -> Orbit | None:
        """Return the orbit that a trajectory has come to; None where a longer one may tell.

        Raises
        ------
        ConvergenceError
            If a longer one would tell nothing.
        """
        self.done, self.events = self.done + self.span, self.events + len(trajectory)
        if self.longest is None:
            self.most = min(self.most, affordable(self.model, self.done, self.events))
        final = self.done >= self.most
        trajectory = in_order(trajectory)
        orbit = orbit_come_to(trajectory, final)
        if orbit is not None and self.model.autonomous and is_point(orbit):
            raise ConvergenceError(comes_to_rest(trajectory), trajectory)
        if orbit is None and final:
            slow = next((r for r in recurrences(trajectory) if r[2] < _CREEPING), None)
            raise why_none(trajectory, self.done, slow, compared=self.longest is None)
        if orbit is None and (
            why := goes_round(trajectory, self.done) or drifts(trajectory, self.done)
        ):
            raise ConvergenceError(why, trajectory)
        return orbit

    def longer(self, trajectory: Trajectory) -> Trajectory:
        """Return what follows a trajectory; of one that creeps the one from where that leads."""
        following = _after_creep(trajectory)
        if following is not None:
            self.time, self.state = following
            return self._simulated(_MOST_EVENTS_AT_ONCE)
        self.span = min(self.span * _LONGER, self.most - self.done)
        self._say(f"{self.span} more")
        return go_on(trajectory, self.span * self.unit, self._say)


def _divided_by_phase(trajectory: Trajectory) -> Model | None:
    """Return the model with a section where a solution stays in a mode without one; or None."""
    model = trajectory.model
    held = trajectory.end is SimulationEnd.HELD
    if not (held or trajectory.end is SimulationEnd.QUIET):
        return None
    stays = moves_on(trajectory) if model.autonomous else held or not moves_on(trajectory)
    if not stays:
        return None
    from contfric.models.deriving.phases import with_phase  # which reads the model again

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
            f"the solution converges to an orbit of {number_and(orbit.periods, 'period')}, not {periods}: "
            f"ask for periods={orbit.periods}, or start elsewhere (state=...)",
            orbit,
        )
    return orbit


def _walls_met(trajectory: Trajectory) -> list[str]:
    """Return the walls that a solution is on where it ends."""
    model, (_, time, state, _) = trajectory.model, trajectory.last
    flow = model.view(model.vector(trajectory.params))
    size = EXACT * (1.0 + float(np.max(np.abs(state))))
    walls = dict.fromkeys(reset.surface for reset in model.resets)
    return [wall for wall in walls if abs(flow.height(wall, time, state)) < size]


def _check_motion(trajectory: Trajectory) -> None:
    if trajectory.end is SimulationEnd.IMPOSSIBLE and (why := outgrown(trajectory)):
        raise ConvergenceError(why, trajectory)
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
            f"no periodic orbit: {why}. Choose other parameters or another start (state=...){says}",
            trajectory,
        )
