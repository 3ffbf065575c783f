"""Write docs/benchmarks-error.md and docs/images/error_orbit.png: run time against error.

All methods run in one process and take turns. The peers and the 40-digit reference stand in ``peers.py``.
"""

from __future__ import annotations

import math
import os
import platform
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import matplotlib as mpl
import numpy as np
import peers
import scipy
from mpmath import mp, mpf

import contfric as cf
from contfric.orbit.full_form import full_form
from contfric.orbit.orbit import Orbit, Status
from contfric.orbit.simulation import Trajectory
from contfric.orbit.solve import polish
from contfric.plot.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION

mpl.use("Agg")
import matplotlib.pyplot as plt

ROUNDS = 9
#: A call shorter than this is repeated within its turn until this much time has passed.
SHORTEST = 5e-3
S, S0 = 0.32, 0.4
OMEGA, NEAR_FOLD = 0.5, 0.54
OFF = 1e-2
RTOLS = [10.0**-k for k in range(4, 13)]
TOLS = [10.0**-k for k in range(3, 10)]
NODES = 21
HEIGHT, PERIODS, MANY = 1.43, 20, 1000
#: Errors for which the fastest setting of each method is looked up.
WANTED = (1e-3, 1e-6, 1e-9, 1e-12)

Result = tuple[float, str]


@dataclass
class Case:
    """One setting of one method: a call that returns (anything, remark), and the error of that."""

    method: str
    setting: str
    call: Callable[[], tuple[object, str]]
    error: Callable[[object], float]
    units: int = 1


@dataclass
class Row:
    """What was measured: error and remark, or a failure; seconds for one unit."""

    case: Case
    error: float
    remark: str
    failed: bool
    median: float
    least: float


