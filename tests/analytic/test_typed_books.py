"""Loops and neurons as their books write them, against their maps and scipy."""

import cmath
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from typed import typed

import contfric as cf

#: A charge pump with a detector of three states, (F. M. Gardner, IEEE Trans. Commun. 28, 1980).
PUMP = """
name: pump
states: [ref, vco, v]
parameters: {fr: 1.0, f0: 0.9, kv: 0.5, I: 1.0, C: 4.0, R: 0.5}
autonomous: true
surfaces: {early: {observable: ref, level: 1}, late: {observable: vco, level: 1}}
modes:
  idle: {in: {early: -, late: -}, field: {ref: fr, vco: f0 + kv*v, v: 0}}
  up: {in: {early: -, late: -}, field: {ref: fr, vco: f0 + kv*(v + I*R), v: I/C}}
  down: {in: {early: -, late: -}, field: {ref: fr, vco: f0 + kv*(v - I*R), v: -I/C}}
resets:
  early: {ref: 0, to: {up: {from: [idle, up]}, idle: {from: down}}}
  late: {vco: 0, to: {down: {from: [idle, down]}, idle: {from: up}}}
"""

#: A firefly that a flashing light entrains (S. H. Strogatz, Nonlinear Dynamics and Chaos, section 4.5).
FIREFLY = """
name: firefly
states: [th]
parameters: {w: 1.1, A: 0.2, W: 1.0}
period: 2*pi/W
surfaces: {flash: {observable: th, level: 2*pi}}
modes: {run: {in: {flash: -}, field: {th: w + A*sin(W*t - th)}}}
resets: {flash: {th: 0}}
"""

#: Izhikevich's simple model of a regular spiking neuron (IEEE Trans. Neural Networks 14, 2003).
SPIKING = """
name: spiking
states: [v, u]
parameters: {I: 10.0, a: 0.02, b: 0.2, c: -65.0, d: 8.0}
autonomous: true
surfaces: {peak: {observable: v, level: 30}}
modes: {sub: {in: {peak: -}, field: {v: 0.04*v**2 + 5*v + 140 - u + I, u: a*(b*v - u)}}}
resets: {peak: {v: c, u: u + d}}
spread: {v: [-80, 20], u: [-20, 10]}
"""


def test_a_locked_loop_meets_both_edges_at_once(tmp_path, caplog) -> None:
    """Its multipliers are those of one order of the edges, and that is said."""
    orbit = cf.find_orbit(typed(tmp_path, PUMP))
    assert orbit.period == pytest.approx(1.0, abs=1e-12)
    assert "meets 'early' and 'late' at once" in caplog.text or (
        "meets 'late' and 'early' at once" in caplog.text
    )
    # where the oscillator is late by e < 0 the pump works for tau = -e/f, at f = f0 + kv (v + I R);
    # where it is early, until the reference comes: tau = e
    kv, pump, resistor, capacity = 0.5, 1.0, 0.5, 4.0
    faster = {"up": 1.0 + kv * pump * resistor, "down": 1.0 - kv * pump * resistor}
    mode = orbit.itinerary[int(np.argmin(orbit.durations))][0]
    tau, left = (1.0 / faster["up"],) * 2 if mode == "up" else (1.0, faster["down"])
    charge = pump * tau / capacity
    trace, det = left - kv * charge + 1.0, left - kv * charge + kv * charge
    root = cmath.sqrt(trace**2 / 4 - det)
    expected = sorted((trace / 2 + root, trace / 2 - root), key=lambda x: x.imag)
    found = sorted(orbit.multipliers.tolist(), key=lambda x: x.imag)
    assert found == pytest.approx(expected, abs=1e-9)


def test_a_firefly_is_entrained_in_a_range(tmp_path) -> None:
    orbit = cf.find_orbit(typed(tmp_path, FIREFLY))
    # e^(lambda T) of the phase difference, whose rate is w - W - A sin(difference)
    slope = -math.sqrt(0.2**2 - 0.1**2)
    assert orbit.multipliers[0].real == pytest.approx(math.exp(2 * math.pi * slope), abs=1e-10)
    diagram = cf.explore(orbit, "w", (0.9, 1.3))
    (event,) = diagram.bifurcations
    assert event.kind is cf.Kind.SN
    assert event.params["w"] == pytest.approx(1.2, abs=1e-9)


def test_a_neuron_forgets_its_adaptation(tmp_path) -> None:
    """The multiplier of the map from spike to spike is -1.4e-9, which is not rounding."""
    orbit = cf.find_orbit(typed(tmp_path, SPIKING))

    def peak(t, y):
        return y[0] - 30.0

    peak.terminal = True
    run = solve_ivp(
        lambda t, y: (
            0.04 * y[0] ** 2 + 5 * y[0] + 140 - y[1] + 10,
            0.02 * (0.2 * y[0] - y[1]),
        ),
        (0.0, 100.0),
        orbit.begins[0][1:],
        method="DOP853",
        rtol=1e-12,
        atol=1e-12,
        events=peak,
    )
    assert run.t[-1] == pytest.approx(orbit.period, abs=1e-7)
    assert run.y[1, -1] + 8.0 == pytest.approx(orbit.begins[0][2], abs=1e-7)
    assert -1.6e-9 < orbit.multipliers[0].real < -1.3e-9
