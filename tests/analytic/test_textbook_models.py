"""Models as a reader of textbooks types them, each against a computation that shares no code with it.

Converters with a diode, a tank with a valve, a pendulum on a turning shaft: kinds of models that a bundled
file does not have. The references are matrix exponentials, closed forms, or scipy's integrator.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from by_scipy import met
from scipy.linalg import expm
from scipy.optimize import brentq
from typed import typed

import contfric as cf

BOOST = """
name: boost
states: [i, u]
parameters: {E: 5.0, L: 1.0, C: 1.0, R: 20.0, D: 0.4, T: 0.5}
period: T
surfaces:
  diode: {observable: i}
  pulse: {observable: "mod(t, T)", level: D*T}
modes:
  on: {in: {pulse: -}, field: {i: E/L, u: -u/(R*C)}}
  off: {in: {pulse: +, diode: +}, field: {i: (E - u)/L, u: (i - u/R)/C}}
  empty: {in: {pulse: +, diode: 0}, field: {i: 0, u: -u/(R*C)}}
spread: {i: 3, u: 8}
"""


def affine(matrix, constant, time: float):
    """Return the matrix and vector that advance an affine system by a time."""
    n = len(constant)
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n], whole[:n, n] = matrix, constant
    found = expm(whole * time)
    return found[:n, :n], found[:n, n]


def boost_in_one_period(R: float, state, D=0.4, T=0.5, E=5.0):
    """Return the state a period after a tick, while the diode conducts all the time."""
    ahead, by = affine([[0, 0], [0, -1 / R]], [E, 0], D * T)
    then, so = affine([[0, -1], [1, -1 / R]], [E, 0], (1 - D) * T)
    return then @ ahead, then @ by + so


def test_boost_converter_in_discontinuous_conduction(tmp_path) -> None:
    """The current dies before the tick from a resistance on at which it just does; T is the period.

    A reset that leads out of a sliding mode: at the tick the diode's mode, i = 0, is left.
    """
    model = typed(tmp_path, BOOST)
    report = cf.check_model(model)
    assert report.ok, report
    orbit = cf.find_orbit(model)
    diagram = cf.explore(orbit, "R", (2, 40))
    assert not diagram.loose_ends
    assert diagram.verify().passed
    (border,) = diagram.bifurcations

    def current_at_tick(R: float) -> float:
        matrix, constant = boost_in_one_period(R, None)
        return float(np.linalg.solve(np.eye(2) - matrix, constant)[0])

    assert border.params["R"] == pytest.approx(brentq(current_at_tick, 5, 60, xtol=1e-12), abs=1e-9)
    matrix, _ = boost_in_one_period(20.0, None)
    exact = np.sort_complex(np.linalg.eigvals(matrix))
    assert np.allclose(np.sort_complex(orbit.multipliers), exact, atol=1e-11)
    empty = cf.find_orbit(model, {"R": 35.0})
    assert [mode for mode, _ in empty.itinerary].count("empty") == 1

    def next_voltage(u: float) -> float:
        """From the tick with no current: on, off until the current dies, the rest empty."""
        R, D, T, E = 35.0, 0.4, 0.5, 5.0
        up, by = affine([[0, 0], [0, -1 / R]], [E, 0], D * T)
        state = up @ [0.0, u] + by

        def off(time: float):
            m, c = affine([[0, -1], [1, -1 / R]], [E, 0], time)
            return m @ state + c

        dies = brentq(lambda time: off(time)[0], 1e-3, (1 - D) * T, xtol=1e-15)
        return float(off(dies)[1] * math.exp(-((1 - D) * T - dies) / R))

    at_tick = brentq(lambda u: next_voltage(u) - u, 8.5, 12, xtol=1e-13)
    assert np.min(np.abs(empty.ends[:, 2] - at_tick)) < 1e-10
    slope = (next_voltage(at_tick + 1e-5) - next_voltage(at_tick - 1e-5)) / 2e-5
    found = sorted(empty.multipliers, key=abs)
    assert found[1].real == pytest.approx(slope, abs=1e-8)
    assert found[0] == 0.0


def test_a_name_of_the_period_must_be_the_period(tmp_path) -> None:
    with pytest.raises(cf.ModelError, match="period: T"):
        typed(tmp_path, BOOST.replace("period: T", "period: 2*T"))


TANK = """
name: tank
states: [h]
parameters: {q: 1.0, k: 0.6, lo: 0.8, hi: 1.2}
autonomous: true
surfaces:
  full: {observable: h, level: hi}
  empty: {observable: h, level: lo}
