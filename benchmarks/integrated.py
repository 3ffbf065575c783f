"""What it costs that a solution is integrated: next to the closed form, and next to scipy's integrators.

``python benchmarks/integrated.py`` writes ``docs/benchmarks-integrated.md`` and its figure. Times are the
least processor times of many calls: they are those of the code, not of what else runs on the machine.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numba
import numpy as np
from numba import types
from origin import origin
from scipy.integrate import solve_ivp

import contfric as cf

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "integrated"))

import coulomb_integrated
import lugre_integrated
import lugre_period

from contfric.compiled import f8, vector
from contfric.flow.integrated import Method
from contfric.flow.oscillator import flow as forced_oscillator

ROOT = Path(__file__).resolve().parents[1]
NONE, NOTHING = np.empty(0, dtype=np.int64), np.empty((0, 0))
SLIDE_LIMITS = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
LUGRE = np.array([0.5, 0.32, 0.4, 1000.0, 0.0, 0.0, 0.05])
TOLERANCES = (1e-6, 1e-9, 1e-12)


def least(call: Callable[[], Any], seconds: float = 0.3) -> float:
    """Least processor time of a call in microseconds; the first one compiles, and is not counted.

    Short calls are measured a millisecond at a time: the clock of the processor costs half a microsecond.
    """
    call()
    start = time.process_time()
    call()
    times = max(1, int(1e-3 / max(time.process_time() - start, 1e-7)))
    best, stop = math.inf, time.perf_counter() + seconds
    while time.perf_counter() < stop:
        start = time.process_time()
        for _ in range(times):
            call()
        best = min(best, (time.process_time() - start) / times)
    return 1e6 * best


def table(head: tuple[str, ...], rows: list[tuple[Any, ...]]) -> str:
    """A table in Markdown."""
    lines = [head, tuple("---" for _ in head), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)


# ------------------------------------------------------------------------- closed form or integrated


def segment_costs(flow: Any) -> list[float]:
    """Microseconds for a slide of 2.75 units of time: hit, turnings, flow, flow with derivatives."""
    p, y, t = np.array([0.5, 0.32, 0.4, 0.0, 0.0]), np.array([-0.8, 0.0]), 0.1
    y1, jac, times = np.empty(2), np.empty((2, 5)), np.empty((2, 9))
    tau = forced_oscillator.hit(0, 1, 0.0, True, t, y, 30.0, p, y1)
    omega = np.array([0])
    return [
        least(lambda: flow.hit(0, 1, 0.0, True, t, y, 30.0, p, y1)),
        least(lambda: flow.stationary(0, 0, t, y, tau, p, times[0], times[1])),
        least(lambda: flow.flow(0, t, y, tau, p, NONE, y1, NOTHING)),
        least(lambda: flow.flow(0, t, y, tau, p, omega, y1, jac)),
    ]


def engine_costs(model: Any) -> list[float]:
    """Microseconds an event of a simulation, a point of a branch of 1a, and a point of Fig. 5."""
    orbit = cf.find_orbit(model, SLIDE_LIMITS)
    start = {"state": [1.2, 0.1], "periods": 200}
    events = len(cf.simulate(model, SLIDE_LIMITS, **start))
    branch = cf.continue_orbit(orbit, "Omega", (0.495, 0.53))
    points = sum(len(b) for b in cf.explore(orbit, "Omega", (0.40, 0.60)).branches)
    return [
        least(lambda: cf.simulate(model, SLIDE_LIMITS, **start), 1.0) / events,
        least(lambda: cf.continue_orbit(orbit, "Omega", (0.495, 0.53)), 1.0) / len(branch),
        least(lambda: cf.explore(orbit, "Omega", (0.40, 0.60)), 2.0) / points,
    ]


def generality() -> str:
    """The cost of generality."""
    closed = cf.load_model("coulomb")
    integrated = replace(closed, flow_factory=coulomb_integrated.compiled_flow)
    one = segment_costs(forced_oscillator) + engine_costs(closed)
    two = segment_costs(coulomb_integrated) + engine_costs(integrated)
    names = (
        "first hit of a slide",
        "stationary points of a slide",
        "state after a slide",
        "the same with derivatives (t0, state, duration, Omega)",
        "simulation, an event",
        "continuation of 1a, a point",
        "exploration of Fig. 5, a point",
    )
    rows = [
        (name, f"{a:.2f}", f"{b:.1f}", f"{b / a:.0f}")
        for name, a, b in zip(names, one, two, strict=True)
    ]
    return table(("microseconds", "closed form", "integrated", "ratio"), rows)


# -------------------------------------------------------------------------------- error and run time


@cache
def kernel_of(module: Any, method: str, tolerance: float) -> Callable[..., Any]:
    """A flow with a method and a tolerance of its own."""
    own = replace(module.FUNCTIONS, method=Method(method), relative=tolerance, absolute=tolerance)
    return own.flow(module.level).flow  # type: ignore[no-any-return]


#: What is integrated: module, mode, t0, y0, dt, p, scales of the states.
SEGMENTS: dict[str, tuple[Any, ...]] = {
    "Coulomb slide": (
        coulomb_integrated,
        (0, 0.1, np.array([-0.8, 0.0]), 2.75, np.array([0.5, 0.32, 0.4, 0.0, 0.0])),
        np.array([1.0, 1.0]),
    ),
    "LuGre slide, sigma0 = 1000": (
        lugre_integrated,
        (0, 0.4, np.array([-1.0, 0.0, 1e-4]), 2.2, LUGRE),
        np.array([1.0, 1.0, 1e-3]),
    ),
}


#: What a solution is integrated with: a slide with Coulomb friction is nowhere stiff.
METHODS = {
    coulomb_integrated: ("explicit",),
    lugre_integrated: ("explicit", "implicit", "automatic"),
}


def scipy_run(module: Any, segment: tuple[Any, ...], scales: Any, method: str, tol: float) -> Any:
    """The same by scipy, with the compiled field, so that the integrators are compared."""
    mode, t0, y0, dt, p = segment
    n = len(y0)

    @numba.njit(vector(f8, vector), error_model="numpy")
    def right(t, y):  # type: ignore[no-untyped-def]
        out = np.empty(n)
        field(mode, t, y, p, np.empty(0, dtype=np.int64), out, np.empty((0, 0)))
        return out

    @numba.njit(types.float64[:, ::1](f8, vector), error_model="numpy")
    def jacobian(t, y):  # type: ignore[no-untyped-def]
        out, jac = np.empty(n), np.empty((n, 1 + n))
        field(mode, t, y, p, np.empty(0, dtype=np.int64), out, jac)
        return jac[:, 1:].copy()

    options = {"rtol": max(tol, 2.3e-14), "atol": tol * scales, "method": method}
    if method == "Radau":
        options["jac"] = jacobian
    return lambda: solve_ivp(right, (t0, t0 + dt), y0, **options).y[:, -1]


field: Any = None  # the field that scipy_run compiles into its functions


def error_against_time() -> tuple[str, dict[str, Any]]:
    """Errors and times of all methods, as a table and for the figure."""
    global field  # noqa: PLW0603
    rows, curves = [], {}
    for name, (module, segment, scales) in SEGMENTS.items():
        field = numba.njit(error_model="numpy")(module.field.__wrapped__)
        exact, y1 = np.empty(len(scales)), np.empty(len(scales))
        kernel_of(module, "explicit", 1e-14)(*segment, NONE, exact, NOTHING)

        def error(y: Any, exact: Any = exact, scales: Any = scales) -> float:
            return float(np.max(np.abs(y - exact) / scales))

        for method in METHODS[module]:
            for tol in TOLERANCES:
                flow = kernel_of(module, method, tol)
                flow(*segment, NONE, y1, NOTHING)
                e = error(y1)
                micro = least(lambda: flow(*segment, NONE, y1, NOTHING))  # noqa: B023
                rows.append((name, f"contfric, {method}", f"{tol:.0e}", f"{e:.1e}", f"{micro:.0f}"))
                curves.setdefault((name, f"contfric, {method}"), []).append((e, micro))
        for method in ("DOP853", "Radau"):
            for tol in TOLERANCES:
                run = scipy_run(module, segment, scales, method, tol)
                e, micro = error(run()), least(run)
                rows.append((name, f"scipy {method}", f"{tol:.0e}", f"{e:.1e}", f"{micro:.0f}"))
                curves.setdefault((name, f"scipy {method}"), []).append((e, micro))
    return table(("motion", "method", "tolerance", "error", "microseconds"), rows), curves


STYLES = {
    "contfric, explicit": "C0o-",
    "contfric, implicit": "C1o-",
    "contfric, automatic": "C2o-",
    "scipy DOP853": "C3s--",
    "scipy Radau": "C4s--",
}


def draw(curves: dict[Any, Any], path: Path) -> None:
    """Run time against error."""
    fig, axes = plt.subplots(1, len(SEGMENTS), figsize=(10, 4.2), sharey=True)
    for ax, name in zip(axes, SEGMENTS, strict=True):
        for (motion, method), points in curves.items():
            if motion == name:
                e, micro = np.array(points).T
                ax.loglog(np.maximum(e, 1e-17), micro, STYLES[method], label=method, ms=4)
        ax.set_title(name)
        ax.set_xlabel("error of the state at the end")
        ax.grid(alpha=0.3)
    axes[0].set_ylabel("microseconds")
    axes[-1].legend(fontsize=8)
    fig.tight_layout()
    fig.savefig(path, dpi=130)


# ------------------------------------------------------------------------------------------ stiffness


def stiffness() -> str:
    """Steps and times of the three choices, from a soft contact to a stiff one; with derivatives."""
    which, rows = np.array([0]), []
    flows = {
        m: kernel_of(lugre_integrated, m, 1e-12) for m in ("explicit", "implicit", "automatic")
    }
    for sigma0 in (1e1, 1e2, 1e3, 1e4, 1e5, 1e6):
        p = LUGRE.copy()
        p[3] = sigma0
        segment = (0, 0.4, np.array([-1.0, 0.0, 0.1 / sigma0]), 2.2, p)
        y1, jac, cells = np.empty(3), np.empty((3, 6)), []
        for flow in flows.values():
            micro = least(lambda: flow(*segment, which, y1, jac), 0.5)  # noqa: B023
            cells.append(f"{1e-3 * micro:.2f}" if np.isfinite(y1).all() else "failed")
        rows.append((f"{sigma0:.0e}", *cells))
    return table(("sigma0", *(f"{m}, ms" for m in flows)), rows)


def period_of_lugre() -> str:
    """One period with variational equations, and that of heyoka."""
    head = ("S", "method", "tolerance", "error", "error of derivatives", "ms a period")
    return table(head, lugre_period.rows())


def main() -> None:
    """Write the page and its figure."""
    errors, curves = error_against_time()
    image = ROOT / "docs" / "images" / "benchmarks-integrated.png"
    draw(curves, image)
    page = PAGE.format(
        origin=origin(),
        generality=generality(),
        errors=errors,
        stiffness=stiffness(),
        period=period_of_lugre(),
    )
    (ROOT / "docs" / "benchmarks-integrated.md").write_text(page, encoding="utf-8")
    print(page)


PAGE = """# What integration costs

Written by `make bench` (`benchmarks/integrated.py`): {origin}.
How it works stands in [integration](integration.md). Times are the least processor times of many calls.

## Compared with the closed form

The Coulomb oscillator, once in closed form and once from its fields, at a tolerance of 1e-12.

{generality}

## Run time against error

State after one segment, no derivatives. scipy is given the compiled field (and for Radau the compiled
Jacobian), so that what is compared is the integrator and what surrounds it.

![Run time against error](images/benchmarks-integrated.png)

{errors}

## Stiffness

A LuGre slide from rest over 2.2 units of time, with derivatives by t0, the three states and Omega, at 1e-12.

{stiffness}

## One period of the LuGre oscillator

Omega = 0.5, S0 = 0.4, sigma0 = 1000, vS = 0.05, with derivatives by the states (contfric: by t0 and the
duration, too), stops found on the way; in turns, next to heyoka (Taylor series compiled by LLVM) where it is
installed. Times are to be compared at one error: those in the bristles fade, so that a tolerance says little.

{period}
"""

if __name__ == "__main__":
    main()
