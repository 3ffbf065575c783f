"""One period of the LuGre oscillator with its variations, compared with heyoka where that is installed.

Both find the stops (v = 0) on the way, at which the field has a kink. Errors are those against our own method
at 1e-14, bristles in units of 1/sigma0. What is compared is the time at one error, not at one tolerance: an
error in the bristles fades within a slide. heyoka has the derivatives by the three states, contfric those by
t0 and the duration, too.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np

import contfric as cf
from contfric.models.generated.build import GeneratedFlow

PLACES = (0.2, 0.32, 0.38)
OURS, THEIRS, EXACT = (1e-10, 1e-11, 1e-12), (1e-10, 1e-12, 1e-14), 1e-14
#: Turns in which all take part, and calls in each.
TURNS, CALLS = 40, 3

#: The state after a period, and its derivatives by the state before it.
Mapped = tuple[np.ndarray, np.ndarray]


def by_contfric(orbit: cf.Orbit, tolerance: float) -> Callable[[], Mapped]:
    """Return the period from the first joint of an orbit, at a tolerance."""
    model, (t, *y) = orbit.model, orbit.cycle[0]
    factory: Any = model.flow_factory
    definition = json.loads(factory.definition)
    definition["integration"]["tolerance"] = tolerance
    flow, start = GeneratedFlow(json.dumps(definition))().flow, np.array(y)
    none = np.empty(0, dtype=np.int64)

    def call() -> Mapped:
        end, jac = np.empty(3), np.empty((3, 5))
        flow(0, t, start, orbit.period, orbit.vector, none, end, jac)
        return end, jac[:, 1:4]

    return call


def by_heyoka(orbit: cf.Orbit, tolerance: float) -> Callable[[], Mapped]:
    """Return the same by heyoka: an integrator for each direction, variations as further equations."""
    import heyoka as hy

    x, v, z = hy.make_vars("x", "v", "z")
    p, t0, y0 = orbit.params, float(orbit.cycle[0, 0]), orbit.cycle[0, 1:]
    integrators = {}
    for sign in (1.0, -1.0):
        g = p["S"] + (p["S0"] - p["S"]) * hy.exp(-sign * v / p["vS"])
        slip = v - p["sigma0"] * sign * v * z / g
        pull = hy.cos(p["Omega"] * hy.time) - x - p["sigma0"] * z
        falls = hy.event_direction.negative if sign > 0.0 else hy.event_direction.positive
        integrators[sign] = hy.taylor_adaptive(
            hy.var_ode_sys([(x, v), (v, pull), (z, slip)], hy.var_args.vars, order=1),
            [0.0] * 3,
            tol=tolerance,
            t_events=[hy.t_event(v, direction=falls)],
        )

    def call() -> Mapped:
        t, sign, state = t0, math.copysign(1.0, y0[1]), np.concatenate([y0, np.eye(3).ravel()])
        while t < t0 + orbit.period - 1e-13:
            own = integrators[sign]
            own.time, own.state[:] = t, state
            own.reset_cooldowns()
            own.propagate_until(t0 + orbit.period)
            t, state, sign = own.time, own.state.copy(), -sign
        return state[:3], state[3:].reshape(3, 3)

    return call


def rows() -> list[tuple[Any, ...]]:
    """Return (S, method, tolerance, error of the state, of the derivatives, ms a period)."""
    found = []
    for place in PLACES:
        orbit = cf.find_orbit("lugre", {"S": place})
        calls = {("contfric", tol): by_contfric(orbit, tol) for tol in OURS}
        if find_spec("heyoka") is not None:
            calls |= {("heyoka", tol): by_heyoka(orbit, tol) for tol in THEIRS}
        exact, best = by_contfric(orbit, EXACT)(), dict.fromkeys(calls, math.inf)
        for _ in range(TURNS):
            for name, call in calls.items():
                start = time.process_time()
                for _ in range(CALLS):
                    call()
                best[name] = min(best[name], (time.process_time() - start) / CALLS)
        for name, call in calls.items():
            errors = _errors(call(), exact, orbit.params["sigma0"])
            found.append((place, *name, *(f"{e:.0e}" for e in errors), f"{1e3 * best[name]:.2f}"))
    return found


def _errors(found: Mapped, exact: Mapped, stiffness: float) -> tuple[float, float]:
    """Return the largest error of the state, and of its derivatives."""
    sizes = np.array([1.0, 1.0, 1.0 / stiffness])
    state, jac = (np.abs(a - b) for a, b in zip(found, exact, strict=True))
    return float((state / sizes).max()), float((jac * sizes / sizes[:, None]).max())
