"""Systems with names, resets and signs as their textbooks have them, against scipy and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from by_scipy import after, met
from scipy.optimize import brentq
from typed import typed

import contfric as cf

SERVO = """
name: servo
states: [x, v, q]
parameters: {Ki: 0.6, Kp: 1.2, d: 0.2, A: 1.0, w: 0.7, c: 0.4}
period: 2*pi/w
define:
  e: A*sin(w*t) - x
  u: Kp*e + Ki*q
surfaces:
  up: {observable: u, level: d}
  low: {observable: u, level: -d}
modes:
  opens: {in: {up: +}, field: {x: v, v: -c*v + u - d - x, q: e}}
  closed: {in: {up: -, low: +}, field: {x: v, v: -c*v - x, q: e}}
  opens-: {in: {low: -}, field: {x: v, v: -c*v + u + d - x, q: e}}
symmetry: x -> -x, v -> -v, q -> -q, t -> t + T/2
spread: {x: 2, v: 2, q: 2}
"""

NEURON = """
name: resonate_and_fire
states: [x, y]
parameters: {b: 0.3, w: 1.0, A: 0.4, W: 1.0}
period: 2*pi/W
surfaces: {spike: {observable: y, level: 1}}
modes: {free: {in: {spike: -}, field: {x: -b*x - w*y + A*cos(W*t), y: w*x - b*y}}}
resets: {spike: {x: 0, y: 1}}
"""

OCEAN = """
name: ocean
states: [T, S]
parameters: {k0: 0.1, k1: 5.0, a: 0.8, b: 0.5, eps: -0.01}
autonomous: true
surfaces: {rho: {observable: S - a*T, level: eps, sliding: filippov}}
modes:
  mixed: {in: {rho: +}, field: {T: 1 - T - k1*T, S: b*(1 - S) - k1*S}}
  calm: {in: {rho: -}, field: {T: 1 - T - k0*T, S: b*(1 - S) - k0*S}}
"""


RUNNER = """
name: runner
states: [x, y, vx, vy]
parameters: {k: 20.0, al: 1.05, g: 1.0}
autonomous: true
define: {r: sqrt(x**2 + y**2)}
surfaces:
  apex: {observable: vy}
  down: {observable: y, level: sin(al)}
  up: {observable: r, level: 1}
modes:
  rise: {in: {apex: +}, field: {x: vx, y: vy, vx: 0, vy: -g}}
  fall: {in: {apex: -, down: +}, field: {x: vx, y: vy, vx: 0, vy: -g}}
  stance: {in: {up: -}, field: {x: vx, y: vy, vx: k*(1 - r)*x/r, vy: k*(1 - r)*y/r - g}}
resets:
  apex: {to: fall, from: [rise]}
  down: {x: -cos(al), to: stance, from: [fall]}
  up: {to: rise, from: [stance]}
"""

#: A predator that is culled above a threshold: prey and predator come to rest on it.
THRESHOLD = """
name: harvest
states: [x, y]
parameters: {r: 1.0, K: 3.0, a: 1.5, m: 0.5, mu: 0.6, E: 0.4, Tc: 0.8}
autonomous: true
define: {eat: a*x*y/(1 + x)}
surfaces:
  threshold: {observable: y, level: Tc, sliding: filippov}
modes:
  free: {in: {threshold: -}, field: {x: r*x*(1 - x/K) - eat, y: mu*eat - m*y}}
  cull: {in: {threshold: +}, field: {x: r*x*(1 - x/K) - eat, y: mu*eat - m*y - E*y}}
