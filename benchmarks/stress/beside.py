"""Margins of an orbit in 50 digits, and orbits just next to an event: solved, judged, continued."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from agreement import compare
from bordered import SIDE, extrema, touching
from chain import Exact, NoReference, acceleration, force, solve
from condition import sensitivity
from report import Tally
from scenes import refusal

import contfric as cf
from contfric.bvp.system import EventFunction, Margin
from contfric.orbit.solve import refine

#: Distance to an event in its parameter, and of a stop to a surface.
NEAR, TOUCHING = 1e-10, 1e-12
#: Beside a fold an orbit is the root of that distance away, times its curvature.
AWAY = 1e-3
#: Share of the range over which a branch is followed from next to an event.
FOLLOWED = 0.02
#: An exit that is met with a rate below this is tangential: multipliers are as large as 1/rate.
TANGENTIAL = 1e-12


def margin(exact: Exact, kind: str, test: EventFunction) -> Any:
    """Return one margin of an orbit in 50 digits; positive if obeyed.

    Raises
    ------
    NoReference
        If it is an extremum inside a segment that has none.
    """
    chain, p = exact.chain, exact.p
    i, s = test.segment, chain.modes[test.segment]
    t, x = chain.closed(exact.z, p)[i + 1]
    f, rate, _ = force(p, t)
    if test.margin is Margin.EXIT:
        return -chain.sides[i] * rate if s == 0 else -s * acceleration(p, s, (t, x))
    side = SIDE.get(test.surface, 0)
    if test.margin is Margin.JOINT:
        following = chain.modes[(i + 1) % len(chain)] * (chain.sign if i + 1 == len(chain) else 1)
        inside = -side if s == 0 or following == 0 else -following
        return inside * (x - f - side * p[2])
    value = touching(chain, kind, i, side)
    instants = extrema(chain, value, exact.z, p, i)
    if not instants:
        raise NoReference("no extremum inside the segment")
    inside = -side if s == 0 else s
    return min(inside * value(exact.z, p, t)[0] for t in instants)


def moved(event: cf.Bifurcation, parameter: str, by: float) -> cf.Orbit | None:
    """Return the orbit of an event solved next to it; None where the model has no such parameters."""
    orbit = event.orbit
    vector = orbit.vector.copy()
    vector[orbit.model.index_of(parameter)] += by
    try:
        orbit.model.vector(orbit.model.mapping(vector))
    except cf.ParameterError:
        return None
    return refine(replace(orbit, vector=vector), damped=False)


def beside(
    tally: Tally, event: cf.Bifurcation, parameter: str, bounds: tuple[float, float], where: str
) -> None:
    """Check the orbits on both sides of an event, and the branches continued from them."""
    for name, by in _offsets(event, parameter):
        orbit = moved(event, parameter, by)
        if orbit is None:
            continue
        if not orbit.converged:
            tally.met(f"{name} of {event.kind.value}: no orbit, and says so")
            continue
        if float(np.max(np.abs(orbit.joints - event.orbit.joints))) > AWAY:
            tally.met(f"{name} of {event.kind.value}: no orbit, Newton went to another one")
            continue
        here = f"{where}, {parameter} + {by:.3g}"
        try:
            exact = solve(orbit)
            judge_margin(tally, orbit, exact, event, name, here)
            found = compare(orbit, exact)
        except NoReference:
            tally.met(f"{name} of {event.kind.value}: no reference")
            continue
        tally.check(f"{name} of an event: joints, multipliers", found.fine, f"{here}: {found}")
        tally.largest(f"{name} of an event: joints, of rounding", found.joints_ratio)
        follow(tally, orbit, parameter, bounds, name, here)


def _offsets(event: cf.Bifurcation, parameter: str) -> Iterator[tuple[str, float]]:
    """Yield how far from the event to look, with a name for it."""
    for sign in (1.0, -1.0):
        yield "within 1e-10", sign * NEAR
    if event.kind not in ("CS", "SS"):
        return
    k = event.orbit.system.tests.index(event.tests[0])
    orbit = moved(event, parameter, NEAR)
    if orbit is None or not orbit.converged or orbit.margins[k] == 0.0:
        return
    for sign in (1.0, -1.0):
        yield "stop at 1e-12", sign * TOUCHING * NEAR / abs(float(orbit.margins[k]))


def judge_margin(
    tally: Tally, orbit: cf.Orbit, exact: Exact, event: cf.Bifurcation, name: str, where: str
) -> None:
    """Compare the margin that vanishes at the event, and its sign, with 50 digits."""
    exits = [k for k, test in enumerate(orbit.system.tests) if test.margin is Margin.EXIT]
    if float(np.min(np.abs(orbit.margins[exits]))) > TANGENTIAL:
        finite = bool(np.all(np.isfinite(orbit.multipliers)))
        tally.check(f"{name} of an event: multipliers are finite", finite, where)
    if event.kind not in ("CS", "SS", "AS", "GS"):
        return
    p = orbit.params
    # margins move with the force, the velocity and the acceleration at a joint
    fast = (1.0 + 3.0 * p["Omega"]) ** 2 * (1.0 + 9.0 * abs(p["h"])) + 2.0 * abs(p["zeta"])
    size = 1.0 + float(np.max(np.abs(orbit.joints[:, 1])))
    allowed = 4.0 * fast * size * float(np.max(sensitivity(exact)))
    test = event.tests[0]
    got = float(orbit.margins[orbit.system.tests.index(test)])
    wanted = float(margin(exact, event.kind.value, test))
    fine = abs(got - wanted) <= allowed
    text = f"{where}: {event.kind.value} margin {got!r}, in 50 digits {wanted!r}, +- {allowed:.2g}"
    tally.check(f"{name} of an event: its margin", fine, text)
    if abs(wanted) > allowed:
        tally.check(f"{name} of an event: sign of its margin", got * wanted > 0.0, text)


def follow(
    tally: Tally,
    orbit: cf.Orbit,
    parameter: str,
    bounds: tuple[float, float],
    name: str,
    where: str,
) -> None:
    """Continue from next to an event: both ends have their reasons, or a message says why not."""
    value, width = orbit.params[parameter], FOLLOWED * (bounds[1] - bounds[0])
    try:
        branch = cf.continue_orbit(orbit, parameter, (value - width, value + width))
    except cf.ContfricError as error:
        tally.met(f"continued from {name} of an event: {refusal(error)}")
        return
    for end in branch.ends:
        tally.check("continued from next to an event: ends have reasons", bool(str(end)), where)
        tally.met(f"continued from next to an event: {end.reason.name}")