def attempt(case: Case) -> tuple[object, str, bool]:
    """Return (result, remark, failed)."""
    try:
        return *case.call(), False
    except (peers.Failure, ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
        return None, f"FAILED: {error}", True


def measure(cases: list[Case]) -> list[Row]:
    """Run all cases once (warm-up, result), then in turns."""
    outcomes, repeats = [], []
    for case in cases:
        result, remark, failed = attempt(case)
        error = math.inf if failed else case.error(result)
        outcomes.append((error, remark, failed))
        start = time.perf_counter()
        attempt(case)
        repeats.append(math.ceil(SHORTEST / max(time.perf_counter() - start, 1e-7)))
    seconds: list[list[float]] = [[] for _ in cases]
    for _ in range(ROUNDS):
        for k, case in enumerate(cases):
            start = time.perf_counter()
            for _ in range(repeats[k]):
                attempt(case)
            seconds[k].append((time.perf_counter() - start) / repeats[k] / case.units)
    return [
        Row(case, *outcome, statistics.median(s), min(s))
        for case, outcome, s in zip(cases, outcomes, seconds, strict=True)
    ]


def farthest(found: object, exact: list) -> float:
    """Largest distance, taken in many digits."""
    with mp.workdps(peers.DIGITS):
        pairs = zip(found, exact, strict=True)  # type: ignore[call-overload]
        return float(max(abs(mpf(a) - b) for a, b in pairs))


# ------------------------------------------------------------------------------------ the tasks


def moved(orbit: Orbit) -> Orbit:
    """Return the orbit as an unsolved start, each time and position off by OFF, signs in turn.

    Velocities are moved where they are unknowns, that is, at the joints that are not stops.
    """
    joints = orbit.joints.copy()
    signs = np.where(np.arange(len(joints)) % 2 == 0, 1.0, -1.0)
    joints[:, 0] += OFF * signs
    joints[:, 1] -= OFF * signs
    joints[:, 2] += np.where(np.abs(joints[:, 2]) > 1e-9, OFF * signs, 0.0)
    return Orbit(orbit.system, joints, orbit.vector.copy(), np.inf, Status.NOT_CONVERGED)


def common_joints(orbit: Orbit) -> list[int]:
    """Rows of the release, the upper stop and the lower stop."""
    modes = [mode for mode, _ in orbit.word]
    return [
        next(i for i in range(len(modes)) if modes[i] == name and modes[i - 1] != name)
        for name in ("slide+", "slide-", "stick")
    ]


def solved(start: Orbit) -> tuple[object, str]:
    """Solve with contfric."""
    orbit = polish(start)
    if not orbit.converged:
        raise peers.Failure(orbit.status.value)
    return orbit, f"{orbit.system.segments} segments"


def orbit_cases() -> list[Case]:
    """Task (a)."""
    reduced = cf.solve_orbit("coulomb", "1a", {"Omega": OMEGA, "S": S, "S0": S0})
    full = full_form(reduced)
    rows = common_joints(reduced)
    exact = peers.Reference(S, S0).orbit(OMEGA, [f"{t:.6f}" for t in reduced.joints[rows, 0]])
    start, whole = moved(reduced), moved(full)
    joints = tuple(map(float, start.joints[rows, :2].ravel()))
    params = (OMEGA, S, S0)
    collocation = peers.Collocation(joints, params, NODES)

    def error(found: object) -> float:
        if isinstance(found, Orbit):
            found = found.joints[common_joints(found), :2].ravel()
        return farthest(found, exact)

    cases = [
        Case("contfric, reduced form", "", lambda: solved(start), error),
        Case("contfric, full form", "", lambda: solved(whole), error),
    ]
    for name, solver, refined in (
        ("DOP853, secant", peers.orbit_by_secant, False),
        ("DOP853, variational Newton", peers.orbit_by_newton, False),
        ("DOP853, the same, stops refined", peers.orbit_by_newton, True),
    ):
        for rtol in RTOLS:
            how = peers.Shooting(rtol, refined)
            call = partial(solver, joints[0], params, how)
            cases.append(Case(name, f"rtol {rtol:.0e}", call, error))
    cases += [
        Case("solve_bvp", f"tol {tol:.0e}", partial(collocation.solve, tol), error) for tol in TOLS
    ]
    closed = partial(peers.orbit_in_closed_form, joints[0], params)
    cases.append(Case("closed form, interpreted", "", closed, error))
    return cases


def fold_cases() -> tuple[list[Case], str]:
    """Task (b); with the digits of the reference."""
    orbit = cf.solve_orbit("coulomb", "1a", {"Omega": NEAR_FOLD, "S": S, "S0": S0})
    times = orbit.joints[common_joints(orbit), 0]

    def by_continuation(low: float, high: float, stability: bool) -> tuple[object, str]:
        branch = cf.continue_orbit(orbit, "Omega", (low, high), stability=stability)
        folds = [b.params["Omega"] for b in branch.bifurcations if b.kind == "SN"]
        if len(folds) != 1:
            raise peers.Failure(f"{len(folds)} folds found")
        return folds, f"{len(branch)} points"

    # the reference starts from the fold to three digits, and from the joints there to three
    (fold,) = by_continuation(0.535, 0.545, False)[0]  # type: ignore[misc]
    near = cf.continue_orbit(orbit, "Omega", (0.535, 0.545)).bifurcations[0].orbit
    starts = [f"{t:.3f}" for t in near.joints[common_joints(near), 0]]
    exact = [peers.Reference(S, S0).fold(f"{fold:.3g}", starts)]

    def error(found: object) -> float:
        return farthest(found, exact)

    cases = [
        Case("contfric, 0.535 to 0.545", "", lambda: by_continuation(0.535, 0.545, True), error),
        Case("contfric, 0.4 to 0.6", "", lambda: by_continuation(0.4, 0.6, True), error),
    ]

    def by_shooting(how: peers.Shooting) -> tuple[object, str]:
        omega, remark = peers.fold_by_newton(float(times[0]), NEAR_FOLD, S, S0, how)
        return [omega], remark

    for name, refined in (
        ("DOP853, hybrid Newton", False),
        ("DOP853, the same, stops refined", True),
    ):
        for rtol in RTOLS:
            call = partial(by_shooting, peers.Shooting(rtol, refined))
            cases.append(Case(name, f"rtol {rtol:.0e}", call, error))
    return cases, mp.nstr(exact[0], 20)


def simulation_cases() -> list[Case]:
    """Task (c)."""
    params = {"Omega": OMEGA, "S": S, "S0": S0}
    exact = peers.Reference(S, S0).simulate(HEIGHT, PERIODS, OMEGA)
    count = len(exact)
    with mp.workdps(peers.DIGITS):
        period = 2 * mp.pi / mpf(OMEGA)

    def error(found: object) -> float:
        if isinstance(found, Trajectory):
            found = list(zip(found.cycles[:count], found.times[:count], strict=True))
        with mp.workdps(peers.DIGITS):
            times = [int(c) * period + mpf(float(t)) for c, t in found]  # type: ignore[attr-defined]
        return farthest(times, exact)

    def simulated(periods: int) -> tuple[object, str]:
        path = cf.simulate("coulomb", params, state=[HEIGHT, 0.0], periods=periods)
        if len(path) < count or (periods == PERIODS and len(path) > count):
            raise peers.Failure(f"{len(path)} events")
        return path, f"{len(path)} events"

    long = len(cf.simulate("coulomb", params, state=[HEIGHT, 0.0], periods=MANY))
    cases = [
        Case(f"contfric, {PERIODS} periods", "", lambda: simulated(PERIODS), error, count),
        Case(f"contfric, {MANY} periods", "", lambda: simulated(MANY), error, long),
    ]

    def by_steps(how: peers.Shooting) -> tuple[object, str]:
        found, remark = peers.simulate(HEIGHT, PERIODS, (OMEGA, S, S0), how)
        if len(found) != count:
            raise peers.Failure(f"{len(found)} events instead of {count}")
        return found, remark

    for name, refined in (
        (f"DOP853, {PERIODS} periods", False),
        ("DOP853, the same, stops refined", True),
    ):
        for rtol in RTOLS:
            call = partial(by_steps, peers.Shooting(rtol, refined))
            cases.append(Case(name, f"rtol {rtol:.0e}", call, error, count))
    return cases


# -------------------------------------------------------------------------------------- output


def duration(seconds: float) -> str:
    """Return a time with its unit."""
    if math.isnan(seconds):
        return "-"
    return f"{seconds * 1e6:.3g} us" if seconds < 1e-3 else f"{seconds * 1e3:.4g} ms"


def table(rows: list[Row]) -> list[str]:
    """All settings, failures too."""
    lines = [
        "| method | setting | time (median) | time (minimum) | error | remark |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        error = "-" if row.failed or math.isinf(row.error) else f"{row.error:.1e}"
        lines.append(
            f"| {row.case.method} | {row.case.setting} | {duration(row.median)} "
            f"| {duration(row.least)} | {error} | {row.remark} |"
        )
    return lines


def methods(rows: list[Row]) -> list[str]:
    """Names in their order."""
    return list(dict.fromkeys(row.case.method for row in rows))


def summary(rows: list[Row]) -> list[str]:
    """The fastest setting of each method for an error wanted."""
    lines = [
        "| error at most | " + " | ".join(f"{w:.0e}" for w in WANTED) + " |",
        "|---" * (len(WANTED) + 1) + "|",
    ]
    for method in methods(rows):
        cells = []
        for wanted in WANTED:
            good = [r.median for r in rows if r.case.method == method and r.error <= wanted]
            cells.append(duration(min(good)) if good else "not reached")
        lines.append(f"| {method} | " + " | ".join(cells) + " |")
    return lines


def draw(rows: list[Row], path: Path) -> None:
    """Error against time, one line for each method."""
    styles = zip("o^sDPvX", (VERMILLION, ORANGE, SKY, BLUE, PURPLE, GREEN, BLACK), strict=True)
    figure, ax = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    for method, (marker, colour) in zip(methods(rows), styles, strict=True):
        good = [r for r in rows if r.case.method == method and not r.failed]
        ax.loglog(
            [r.median for r in good],
            [max(r.error, 1e-17) for r in good],
            marker=marker,
            color=colour,
            markersize=8 if len(good) == 1 else 5,
            linewidth=1.2,
            label=method,
            linestyle="-" if len(good) > 1 else "none",
        )
    ax.set_xlabel("time of one solution, s")
    ax.set_ylabel("largest error of a joint")
    ax.set_title(rf"Orbit 1a, $\Omega$ = {OMEGA}, $S$ = {S}, $S_0$ = {S0}")
    ax.grid(True, which="major", linewidth=0.4, alpha=0.6)
    ax.legend(frameon=True, fontsize=9)
    figure.savefig(path, dpi=150)
    plt.close(figure)


PAGE = """\
# Run time against error

Written by `make bench` (`benchmarks/error.py`, which took {took} s). All settings run in one process and
take turns; medians and minima of {rounds} rounds. A call shorter than {shortest} is repeated within its
turn, so short ones are measured with warm caches. Compiled kernels are loaded before: compiling them
(once, then cached on disk) is not counted. {machine}.

The reference has {digits} digits and shares nothing with the library but a rough start: slides in closed
form, Newton with mpmath (`benchmarks/peers.py`). Failures stay in the tables: {failures} of {settings}.

The comparison is not one of integrators. For this model contfric has the slides in closed form, and
compiled; the peers integrate numerically with a right-hand side in Python, as for any other model. How much
of the difference the closed form makes without a compiler is the method "closed form, interpreted" below.
Contfric has no tolerance to choose, so it is one point and not a curve.

## One orbit: 1a at Omega = {omega}, S = {S}, S0 = {S0}

Every time and position of the start is {off} off. The error is the largest one of the times and positions
of the release and of both stops. No method computes stability or admissibility here.

* **contfric, reduced form**: Newton on the joints of both slides and the stick.
* **contfric, full form**: the same with one segment for each of the model's seven domains that the orbit
  visits ({segments}); the crossings of the static limits are joints too, {off} off in velocity as well.
* **DOP853, secant**: `solve_ivp` with a terminal event at each stop (atol = rtol), the stick in closed form;
  `scipy.optimize.newton` (secant) on the release time, to the tolerance rtol.
* **DOP853, variational Newton**: the same with variational equations, their jumps at the joints exact.
* **stops refined**: scipy takes an event from the interpolant of a step, which is less exact than the step.
  Here the last step is repeated to the event, and the rest of the velocity removed by Newton.
* **solve_bvp**: both slides on [0, 1] at once, release and durations as parameters, all Jacobians analytic,
  {nodes} nodes at first; the first guess is one rough integration from the start (not counted).
* **closed form, interpreted**: secant on the release time, slides in closed form in plain Python, `brentq`.

![Error against time](images/error_orbit.png)

Time of the fastest setting whose error is small enough:

{orbit_summary}

All settings:

{orbit_table}

## The fold SN of 1a in Omega

S = {S}, S0 = {S0}; all start from the orbit at Omega = {near}. The error is that of Omega;
the reference (where the Jacobian of the orbit is singular) begins with {fold}.

* **contfric**: the branch is continued over the range named, with multipliers, admissibility and all other
  events; the fold is found on the way, from no guess. The time is that of the whole branch.
* **DOP853, hybrid Newton**: only the fold, and the start must be near enough: `scipy.optimize.root` on
  (release time, Omega) for a return with slope 1, to the tolerance rtol. The slope comes from variational
  equations, the Jacobian from forward differences once and then from updates.

{fold_summary}

{fold_table}

## Simulation

From rest at x = {height} at t = 0, Omega = {omega}, S = {S}, S0 = {S0}: the motion tends to 1a. The error is
the largest one of the event times over the first {periods} periods ({events}); times are for one event. All
keep time as completed periods and phase, and decide at each stop what follows. DOP853 has a terminal event
at each stop, and sticks in closed form.

{simulation_summary}

{simulation_table}
"""


def main() -> None:
    """Measure, draw and write the page."""
    began = time.perf_counter()
    folds, digits_of_fold = fold_cases()
    tasks = [measure(cases) for cases in (orbit_cases(), folds, simulation_cases())]
    took = time.perf_counter() - began
    docs = Path(__file__).parents[1] / "docs"
    draw(tasks[0], docs / "images" / "error_orbit.png")
    orbit, fold, simulation = tasks
    failures = sum(row.failed for rows in tasks for row in rows)
    text = PAGE.format(
        took=f"{took:.0f}",
        rounds=ROUNDS,
        shortest=duration(SHORTEST),
        machine=f"{platform.machine()}, {os.cpu_count()} processors, Python "
        f"{platform.python_version()}, numpy {np.__version__}, scipy {scipy.__version__}",
        digits=peers.DIGITS,
        failures=failures,
        settings=sum(map(len, tasks)),
        omega=OMEGA,
        S=S,
        S0=S0,
        off=f"{OFF:g}",
        segments=orbit[1].remark,
        nodes=NODES,
        near=NEAR_FOLD,
        fold=digits_of_fold,
        height=HEIGHT,
        periods=PERIODS,
        events=simulation[0].remark,
        orbit_summary="\n".join(summary(orbit)),
        orbit_table="\n".join(table(orbit)),
        fold_summary="\n".join(summary(fold)),
        fold_table="\n".join(table(fold)),
        simulation_summary="\n".join(summary(simulation)),
        simulation_table="\n".join(table(simulation)),
    )
    page = docs / "benchmarks-error.md"
    page.write_text(text, encoding="utf-8")
    print(page.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
