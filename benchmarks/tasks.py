"""What is measured: one orbit, one fold, one branch, a simulation; each by every method."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from many_digits import DIGITS, Reference, farthest
from measuring import Case
from mpmath import mp, mpf
from peers import arclength, shooting, simulation
from peers.collocation import OrbitByCollocation
from peers.collocation_branch import BranchByCollocation
from peers.collocation_fold import FoldByCollocation
from peers.interpreted import orbit_in_closed_form
from peers.oscillator import Failure
from settings import (
    NEAR_FOLD,
    NODES,
    OMEGA,
    S0,
    TOLS,
    Method,
    S,
    joints_of,
    orbit_at,
    params_at,
    rows_of,
)

import contfric as cf
from contfric.orbit.orbit import Orbit, Status
from contfric.orbit.solve import refine

#: How far each time and position of a start is off: what one reads from a picture.
OFF = 1e-2
#: A joint slower than this is a stop, where the velocity is not an unknown.
AT_REST = 1e-9
#: The ranges for the fold and for the branch, in Omega: the fold only, and that of the figure.
FOLD_ONLY, WHOLE = (0.535, 0.545), (0.4, 0.6)
#: Where collocation begins for the fold: two orbits this far apart in Omega.
APART = 1e-3
#: The first step of collocation along the branch, in Omega: about as long as the others.
FIRST = 1e-3
#: Start and length of the simulation: near 1a, and long enough for the transient to be a small part.
HEIGHT, PERIODS, MANY = 1.43, 200, 10_000


def moved(orbit: Orbit) -> Orbit:
    """Return the orbit as an unsolved start, each time and position off by OFF, signs in turn.

    Velocities are moved where they are unknowns, that is, at the joints that are not stops.
    """
    joints = orbit.joints.copy()
    signs = np.where(np.arange(len(joints)) % 2 == 0, 1.0, -1.0)
    joints[:, 0] += OFF * signs
    joints[:, 1] -= OFF * signs
    joints[:, 2] += np.where(np.abs(joints[:, 2]) > AT_REST, OFF * signs, 0.0)
    return Orbit(orbit.system, joints, orbit.vector.copy(), np.inf, Status.NOT_CONVERGED)


def solved(start: Orbit) -> tuple[Orbit, str]:
    """Solve with contfric."""
    orbit = refine(start)
    if not orbit.converged:
        raise Failure(orbit.status.value)
    return orbit, f"{orbit.system.segments} segments"


def orbit_cases(methods: list[Method]) -> list[Case]:
    """Task (a)."""
    reduced, full = orbit_at(OMEGA), orbit_at(OMEGA, full=True)
    times = reduced.joints[rows_of(reduced.itinerary), 0]
    exact = Reference(S, S0).orbit(OMEGA, [f"{t:.6f}" for t in times])
    start, whole = moved(reduced), moved(full)
    joints, params = joints_of(start), (OMEGA, S, S0)

    def error(found: Any) -> float:
        return farthest(joints_of(found) if isinstance(found, Orbit) else found, exact)

    cases = [
        Case("contfric, reduced form", "", lambda: solved(start), error),
        Case("contfric, full form", "", lambda: solved(whole), error),
    ]
    for method in (m for m in methods if m.name == "DOP853"):
        call = partial(shooting.orbit_by_secant, joints[0], params, method.how)
        cases.append(Case("DOP853, secant", method.setting, call, error))
    for method in methods:
        call = partial(shooting.orbit_by_newton, joints[0], params, method.how)
        cases.append(Case(method.name, method.setting, call, error))
    collocation = OrbitByCollocation(joints, params, NODES)
    for tol in TOLS:
        cases.append(Case("solve_bvp", f"tol {tol:.0e}", partial(collocation.solve, tol), error))
    closed = partial(orbit_in_closed_form, joints[0], params)
    cases.append(Case("closed form, interpreted", "", closed, error))
    return cases


def fold_on(orbit: Orbit, low: float, high: float) -> tuple[float, str]:
    """Omega of the fold on the branch of an orbit, with contfric."""
    branch = cf.continue_orbit(orbit, "Omega", (low, high))
    folds = [b.params["Omega"] for b in branch.bifurcations if b.kind == "SN"]
    if len(folds) != 1:
        raise Failure(f"{len(folds)} folds found")
    return folds[0], f"{len(branch)} points"


def exact_fold() -> Any:
    """Omega of the fold to 40 digits, from the fold to three digits and its joints to three."""
    near = cf.continue_orbit(orbit_at(NEAR_FOLD), "Omega", FOLD_ONLY).bifurcations[0]
    times = near.orbit.joints[rows_of(near.orbit.itinerary), 0]
    return Reference(S, S0).fold(f"{near.params['Omega']:.3g}", [f"{t:.3f}" for t in times])


def fold_cases(methods: list[Method]) -> list[Case]:
    """Task (b)."""
    exact = exact_fold()
    reduced, full = orbit_at(NEAR_FOLD), orbit_at(NEAR_FOLD, full=True)
    t0 = joints_of(reduced)[0]

    def error(found: float) -> float:
        return farthest([found], [exact])

    cases = [
        Case(
            f"contfric, {form} form",
            f"{low:g} to {high:g}",
            partial(fold_on, orbit, low, high),
            error,
        )
        for form, orbit in (("reduced", reduced), ("full", full))
        for low, high in (FOLD_ONLY, WHOLE)
    ]
    for method in methods:
        call = partial(shooting.fold_by_newton, t0, NEAR_FOLD, S, S0, method.how)
        cases.append(Case(method.name, method.setting, call, error))
    starts = [(joints_of(orbit_at(omega)), omega) for omega in (NEAR_FOLD - APART, NEAR_FOLD)]
    collocation = FoldByCollocation(starts, S, S0, NODES)
    for tol in TOLS:
        cases.append(Case("solve_bvp", f"tol {tol:.0e}", partial(collocation.solve, tol), error))
    return cases


def followed(orbit: Orbit, stability: bool) -> tuple[arclength.Followed, str]:
    """Follow the whole branch with contfric."""
    branch = cf.continue_orbit(orbit, "Omega", WHOLE, stability=stability)
    folds = [b.params["Omega"] for b in branch.bifurcations if b.kind == "SN"]
    rows = rows_of(branch.system.itinerary)
    joints = branch.joints[:, rows, :2].reshape(len(branch), -1)
    points = list(zip(branch.values, joints, strict=True))
    return arclength.Followed(points, *folds), f"{len(branch)} points"


def branch_task() -> arclength.Task:
    """The branch as the peers are given it: both ends, and steps for as many points as contfric has."""
    branch = cf.continue_orbit(orbit_at(OMEGA), "Omega", WHOLE)
    releases = branch.joints[:, rows_of(branch.system.itinerary)[0], 0]
    length = np.hypot(np.diff(releases), np.diff(branch.values)).sum()
    lower, upper = (float(end.bifurcation.params["Omega"]) for end in branch.ends)
    t0 = joints_of(orbit_at(OMEGA))[0]
    return arclength.Task(t0, OMEGA, S, S0, length / (len(branch) - 1), FIRST, (lower, upper))


def branch_cases(methods: list[Method]) -> list[Case]:
    """Task (c)."""
    exact, reference, task = exact_fold(), Reference(S, S0), branch_task()
    reduced, full = orbit_at(OMEGA), orbit_at(OMEGA, full=True)

    def error(found: arclength.Followed) -> float:
        points = max(reference.distance(omega, joints) for omega, joints in found.points)
        return max(points, farthest([found.fold], [exact]))

    cases = [
        Case("contfric, reduced form", "", lambda: followed(reduced, True), error),
        Case("contfric, no multipliers", "", lambda: followed(reduced, False), error),
        Case("contfric, full form", "", lambda: followed(full, True), error),
    ]
    for method in methods:
        call = partial(arclength.follow, task, method.how)
        cases.append(Case(method.name, method.setting, call, error))
    collocation = BranchByCollocation(task, joints_of(reduced), NODES)
    for tol in TOLS:
        cases.append(Case("solve_bvp", f"tol {tol:.0e}", partial(collocation.follow, tol), error))
    return cases


def simulated(periods: int) -> tuple[list[tuple[int, float]], str]:
    """Simulate with contfric."""
    path = cf.simulate("coulomb", params_at(OMEGA), state=[HEIGHT, 0.0], periods=periods)
    return path, f"{len(path)} events"


def by_peer(method: Method, count: int) -> tuple[list[tuple[int, float]], str]:
    """Simulate with an integrator; another number of events is another solution, and a failure."""
    found, remark = simulation.simulate(HEIGHT, PERIODS, (OMEGA, S, S0), method.how)
    if len(found) != count:
        raise Failure(f"{len(found)} events instead of {count}")
    return found, remark


def simulation_cases(methods: list[Method]) -> list[Case]:
    """Task (d)."""
    exact = Reference(S, S0).simulate(HEIGHT, PERIODS, OMEGA)
    count = len(exact)
    with mp.workdps(DIGITS):
        period = 2 * mp.pi / mpf(OMEGA)

    def error(found: Any) -> float:
        if not isinstance(found, list):
            found = list(zip(found.cycles, found.times, strict=True))[:count]
        with mp.workdps(DIGITS):
            return farthest([int(c) * period + mpf(float(t)) for c, t in found], exact)

    cases = [
        Case("contfric", f"{n} periods", partial(simulated, n), error, len(simulated(n)[0]))
        for n in (PERIODS, MANY)
    ]
    for method in methods:
        call = partial(by_peer, method, count)
        cases.append(Case(method.name, method.setting, call, error, count))
    return cases
