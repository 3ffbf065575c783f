"""Newton at fixed parameters, and orbits of a given signature from many starts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.tally import tally
from contfric.bvp.conserved import conserved
from contfric.bvp.system import System, build_system
from contfric.errors import ConvergenceError, ParameterError, function_of, whole_number
from contfric.models import ModelSource, Parameters
from contfric.models.tied import tied
from contfric.orbit.canonical.sections import has_sections, named_by_ends
from contfric.orbit.clock import clocked
from contfric.orbit.itinerary.itineraries import half_of
from contfric.orbit.orbit import Orbit, Status
from contfric.remember.journal import SLOW, remembered
from contfric.signature import Signature, reduced_itinerary
from contfric.simulation.excitation import check_excitation
from contfric.simulation.simulate import Trajectory, run
from contfric.simulation.starts import start_of

#: What the kernel's numbers mean.
_STATUSES = tuple(Status)
#: Starts drawn for one signature: enough for every bundled signature to be found from scratch in
#: the tests (the rarest needs about 150), at about a tenth of a millisecond each.
STARTS = 600
#: Longest Newton correction from a start that may be far: a third of the natural scale of the states.
TRUST = 0.3
#: Units of time that a stretch of an autonomous model may take: far more than a cycle, and few enough
#: where it converges.
_LONGEST = 300.0
#: States that differ by this (relative to 1 + the largest) are the same: two solutions by Newton's method.
_SAME = 1e-8
#: Candidates of the smallest mismatch that are handed to Newton.
CANDIDATES = 40


@remembered(slow=SLOW)
def refine(orbit: Orbit, damped: bool = True) -> Orbit:
    """Solve the boundary-value problem from an orbit's joints; the status says how it went.

    Parameters
    ----------
    damped : bool
        Whether long corrections are cut: for starts that may be far.
    """
    from contfric.bvp.newton import solve

    joints, vector = orbit.joints.copy(), orbit.vector.copy()
    m = joints.shape[1]
    status, _, _, residual = solve(
        orbit.system.functions(),
        orbit.system.layout,
        joints,
        vector,
        TRUST if damped else np.inf,
        np.empty((2, m, m)),
        tally(),
    )
    return Orbit(orbit.system, joints, vector, float(residual), _STATUSES[int(status)])


def ended_at_surfaces(orbit: Orbit) -> Orbit:
    """Return a guess whose segments that are not finite end where they first meet their surfaces.

    Where a solution is infinite soon after its surface, times must be guessed far better than states.
    Without excitation, and on a whole cycle: there the times of all segments are free.
    """
    if not orbit.model.autonomous or orbit.system.half or orbit.system.holds:
        return orbit
    durations, flow = orbit.durations.copy(), orbit.flow
    for k, ((mode, surface), (t, *y)) in enumerate(zip(orbit.itinerary, orbit.begins, strict=True)):
        start, within = np.array(y), float(durations[k])
        if not np.all(np.isfinite(flow.state(mode, t, start, within))):
            observable = orbit.model.surface_by_name[surface].observable
            on = abs(flow.height(surface, t, start)) < _SAME
            met = flow.first(mode, observable, flow.level(surface), t, start, within, on=on)
            durations[k] = within if met is None else met[0]
    joints = orbit.joints.copy()
    joints[:, 0] = -np.cumsum(durations[::-1])[::-1]
    return replace(orbit, joints=joints)


def solve_orbit(
    model: ModelSource,
    signature: str | Path | Signature,
    params: Parameters,
    *,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> Orbit:
    """Find an admissible orbit of a signature at given parameters, stable or not.

    Short simulations from many starts are searched for stretches that follow the itinerary of the signature;
    those that nearly close are handed to Newton.

    Parameters
    ----------
    signature : str, path or Signature
        A bundled name (``"2s"``), a YAML file, or an object. If it says ``symmetric``, only orbits
        that are (or are not) their own mirror image count.
    seed : int
        Seed of the starts; the same seed gives the same orbit.
    progress : called with one line of text now and then

    Returns
    -------
    Orbit
        Solved to rounding and admissible, stable or not.

    Raises
    ------
    ConvergenceError
        If no start leads to such an orbit; ``result`` holds the nearest unsolved or inadmissible one.

    Examples
    --------
    >>> import contfric as cf
    >>> cf.solve_orbit("coulomb", "1a", {"Omega": 0.5, "S": 0.32, "S0": 0.4}).stable
    True
    """
    model, params = tied(model, params)
    if not isinstance(signature, Signature):
        from contfric.signature import load_signature

        signature = load_signature(signature, model)
    vector = model.vector(params)
    check_excitation(model, vector)
    seed = whole_number("seed", seed, least=0)
    function_of("progress", progress)
    itinerary = reduced_itinerary(signature)
    half = half_of(model, itinerary, signature.periods) if signature.symmetric else None
    if half is not None:
        system = build_system(model, half, signature.periods, half=True)
    else:
        system = build_system(model, itinerary, signature.periods)
    nearest: Orbit | None = None
    for orbit in _solved_starts(system, vector, seed, progress or _nothing):
        if orbit.converged and orbit.admissible and signature.symmetric in (None, orbit.symmetric):
            return orbit
        if nearest is None or (orbit.converged, -orbit.residual) > (
            nearest.converged,
            -nearest.residual,
        ):
            nearest = orbit
    raise ConvergenceError(_explain(signature, model.mapping(vector), nearest), nearest)


def _explain(signature: Signature, params: Mapping[str, float], nearest: Orbit | None) -> str:
    name = signature.name or str(signature)
    where = ", ".join(f"{k} = {v:.6g}" for k, v in params.items())
    text = f"no admissible orbit '{name}' was found at {where}"
    if nearest is None:
        text += ": no start follows this signature"
    elif not nearest.converged:
        text += (
            f"; the best start ended with residual {nearest.residual:.2g} ({nearest.status.value})"
        )
    elif not nearest.admissible:
        text += "; a solution exists that violates: " + "; ".join(nearest.violations()[:3])
    else:
        kind = "symmetric" if nearest.symmetric else "asymmetric"
        text += f"; the orbits found are {kind}"
    if signature.example:
        at = ", ".join(f"{k} = {v:g}" for k, v in signature.example.items())
        text += f". The signature is known to exist at {at}: solve there and continue"
    return text


def _nothing(text: str) -> None:
    """Take what nobody wants to hear."""


def _solved_starts(
    system: System, vector: FloatArray, seed: int, say: Callable[[str], None]
) -> Iterator[Orbit]:
    """Yield Newton's results from the best-closing stretches, nearest first, round by round."""
    tried: list[FloatArray] = []
    for batch in range(4):
        found = sorted(
            _matching_stretches(system, vector, seed + batch, say), key=lambda pair: pair[0]
        )
        for k, (_, joints) in enumerate(found[:CANDIDATES]):
            say(f"solving: candidate {k + 1} of {min(len(found), CANDIDATES)}")
            if any(np.max(np.abs(joints - other)) < 1e-3 for other in tried):
                continue
            tried.append(joints)
            yield refine(Orbit(system, joints, vector.copy(), np.inf, Status.NOT_CONVERGED))


