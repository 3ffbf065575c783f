"""One segment of contfric's flow against fifty digits: states, derivatives, first roots, stationary points.

    python benchmarks/stress/segments.py --count 2000 --seed 1 --out segments.json

**Flow**: :mod:`segment_flow`.

**Roots.** A first root is right if the reference's function is zero there within rounding, and if before
it the function has nowhere been on the other side by more than rounding. Stationary points: each found
one is a zero of the rate within rounding (and its resolution, 1e-10), and each zero of the rate between two
lobes that are larger than rounding is found.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
from first_root import Undecided
from flint import arb
from quantities import RATE, OfRest, OfSlide, Quantity, zeros
from reference import Law, Slide, working_precision
from report import Report, Tally, say
from segment_cases import Case, draw_flow, draw_graze, draw_root
from segment_flow import EPS, check_flow, parts_of

from contfric.compiled import stationary_signature
from contfric.flow.oscillator.flow import hit, stationary

#: A function that is this many roundings from zero has a sign.
LIMIT_ROOT = 30.0
#: contfric ends the search for a stationary time at this error, relative to 1 + the time; its square counts.
STATIONARY = 1e-10
#: Two stationary times this near each other, relative to 1 + the time, have a lobe between them that is
#: of the size of rounding (its square).
LOBE = 1e-6
#: Stationary points of one segment: 60 units of time have fewer.
MOST_STATIONARY = 4096
WHAT = (
    "Single segments against fifty digits: states and derivatives, first roots, stationary points."
)


def uncertainty(case: Case, name: str, d: float) -> float:
    """Return the rounding of a quantity along a segment after d."""
    p = case.params
    at = Case(case.index, case.mode, p, case.t0, case.x0, case.v0, d, case.c, case.level, case.on)
    state = parts_of(at)[0] * (1 + d)
    if case.mode == 2:
        state = abs(case.x0)
    fastest = p["Omega"] * (3 if p["h"] else 1)
    phase = 1 + abs(p["h"]) * 3 + (1 + abs(p["h"])) * p["Omega"] * (abs(case.t0) + d)
    force = (1 + abs(p["h"])) * phase
    if name in ("a", "du"):
        force *= 1 + fastest * fastest
        state *= 1 + 2 * abs(p["zeta"])
    if name == "v":
        force *= min(1.0, d) * phase
    return EPS * (state * phase + force + abs(case.level) + p["S"])


def quantity_of(case: Case, law: Law, name: str, level: float) -> Quantity:
    """Return the reference's function for an observable, or the rate of one."""
    with working_precision(law.bits):
        if case.mode == 2:
            return OfRest(law, arb(case.t0), arb(case.x0), name, level)
        slide = Slide(law, 1 - 2 * case.mode, arb(case.t0), arb(case.x0), arb(case.v0))
        return OfSlide(slide, name, level)


def value(quantity: Quantity, d: float | arb) -> tuple[float, float]:
    """Return the quantity and its rate."""
    with working_precision(quantity.law.bits):
        q, q1, _ = quantity.halley(arb(d))
        return float(q), float(q1)


def wrong_side(quantity: Quantity, rate: Quantity, sign: int, until: float) -> tuple[float, float]:
    """Return how far the quantity gets to the other side before a time, and where."""
    places = [float(r) for r in zeros(rate, False, until)] + [until]
    depths = [(-sign * value(quantity, d)[0], d) for d in places]
    return max(depths)


def check_hit(case: Case, tally: Tally) -> None:
    """Compare a first root."""
    law = Law(*(case.params[k] for k in ("Omega", "S", "S0", "h", "zeta")))
    name = "v" if case.c == 1 else "u"
    quantity = quantity_of(case, law, name, case.level)
    rate = quantity_of(case, law, RATE[name], 0.0)
    y0 = np.array([case.x0, case.v0])
    there = np.empty(2)
    found = hit(case.mode, case.c, case.level, case.on, case.t0, y0, case.d, case.vector(), there)
    kind = f"first root of {name}" + (f", {case.kind}" if case.kind else "")
    q, q1 = value(quantity, 0.0)
    # a start that rounding places is on neither side
    if not case.on and abs(q) < LIMIT_ROOT * uncertainty(case, name, 0.0):
        tally.met("start undecided")
        return
    sign = 1 if (q1 if case.on else q) > 0 else -1
    until = found if found >= 0.0 else case.d
    doubt = LIMIT_ROOT * uncertainty(case, name, until)
    try:
        # a little before the root itself: within 4 units in the last place of it, and its rounding
        depth, where = wrong_side(quantity, rate, sign, until)
    except Undecided:
        tally.met("undecided in fifty digits")
        return
    q, q1 = value(quantity, until)
    near = doubt + abs(q1) * 8 * EPS * until
    text = f"found {found!r}: reference {q:.3g} there"
    fine = depth <= near and (found < 0.0 or abs(q) <= near)
    tally.check(
        kind, fine, f"{text}, {depth:.3g} beyond at {where!r}, rounding {near:.2g} :: {case}"
    )
    if found >= 0.0:
        tally.met(f"{kind}: found")


