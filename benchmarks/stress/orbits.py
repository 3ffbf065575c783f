"""Orbits from random starts at random parameters, against 50 digits: joints, multipliers, places in time.

``python benchmarks/stress/orbits.py --count 300 --seed 0 --out orbits.json``
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from agreement import Agreement, admissible, compare
from chain import DIGITS, Exact, NoReference, slide, solve
from condition import EPS, sensitivity
from mpmath import mp, mpf
from report import Report, Tally, command_line
from scenes import Params, generator, refusal, start, strictly, time_limit

import contfric as cf
from contfric.orbit.solve import refine

WHAT = "Orbits from random starts, compared with their equations solved in 50 digits."
#: Longest that one case may take (s): the slowest of the first thousand took a tenth of it.
LIMIT = 60.0
#: Numbers of periods that an orbit is shifted by: to the last digits of a time.
SHIFTS = (1, 1000, 10**6, 10**9)
#: An orbit this near to an event may be called admissible or not; a joint may touch to 1e-9.
AT_EVENT = 1e-9
#: Joints of the longest orbit whose condition is computed: a dense inverse of twice the size.
MOST_JOINTS = 700
#: Every how many cases an orbit is looked for again by its signature (tens of milliseconds).
EVERY = 5
#: Starts of continua: Omega = 1/(2n) with S = S0; one of them for ten random cases.
CONTINUA = tuple((n, S) for S in (0.32, 1e-3, 0.05, 0.2, 0.5, 0.7) for n in (1, 2, 3, 4, 6, 10))
RANGES = {"Omega": 0.02, "S": 0.1, "S0": 0.1, "h": 0.1, "zeta": 0.05}

Progress = Callable[[str], None] | None


def run(count: int, seed: int, *, progress: Progress = None) -> Report:
    """Try orbits, then the continua of orbits at Omega = 1/(2n), S = S0."""
    began, tally = time.perf_counter(), Tally()
    for index in range(count):
        tally.index = index
        with mp.workdps(DIGITS):
            guarded(tally, one_case, seed, index)
        if progress is not None and index % 20 == 19:
            progress(f"orbits: {index + 1} of {count}, {len(tally.failed)} failures")
    for index, (n, friction) in enumerate(CONTINUA[: -(-count // 10)]):
        tally.index = -1 - index
        guarded(tally, continuum, n, friction)
    return tally.report("orbits", WHAT, count, seed, time.perf_counter() - began)


def guarded(tally: Tally, case: Callable[..., None], *args: float) -> None:
    """Try one case: no warning, no error that is not contfric's own, and in time."""
    try:
        with strictly(), time_limit(LIMIT):
            case(tally, *args)
    except NoReference as reason:
        tally.met(f"no reference: {str(reason).split(' at ')[0]}")
    except Exception as error:  # whatever it is, it is a failure of this case and not of the run
        tally.check("no exception", False, f"{case.__name__}{args}: {error!r}")
    else:
        tally.check("no exception", True)


def one_case(tally: Tally, seed: int, index: int) -> None:
    """Find an orbit, and look at it from all sides."""
    rng = generator(seed, index)
    kind, params, orbit, why = start(rng)
    tally.met(f"parameters: {kind}")
    if orbit is None:
        tally.met(why)
        return
    tally.met(f"periods: {_class(orbit.periods)}")
    where = f"{params}, {orbit.periods} periods"
    if orbit.degenerate:
        tally.met("orbit of a continuum, and says so")
        return
    tally.check("found orbit is admissible", orbit.admissible, f"{where}: {orbit.violations()}")
    if len(orbit.joints) > MOST_JOINTS:
        tally.met("too long for its condition")
        return
    exact = solve(orbit)
    judge(tally, "orbit", orbit, where, exact)
    violated = admissible(exact)
    beside = float(np.min(orbit.margins)) < AT_EVENT
    tally.check("admissible in 50 digits", not violated or beside, f"{where}: {violated}")
    shifted(tally, orbit, int(rng.choice(SHIFTS)), where)
    placed(tally, orbit, exact, int(rng.choice(SHIFTS)), rng.uniform(), where)
    if index % EVERY == 0:
        again(tally, orbit, params, where)
    if kind == "long":
        cascade(tally, orbit, rng)


def _class(periods: int) -> str:
    return str(periods) if periods < 4 else "4 to 15" if periods < 16 else "16 to 64"


def judge(
    tally: Tally, name: str, orbit: cf.Orbit, where: str, exact: Exact | None = None
) -> Agreement:
    """Compare an orbit with the reference and keep the result."""
    found = compare(orbit, exact)
    tally.check(f"{name}: joints and multipliers", found.fine, f"{where}: {found}")
    tally.largest(f"{name}: joints, of what rounding explains", found.joints_ratio)
    tally.largest(f"{name}: multipliers, of what rounding explains", found.multipliers_ratio)
    if not name.startswith("shifted"):  # there an error is that of the time itself
        tally.largest(f"{name}: joints, relative error", found.joints)
        tally.largest(f"{name}: multipliers, relative error", found.multipliers)
    if found.joints > 1e-14 or found.multipliers > 1e-14:
        tally.met(f"{name}: beyond 1e-14, explained by its condition", int(found.fine))
    return found


def shifted(tally: Tally, orbit: cf.Orbit, periods: int, where: str) -> None:
    """The same orbit many periods later: the same, to the digits that its times have left."""
    joints = orbit.joints.copy()
    joints[:, 0] += periods * orbit.period
    later = refine(replace(orbit, joints=joints), damped=False)
    where = f"{where}, shifted by {periods} turns"
    if not later.converged:  # its times have no digits left that Newton could correct
        tally.met(f"shifted by {periods:.0e}: not converged, and says so")
        return
    judge(tally, f"shifted by {periods:.0e}", later, where)


