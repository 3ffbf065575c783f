"""Cycles that are born at a Hopf point or a boundary equilibrium, solved for as periodic orbits.

A cycle of a Hopf point is, to first order in its amplitude a, the ellipse ``y0 + 2 a Re(q exp(i omega t))``
of the centre subspace, at the parameter where the normal form (:mod:`contfric.equilibria.hopf`) has it,
``mu = -omega l1 a^2``. It is cut where it crosses a section of the model and handed to Newton's method, which
finds it whether it is stable or not. A cycle at a boundary equilibrium has no such ellipse: its size is
proportional to the distance of the parameter, and simulations on both sides of the event find it where it
attracts.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.equilibria.events import BoundaryPoint, EquilibriumEvent, HopfPoint
from contfric.equilibria.regions import regions_of, scale_of
from contfric.errors import ContfricError, ConvergenceError, real_number
from contfric.orbit.orbit import Orbit, Status

if TYPE_CHECKING:
    from contfric.equilibria.hopf import Centre

#: Share of the way to the nearest boundary (or of the natural sizes) that a cycle takes up by default, and
#: how often it is halved where Newton's method fails.
_SHARE, _HALVINGS = 0.1, 8
#: A cycle is of the size that it was asked for within this factor; else it is another one.
_LIKE = 2.0
#: Distance of the parameter from a boundary equilibrium by default, relative to its value; a second one,
#: nearer by this factor, tells whether a cycle shrinks with it, to this accuracy.
_DISTANCE, _NEARER, _PROPORTIONAL = 1e-2, 4.0, 0.3
#: Units of time that a cycle may take to attract.
_LONGEST = 4000


def cycle_of_hopf(event: HopfPoint, amplitude: float | None = None) -> Orbit:
    """Return a small cycle near a Hopf point; see :meth:`~contfric.HopfPoint.cycle`."""
    _check_autonomous(event)
    event = _with_section(event)
    if event.lyapunov == 0.0:
        raise ConvergenceError(
            f"{event!r}: the first Lyapunov coefficient is 0, and tells neither side nor size of a cycle"
        )
    first = (
        _amplitude(event) if amplitude is None else real_number("amplitude", amplitude, least=0.0)
    )
    for k in range(_HALVINGS if amplitude is None else 1):
        orbit = _solved(event, first * 0.5**k)
        if orbit is not None:
            return orbit
    raise ConvergenceError(
        f"{event!r}: Newton's method found no cycle of amplitude {first:.3g} or less; try another "
        "amplitude=..."
    )


def _with_section(event: HopfPoint) -> HopfPoint:
    """Return an event in a model with a section through its equilibrium, which cuts the cycles that are born.

    The rate of a state vanishes at an equilibrium.
    """
    from contfric.models.deriving.phases import with_phase

    at = event.equilibrium
    divided = None if any(_sections(event)) else with_phase(at.model, at.region.mode)
    if divided is None:
        return event
    region = next(r for r in regions_of(divided) if r.mode == at.region.mode)
    return replace(event, equilibrium=replace(at, region=region))


def _check_autonomous(event: EquilibriumEvent) -> None:
    model = event.equilibrium.model
    if not model.autonomous:
        raise ConvergenceError(
            f"model '{model.name}' has an excitation, and its orbits have that period: write it without one "
            "(autonomous: true) for cycles that are born at equilibria"
        )


def _amplitude(event: HopfPoint) -> float:
    """Return the default amplitude: a share of what the surfaces around and the natural sizes allow."""
    at, q = event.equilibrium, event.centre.vector
    region = at.region
    scale = scale_of(at.model, at.vector)
    limits = [float(np.min(scale / np.maximum(np.abs(q), 1e-12 * np.max(np.abs(q)))))]
    domain, _ = region.domain_of(at.state, at.vector)
    values, slopes = (f(at.state, at.vector) for f in (region.heights.value, region.heights.slopes))
    for k, name in enumerate(region.heights.names):
        reach = float(abs(slopes[k] @ q))
        if name in region.sides(domain) and region.bounds(domain, name) and reach > 0.0:
            limits.append(float(abs(values[k])) / reach)
    return 0.5 * _SHARE * min(limits)


def _solved(event: HopfPoint, amplitude: float) -> Orbit | None:
    """Return the cycle of an amplitude; None if Newton's method comes to none of that size."""
    from contfric.orbit.solve import refine_with_symmetry

    guess = _ellipse(event, amplitude)
    if guess is None:
        return None
    found = refine_with_symmetry(guess)
    if not (found.converged and found.admissible):
        return None
    centre = event.equilibrium.state
    sizes = [float(np.max(np.abs(o.joints[:, 1:] - centre))) for o in (guess, found)]
    return found if 1.0 / _LIKE < sizes[1] / sizes[0] < _LIKE else None


