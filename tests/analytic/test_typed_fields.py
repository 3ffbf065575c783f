"""Systems of several fields as their textbooks have them, each followed for one period by scipy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from by_scipy import met
from scipy.integrate import solve_ivp
from typed import typed

import contfric as cf

#: McKean's piecewise linear FitzHugh-Nagumo equations.
MCKEAN = """
name: mckean
states: [v, w]
parameters: {I: 0.5, eps: 0.05, a: 0.25, g: 0.5}
autonomous: true
surfaces: {low: {observable: v, level: a/2}, high: {observable: v, level: (1 + a)/2}}
modes:
  left: {in: {low: -}, field: {v: -v - w + I, w: eps*(v - g*w)}}
  middle: {in: {low: +, high: -}, field: {v: v - a - w + I, w: eps*(v - g*w)}}
  right: {in: {high: +}, field: {v: 1 - v - w + I, w: eps*(v - g*w)}}
"""

#: Kaldor's trade cycle, investment between a floor and a ceiling.
KALDOR = """
name: kaldor
states: [Y, K]
parameters: {al: 4.0, s: 0.4, be: 0.9, d: 0.2, cap: 1.0}
autonomous: true
surfaces: {ceiling: {observable: Y, level: cap}, floor: {observable: Y, level: -cap}}
modes:
  boom: {in: {ceiling: +}, field: {Y: al*(be*cap - K - s*Y), K: be*cap - K - d*K}}
  normal: {in: {ceiling: -, floor: +}, field: {Y: al*(be*Y - K - s*Y), K: be*Y - K - d*K}}
  slump: {in: {floor: -}, field: {Y: al*(-be*cap - K - s*Y), K: -be*cap - K - d*K}}
symmetry: Y -> -Y, K -> -K
spread: {Y: 3, K: 2}
"""

#: Three genes in a ring, each switched off by the one before it.
RING = """
name: ring
states: [x, y, z]
parameters: {k: 1.0, th: 0.4}
autonomous: true
surfaces: {X: {observable: x, level: th}, Y: {observable: y, level: th}, Z: {observable: z, level: th}}
field: {x: "where(z < th, k, 0) - x", y: "where(x < th, k, 0) - y", z: "where(y < th, k, 0) - z"}
modes:
  a: {in: {X: +, Y: +, Z: -}}
  b: {in: {X: -, Y: +, Z: -}}
  c: {in: {X: -, Y: +, Z: +}}
  d: {in: {X: -, Y: -, Z: +}}
  e: {in: {X: +, Y: -, Z: +}}
  f: {in: {X: +, Y: -, Z: -}}
  g: {in: {X: +, Y: +, Z: +}}
  h: {in: {X: -, Y: -, Z: -}}
