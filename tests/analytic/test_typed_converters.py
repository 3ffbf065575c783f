"""Converters as textbooks have them: in SI units, with a diode that lets no current pass.

The references are matrix exponentials from tick to tick.
"""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq
from typed import typed

import contfric as cf

FLYBACK = """
name: flyback
states: [im, u]
parameters: {E: 30.0, n: 0.5, L: 200.0e-6, C: 100.0e-6, R: 20.0, Ip: 3.0, Ts: 50.0e-6}
period: Ts
surfaces:
  peak: {observable: im, level: Ip}
  diode: {observable: im}
modes:
  on: {in: {peak: -}, field: {im: E/L, u: -u/(R*C)}}
  off: {in: {diode: +}, field: {im: -u/(n*L), u: (im/n - u/R)/C}}
  empty: {in: {diode: 0}, field: {im: 0, u: -u/(R*C)}}
resets: {tick: {to: on}}
"""

BUCK = """
name: buck
states: [i, u]
parameters: {E: 10.0, L: 1.0, C: 1.0, R: 20.0, D: 0.4, T: 0.5}
period: T
surfaces:
  diode: {observable: i}
  pulse: {observable: "mod(t, T)", level: D*T}
modes:
  on: {in: {pulse: -}, field: {i: (E - u)/L, u: (i - u/R)/C}}
  off: {in: {pulse: +, diode: +}, field: {i: -u/L, u: (i - u/R)/C}}
  empty: {in: {pulse: +, diode: 0}, field: {i: 0, u: -u/(R*C)}}
spread: {i: 3, u: 8}
"""

BOOST = """
name: boost
states: [i, u]
parameters: {E: 5.0, L: 100.0e-6, C: 100.0e-6, R: 20.0, D: 0.4, T: 50.0e-6}
period: T
surfaces:
  diode: {observable: i}
  pulse: {observable: "mod(t, T)", level: D*T}
modes:
  on: {in: {pulse: -}, field: {i: E/L, u: -u/(R*C)}}
  off: {in: {pulse: +, diode: +}, field: {i: (E - u)/L, u: (i - u/R)/C}}
  empty: {in: {pulse: +, diode: 0}, field: {i: 0, u: -u/(R*C)}}
"""


def advanced(matrix, constant, state, time: float):
    """Return the state of an affine system after a time."""
    n = len(state)
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n], whole[:n, n] = matrix, constant
    return (expm(whole * time) @ [*state, 1.0])[:n]


def fixed(mapped, low: float, high: float) -> tuple[float, float]:
    """Return where a map of a voltage has its fixed point, and its slope there."""
    at = brentq(lambda u: mapped(u) - u, low, high, xtol=1e-13)
    return at, (mapped(at + 1e-5) - mapped(at - 1e-5)) / 2e-5


def flyback_off(R: float, u: float, time: float):
    """Return (current, voltage) a time after the peak, from the voltage u at the tick; the diode conducts."""
    rises = 3.0 * 200e-6 / 30.0
    start = [3.0, u * math.exp(-rises / (R * 1e-4))]
    return advanced([[0, -1e4], [2e4, -1e4 / R]], [0, 0], start, time)


@pytest.mark.parametrize("on", ["peak: -", "peak: -, diode: +"])
def test_a_tick_leads_out_of_sliding_that_could_go_on(tmp_path, on: str) -> None:
    """Without current the diode blocks, and would do so for ever; the tick leads to 'on'."""
    model = typed(tmp_path, FLYBACK.replace("{peak: -}", f"{{{on}}}"))
    report = cf.check_model(model)
    assert report.ok and "is never left" not in str(report)
    orbit = cf.find_orbit(model)
    assert sorted(mode for mode, _ in orbit.itinerary) == ["empty", "off", "on"]
    rises, Ts = 20e-6, 50e-6

    def mapped(u: float) -> float:
        dies = brentq(
            lambda time: flyback_off(20.0, u, time)[0], 1e-6, Ts - rises, xtol=1e-20, rtol=1e-14
        )
        return flyback_off(20.0, u, dies)[1] * math.exp(-(Ts - rises - dies) / (20.0 * 1e-4))

    at_tick, slope = fixed(mapped, 15.0, 25.0)
    assert np.min(np.abs(orbit.ends[:, 2] - at_tick)) < 1e-9
    assert max(abs(orbit.multipliers)) == pytest.approx(slope, abs=1e-7)
    diagram = cf.explore(orbit, "R", (5.0, 30.0))
    assert not diagram.loose_ends

    def current_at_tick(R: float) -> float:
        """The current at the next tick, where the voltage repeats itself with the diode conducting to it."""
        at = brentq(lambda u: flyback_off(R, u, Ts - rises)[1] - u, 1.0, 40.0, xtol=1e-13)
        return float(flyback_off(R, at, Ts - rises)[0])

    border = [b for b in diagram.bifurcations if b.kind is cf.Kind.CS]
    assert border[0].params["R"] == pytest.approx(
        brentq(current_at_tick, 5.0, 15.0, xtol=1e-12), abs=1e-8
    )
    assert len(diagram.branches) == 2


