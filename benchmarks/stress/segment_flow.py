"""The state after one slide, and its derivatives, against fifty digits.

Let y be the state, J its derivatives, and p_k the arguments (t0, x0, v0, duration, Omega, S, h, zeta), each a
double. Half a unit in the last place of an argument changes an entry e of y or J by ``EPS/2 |de/dp_k p_k|``;
that is its conditioning, from differences in the reference. Next to it stands what the formulas must
round: the parts that an entry is the sum of. Errors are reported in units of

    EPS (|e| + sum_k |de/dp_k p_k| + parts).

With the parts as in :func:`parts_of`, two things are allowed that conditioning alone would not: the phase
of a response is rounded once for each of its terms (by ``EPS w t0``: for starts far from t = 0), and the
derivative by Omega of a short slide is good to ``EPS d`` only, not to its own size (``d^4`` at t0 = 0).
"""

from __future__ import annotations

import math

import numpy as np
from flint import arb
from numpy.typing import NDArray
from reference import Law, Slide, working_precision
from report import Tally
from segment_cases import Case

from contfric.flow.oscillator.flow import flow

EPS = 2.0**-52
#: Bits for differences of differences: 200 are lost next to resonance, 80 to 120 by each difference.
BITS = 900
#: Relative steps of the differences: their squares are the relative errors.
STEP, OUTER_STEP = 2.0**-120, 2.0**-80
#: An argument smaller than this is stepped by as much: it may be zero.
LEAST_STEPPED = 2.0**-30
#: Errors in the units above. Measured over 10^4 segments: states stay below 6, derivatives below 20 (most
#: below 4); that by zeta comes from a repeated squaring, which doubles its error each time: below 80.
LIMIT_STATE, LIMIT_SLOPE, LIMIT_ZETA = 20.0, 60.0, 300.0
#: Column of contfric's derivatives for each argument (column 6 is S0, which a slide does not know).
COLUMNS = {"t0": 0, "x0": 1, "v0": 2, "d": 3, "Omega": 4, "S": 5, "h": 7, "zeta": 8}
#: Keeps quotients finite.
SMALLEST = 1e-300


def end_state(mode: int, arguments: list[arb]) -> tuple[arb, arb]:
    """Return (x, v) at the end of a slide, in the order of ``COLUMNS``."""
    t0, x0, v0, d, omega, S, h, zeta = arguments
    law = Law(omega, S, S, h, zeta, bits=BITS)
    at = Slide(law, 1 - 2 * mode, t0, x0, v0).state(d)
    return at.x, at.v


def steps_of(arguments: list[arb], relative: float) -> list[arb]:
    """Return a step for each argument: relative to it, or absolute where it is small."""
    return [relative * abs(a).max(arb(LEAST_STEPPED)) for a in arguments]


def slopes(mode: int, arguments: list[arb]) -> list[list[arb]]:
    """Return the derivatives of (x, v) by each argument, by central differences."""
    rows: list[list[arb]] = [[], []]
    for k, step in enumerate(steps_of(arguments, STEP)):
        up, down = list(arguments), list(arguments)
        up[k], down[k] = (up[k] + step).mid(), (down[k] - step).mid()
        for row, a, b in zip(rows, end_state(mode, up), end_state(mode, down), strict=True):
            row.append((a - b) / (up[k] - down[k]))
    return rows


def conditioning(mode: int, arguments: list[arb]) -> NDArray[np.float64]:
    """Return ``sum_k |dJ/dp_k p_k|`` for each derivative J."""
    total = np.zeros((2, len(arguments)))
    for k, step in enumerate(steps_of(arguments, OUTER_STEP)):
        size = float(abs(arguments[k]))
        if size == 0.0:
            continue
        up, down = list(arguments), list(arguments)
        up[k], down[k] = (up[k] + step).mid(), (down[k] - step).mid()
        high, low = slopes(mode, up), slopes(mode, down)
        for i in range(2):
            for j in range(len(arguments)):
                change = (high[i][j] - low[i][j]) / (up[k] - down[k])
                total[i, j] += abs(float(change)) * size
    return total


def harmonic_part(case: Case, k: int) -> float:
    """Return the size of the response to a harmonic, with the rounding of its phase in each term."""
    w = k * case.params["Omega"]
    away = max(math.hypot(1 - w * w, 2 * case.params["zeta"] * w), SMALLEST)
    return k * min(case.d, 1 + 1 / away) * (1 + w * abs(case.t0))


def parts_of(case: Case) -> tuple[float, dict[str, float]]:
    """Return the size of what a state, and each derivative, is the sum of.

    G, C and the response to a force of size one are at most d long, or as large as damping and the
    distance from resonance allow; a derivative by Omega or zeta is that of a response to a response.
    """
    p, d = case.params, case.d
    growth = math.exp(max(0.0, -p["zeta"] * d))
    one, third = (harmonic_part(case, k) for k in (1, 3))
    forced = one + abs(p["h"]) * third
    memory = min(d, 1 / max(abs(p["zeta"]), SMALLEST)) if p["zeta"] <= 1 else min(d, 2 * p["zeta"])
    free = abs(case.x0) + abs(case.v0) + p["S"]
    w = p["Omega"]
    state = growth * (free + forced)
    sizes = {
        "t0": growth * w * 3 * forced,
        "x0": growth,
        "v0": growth,
        "d": state * (1 + 2 * abs(p["zeta"])) + (1 + 3 * abs(p["h"])) * (1 + w * abs(case.t0)),
        "Omega": growth * forced * (1 + abs(case.t0) + d),
        "S": growth,
        "h": growth * third,
        "zeta": state * (1 + memory),
    }
    return state, sizes


def check_flow(case: Case, tally: Tally) -> None:
    """Compare a state and its derivatives."""
    p = case.params
    y1, jac = np.empty(2), np.empty((2, 9))
    vector = case.vector()
    y0 = np.array([case.x0, case.v0])
    flow(case.mode, case.t0, y0, case.d, vector, np.arange(5), y1, jac)
    with working_precision(BITS):
        names = (p["Omega"], p["S"], p["h"], p["zeta"])
        arguments = [arb(a) for a in (case.t0, case.x0, case.v0, case.d, *names)]
        exact, rows = end_state(case.mode, arguments), slopes(case.mode, arguments)
        second = conditioning(case.mode, arguments)
        errors = np.array([float(abs(arb(y1[i]) - exact[i])) for i in range(2)])
        columns = list(COLUMNS.values())
        jac_errors = np.array(
            [
                [float(abs(arb(jac[i, c]) - rows[i][j])) for j, c in enumerate(columns)]
                for i in range(2)
            ]
        )
        first = np.array([[float(e) for e in row] for row in rows])
        sizes = np.array([abs(float(a)) for a in arguments])
    parts, slope_parts = parts_of(case)
    scale = np.abs(y1) + np.abs(first) @ sizes + parts
    _record(case, tally, "state", float((errors / (EPS * scale)).max()), LIMIT_STATE)
    for j, name in enumerate(COLUMNS):
        unit = EPS * (np.abs(first[:, j]) + second[:, j] + slope_parts[name])
        limit = LIMIT_ZETA if name == "zeta" else LIMIT_SLOPE
        _record(case, tally, f"derivative by {name}", float((jac_errors[:, j] / unit).max()), limit)


def _record(case: Case, tally: Tally, kind: str, ratio: float, limit: float) -> None:
    tally.largest(f"{kind}: error in units of rounding", ratio)
    tally.check(kind, ratio <= limit, f"{ratio:.3g} units :: {case}")