"""


def by_mckean(t, y):
    """Return the rates by the middle of three lines."""
    v, w = y
    return -v - w + 0.5 + (0.0 if v < 0.125 else min(2 * v - 0.25, 1.0)), 0.05 * (v - 0.5 * w)


def by_kaldor(t, y):
    """Return the rates with investment cut off."""
    invested = 0.9 * min(max(y[0], -1.0), 1.0)
    return 4.0 * (invested - y[1] - 0.4 * y[0]), invested - 1.2 * y[1]


def by_ring(t, y):
    """Return what each gene makes, less what decays."""
    return [float(y[k - 1] < 0.4) - y[k] for k in range(3)]


@pytest.mark.parametrize(
    ("text", "start", "field", "kinks"),
    [
        (MCKEAN, None, by_mckean, ((0, 0.125), (0, 0.625))),
        (KALDOR, None, by_kaldor, ((0, 1.0), (0, -1.0))),
        (RING, [0.6, 0.2, 0.3], by_ring, ((0, 0.4), (1, 0.4), (2, 0.4))),
    ],
    ids=["mckean", "kaldor", "ring"],
)
def test_a_cycle_closes_by_scipy(tmp_path, text: str, start, field: Callable, kinks) -> None:
    """The field is one formula with its kinks, from which scipy starts again at each."""
    orbit = cf.find_orbit(typed(tmp_path, text), **({} if start is None else {"state": start}))
    y, t = orbit.begins[0, 1:] + 1e-9, 0.0
    first = y
    while t < orbit.period:
        events = [lambda t, y, i=i, level=level: y[i] - level for i, level in kinks]
        for event in events:
            event.terminal = True
        found = solve_ivp(
            field, (t, orbit.period), y, method="DOP853", rtol=1e-11, atol=1e-13, events=events
        )
        t, y = found.t[-1], found.y[:, -1]
        y = y + 1e-12 * np.array(field(t, y))
    assert y == pytest.approx(first, abs=1e-6)


IZHIKEVICH = """
name: izhikevich
states: [v, u]
parameters: {a: 0.02, b: 0.2, c: -65.0, d: 8.0, I: 10.0}
autonomous: true
surfaces: {peak: {observable: v, level: 30}}
modes: {free: {in: {peak: -}, field: {v: 0.04*v**2 + 5*v + 140 - u + I, u: a*(b*v - u)}}}
resets: {peak: {v: c, u: u + d}}
spread: {v: 80, u: 20}
"""

#: Pfeiffer's woodpecker in angles: it falls below the lower angle, where the sleeve has come loose.
WOODPECKER = """
name: woodpecker
states: [phi, w]
parameters: {m: 0.2, pk: 0.4, p1: 0.15, d1: 0.55, d3: 0.7, kick: 0.35}
autonomous: true
surfaces: {beak: {observable: phi, level: pk}, lower: {observable: phi, level: -p1}}
modes:
  swings: {in: {beak: -, lower: +}, field: {phi: w, w: -phi}}
  falls: {in: {lower: -}, field: {phi: w, w: -phi + m}}
resets:
  beak: {w: -d3*w}
  lower: {w: d1*w + kick, to: swings, from: [falls]}
"""

SCHMITT = """
name: schmitt
states: [u]
parameters: {Vs: 10.0, R: 2.0, C: 0.5, b: 0.4}
autonomous: true
surfaces: {high: {observable: u, level: b*Vs}, low: {observable: u, level: -b*Vs}}
modes:
  charges: {in: {high: -}, field: {u: (Vs - u)/(R*C)}}
  discharges: {in: {low: +}, field: {u: (-Vs - u)/(R*C)}}
symmetry: u -> -u
spread: {u: 5}
"""

#: A bridge whose duty cycle is sampled, and cut off at 0 and 1 (Robert and Robert 2002).
BRIDGE = """
name: bridge
states: [i, r]
parameters: {E: 400.0, R: 40.0, L: 20.0e-3, Ts: 62.5e-6, k: 0.1, ref: 5.0}
period: Ts
surfaces: {switch: {observable: "mod(t, Ts)/Ts - r"}}
modes:
  plus: {in: {switch: -}, field: {i: (E - R*i)/L, r: 0}}
  minus: {in: {switch: +}, field: {i: (-E - R*i)/L, r: 0}}