spread: {x: 3, y: 2}
"""


def test_modes_may_be_called_plus_and_minus(tmp_path) -> None:
    """A valve with a dead zone: 'opens' and 'opens-' are both divided by the phase."""
    model = typed(tmp_path, SERVO)
    report = cf.check_model(model)
    assert report.ok, report
    orbit = cf.find_orbit(model)
    assert {mode for mode, _ in orbit.itinerary} == {"opens", "closed", "opens-"}

    def field(t, y):
        e = math.sin(0.7 * t) - y[0]
        u = 1.2 * e + 0.6 * y[2]
        dead = u - min(max(u, -0.2), 0.2)
        return y[1], -0.4 * y[1] + dead - y[0], e

    t, *state = orbit.ends[0]
    half = after(field, state, (t, t + math.pi / 0.7), max_step=0.02)
    assert half == pytest.approx(-np.array(state), abs=1e-8)


def test_a_spike_that_is_just_touched_jumps(tmp_path) -> None:
    """Izhikevich's resonate-and-fire neuron begins at x = 0 after a spike, at which y' = 0 means x = b.

    Below the threshold the neuron is linear: it touches y = 1 where A is 1 over the gain.
    """
    model = typed(tmp_path, NEURON)
    diagram = cf.explore(cf.find_orbit(model), "A", (0.3, 2.0))
    (event,) = diagram.bifurcations
    assert event.kind is cf.Kind.GS
    gain = abs(1.0 / ((1j + 0.3) ** 2 + 1.0))
    assert event.params["A"] == pytest.approx(1.0 / gain, abs=1e-10)
    assert "leads to another place" in event.meaning and "the map jumps" in event.meaning
    assert diagram.verify().passed


def test_an_impact_that_is_just_touched_does_not_jump(tmp_path) -> None:
    """The same threshold as a wall of y, with its rate turned round: nothing is thrown at speed zero."""
    wall = NEURON.replace("{x: 0, y: 1}", "{x: 2*b/w - x}")
    diagram = cf.explore(cf.find_orbit(typed(tmp_path, wall)), "A", (0.3, 0.8))
    assert all("jumps" not in event.meaning for event in diagram.bifurcations)


@pytest.mark.parametrize("eps", [-0.03, -0.01])
def test_a_temperature_may_be_called_T_and_nothing_slides_where_fields_part(tmp_path, eps) -> None:
    """Welander's ocean: for eps < 0 mixing takes density through the surface, and no sliding mode is added.

    With D = S - a T each regime relaxes at the rates 1 + k and b + k; both flights are roots of exponentials.
    """
    model = typed(tmp_path, OCEAN.replace("eps: -0.01", f"eps: {eps}"))
    assert [mode.name for mode in model.modes] == ["mixed", "calm"]
    assert cf.check_model(model).ok
    a, b = 0.8, 0.5

    def flight(k: float, T: float) -> tuple[float, float]:
        """Return (time, T) at which density returns to its level, from T on it."""
        T0, S0, S = 1 / (1 + k), b / (b + k), eps + a * T

        def density(t: float) -> float:
            temperature = T0 + (T - T0) * math.exp(-(1 + k) * t)
            return S0 + (S - S0) * math.exp(-(b + k) * t) - a * temperature - eps

        times = np.linspace(1e-6, 20.0, 20001)
        signs = np.sign([density(t) for t in times])
        i = int(np.flatnonzero(signs[1:] != signs[:-1])[0])
        last = brentq(density, times[i], times[i + 1], xtol=1e-15)
        return last, T0 + (T - T0) * math.exp(-(1 + k) * last)

    orbit = cf.find_orbit(model)
    ends = {mode: end for (mode, _), end in zip(orbit.itinerary, orbit.ends, strict=True)}
    mixes, low = flight(5.0, float(ends["calm"][1]))
    calms, high = flight(0.1, low)
    assert low == pytest.approx(float(ends["mixed"][1]), abs=1e-10)
    assert high == pytest.approx(float(ends["calm"][1]), abs=1e-10)
    assert orbit.period == pytest.approx(mixes + calms, abs=1e-10)


def test_the_period_of_an_excitation_keeps_its_name(tmp_path) -> None:
    text = OCEAN.replace("autonomous: true", "period: 2*pi")
    with pytest.raises(cf.ModelError, match="the period of the excitation"):
        typed(tmp_path, text)


def test_a_runner_on_a_spring(tmp_path) -> None:
    """SLIP, touching down at a fixed angle: the map from apex to apex keeps energy and has one slope."""
    orbit = cf.find_orbit(typed(tmp_path, RUNNER), state=[0.0, 1.02, 2.0, 0.0])
    assert [mode for mode, _ in orbit.itinerary] == ["fall", "stance", "rise"]

    def next_apex(height: float, energy: float) -> float:
        speed, al = math.sqrt(2.0 * (energy - height)), 1.05
        start = [-math.cos(al), math.sin(al), speed, -math.sqrt(2.0 * (height - math.sin(al)))]

        def stance(_, y):
            r = math.hypot(y[0], y[1])
            pull = 20.0 * (1.0 - r) / r
            return y[2], y[3], pull * y[0], pull * y[1] - 1.0

        def lift(_, y):
            return math.hypot(y[0], y[1]) - 1.0

        _, y = met(stance, start, lift, 1, (0, 5))
        return float(y[1] + y[3] ** 2 / 2.0)

    places = dict(zip((exit_ for _, exit_ in orbit.itinerary), orbit.ends, strict=True))
    _, _, height, speed, _ = places["apex"]
    energy = height + speed**2 / 2.0
    assert next_apex(height, energy) == pytest.approx(height, abs=1e-9)
    step = 1e-5
    slope = (next_apex(height + step, energy) - next_apex(height - step, energy)) / (2.0 * step)
    multipliers = sorted(orbit.multipliers, key=abs)
    assert multipliers[-1].real == pytest.approx(1.0, abs=1e-9)
    assert multipliers[-2].real == pytest.approx(slope, abs=1e-6)


def test_what_slides_for_ever_is_called_by_its_mode(tmp_path) -> None:
    # on y = Tc prey grows as it is eaten: (1 - x/K)(1 + x) = a Tc, so that x = 1 + sqrt(0.4)
    where = (
        rf"for ever, at its pseudo-equilibrium x = {1.0 + math.sqrt(0.4):.4g}, y = 0\.8: nothing"
    )
    with pytest.raises(cf.ConvergenceError, match=f"stays in mode 'slide' {where}"):
        cf.find_orbit(typed(tmp_path, THRESHOLD), state=[1.0, 0.5])