def _ellipse(event: HopfPoint, amplitude: float) -> Orbit | None:
    """Return the cycle of the normal form, unsolved; None at parameters that the model does not have."""
    from contfric.bvp.system import build_system
    from contfric.orbit.clock import clocked

    at, centre = event.equilibrium, event.centre
    model, active = at.model, at.model.index_of(event.parameter)
    moved = -centre.frequency * centre.lyapunov * amplitude**2 / centre.rate
    vector = at.vector.copy()
    vector[active] += moved
    try:
        model.check_params(model.mapping(vector))
    except ContfricError:
        return None
    middle = at.state + moved * centre.drift
    itinerary, phases = _cut(event, middle, vector, amplitude)
    period = 2.0 * math.pi / centre.frequency
    rows = [[t, *_point(centre, middle, amplitude, centre.frequency * t)] for t in phases]
    joints = clocked(model, np.array(rows), phases[0] + period)
    return Orbit(build_system(model, itinerary, 1), joints, vector, np.inf, Status.NOT_CONVERGED)


def _point(centre: Centre, middle: FloatArray, amplitude: float, angle: float) -> FloatArray:
    return np.asarray(middle + 2.0 * amplitude * (centre.vector * np.exp(1j * angle)).real)


def _cut(
    event: HopfPoint, middle: FloatArray, vector: FloatArray, amplitude: float
) -> tuple[tuple[tuple[str, str], ...], tuple[float, float]]:
    """Return the itinerary of the cycle at a section, and the times of its crossings, upwards first.

    Raises
    ------
    ConvergenceError
        If no section does.
    """
    at, centre = event.equilibrium, event.centre
    heights = at.region.heights
    values, slopes = heights.value(middle, vector), heights.slopes(middle, vector)
    best: tuple[float, str, tuple[str, str], complex, float] | None = None
    for name, modes in _sections(event):
        k = heights.names.index(name)
        swing = complex(2.0 * amplitude * (slopes[k] @ centre.vector))
        share = abs(values[k]) / abs(swing) if swing else math.inf
        if share < 1.0 and (best is None or share < best[0]):
            best = share, name, modes, swing, float(values[k])
    if best is None:
        raise ConvergenceError(
            f"{event!r}: the cycle meets no surface of '{at.model.name}', an orbit needs one to be fixed: "
            "declare a section through the equilibrium, a surface with a mode of the same field on each side "
            "(such as v = 0)"
        )
    _, name, (above, below), swing, height = best
    # height + |swing| cos(angle + turn) = 0, upwards where the sine is negative
    turn, opening = math.atan2(swing.imag, swing.real), math.acos(-height / abs(swing))
    up = (-opening - turn) / centre.frequency
    down = (opening - turn) / centre.frequency
    return ((above, name), (below, name)), (up, down)


def _sections(event: HopfPoint) -> Iterator[tuple[str, tuple[str, str]]]:
    """Yield the sections near an equilibrium, each with the modes above and below it."""
    at = event.equilibrium
    near = at.region.near(at.state, at.vector)
    for surface in at.model.surfaces:
        sides = {}
        for domain in at.region.domains:
            nearby = all(
                near[s] == 0.0 or near[s] * side > 0.0
                for s, side in at.region.sides(domain).items()
                if s != surface.name
            )
            if nearby:
                sides[domain.signs[surface.name]] = domain.own_mode
        if set(sides) == {1, -1} and sides[1] != sides[-1]:
            yield surface.name, (sides[1], sides[-1])


# ------------------------------------------------------------------------ boundary equilibria


def cycle_of_boundary(event: BoundaryPoint, distance: float | None = None) -> Orbit:
    """Return a small cycle near a boundary equilibrium; see :meth:`~contfric.BoundaryPoint.cycle`."""
    _check_autonomous(event)
    apart = _DISTANCE * (abs(event.value) or 1.0)
    if distance is not None:
        apart = real_number("distance", distance, least=0.0)
    for sign in (1.0, -1.0):
        for far in _attractors(event, sign * apart):
            reach = _reach(event, far)
            near = [_reach(event, o) for o in _attractors(event, sign * apart / _NEARER)]
            if any(abs(r * _NEARER / reach - 1.0) < _PROPORTIONAL for r in near):
                return far
    raise ConvergenceError(
        f"{event!r}: no attracting cycle was found that shrinks to the equilibrium with the distance from "
        f"the event ({apart:.3g}); try another distance=..."
    )


def _attractors(event: BoundaryPoint, moved: float) -> Iterator[Orbit]:
    """Yield the orbits that simulations from near a boundary equilibrium come to, near the event."""
    from contfric.orbit.finding.find import find_orbit

    at = event.equilibrium
    params = {**event.params, event.parameter: event.value + moved}
    scale = scale_of(at.model, at.vector)
    found: list[float] = []
    for k in range(len(scale)):
        for side in (1.0, -1.0):
            start = at.state.copy()
            start[k] += side * abs(moved) * scale[k]
            try:
                orbit = find_orbit(at.model, params, state=start, longest=_LONGEST)
            except ContfricError:  # it rests, diverges, or starts in no domain
                continue
            reach = _reach(event, orbit)
            if not any(abs(reach - other) < 1e-6 * other for other in found):
                found.append(reach)
                yield orbit


def _reach(event: BoundaryPoint, orbit: Orbit) -> float:
    """Return how far the joints of an orbit are from the boundary equilibrium."""
    return float(np.max(np.abs(orbit.joints[:, 1:] - event.equilibrium.state)))