modes:
  fill: {in: {full: -}, field: {h: q - k*sqrt(h)}}
  drain: {in: {empty: +}, field: {h: -k*sqrt(h)}}
"""


def test_tank_with_a_root_of_its_level(tmp_path) -> None:
    """A formula that has no value where motion never comes is said once, and is no fault."""
    model = typed(tmp_path, TANK)
    report = cf.check_model(model)
    assert report.ok, report
    said = [f for f in report.findings if "have no value at" in f.message]
    assert len(said) == 1
    assert "mode 'fill'" in said[0].message
    orbit, q, k, low, high = cf.find_orbit(model), 1.0, 0.6, math.sqrt(0.8), math.sqrt(1.2)
    drains = 2 * (high - low) / k  # with s = sqrt(h): 2 s s' = q - k s
    fills = 2 * (-(high - low) / k - q / k**2 * math.log((q - k * high) / (q - k * low)))
    assert orbit.period == pytest.approx(drains + fills, abs=1e-11)


def test_formulas_without_any_value_are_an_error(tmp_path) -> None:
    model = typed(tmp_path, TANK.replace("q - k*sqrt(h)", "q - k*sqrt(-1 - h**2)"))
    assert not cf.check_model(model).ok


FROUDE = """
name: froude
states: [phi, w]
parameters: {Om: 1.2, mu: 0.6, mu0: 0.8, c: 0.05}
autonomous: true
angles: [phi]
observables: {load: -sin(phi) - c*w}
surfaces:
  shaft: {observable: w, level: Om}
  up: {observable: load, level: mu0}
  low: {observable: load, level: -mu0}
field: {phi: w, w: load - (mu + (mu0 - mu)*exp(-abs(w - Om)))*sign(w - Om)}
modes:
  fast: {in: {shaft: +}}
  slow: {in: {shaft: -}}
  held: {in: {shaft: 0, up: -, low: +}, field: {phi: Om, w: 0}}
spread: {phi: 3, w: 2}
"""


@pytest.fixture(scope="module")
def froude(tmp_path_factory) -> cf.Diagram:
    model = typed(tmp_path_factory.mktemp("froude"), FROUDE)
    return cf.explore(cf.find_orbit(model), "Om", (0.3, 2.5))


def test_nothing_happens_to_a_motion_where_an_angle_begins_again(froude: cf.Diagram) -> None:
    """The pendulum sticks to its shaft just where a turn is over: the name changes, the solution does not.

    The branches of both names end there, and go on as each other, whichever is met first.
    """
    assert not froude.loose_ends
    assert froude.verify().passed
    (event,) = froude.bifurcations
    assert "new turn" in event.meaning
    before, after = sorted(froude.branches, key=lambda b: b.values.min())
    assert before.values.max() == pytest.approx(after.values.min(), abs=1e-10)
    model = froude.branches[0][0].model
    other = cf.explore(cf.find_orbit(model, {"Om": 1.0}), "Om", (0.3, 2.5))
    assert not other.loose_ends
    assert len(other.branches) == 2
    assert other.bifurcations[0].params["Om"] == pytest.approx(event.params["Om"], abs=1e-10)


def test_froude_pendulum_against_scipy(froude: cf.Diagram) -> None:
    """At the event the pendulum comes to its shaft upside down: slow from the lower limit of the load."""
    (event,) = froude.bifurcations
    Om = event.params["Om"]
    mu, mu0, c = 0.6, 0.8, 0.05

    def slow(_t, y):
        friction = mu + (mu0 - mu) * math.exp(-abs(y[1] - Om))
        return y[1], -math.sin(y[0]) - c * y[1] + friction

    def back(_t, y):
        return y[1] - Om

    released = math.asin(mu0 - c * Om)
    start = [released + 1e-10, Om - 1e-15]
    _, end = met(slow, start, back, 1, (0, 20), atol=1e-14, first_step=1e-3)
    assert end[0] == pytest.approx(math.pi, abs=1e-5)


GENES = """
name: genes
states: [x, y]
parameters: {k: 2.0, th: 1.0}
autonomous: true
surfaces:
  X: {observable: x, level: th}
  Y: {observable: y, level: th}
