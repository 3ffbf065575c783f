"""Decides when to give up a simulation that finds no periodic orbit, and whether it is chaotic.

No finite simulation shows that a solution is not periodic: chaos may be a transient, and a slow spiral
needs thousands of periods. So the work is limited; it grows with the number of events, and about with the
square of the number of states. Two solutions that begin close to each other then tell whether it is chaotic:
their distance grows as ``exp(t/t_0)`` along a chaotic solution, and at most in proportion to t along a
quasi-periodic one.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from contfric.errors import AperiodicError, ConvergenceError, ParameterError, number_and
from contfric.models.check.period import undeclared_angles
from contfric.models.check.probe import Probe
from contfric.models.check.translations import of_translation, translations
from contfric.models.definition import Model
from contfric.models.mode_domains import open_ends
from contfric.models.shorthand.clocks import is_clock
from contfric.simulation.simulate import SimulationEnd, Trajectory, simulate
from contfric.simulation.starts import left_through
from contfric.simulation.time_scale import clock_period

#: Longest period that is looked for, in periods of the excitation.
MOST_PERIODS = 64
#: Periods that are simulated at most, and in any case.
MOST, _LEAST = 50_000, 1_000
#: Events times the square of the number of states that are worth it: about ten seconds.
_WORK = 2e6
#: Growth over the last stretch (three quarters of the whole simulation) that no settling motion has.
_GROWTH = 2.0
#: Slower growth, as of a relay with a lag (the square root of time): each of so many parts is larger than the
#: one before, and all together by this factor. A quasi-periodic solution comes back.
_PARTS, _SLOWLY = 10, 1.2
#: Turns within the last half of a simulation, of a solution that goes round for good.
_TURNS = 8
#: Two motions that begin this far apart (relative to 1 + the states) are compared after some periods; they
#: part by a larger factor than quasi-periodic ones, in proportion to time, could.
_APART, _COMPARED, _CHAOTIC = 1e-9, 100, 1e3
#: Weak chaos is seen late, so a share of the periods that were simulated is compared, up to so many times
#: more. An exponent of 0.005 where the frequency is 0.5 is seen after 200 periods.
_SHARE, _LONGER = 0.1, 20
#: What a solution that moves on may change besides, as a share of how far it moves.
_REST = 0.1
#: Growth of states after which their events are rounding.
_FAR = 1e12
#: A simulation that ends on a surface is on it to rounding, or a little more at a small angle.
_ON = 1e-9


def affordable(model: Model, done: int, events: int) -> int:
    """Return how many periods a solution may be followed that has met some events in those that are done."""
    work = events * len(model.states) ** 2
    return MOST if not work else min(MOST, max(_LEAST, int(done * _WORK / work)))


def why_none(
    trajectory: Trajectory, done: int, slow: tuple[int, int, float] | None, compared: bool
) -> ConvergenceError | AperiodicError:
    """Return the error that says why a solution has come to no orbit.

    Parameters
    ----------
    done : periods that were simulated
    slow : a return (events, periods, mismatch) that is nearly exact
    compared : whether it is worth up to a fifth of the periods more to tell whether the solution is chaotic
    """
    if slow is not None:
        return ConvergenceError(_marginal(trajectory, done, *slow[1:]), trajectory)
    if _grows(trajectory):
        return ConvergenceError(drifts(trajectory, _LEAST) or _unbounded(trajectory), trajectory)
    text = _advice(trajectory, done) + (_parting(trajectory, done) if compared else "")
    return AperiodicError(text, trajectory)


def goes_round(trajectory: Trajectory, done: int) -> str:
    """Return which state goes round and round and is not declared as an angle; nothing if none does."""
    model, half = trajectory.model, len(trajectory) // 2
    if done < _LEAST or not half:
        return ""
    turns = np.abs(trajectory.states[-1] - trajectory.states[half]) / (2.0 * np.pi)
    if not np.any(turns > _TURNS):
        return ""
    for state, text in undeclared_angles(Probe(model, trajectory.params)).items():
        k = model.states.index(state)
        if turns[k] > _TURNS:
            return (
                f"no periodic orbit: '{state}' goes round and round (to {trajectory.states[-1, k]:.3g} so "
                f"far), and is no angle of the model. If it is one, {text}"
            )
    return ""


def drifts(trajectory: Trajectory, done: int) -> str:
    """Return which states a solution moves on in that nothing depends on; nothing if it does not."""
    model, states = trajectory.model, trajectory.states[len(trajectory) // 2 :]
    if done < _LEAST or len(states) < 2 or not model.definition:
        return ""
    moved = states[-1] - states[0]
    steps = np.max(np.abs(np.diff(states, axis=0)), axis=0)
    if not np.any(np.abs(moved) > _TURNS * steps):
        return ""
    probe = Probe(model, trajectory.params)
    directions = translations(probe)
    along = np.array(directions).T
    shares = np.linalg.lstsq(along, moved, rcond=None)[0] if directions else np.zeros(1)
    if not np.any(shares) or np.max(np.abs(moved - along @ shares)) > _REST * np.max(np.abs(moved)):
        return ""
    text = of_translation(probe, directions[int(np.argmax(np.abs(shares)))])
    return f"no periodic orbit: the solution moves on (to {np.max(np.abs(states[-1])):.3g} so far): {text}"


def _marginal(trajectory: Trajectory, done: int, turns: int, mismatch: float) -> str:
    where = ", ".join(f"{k} = {v:g}" for k, v in trajectory.params.items())
    return (
        f"the solution at {where} has not converged in {done} periods: it still changes by "
        f"{mismatch:.1g} in {number_and(turns, 'period')}, more slowly than any exponential. The orbit is "
        "marginally stable (a multiplier is 1), as orbits of a continuum are. Move a parameter a "
        "little, or add damping"
    )


def _grows(trajectory: Trajectory) -> bool:
    """Tell whether the last stretch of a simulation is far larger at its end than at its start."""
    if not len(trajectory):  # it has met no surface at all
        return False
    size = np.max(np.abs(trajectory.states), axis=1)
    tenth = max(1, len(size) // 10)
    return bool(np.max(size[-tenth:]) > _GROWTH * np.max(size[:tenth]))


def outgrown(trajectory: Trajectory) -> str:
    """Return that a solution has grown so large that levels are rounding next to it, or nothing."""
    before = 1.0 + float(np.max(np.abs(trajectory.begin[1])))
    large = float(np.max(np.abs(trajectory.last[2]))) > _FAR * before
    return _unbounded(trajectory) if large and _grows(trajectory) else ""


def _unbounded(trajectory: Trajectory) -> str:
    where = ", ".join(f"{k} = {v:g}" for k, v in trajectory.params.items())
    size = float(np.max(np.abs(trajectory.states[-1])))
    return (
        f"no periodic orbit: the solution at {where} grows without bound (to {size:.3g} so far), as at "
        f"a resonance with too little damping{out_of_range(trajectory)}. Choose other parameters"
    )


def out_of_range(trajectory: Trajectory) -> str:
    """Return which state first leaves the range that the model gives it, at an event; or nothing."""
    model = trajectory.model
    if model.ranges is None:
        return ""
    bounds = model.ranges(trajectory.params)
    for k, y in enumerate(trajectory.states):
        for state, value, (low, high) in zip(model.states, y.tolist(), bounds, strict=True):
            if value < low or value > high:  # no numbers where it has no range
                return f"; event {k + 1} is the first with {state} = {value:.6g} out of [{low:g}, {high:g}]"
    return ""


#: Times after which a solution that goes round is somewhere else: no multiples of each other's periods.
_LATER = 1.2345


def _advice(trajectory: Trajectory, done: int) -> str:
    where = ", ".join(f"{k} = {v:g}" for k, v in trajectory.params.items())
    return (
        f"the solution at {where} is aperiodic: no period from 1 to {MOST_PERIODS} was found in {done} "
        f"periods. Try another parameter value, another start (state=...), a longer simulation "
        "(longest=...), or start from a signature (start: {signature: NAME} in a study)"
    )


def _parting(trajectory: Trajectory, done: int) -> str:
    """Return what two solutions say that begin close to each other where a trajectory ends."""
    model, (_, time, state, _) = trajectory.model, trajectory.last
    moved = np.array([not is_clock(name) for name in model.states])
    towards = np.where(state == 0.0, (-1.0) ** np.arange(len(state)), -np.sign(state))
    shift = moved * _APART * (1.0 + np.abs(state)) * towards  # no element goes beyond its limit
    least = _COMPARED
    if model.autonomous:  # a unit of time says nothing of how often something happens
        passed = float(trajectory.last[1]) - trajectory.begin[0]
        least = math.ceil(_COMPARED * max(1.0, passed / max(1, len(trajectory))))
    compared = max(least, min(int(_SHARE * done), _LONGER * least))
    length = compared / clock_period(model, model.vector(trajectory.params))
    try:
        one, other = (
            simulate(model, trajectory.params, state=begin, time=time, periods=length)
            for begin in (state, state + shift)
        )
    except ParameterError:  # no state of the model: an element beyond its limit
        return ""
    if {one.end, other.end} != {SimulationEnd.TIME}:
        return ""
    apart = float(np.max(np.abs(one.last[2] - other.last[2]) / (1.0 + np.abs(one.last[2]))))
    if apart > _CHAOTIC * compared / least * _APART:
        return (
            f". Solutions that begin {_APART:.0e} apart are {apart:.0e} apart after {compared} periods: it "
            "is chaotic, or a long transient of chaos"
        )
    close = f". Solutions that begin close stay close for {compared} periods: it"
    if (growth := _slow_growth(trajectory)) > _SLOWLY:
        return (
            f"{close} grows, by a factor {growth:.3g} in the last {len(trajectory)} events, without bound or "
            "to an orbit far away"
        )
    return f"{close} is quasi-periodic, or it converges slowly"


def _slow_growth(trajectory: Trajectory) -> float:
    """Return the factor by which the last stretch of a simulation grows, each tenth of it; else 1."""
    if len(trajectory) < _PARTS**2:
        return 1.0
    size = np.max(np.abs(trajectory.states), axis=1)
    largest = [float(np.max(part)) for part in np.array_split(size, _PARTS)]
    grows = all(a < b for a, b in itertools.pairwise(largest))
    return largest[-1] / largest[0] if grows and largest[0] > 0.0 else 1.0


def goes_on(trajectory: Trajectory) -> str:
    """Return what a solution does that meets nothing any more; nothing if it has come to an equilibrium."""
    if left := left_region(trajectory):
        return left
    mode = trajectory.last[3]
    if not moves_on(trajectory):
        return ""
    return (
        f"the solution stays in '{mode}' and meets no surface any more. A cycle inside of one mode is found "
        "at a section: give the model a surface that it crosses, with two modes of the same field on its "
        "sides"
    )


def left_region(trajectory: Trajectory) -> str:
    """Return where a solution has left the region of its mode, as no mode follows; nothing if it has not."""
    model, (_, time, state, mode) = trajectory.model, trajectory.last
    vector = model.vector(trajectory.params)
    surface = mode and left_through(model, mode, time, state, vector)
    if mode and not surface and not model.composed:
        flow, size = model.view(vector), _ON * (1.0 + float(np.max(np.abs(state))))
        ends = (s for s in open_ends(model, mode) if abs(flow.height(s, time, state)) < size)
        surface = next(ends, "")
    if not surface:
        return ""
    return (
        f"the solution has left the region of '{mode}' at '{surface}', where no mode follows. "
        "`contfric check` says what is missing"
    )


def moves_on(trajectory: Trajectory) -> bool:
    """Tell whether a solution is somewhere else at times after its end: it has not come to an equilibrium."""
    model, (_, time, state, mode) = trajectory.model, trajectory.last
    flow, whole = model.view(model.vector(trajectory.params)), model.whole_mode(mode)
    before, after = (flow.state(whole, time, state, d) for d in (_LATER, math.e * _LATER))
    moves = min(float(np.max(np.abs(y - state))) for y in (before, after))
    return moves > _APART * (1.0 + float(np.max(np.abs(state))))


def stays(trajectory: Trajectory) -> str:
    """Return what is said of a solution that stays on a surface for ever: where, if it comes to a point."""
    model, (_, _, state, mode) = trajectory.model, trajectory.last
    where = ""
    if model.autonomous and np.all(np.isfinite(state)) and not moves_on(trajectory):
        place = ", ".join(f"{s} = {v:.4g}" for s, v in zip(model.states, state, strict=True))
        where = f", at its pseudo-equilibrium {place}"
    return f"the solution stays in mode '{model.whole_mode(mode)}' for ever{where}: nothing releases it"
