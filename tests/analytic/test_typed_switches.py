"""Switches and clocks as their textbooks have them, against simulations of their own."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from typed import typed

import contfric as cf

#: An inverter of three levels, whose current follows a sine in two bands of hysteresis.
THREE_LEVELS = """
name: three_levels
states: [i]
parameters: {V: 1.2, R: 0.1, L: 0.3, A: 1.0, W: 1.0, h: 0.1}
period: 2*pi/W
observables: {err: i - A*sin(W*t)}
surfaces:
  pos: {observable: err, level: h}
  neg: {observable: err, level: -h}
  zero+: {observable: err, level: 2*h}
  zero-: {observable: err, level: -2*h}
modes:
  plus: {in: {pos: -}, field: {i: (V - R*i)/L}}
  off: {in: {zero+: -, zero-: +}, field: {i: -R*i/L}}
  minus: {in: {neg: +}, field: {i: (-V - R*i)/L}}
resets:
  pos: {to: off, from: [plus]}
  neg: {to: off, from: [minus]}
  zero+: {to: minus, from: [off]}
  zero-: {to: plus, from: [off]}
symmetry: i -> -i, t -> t + T/2
spread: {i: 1}
"""
#: (mode, surface) -> mode after it, and the levels in units of h.
NEXT = {
    ("plus", "pos"): "off",
    ("minus", "neg"): "off",
    ("off", "zero+"): "minus",
    ("off", "zero-"): "plus",
}
LEVELS = {"pos": 1.0, "neg": -1.0, "zero+": 2.0, "zero-": -2.0}


def switched(i: float, until: float, h: float) -> tuple[list[tuple[str, str]], float]:
    """Return (mode, surface) of all switchings from 'off' at t = 0, and the current at the end."""
    t, mode, found = 0.0, "off", []
    while True:
        volts = {"plus": 1.2, "off": 0.0, "minus": -1.2}[mode]

        def current(s: float, t=t, i=i, volts=volts) -> float:
            """Return the current a time after t."""
            return 10 * volts + (i - 10 * volts) * np.exp(-s / 3)

        grid = np.linspace(1e-9, until - t, 2 + int(400 * (until - t)))
        hits = []
        for surface in (s for m, s in NEXT if m == mode):

            def above(s, current=current, t=t, level=h * LEVELS[surface]):
                """Return the height over a level."""
                return current(s) - np.sin(t + s) - level

            signs = np.sign(above(grid))
            cross = np.flatnonzero(signs[1:] != signs[:-1])
            if len(cross):
                hits.append((brentq(above, *grid[cross[0] : cross[0] + 2], xtol=1e-14), surface))
        if not hits:
            return found, current(until - t)
        after, surface = min(hits)
        found.append((mode, surface))
        t, i, mode = t + after, current(after), NEXT[mode, surface]


@pytest.mark.parametrize("h", [0.15])
def test_a_mode_that_goes_on_to_either_side_of_where_a_reset_leads_it(tmp_path, h: float) -> None:
    """From the inner band 'off' drifts to either side, which is a label; reading the orbit failed."""
    model = typed(tmp_path, THREE_LEVELS)
    assert "still runs into" not in str(cf.check_model(model))
    found = cf.simulate(model, {"h": h}, state=[0.05], domain="off:err2", periods=2)
    events, last = switched(0.05, 4 * np.pi, h)
    ours = [(m.rstrip("-"), s) for m, s in found.itinerary if s != "phase"]
    assert ours == events
    assert found.last[2][0] == pytest.approx(last, abs=1e-10)
    orbit = cf.find_orbit(model, {"h": h}, state=[0.05])
    assert orbit.converged
    assert orbit.admissible


#: Two pendulum clocks on one beam, each kicked on its way up.
HUYGENS = """
name: huygens
states: [a, w, b, u]
parameters: {c: 0.1, kick: 0.2, eps: 0.05, at: 0.2, d: 1.02}
autonomous: true
surfaces:
  hit1: {observable: a, level: at}
  hit2: {observable: b, level: at}
  up1: {observable: w}
  up2: {observable: u}
field: {a: w, w: -a - c*w + eps*(b - a), b: u, u: -d*b - c*u + eps*(a - b)}
modes:
  pp: {in: {up1: +, up2: +}}
  pm: {in: {up1: +, up2: -}}
  mp: {in: {up1: -, up2: +}}
  mm: {in: {up1: -, up2: -}}
resets:
  hit1: {w: w + kick, from: [pp, pm]}
  hit2: {u: u + kick, from: [pp, mp]}
spread: {a: 1, w: 1, b: 1, u: 1}
"""


def test_two_clocks_on_one_beam(tmp_path) -> None:
    """They tick together, by scipy; and part at a Neimark-Sacker where one is too fast for the other."""
    model = typed(tmp_path, HUYGENS)
    orbit = cf.find_orbit(model, state=[0.5, 0.0, 0.6, 0.1])

    def rate(_, y):
        a, w, b, u = y
        return [w, -a - 0.1 * w + 0.05 * (b - a), u, -1.02 * b - 0.1 * u + 0.05 * (a - b)]

    def hit1(_, y):
        return y[0] - 0.2

    def hit2(_, y):
        return y[2] - 0.2

    for hit in (hit1, hit2):
        hit.terminal, hit.direction = True, 1
    start = next(y[1:] for y, (m, _) in zip(orbit.ends, orbit.itinerary, strict=True) if m == "mm")
    t, y, how = 0.0, np.array(start), {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
    for _ in range(3):  # two kicks, and what is left
        found = solve_ivp(rate, (t, orbit.period), y, events=(hit1, hit2), **how)
        t, y = found.t[-1], found.y[:, -1]
        for place, times in zip((1, 3), found.t_events, strict=True):
            y[place] += 0.2 * len(times)
        if t < orbit.period:  # off the surface, which would be met at once
            ahead = solve_ivp(rate, (t, t + 1e-3), y, **how)
            t, y = ahead.t[-1], ahead.y[:, -1]
    assert y == pytest.approx(start, abs=1e-9)
    diagram = cf.explore(orbit, "d", (1.0, 1.15))
    assert [event.kind.value for event in diagram.bifurcations] == ["NS"]