modes:
  both: {in: {X: +, Y: +}, field: {x: -x, y: k - y}}
  xo: {in: {X: +, Y: -}, field: {x: k - x, y: k - y}}
  oy: {in: {X: -, Y: +}, field: {x: -x, y: -y}}
  none: {in: {X: -, Y: -}, field: {x: k - x, y: -y}}
spread: {x: 2, y: 2}
"""


def test_a_motion_that_winds_into_a_point_is_no_orbit(tmp_path) -> None:
    """Two genes, one that represses the other and is switched on by it, come to their thresholds.

    From x = th + d a round makes d/(1 + 4 d) of d: turns shrink like 1/n, and small ones repeat themselves.
    """
    with pytest.raises(cf.ConvergenceError, match=r"comes to rest near x = 1.*, y = 1"):
        cf.find_orbit(typed(tmp_path, GENES))


CLOCK = """
name: clock
states: [x, v]
parameters: {f: 0.1, h: 1.0}
autonomous: true
surfaces:
  middle: {observable: x}
  stop: {observable: v, sliding: filippov}
field: {x: v, v: -x - f*sign(v)}
modes:
  forth: {in: {stop: +}}
  back: {in: {stop: -}}
resets: {middle: {v: sqrt(v**2 + h**2), from: [forth]}}
"""


def test_a_clock_is_struck_on_its_way_up(tmp_path) -> None:
    """Andronov's clock: dry friction, and an impulse of energy h^2/2 where its balance passes the middle.

    With amplitude A to the right the next one is (A' + f)^2 = (A - 3 f)^2 + h^2, so that A = f + h^2/(8 f),
    with the multiplier (A - 3 f)/(A + f); it passes the middle while A >= 4 f, f <= h/sqrt(24).
    """
    model = typed(tmp_path, CLOCK)
    assert cf.check_model(model).ok
    orbit = cf.find_orbit(model)
    f = 0.1
    amplitude = f + 1 / (8 * f)
    assert orbit.x_max == pytest.approx(amplitude, abs=1e-12)
    assert orbit.multipliers[0].real == pytest.approx(
        (amplitude - 3 * f) / (amplitude + f), abs=1e-11
    )
    branch = cf.continue_orbit(orbit, "f", (0.02, 0.3))
    assert branch.params["f"].max() == pytest.approx(1 / math.sqrt(24), abs=1e-9)
    assert branch.ends[1].bifurcation.kind is cf.Kind.GS
    with pytest.raises(cf.ModelError, match="acts in no mode"):
        typed(tmp_path, CLOCK.replace(", from: [forth]", ""))


#: Exponential integrate-and-fire without a leak: V' = exp(V) blows up, and is cut far up at V = top.
BLOWS_UP = """
name: blow-up
states: [V, w]
parameters: {low: -8.0, top: 30.0, b: 2.0, tau: 4000.0}
autonomous: true
surfaces:
  spike: {observable: V, level: top}
modes:
  free: {in: {spike: -}, field: {V: exp(V), w: -w/tau}}
resets:
  spike: {V: low, w: w + b}
spread: {V: low}
"""


@pytest.mark.parametrize("top", [5.0, 20.0, 30.0])
def test_a_motion_may_be_faster_than_the_time_can_say(tmp_path, top: float) -> None:
    """At the top V moves by exp(top): over less than the rounding of a time of thousands.

    The period is exp(-low) - exp(-top), and w decays over it by what it gains.
    """
    model = typed(tmp_path, BLOWS_UP)
    T = math.exp(8.0) - math.exp(-top)
    run = cf.simulate(model, {"top": top}, state=[-8.0, 0.0], time=1e6, periods=9.5 * T)
    assert run.end.name == "TIME" and len(run) == 9
    assert run.times == pytest.approx(1e6 + T * np.arange(1, 10), rel=1e-12)
    if (
        top > 20.0
    ):  # an orbit has its durations as numbers, and V at the top depends on them by exp(top)
        return
    orbit = cf.find_orbit(model, {"top": top}, state=[-8.0, 0.0])
    decay = math.exp(-T / 4000.0)
    assert orbit.ends[0] == pytest.approx([0.0, top, 2.0 * decay / (1.0 - decay)], rel=1e-11)
    assert orbit.period == pytest.approx(T, rel=1e-12)
    assert max(abs(orbit.multipliers)) == pytest.approx(decay, rel=1e-9)


ADEX = """
name: adex
states: [V, w]
parameters: {C: 281.0, gL: 30.0, EL: -70.6, VT: -50.4, DT: 2.0, a: 4.0, b: 80.5, tau: 144.0, I: 800.0,
  Vr: -70.6, Vspike: 0.0}
autonomous: true
surfaces:
  spike: {observable: V, level: Vspike}
modes:
  free:
    in: {spike: -}
    field: {V: (-gL*(V - EL) + gL*DT*exp((V - VT)/DT) - w + I)/C, w: (a*(V - EL) - w)/tau}
resets:
  spike: {V: Vr, w: w + b}
spread: {V: EL}
"""


def adex_flight(current: float, w: float):
    """Return (time, w) of a spike from (Vr, w): scipy, in the time that runs as fast as V does."""

    def field(_, y):
        V, w, _ = y
        rate = (-30.0 * (V + 70.6) + 60.0 * math.exp((V + 50.4) / 2.0) - w + current) / 281.0
        slow = 1.0 / math.hypot(1.0, rate)
        return [slow * rate, slow * (4.0 * (V + 70.6) - w) / 144.0, slow]

    def spike(_, y):
        return y[0]

    _, (_, last, t) = met(field, [-70.6, w, 0.0], spike, span=(0.0, 1e4), atol=1e-11)
    return t, last


@pytest.mark.parametrize("current", [700.0, 1000.0, 2500.0])
def test_adaptive_exponential_neuron(tmp_path, current: float) -> None:
    """Brette and Gerstner, J. Neurophysiol. 94 (2005) 3637: spikes at 0 mV, where V' is 2e10 mV/ms."""
    model = typed(tmp_path, ADEX)
    run = cf.simulate(model, {"I": current}, state=[-70.6, 0.0], periods=20_000)
    w = brentq(lambda w: adex_flight(current, w)[1] + 80.5 - w, 100.0, 3000.0, xtol=1e-9)
    T, at_spike = adex_flight(current, w)
    assert run.end.name == "TIME"
    assert np.diff(run.times)[-5:] == pytest.approx(T, rel=1e-8)
    orbit = cf.find_orbit(model, {"I": current}, state=[-70.6, 0.0])
    assert str(orbit.signature) == "free -> reset@spike" and orbit.stable
    assert orbit.ends[0] == pytest.approx([0.0, 0.0, at_spike], rel=1e-8)
    assert orbit.period == pytest.approx(T, rel=1e-8)


def test_what_escapes_behind_an_impact_has_not_chattered(tmp_path) -> None:
    """Thrown off by a wall, x'' = x^3 - 1 is infinite in finite time."""
    model = typed(
        tmp_path,
        """
name: thrown
states: [x, v]
parameters: {e: 6.0}
autonomous: true
surfaces:
  wall: {observable: x}
modes:
  flight: {in: {wall: +}, field: {x: v, v: x**3 - 1}}
resets:
  wall: {v: -e*v}
""",
    )
    run = cf.simulate(model, {}, state=[0.1, 0.0], periods=100)
    assert run.end.name == "INFINITE" and len(run) == 1
    assert "unbounded" in repr(cf.lyapunov_exponent(model, {}, state=[0.1, 0.0]))
