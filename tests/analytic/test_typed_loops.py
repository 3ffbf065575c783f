"""Models typed by textbook equations, against scipy: a string under a bow, a controller with a limit."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from by_scipy import met
from typed import typed

import contfric as cf
from contfric.events.sliding_kinds import kind_of_margin

#: Two modes of a string, and friction that falls with the speed of sliding (Smith and Woodhouse 2000).
BOW = """
name: bow
states: [q1, v1, q2, v2]
parameters: {vb: 0.2, N: 1.0, mud: 0.3, mus: 0.8, v0: 0.1, Q: 60.0, w2: 2.05, p2: 0.8}
autonomous: true
observables: {slip: v1 + p2*v2 - vb}
define:
  mu: mud + (mus - mud)*v0/(v0 + abs(slip))
  f: -N*mu*sign(slip)
surfaces: {contact: {observable: slip, sliding: filippov}}
field: {q1: v1, v1: -v1/Q - q1 + f, q2: v2, v2: -w2*v2/Q - w2**2*q2 + p2*f}
modes: {faster: {in: {contact: +}}, slower: {in: {contact: -}}}
"""

#: A limited actuator; the integral of the error waits while it would drive further into the limit.
LIMITED = """
name: limited
states: [x, v, z]
parameters: {kp: 2.0, ki: 1.5, umax: 1.0, a: 2.5, w: 0.6, zeta: 0.2}
period: 2*pi/w
observables:
  e: a*cos(w*t) - x
  u: kp*(a*cos(w*t) - x) + ki*z
surfaces:
  hi: {observable: u, level: umax, sliding: filippov}
  lo: {observable: u, level: -umax, sliding: filippov}
  err: {observable: e}
modes:
  linear: {in: {hi: -, lo: +}, field: {x: v, v: -2*zeta*v + u - x, z: e}}
  top_hold: {in: {hi: +, err: +}, field: {x: v, v: -2*zeta*v + umax - x, z: 0}}
  top_free: {in: {hi: +, err: -}, field: {x: v, v: -2*zeta*v + umax - x, z: e}}
  bottom_hold: {in: {lo: -, err: -}, field: {x: v, v: -2*zeta*v - umax - x, z: 0}}
  bottom_free: {in: {lo: -, err: +}, field: {x: v, v: -2*zeta*v - umax - x, z: e}}
symmetry: x -> -x, v -> -v, z -> -z, t -> t + T/2
spread: {x: 2, v: 2, z: 2}
"""


def test_a_string_sticks_to_its_bow(tmp_path: Path) -> None:
    """Its force is that which keeps the speeds alike, up to the limit; the model could not be compiled."""
    model = typed(tmp_path, BOW)
    start = [0.05, 0.2 - 0.8 * 0.03, -0.02, 0.03]

    def force(y: np.ndarray) -> float:
        free = -y[1] / 60.0 - y[0] + 0.8 * (-2.05 * y[3] / 60.0 - 2.05**2 * y[2])
        return float(-free / (1.0 + 0.8**2))

    def rates(t: float, y: np.ndarray) -> list[float]:
        f = force(y)
        return [y[1], -y[1] / 60 - y[0] + f, y[3], -2.05 * y[3] / 60 - 2.05**2 * y[2] + 0.8 * f]

    def limit(t: float, y: np.ndarray) -> float:
        return abs(force(y)) - 0.8

    last, end = met(rates, start, limit, span=(0, 20), rtol=1e-13, atol=1e-14)
    found = cf.simulate(model, state=start, periods=20.0)
    assert found.itinerary[0][0] == "slide"
    assert found.times[0] == pytest.approx(last, abs=1e-10)
    assert found.states[0] == pytest.approx(end, abs=1e-10)


def test_a_limit_that_another_surface_divides(tmp_path: Path) -> None:
    """What comes off the limit while the error is negative passes it: it went on beyond, in no mode."""
    model = typed(tmp_path, LIMITED)
    report = cf.check_model(model)
    assert report.ok and "warning" not in str(report)
    t, x, v = 4.135, -0.862, -1.43
    z = (1 - 2.0 * (2.5 * np.cos(0.6 * t) - x)) / 1.5 + 1e-3

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], -0.4 * y[1] + 1.0 - y[0], 2.5 * np.cos(0.6 * t) - y[0]]

    def limit(t: float, y: np.ndarray) -> float:
        return float(2.0 * (2.5 * np.cos(0.6 * t) - y[0]) + 1.5 * y[2] - 1.0)

    _, end = met(rates, [x, v, z], limit, span=(t, t + 1), rtol=1e-13, atol=1e-14)
    found = cf.simulate(model, state=[x, v, z], time=t, periods=1.0)
    assert [mode for mode, _ in found.itinerary[:2]] == ["top_free", "linear"]
    assert found.states[0] == pytest.approx(end, abs=1e-11)
    caught = typed(tmp_path, LIMITED.replace(", sliding: filippov", ""))
    with pytest.raises(cf.ConvergenceError, match="has left the region of 'bottom_free' at 'hi'"):
        cf.find_orbit(caught)


def test_what_vanishes_is_named_alike_by_all_its_margins(tmp_path: Path) -> None:
    """Which margin of a segment without length is met first is rounding.

    A slide that vanishes has been a graze of its surface (GS), and what vanishes between two slides a touch
    of their end (AS). Margins said CS, SS, or the other of the two; at w = 0.412576935572 so did the diagram.
    """
    model, rng, named = typed(tmp_path, LIMITED), np.random.default_rng(5), Counter[cf.Kind]()
    drawn = [(0.41, {}), *((0.4, own) for own in _some_limits(rng, 3))]
    for w, own in drawn:
        orbit = cf.find_orbit(model, params={"w": w, **own})
        branches = cf.explore(orbit, "w", (0.35, 0.6), max_branches=8).branches
        again = [cf.continue_orbit(b[len(b) // 2], "w", (0.35, 0.6)) for b in branches]
        for event in (end.bifurcation for branch in again for end in branch.ends):
            if event is None:
                continue
            here = event.orbit
            for k in np.flatnonzero(here.durations < 1e-5 * here.period):
                before, mode, behind = (
                    here.itinerary[(k + j) % len(here.itinerary)][0] for j in (-1, 0, 1)
                )
                if before != behind:
                    continue
                expected = cf.Kind.GS if model.mode_by_name[mode].sliding else cf.Kind.AS
                tests = [test for test in here.system.tests if test.segment == k]
                if not tests:  # of the other half
                    continue
                kinds = {kind_of_margin(here.system, test, here) for test in tests}
                assert kinds == {expected}, (own, event)
                named[expected] += 1
    assert named[cf.Kind.AS] and named[cf.Kind.GS]
    assert cf.explore(cf.find_orbit(model), "w", (0.4, 0.6)).verify().passed


def _some_limits(rng: np.random.Generator, count: int) -> list[dict[str, float]]:
    low, high = (1.0, 0.8, 1.5, 0.1), (3.0, 2.5, 4.0, 0.4)
    rows = rng.uniform(low, high, (count, 4)).tolist()
    return [dict(zip(("kp", "ki", "a", "zeta"), row, strict=True)) for row in rows]