def placed(
    tally: Tally, orbit: cf.Orbit, exact: Exact, periods: int, share: float, where: str
) -> None:
    """The state at a late time: off by the rounding of that time, and by that of the joints."""
    whole = exact if exact.chain.sign > 0 else solve(orbit.as_whole())
    at = float(whole.z[0][0]) + (periods + share) * orbit.period
    x, v = state(whole, mpf(at))
    got = orbit.state(at)
    gap = max(abs(float(got[0] - x)), abs(float(got[1] - v)))
    fast = 1.0 + 3.0 * orbit.params["Omega"] + 2.0 * orbit.params["zeta"]
    size = 1.0 + float(np.max(np.abs(orbit.trajectory(60)[1])))
    joints = float(np.max(sensitivity(whole)))
    # the position in the period is good to an ulp of the time, and one of each period counted off
    allowed = 4.0 * fast * size * (EPS * abs(at) + joints)
    tally.check("state at a late time", gap <= allowed, f"{where} at {at!r}: {gap:.2g}")
    tally.largest("state at a late time, of what rounding explains", gap / allowed)


def state(whole: Exact, t: mpf) -> tuple[mpf, mpf]:
    """Return x and v of an orbit in 50 digits at a time."""
    chain, p = whole.chain, whole.p
    closed = chain.closed(whole.z, p)
    period = closed[-1][0] - closed[0][0]
    t = closed[0][0] + mp.fmod(t - closed[0][0], period)
    i = next(k for k in range(len(chain)) if t < closed[k + 1][0])
    if chain.modes[i] == 0:
        return closed[i][1], mpf(0)
    return slide(p, chain.modes[i], closed[i], t)[:2]


def again(tally: Tally, orbit: cf.Orbit, params: Params, where: str) -> None:
    """An orbit of the same signature, from its signature alone, and one from a late start."""
    try:
        judge(tally, "by signature", cf.solve_orbit("coulomb", orbit.signature, params), where)
    except cf.ConvergenceError:
        tally.met("signature not found from random starts, and says so")
    late = float(10**9 * orbit.period)
    try:
        found = cf.find_orbit("coulomb", params, time=late, longest=1000)
    except cf.ContfricError as error:
        tally.met(f"late start: {refusal(error)}")
        return
    if not found.degenerate:
        judge(tally, "found from a late start", found, f"{where}, time={late!r}")


def cascade(tally: Tally, orbit: cf.Orbit, rng: np.random.Generator) -> None:
    """Orbits of many periods, stable or not, through the period doublings next to an orbit."""
    parameter = str(rng.choice(["Omega", "S", "S0"]))
    value = orbit.params[parameter]
    bounds = (0.95 * value, 1.05 * value)
    diagram = cf.explore(orbit, parameter, bounds, bridges=False, max_periods=64, max_branches=12)
    for branch in diagram.branches:
        middle = branch[len(branch) // 2]
        if branch.mirrored or len(middle.joints) > MOST_JOINTS or middle.degenerate:
            continue
        where = f"{middle.params}, {middle.periods} periods, {middle.name}"
        try:
            judge(tally, "on a branch", refine(middle, damped=False), where)
        except NoReference:
            tally.met("no reference for a point of a branch")
        tally.met(f"on a branch, periods: {_class(middle.periods)}")


# ------------------------------------------------------------------------------------- continua


def continuum(tally: Tally, n: int, friction: float) -> None:
    """What is said of orbits at Omega = 1/(2n) with S = S0: each answer is an orbit or a message."""
    params = {"Omega": 1.0 / (2 * n), "S": friction, "S0": friction}
    where = f"Omega = 1/{2 * n}"
    orbits = []
    for name, call in _calls(params).items():
        try:
            found = call()
        except cf.ContfricError as error:
            tally.met(f"{name} at a continuum: {refusal(error)}")
            continue
        orbits.append(found)
        said = "a continuum" if found.degenerate else "no continuum"
        tally.met(f"{name} at a continuum: an orbit, {said}")
    for orbit in orbits:
        for parameter, half in RANGES.items():
            value = orbit.params[parameter]
            low = max(value - half * (1 + value), 0.0 if parameter != "h" else -1.0)
            outward(tally, orbit, parameter, (low, value + half), where)


def _calls(params: Params) -> dict[str, Callable[[], cf.Orbit]]:
    calls: dict[str, Callable[[], cf.Orbit]] = {
        "find_orbit": lambda: cf.find_orbit("coulomb", params, longest=3000)
    }
    for name in ("0s", "1a", "2s", "2a"):
        calls[f"solve_orbit {name}"] = lambda name=name: cf.solve_orbit("coulomb", name, params)
    return calls


def outward(
    tally: Tally, orbit: cf.Orbit, parameter: str, bounds: tuple[float, float], where: str
) -> None:
    """Continue and explore from an orbit of a continuum, or be told why not."""
    for call in (cf.continue_orbit, cf.explore):
        try:
            found = call(orbit, parameter, bounds)
        except cf.ContfricError as error:
            tally.met(f"{call.__name__} in {parameter} at a continuum: {refusal(error)}")
            continue
        branches = found.branches if isinstance(found, cf.Diagram) else (found,)
        for end in (end for branch in branches for end in branch.ends):
            named = isinstance(end.reason, cf.EndReason) and bool(str(end))
            tally.check("ends at a continuum have reasons", named, f"{where}, {parameter}")
            tally.met(f"end of a branch at a continuum: {end.reason.name}")


if __name__ == "__main__":
    command_line(run, count=300)
