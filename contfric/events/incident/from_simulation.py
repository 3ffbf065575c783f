"""Finds what follows an event by simulation: the itineraries of solutions near it.

Where the flow is continuous at an event (static and kinetic limit agree, a grazing impact, two surfaces
met at once), solutions near the orbit at the event have its itinerary or that of the orbit that takes over.
So motions that start near it are followed for one turn, and each itinerary that is new is proposed. Near a
symmetric orbit few of them do the same in both halves of a turn: what they do in one half, and its mirror
image, can be asked for. It takes no knowledge of the event, and finds nothing where what follows repels too
fast to be simulated.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.conserved import conserved
from contfric.bvp.system import Itinerary, build_system
from contfric.models.definition import Domain, Model
from contfric.models.mode_domains import mode_domains
from contfric.orbit.canonical.sections import is_smooth, without_sections
from contfric.orbit.canonical.slides import resting_modes
from contfric.orbit.clock import clocked
from contfric.orbit.itinerary.itineraries import whole_of
from contfric.orbit.itinerary.one_way import only_grows
from contfric.orbit.orbit import Orbit, Status
from contfric.signature import canonical_itinerary
from contfric.signature.cyclic import primitive_length
from contfric.simulation.simulate import SimulationEnd, Trajectory, run
from contfric.simulation.starts import signs_at

#: Distances of the motions from the orbit at the event (nondimensional), the nearest first: where a turn
#: amplifies much only those are guesses that Newton's method takes, where little the others change the
#: itinerary.
_NEARBY = (1e-7, 1e-5, 1e-3)
#: A turn may last this much longer than that at the event: a grazing changes it by the root of a distance.
_LONGER = 1.2
#: Where in a segment solutions may start: odd shares, no two of them symmetric to its middle.
_PLACES = np.array([0.17, 0.26, 0.37, 0.44, 0.52, 0.61, 0.70, 0.79])
#: Turns after which a solution that creeps is periodic but for that: what it rings with decays like
#: exp(-2 pi zeta) a turn, with a damping ratio of 0.02 to 1e-5.
_CREEPS = 100
#: Events in one turn, and in those: far more than any orbit has, which are tens a turn. One that has more is
#: left out.
_EVENTS, _CREEPING_EVENTS = 10_000, 100_000
#: What an orbit changes by less than this (relative to 1 + its size) it conserves: at an event slips of no
#: length are located to rounding or its root.
_KEPT = 1e-6
#: A surface that the state leaves by less than this all along (rounding of states of order 1) is lain on.
_LEFT = 1e-9


def solutions_near(
    orbit: Orbit, shifts: tuple[tuple[int, float], ...] = (), half: bool = False
) -> Iterator[Orbit]:
    """Yield orbits, not solved, with the itineraries of solutions near an orbit over one turn.

    The same itinerary may come again, as a guess from a solution farther away.

    Parameters
    ----------
    orbit : the orbit at the event, on its whole cycle
    shifts : (parameter, change) of further solutions, from the orbit itself at other parameters
    half : of half a turn, and its mirror image, near a symmetric orbit
    """
    own, seen = canonical_itinerary(orbit.itinerary, orbit.model), set()
    start = _inside(orbit)
    for size, vector, state in _starts_near(orbit, start[1], shifts):
        found = _one_turn(orbit, start, vector, state, half)
        if found is not None and size == np.inf:
            found = _without_creep(orbit, found, start, state) or found
        if found is None:
            continue
        itinerary = canonical_itinerary(found.itinerary, orbit.model)
        # from another distance it is another guess
        if itinerary != own and (itinerary, size) not in seen:
            seen.add((itinerary, size))
            yield _where_orbit_is(orbit, found)


def _inside(orbit: Orbit) -> tuple[int, float]:
    """Return the longest segment that does not rest, and a time of it at which no surface is near.

    Its middle will not do: by symmetry, or after a touch, it may be a stationary point.
    """
    lasts = orbit.durations
    resting = resting_modes(orbit)
    rests = [mode in resting for mode, _ in orbit.itinerary]
    i = int(np.argmax(np.where(rests, -1.0, lasts)))
    times = orbit.cycle[i, 0] + _PLACES * lasts[i]
    states = [orbit.state(float(time)) for time in times]
    flow = orbit.model.view(orbit.vector)
    apart = [
        [abs(flow.height(surface.name, float(t), y)) for t, y in zip(times, states, strict=True)]
        for surface in orbit.model.surfaces
    ]
    clear = np.array([row / np.max(row) for row in apart if np.max(row) > _LEFT])
    best = len(times) // 2 if len(clear) == 0 else int(np.argmax(clear.min(axis=0)))
    return i, float(times[best])


def _starts_near(
    orbit: Orbit, time: float, shifts: tuple[tuple[int, float], ...]
) -> Iterator[tuple[float, FloatArray, FloatArray]]:
    """Yield the distance, the parameters and the state of motions near an orbit, the nearest first."""
    start = orbit.state(time)
    data = orbit.system.layout.conserved  # which are given: solutions near the orbit have the same
    for size in _NEARBY:
        for k in range(len(start)):
            apart = np.zeros(len(start))
            apart[k] = size * (1.0 + abs(start[k]))
            apart -= data.T @ (data @ apart)
            for sign in (1.0, -1.0):
                yield size, orbit.vector, start + sign * apart
    for index, change in shifts:
        vector = orbit.vector.copy()
        vector[index] += change
        yield np.inf, vector, start


def _one_turn(
    orbit: Orbit,
    start: tuple[int, float],
    vector: FloatArray,
    state: FloatArray,
    half: bool = False,
) -> Orbit | None:
    """Follow a solution for one turn; return the orbit that it nearly is, None if it breaks off.

    Or for half a turn: then the orbit is that and its mirror image.
    """
    model, (i, time), turn = orbit.model, start, orbit.period * (0.5 if half else 1.0)
    mode = model.mode_index[_declared(orbit, i, time, state)]
    unit = 1.0 if model.autonomous else orbit.period / orbit.periods
    trajectory = run(model, vector, mode, 0, time, state, _LONGER * turn / unit, _EVENTS)
    stop = _end_of_turn(orbit, trajectory, start, unit, half)
    if stop is None:
        return None
    itinerary: Itinerary = trajectory.itinerary[:stop]
    clock = trajectory.times + trajectory.cycles * unit * (not model.autonomous)
    joints = np.column_stack([clock, trajectory.states])[:stop]
    if half:
        itinerary = whole_of(model, itinerary, half)
        joints = np.vstack([joints, _image(model, joints, turn)])
    end = float(joints[-1, 0])
    joints = np.roll(joints, 1, axis=0)
    joints[0, 0] = end - orbit.period
    itinerary, joints, end = without_sections(model, itinerary, joints, end, vector, orbit.periods)
    if len(itinerary) == 1 and is_smooth(model, itinerary) and not model.wraps:
        return None  # a cycle that crosses a section comes back through it: this one has not closed
    periods = orbit.periods
    if model.autonomous:  # near a saddle a cycle of the time of this one may have more of them
        periods = max(periods, len(itinerary) // primitive_length(itinerary))
    try:
        system = build_system(model, itinerary, periods)
    except ValueError:
        return None
    return Orbit(system, clocked(model, joints, end), vector.copy(), np.inf, Status.NOT_CONVERGED)


def _image(model: Model, joints: FloatArray, later: float) -> FloatArray:
    """Return the mirror image of joints, half a turn later."""
    assert model.symmetry is not None
    image = joints.copy()
    image[:, 0] += later
    image[:, 1:] = image[:, 1:] @ model.symmetry.array().T
    return image


def _without_creep(
    orbit: Orbit, found: Orbit, start: tuple[int, float], state: FloatArray
) -> Orbit | None:
    """Return the orbit that a solution has when what creeps is where it is at the event; None without.

    It creeps to the end of a continuum of orbits along which it sticks. One of them is at the event.
    """
    model = orbit.model
    modes = only_grows(model, found.itinerary)
    if model.autonomous or not modes:
        return None
    mode = model.mode_index[_declared(orbit, *start, state)]
    turns = _CREEPS * orbit.periods
    trajectory = run(model, found.vector, mode, 0, start[1], state, turns, _CREEPING_EVENTS)
    if trajectory.end not in (SimulationEnd.TIME, SimulationEnd.HELD):
        return None
    data = conserved(model, tuple(pair for pair in found.itinerary if pair[0] not in modes))
    last = trajectory.last[2]
    return _one_turn(orbit, start, found.vector, last + data.T @ (data @ (state - last)))


def _where_orbit_is(orbit: Orbit, found: Orbit) -> Orbit:
    """Return a solution with what its itinerary conserves as it is along the orbit at the event.

    Where elements stick all along there is an orbit for each of their offsets; one of them is at the event.
    """
    data = found.system.layout.conserved
    if not len(data) or len(orbit.system.layout.conserved):
        return found
    values = orbit.cycle[:, 1:] @ data.T
    if np.max(np.ptp(values, axis=0)) > _KEPT * (1.0 + np.max(np.abs(values))):
        return found  # something slips along the orbit
    joints = found.joints.copy()
    joints[:, 1:] += (values[0] - joints[:, 1:] @ data.T) @ data
    return replace(found, joints=joints)


def _end_of_turn(
    orbit: Orbit, trajectory: Trajectory, start: tuple[int, float], unit: float, half: bool
) -> int | None:
    """Return the number of events of a turn, or half of one; None if the mode after it is another one."""
    model, itinerary = orbit.model, trajectory.itinerary
    clock = trajectory.times + trajectory.cycles * unit * (not model.autonomous)
    i, time = start
    count = int(np.searchsorted(clock, time + orbit.period * (0.5 if half else 1.0)))
    mode = itinerary[count][0] if count < len(itinerary) else trajectory.last[3]
    own = orbit.itinerary[i - len(orbit.itinerary) // 2 if half else i][0]
    same = bool(mode) and model.whole_mode(mode) == model.whole_mode(own)
    return count if count > 0 and same else None


def _declared(orbit: Orbit, i: int, time: float, state: FloatArray) -> str:
    """Return the mode, as it was declared, that a solution near segment i is in."""
    model, mode = orbit.model, orbit.itinerary[i][0]
    if mode not in model.joined:
        return mode
    signs = signs_at(model, time, state, orbit.vector)
    own = [model.domain_by_name[name] for name in mode_domains(model, mode)]

    def contradicted(domain: Domain) -> int:
        """Return by how many of the surfaces that bound it; a composed one has few."""
        return sum(domain.signs.get(s, 0) * sign < 0 for s, sign in signs.items())

    return min(own, key=contradicted).own_mode
