"""Simulations event by event against fifty digits: the short form of benchmarks/stress/sequences.py.

The reference itself is held by a matrix exponential (its states) and by dense samples (its first roots).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from mpmath import mp, mpf

import contfric as cf

pytest.importorskip("flint")
import sequence_compare
import sequences
from flint import arb
from motion import SLIDE_DOWN, SLIDE_UP, Start, follow
from reference import Law, Slide, working_precision
from report import Tally
from sequence_cases import draw

SEED = 2


def digits(number: arb) -> mpf:
    """An exact number of the reference as mpmath's."""
    mantissa, exponent = number.mid().man_exp()
    return mpf(int(mantissa)) * mpf(2) ** int(exponent)


@pytest.mark.parametrize("zeta", [0.0, 1e-12, 0.1, 1.0, 1 + 1e-12, 2.5, -1e-3])
@pytest.mark.parametrize("omega", [1.0, 1 / 3, 1 - 1e-15, 0.7])
def test_reference_agrees_with_the_matrix_exponential(omega: float, zeta: float) -> None:
    s, S, h, t0, x0, v0, d = -1, 0.3, 0.4, 1.7, 0.9, -0.4, 2.5
    law = Law(omega, S, S, h, zeta)
    with working_precision(law.bits):
        at = Slide(law, s, arb(t0), arb(x0), arb(v0)).state(arb(d))
    with mp.workdps(60):
        w = mpf(omega)
        m = mp.zeros(7)  # of (x, v, cos, sin, cos 3, sin 3, 1)
        m[0, 1] = 1
        m[1, 0], m[1, 1], m[1, 2], m[1, 4], m[1, 6] = -1, -2 * mpf(zeta), 1, mpf(h), -s * mpf(S)
        m[2, 3], m[3, 2], m[4, 5], m[5, 4] = -w, w, -3 * w, 3 * w
        t = w * mpf(t0)
        y = mp.matrix([x0, v0, mp.cos(t), mp.sin(t), mp.cos(3 * t), mp.sin(3 * t), 1])
        y = mp.expm(m * mpf(d)) * y
        assert abs(digits(at.x) - y[0]) < mpf(10) ** -50
        assert abs(digits(at.v) - y[1]) < mpf(10) ** -50


def test_reference_finds_the_first_of_all_roots() -> None:
    """Against samples: what has the sign of the slide up to the event, and the other one after it."""
    for index in range(60):
        case = draw(SEED, index)
        law = Law(*(case.params[k] for k in ("Omega", "S", "S0", "h", "zeta")))
        event = next(follow(law, case.start, 40.0))
        if not isinstance(event.segment, Slide) or event.surface != "v":
            continue
        s = event.segment.s
        for share in np.linspace(1e-3, 0.999, 200):
            with working_precision(law.bits):
                v = event.segment.state(arb(event.duration * float(share))).v
            assert s * v > 0, case
        with working_precision(law.bits):
            behind = event.segment.state(arb(event.duration * (1 + 1e-9) + 1e-25)).v
        assert s * behind < 0 or abs(event.slope) < 1e-6, case


def test_events_of_simulations() -> None:
    tally = sequences.chunk(SEED, 0, 60)
    assert not tally.failed, tally.failed
    assert tally.tried["sequence"] > 50 and tally.tried["event"] > 5_000
    undecided = sum(n for name, n in tally.counts.items() if name.startswith("undecidable"))
    assert undecided < 10, "so many cannot be what rounding leaves open"


def test_a_wrong_simulation_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """A time that is wrong by 1e-10, an event that is missing, one that is another: each one fails."""
    case = replace(
        draw(SEED, 0), params={"Omega": 0.5, "S": 0.32, "S0": 0.4, "h": 0.1, "zeta": 0.0}
    )
    case = replace(case, start=Start(0.0, 1.3, 0.2, SLIDE_UP), domain=None)
    motion = sequence_compare.simulated(case)
    late = motion.times.copy()
    late[40:] += 1e-10
    exits = motion.exits.copy()
    exits[40] = 1 - exits[40] if exits[40] < 2 else 0
    rows = [k for k in range(len(motion)) if k != 40]
    missing = replace(
        motion,
        **{k: getattr(motion, k)[rows] for k in ("modes", "exits", "cycles", "times", "states")},
    )
    wrong = [replace(motion, times=late), replace(motion, exits=exits), missing]
    for outcome, fails in [(motion, 0), *((w, 1) for w in wrong)]:
        monkeypatch.setattr(sequence_compare, "simulated", lambda _, outcome=outcome: outcome)
        tally = Tally()
        sequence_compare.compare(case, tally)
        assert len(tally.failed) == fails


@pytest.mark.parametrize("excess", [0.0, 2.0**-44])
def test_a_release_at_the_largest_force(excess: float) -> None:
    """S = S0, u = S0 (+ 6e-14) where f' = 0: v = -Omega^2 t^3 / 6 leaves zero, and comes back at 2 pi."""
    params = {"Omega": 0.5, "S": 0.25, "S0": 0.25}
    domain = None if excess else "x+v-"
    motion = cf.simulate(
        "coulomb", params, state=[1.25 + excess, 0.0], periods=0.9, events=10, domain=domain
    )
    law = Law(0.5, 0.25, 0.25, 0.0, 0.0)
    start = Start(0.0, 1.25 + excess, 0.0, SLIDE_DOWN, 0 if excess else 1)
    event = next(follow(law, start, 12.0))
    assert float(event.t) == pytest.approx(2 * math.pi, abs=1e-12)
    assert motion.itinerary[0] == ("slide-", "v")
    assert motion.times[0] == pytest.approx(float(event.t), abs=1e-9)