def stationary_times(case: Case) -> list[float]:
    """Return contfric's stationary times."""
    # the kernel writes times, and values too if its signature has a place for them
    places = len(stationary_signature.args) - 6
    out = [np.empty(MOST_STATIONARY) for _ in range(places)]
    y0 = np.array([case.x0, case.v0])
    count = stationary(case.mode, case.c, case.t0, y0, case.d, case.vector(), *out)
    return [float(d) for d in out[0][:count]]


def check_turning(case: Case, tally: Tally) -> None:
    """Compare all stationary times of an observable."""
    law = Law(*(case.params[k] for k in ("Omega", "S", "S0", "h", "zeta")))
    name = RATE["v" if case.c == 1 else "u"]
    rate = quantity_of(case, law, name, 0.0)
    found = stationary_times(case)
    try:
        exact = [float(r) for r in zeros(rate, False, case.d)]
    except Undecided:
        tally.met("undecided in fifty digits")
        return
    doubt = LIMIT_ROOT * uncertainty(case, name, case.d)
    kind = f"stationary points of {'v' if case.c == 1 else 'u'}"
    for d in found:
        q, q1 = value(rate, d)
        near = doubt + 4 * abs(q1) * STATIONARY * (1 + d) + (STATIONARY * (1 + d)) ** 2
        if not abs(q) <= near:
            tally.check(kind, False, f"invented {d!r}: {q:.3g}, rounding {near:.2g} :: {case}")
            return
    missed = [d for d in sure_zeros(rate, exact, case.d, doubt) if not _has(case, found, d)]
    tally.check(kind, not missed, f"missed {missed}, found {found} :: {case}")
    tally.met(f"{kind}: found", len(found))


def sure_zeros(rate: Quantity, exact: list[float], end: float, doubt: float) -> list[float]:
    """Return those zeros on both sides of which the rate gets larger than rounding."""
    marks = [0.0, *exact, end]
    middles = [0.5 * (a + b) for a, b in pairwise(marks)]
    # nearer than the resolution of stationary times two zeros may be taken for one
    wide = [b - a > 100 * STATIONARY * (1 + b) for a, b in pairwise(marks)]
    large = [w and abs(value(rate, d)[0]) > 2 * doubt for d, w in zip(middles, wide, strict=True)]
    return [d for k, d in enumerate(exact) if large[k] and large[k + 1]]


def _has(case: Case, found: list[float], d: float) -> bool:
    """Tell whether a zero is among those found: as near as lobes are told apart, and t0 is a double."""
    near = LOBE * (1 + d) + 2 * EPS * abs(case.t0)
    return any(abs(e - d) <= near for e in found)


def check(seed: int, index: int, tally: Tally) -> None:
    """Try one flow, two roots and one set of stationary points."""
    check_flow(draw_flow(seed, index), tally)
    check_hit(draw_root(seed, index), tally)
    graze = draw_graze(seed, index)
    if graze is not None:
        check_hit(graze, tally)
        check_turning(graze, tally)
    check_turning(draw_root(seed, index), tally)


def run(count: int, seed: int, progress: Callable[[str], None] | None = None) -> Report:
    """Try ``count`` segments of each kind."""
    began, tally = time.perf_counter(), Tally()
    for index in range(count):
        tally.index = index
        check(seed, index, tally)
        if progress is not None and index % 200 == 199:
            progress(f"{index + 1}/{count}, {len(tally.failed)} failed")
    return tally.report("segments", WHAT, count, seed, time.perf_counter() - began)


def main() -> None:
    parser = argparse.ArgumentParser(description=WHAT)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    report = run(args.count, args.seed, say)
    print(*report.lines(), sep="\n")
    if args.out is not None:
        report.write(args.out)
    sys.exit(1 if report.failed else 0)


if __name__ == "__main__":
    main()