resets: {tick: {r: "min(max(0.5 + k*(ref - i), 0), 1)", to: plus}}
units: {t: 1.0e-5}
spread: {i: 10, r: 1}
"""


def test_one_state_without_excitation_is_explored(tmp_path) -> None:
    """A Schmitt trigger: no multiplier is left, T = 2 R C log((1 + b)/(1 - b))."""
    orbit = cf.find_orbit(typed(tmp_path, SCHMITT))
    (branch,) = cf.explore(orbit, "b", (0.1, 0.8)).branches
    expected = 2.0 * np.log((1 + branch.values) / (1 - branch.values))
    assert branch.period == pytest.approx(expected, abs=1e-9)


def test_a_kink_of_a_reset_is_said(tmp_path) -> None:
    """Without saturation there is none, and one that no motion meets does not count."""
    assert "the reset at 'tick' has a kink where" in str(cf.check_model(typed(tmp_path, BRIDGE)))
    plain = BRIDGE.replace("min(max(0.5 + k*(ref - i), 0), 1)", "0.5 + k*(ref - i)")
    along = plain.replace("(ref - i)", "(ref - i) + 0*abs(r + 5)")
    assert "has a kink" not in str(cf.check_model(typed(tmp_path, along)))


def test_a_spiking_neuron(tmp_path) -> None:
    """Izhikevich (2003), regular spiking at I = 10: the time between two spikes, in ms."""
    orbit = cf.find_orbit(typed(tmp_path, IZHIKEVICH), state=[-65, -13])

    def field(t, y):
        return 0.04 * y[0] ** 2 + 5 * y[0] + 140 - y[1] + 10, 0.02 * (0.2 * y[0] - y[1])

    time, peak = met(field, orbit.begins[0, 1:], lambda t, y: y[0] - 30, 1)
    assert time == pytest.approx(orbit.period, abs=1e-7)
    assert peak[1] + 8 == pytest.approx(orbit.begins[0, 2], abs=1e-7)


def test_a_woodpecker_passes_where_it_is_not_kicked(tmp_path) -> None:
    """On its way down the lower angle changes nothing but the mode: the kick is from 'falls' alone."""
    orbit = cf.find_orbit(typed(tmp_path, WOODPECKER))
    assert str(orbit.signature) == "swings -> falls -> impact@lower -> swings -> impact@beak"

    def swings(t, y):
        return y[1], -y[0]

    def falls(t, y):
        return y[1], -y[0] + 0.2

    strike = [exit_ for _, exit_ in orbit.itinerary].index("beak")
    w = orbit.ends[strike, 2]
    down, y = met(swings, [0.4, -0.7 * w], lambda t, y: y[0] + 0.15, -1)
    below, y = met(falls, y, lambda t, y: y[0] + 0.15, 1)
    up, y = met(swings, [y[0], 0.55 * y[1] + 0.35], lambda t, y: y[0] - 0.4, 1)
    assert y[1] == pytest.approx(w, abs=1e-9)
    assert down + below + up == pytest.approx(orbit.period, abs=1e-9)


#: The switch of a class-E amplifier discharges what is left on its capacitor, and holds v = 0.
CLASS_E = """
name: class_e
states: [v, i, u, iL]
parameters: {VI: 1.0, Q: 5.0, C1: 0.18, Lf: 7.0, R: 1.0, D: 0.5, X: 1.15, T: 6.283185307179586}
period: T
surfaces:
  pulse: {observable: "mod(t, T)", level: D*T}
  body: {observable: v}
  charge: {observable: iL - i}
modes:
  closed: {in: {pulse: -, body: 0}, field: {v: 0, i: (-u - R*i)/(Q + X), u: Q*i, iL: VI/Lf}}
  open: {in: {pulse: +, body: +}, field: {v: (iL - i)/C1, i: (v - u - R*i)/(Q + X), u: Q*i, iL: (VI - v)/Lf}}
  diode: {in: {pulse: +, body: 0, charge: -}, field: {v: 0, i: (-u - R*i)/(Q + X), u: Q*i, iL: VI/Lf}}