def _matching_stretches(
    system: System, vector: FloatArray, seed: int, say: Callable[[str], None]
) -> Iterator[tuple[float, FloatArray]]:
    """Yield (mismatch, joints) of simulated stretches that follow the itinerary of one turn."""
    model = system.model
    rng = np.random.default_rng(seed)
    low, high = model.region(vector)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    period = model.view(vector).period or 10.0
    turn = system.layout.turn
    length, events = 2.0 + 2.0 * turn, 40 * (1 + int(turn))
    if model.autonomous:
        length, events = _LONGEST, 4 * system.segments + 40
    starts = STARTS // 4
    for k in range(starts):
        say(f"simulating from start {k + 1} of {starts}")
        y = middle + rng.uniform(-1.0, 1.0, half.shape) * half
        if rng.random() < 0.5:
            y[1:] = 0.0  # at rest: the start of a stick or of a slide
        time = rng.uniform(0.0, period)
        try:
            mode, on = start_of(model, time, y, vector, None)
        except ParameterError:  # beyond a wall
            continue
        trajectory = run(model, vector, mode, on, time, y, length, events)
        yield from stretches(trajectory, system, period)


def stretches(
    trajectory: Trajectory, system: System, period: float
) -> Iterator[tuple[float, FloatArray]]:
    """Yield (mismatch, joints) for each place where a trajectory follows the system's itinerary."""
    model, count = system.model, system.segments
    itinerary = named_by_ends(trajectory.itinerary, model)
    clock = trajectory.times + trajectory.cycles * period
    points = np.column_stack([clock, trajectory.states])
    if not has_sections(model, system.itinerary):  # it passes them without joints
        kept = [i for i, pair in enumerate(itinerary) if pair not in model.sections]
        itinerary, points = tuple(itinerary[i] for i in kept), points[kept]
    closure, turn, first = system.layout.closure, system.layout.turn * period, system.itinerary[0]
    for i in range(1, len(itinerary) - count + 1):
        if itinerary[i] != first or itinerary[i : i + count] != system.itinerary:
            continue
        joints = clocked(model, points[i - 1 : i - 1 + count].copy(), points[i - 1 + count, 0])
        gap = points[i - 1 + count, 1:] - joints[0, 1:] @ closure.T
        slip = 0.0
        if not model.autonomous:
            slip = points[i - 1 + count, 0] - joints[0, 0] - turn
            joints[:, 0] -= np.floor(joints[0, 0] / period) * period
        yield float(np.max(np.abs(gap)) + abs(slip)), joints


def refine_with_symmetry(orbit: Orbit) -> Orbit:
    """Solve an orbit, on its half if it turns out symmetric."""
    solved = refine(orbit)
    if not solved.converged:
        return solved
    half = solved.as_half()
    return solved if half is solved else refine(half)


def centred(orbit: Orbit) -> Orbit:
    """Return an orbit on its half, moved to where it is symmetric, if a constant does that; else as it is.

    Masses that nothing holds may oscillate anywhere: orbits are a continuum in which each is another one
    moved by a constant, and one of them is its own image. The symmetry R takes a place d of it to -d, so that
    ``y(t + T/2) - R y(t)`` is 2 d all along. Where a contact rests that never slips is a datum, and stays.
    """
    if not np.isfinite(orbit.mirror_distance) or len(conserved(orbit.model, orbit.itinerary)):
        return orbit
    assert orbit.model.symmetry is not None
    n, states = len(orbit.joints) // 2, orbit.joints[:, 1:]
    turned = orbit.model.symmetry.array()
    twice = states[n:] - states[:n] @ turned.T
    offset = 0.5 * np.mean(twice, axis=0)
    small = _SAME * (1.0 + float(np.max(np.abs(states))))
    if max(np.ptp(twice, axis=0).max(), np.max(np.abs(turned @ offset + offset))) > small:
        return orbit
    joints = orbit.joints.copy()
    joints[:, 1:] -= offset
    half = replace(orbit, joints=joints).as_half()
    if not half.system.half:
        return orbit
    found = refine(half)
    moved = float(np.max(np.abs(found.joints - half.joints)))
    return found if found.converged and found.admissible and moved < small else orbit