def test_one_mode_on_both_sides_is_where_sliding_leads(tmp_path) -> None:
    """What leaves i = 0 when the switch closes goes on in 'on', whichever way its current goes there."""
    model = typed(tmp_path, BUCK)
    orbit = cf.find_orbit(model)
    assert str(orbit.signature) == "on:i+ -> off -> empty -> reset@tick"
    matrix = [[0, -1], [1, -1 / 20]]

    def mapped(u: float) -> float:
        peak = advanced(matrix, [10.0, 0.0], [0.0, u], 0.2)
        dies = brentq(lambda time: advanced(matrix, [0, 0], peak, time)[0], 1e-3, 0.3, xtol=1e-15)
        return float(advanced(matrix, [0, 0], peak, dies)[1] * math.exp(-(0.3 - dies) / 20))

    at_tick, slope = fixed(mapped, 5.0, 9.5)
    assert np.min(np.abs(orbit.ends[:, 2] - at_tick)) < 1e-11
    assert max(abs(orbit.multipliers)) == pytest.approx(slope, abs=1e-8)


def test_a_boost_converter_in_seconds_goes_on_where_its_current_dies(tmp_path) -> None:
    """A segment of microseconds is long in a period of 50: its solution has not come to rest."""
    diagram = cf.explore(cf.find_orbit(typed(tmp_path, BOOST)), "R", (5.0, 60.0))
    assert not diagram.loose_ends
    assert len(diagram.branches) == 2

    def current_at_tick(R: float) -> float:
        def period(state):
            risen = advanced([[0, 0], [0, -1e4 / R]], [5e4, 0], state, 20e-6)
            return advanced([[0, -1e4], [1e4, -1e4 / R]], [5e4, 0], risen, 30e-6)

        base = period(np.zeros(2))
        matrix = np.column_stack([period(unit) - base for unit in np.eye(2)])
        return float(np.linalg.solve(np.eye(2) - matrix, base)[0])

    (border,) = [b for b in diagram.bifurcations if b.kind is cf.Kind.CS]
    assert border.params["R"] == pytest.approx(brentq(current_at_tick, 5.0, 60.0), abs=1e-8)


@pytest.mark.parametrize(("n", "m"), [(9, 0.8), (4, 0.9)])
def test_a_sine_against_a_triangle(tmp_path, n: int, m: float) -> None:
    """A carrier as a state: switches are where the sine meets the triangle, the current is that of them.

    The page's inverter has nine pulses; with an even number it has no symmetry.
    """
    page = (Path(__file__).parents[2] / "docs/models.md").read_text(encoding="utf-8")
    text = "name: inverter" + page.split("name: inverter")[1].split("```")[0]
    text = text.replace("9*w", f"{n}*w")
    if n % 2 == 0:
        text = text.replace("symmetry: i -> -i, z -> -z, t -> t + T/2", "")
    model = typed(tmp_path, text)

    def apart(t: float) -> float:
        return m * math.sin(t) - 2.0 / math.pi * math.asin(math.sin(n * t))

    grid = np.linspace(0.0, 2.0 * math.pi, 4001) + 1e-9
    switches = [
        brentq(apart, a, b, xtol=1e-15) for a, b in pairwise(grid) if apart(a) * apart(b) < 0.0
    ]

    def moved(i: float) -> float:
        for a, b in pairwise([0.0, *switches, 2.0 * math.pi]):
            limit = math.copysign(10.0, apart((a + b) / 2.0))
            i = limit + (i - limit) * math.exp(a - b)
        return i

    start = moved(0.0) / (1.0 - math.exp(-2.0 * math.pi))
    orbit = cf.find_orbit(model, {"m": m})
    assert orbit.periods == 1
    assert abs(orbit.multipliers[0]) == pytest.approx(math.exp(-2.0 * math.pi), rel=1e-9)
    motion = cf.simulate(model, {"m": m}, state=[start, 0.0], periods=1)
    assert motion.last[2] == pytest.approx([start, 0.0], abs=1e-11)
    inside = (1e-6, 2.0 * math.pi - 1e-6)  # they meet at the ends, too
    met = [t for t, (_, s) in zip(motion.times, motion.itinerary, strict=True) if s == "switch"]
    met, switches = ([t for t in ts if inside[0] < t < inside[1]] for ts in (met, switches))
    assert met == pytest.approx(switches, abs=1e-11)