resets: {tick: {v: 0, to: closed}}
"""


def test_a_reset_leads_into_motion_on_another_surface(tmp_path) -> None:
    """'v: 0' lands on v = 0, where 'closed' slides; it was refused."""
    model = typed(tmp_path, CLASS_E)
    assert cf.check_model(model).ok
    orbit = cf.find_orbit(model, state=[0, 0, 0, 0.5])
    modes = [mode for mode, _ in orbit.itinerary]
    assert sorted(modes) == ["closed", "diode", "open", "open"]
    start = orbit.begins[modes.index("closed"), 1:5]
    assert start[0] == 0.0

    def field(t, y):
        v, i, u, current = y
        held = t < np.pi or (v <= 0.0 and current < i)
        drive = 0.0 if held else v
        rate = 0.0 if held else (current - i) / 0.18
        return rate, (drive - u - i) / 6.15, 5 * i, (1 - drive) / 7

    y = start
    for span in ((0, np.pi), (np.pi, 2 * np.pi)):
        y = solve_ivp(field, span, y, rtol=1e-9, atol=1e-11, max_step=2e-3).y[:, -1]
    assert y[1:] == pytest.approx(start[1:], abs=1e-6)


SEPIC = """
name: sepic
states: [i1, i2, v1, v2]
parameters: {E: 12.0, L1: 50.0, L2: 50.0, C1: 23.0, C2: 50.0, R: 10.0, D: 0.4, Ts: 5.0}
period: Ts
surfaces: {pulse: {observable: "mod(t, Ts)", level: D*Ts}, diode: {observable: i1 + i2}}
modes:
  on: {in: {pulse: -}, field: {i1: E/L1, i2: v1/L2, v1: -i2/C1, v2: -v2/(R*C2)}}
  off:
    in: {pulse: +, diode: +}
    field: {i1: (E - v1 - v2)/L1, i2: -v2/L2, v1: i1/C1, v2: (i1 + i2 - v2/R)/C2}
  idle:
    in: {pulse: +, diode: 0}
    field: {i1: (E - v1)/(L1 + L2), i2: -(E - v1)/(L1 + L2), v1: i1/C1, v2: -v2/(R*C2)}
"""


def test_a_mode_on_both_sides_passes_where_others_leave_rest(tmp_path) -> None:
    """While the switch is on the diode says nothing; 'idle' leaves its surface upwards there."""
    model = typed(tmp_path, SEPIC)
    assert model.transitions["on:diode+", "diode"] == "on:diode-"
    assert model.transitions["idle", "pulse"] == "on:diode+"


#: A child who stands up where the swing is lowest, and sits down where it turns round.
SWING = """
name: swing
states: [th, w]
parameters: {l: 1.0, d: 0.066, c: 0.1}
autonomous: true
surfaces: {bottom: {observable: th}, turn: {observable: w}}
modes:
  down+: {in: {bottom: +, turn: -}, field: {th: w, w: -sin(th)/(l + d) - c*w}}
  up-: {in: {bottom: -, turn: -}, field: {th: w, w: -sin(th)/(l - d) - c*w}}
  down-: {in: {bottom: -, turn: +}, field: {th: w, w: -sin(th)/(l + d) - c*w}}
  up+: {in: {bottom: +, turn: +}, field: {th: w, w: -sin(th)/(l - d) - c*w}}
resets: {bottom: {w: w*((l + d)/(l - d))**2}}
symmetry: th -> -th, w -> -w
spread: {th: 2, w: 1}
"""


def test_a_swing_that_comes_to_stand_on_its_head(tmp_path) -> None:
    """Half a cycle by scipy. At its end points differ by rounding, and none is a branch point."""
    model = typed(tmp_path, SWING)
    orbit = cf.find_orbit(model, state=[2.0, 0.0])

    def swung(d: float, th: float) -> float:
        """Return the next turn of a swing from rest at an angle."""
        down, up = (
            lambda t, y, length=length: [y[1], -np.sin(y[0]) / length - 0.1 * y[1]]
            for length in (1.0 + d, 1.0 - d)
        )
        _, low = met(down, [th, 0.0], lambda t, y: y[0], -1)
        kicked = [0.0, low[1] * ((1.0 + d) / (1.0 - d)) ** 2]
        return -float(met(up, kicked, lambda t, y: y[1], 1)[1][0])

    assert swung(0.066, orbit.x_max) == pytest.approx(orbit.x_max, rel=1e-9)
    diagram = cf.explore(orbit, "d", (0.065, 0.07))
    assert diagram.bifurcations == ()
    assert any(end.reason.name == "PERIOD" for b in diagram.branches for end in b.ends)
