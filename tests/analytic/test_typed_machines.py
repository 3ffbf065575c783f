"""Machines, cells and circuits as their textbooks have them, against published numbers and scipy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from by_scipy import after, met
from scipy.linalg import expm
from scipy.optimize import fsolve
from typed import typed

import contfric as cf

#: The simplest walker: a heel strikes at phi = 2 theta, but not where the legs pass each other.
WALKER = """
name: walker
states: [theta, phi, thetad, phid]
parameters: {gamma: 0.009}
autonomous: true
define:
  falls: sin(theta - gamma)
  swings: falls + thetad**2*sin(phi) - cos(theta - gamma)*sin(phi)
surfaces: {heel: {observable: phi - 2*theta}, pass: {observable: phi}}
field: {theta: thetad, phi: phid, thetad: falls, phid: swings}
modes:
  early: {in: {pass: +}}
  late: {in: {pass: -, heel: -}}
resets:
  heel:
    theta: -theta
    phi: -2*theta
    thetad: cos(2*theta)*thetad
    phid: cos(2*theta)*(1 - cos(2*theta))*thetad
spread: {theta: 0.4, phi: 0.6, thetad: 0.4, phid: 0.4}
"""


def test_the_simplest_walker(tmp_path) -> None:
    """Garcia, Chatterjee, Ruina, Coleman (1998): both gaits at 0.009, and where the long one doubles."""
    model = typed(tmp_path, WALKER)
    start = [0.2, 0.4, -0.2, -0.0158]
    orbit = cf.find_orbit(model, state=start)
    (strike,) = [
        e for (_, exit_), e in zip(orbit.itinerary, orbit.ends, strict=True) if exit_ == "heel"
    ]
    assert -strike[1] == pytest.approx(0.200310900544287, abs=1e-11)
    assert math.cos(2 * strike[1]) * strike[3] == pytest.approx(-0.199832473004977, abs=1e-11)
    assert orbit.multipliers[:2] == pytest.approx(
        [-0.1900998 + 0.5575988j, -0.1900998 - 0.5575988j], abs=1e-6
    )
    doubling = [
        b for b in cf.explore(orbit, "gamma", (0.008, 0.0165)).bifurcations if b.kind is cf.Kind.PD
    ]
    assert doubling[0].params["gamma"] == pytest.approx(0.0151, abs=5e-5)


@pytest.mark.parametrize("lead", ["", "to: stance"])
def test_motion_that_a_reset_does_not_map_passes(tmp_path, lead: str) -> None:
    """The legs pass each other where phi = 2 theta, too: in 'stance' the heel goes on below the ground.

    Its gait is that of the walker with a surface of its own for the passing.
    """
    text = WALKER.replace(", pass: {observable: phi}", "")
    text = text.replace("early: {in: {pass: +}}", "stance: {in: {heel: +}}")
    text = text.replace("{pass: -, heel: -}", "{heel: -}")
    text = text.replace("theta: -theta\n", f"theta: -theta\n    from: late\n    {lead}\n")
    if not lead:
        with pytest.raises(cf.ModelError, match="or the mode to which it leads"):
            typed(tmp_path, text)
        return
    model = typed(tmp_path, text)
    assert model.targets == {("stance", "heel"): ("late",), ("late", "heel"): ("stance",)}
    assert cf.check_model(model).ok
    orbit = cf.find_orbit(model, state=[0.2, 0.4, -0.2, -0.0158])
    assert str(orbit.signature) == "late -> impact@heel -> stance"
    strike = orbit.ends[[exit_ for _, exit_ in orbit.itinerary].index("heel")]
    assert abs(strike[1]) == pytest.approx(0.200310900544287, abs=1e-11)
    assert orbit.multipliers[0] == pytest.approx(-0.1900998 + 0.5575988j, abs=1e-6)


def test_what_a_reset_does_not_map_ends_where_nothing_is_behind(tmp_path) -> None:
    """Below 'low' the heater is off, whatever turned it off: what a reset does not map has nowhere to go."""
    text = """
name: fuse
states: [x, y]
parameters: {b: 0.5}
autonomous: true
surfaces: {top: {observable: x, level: 1}, bottom: {observable: x, level: -1}}
modes:
  up: {in: {top: -}, field: {x: 1 + 0*y, y: -y}}
  down: {in: {top: -, bottom: +}, field: {x: b - 2 + 0*y, y: -y}}
  late: {in: {top: -, bottom: +}, field: {x: 2 + 0*y, y: -y}}
resets:
  top: {y: y + 1, from: up, to: down}
  bottom: {to: late}
"""
    model = typed(tmp_path, text)
    assert "a solution in 'late' meets 'top'" in str(cf.check_model(model))
    ends = cf.simulate(model, state=[0, 0], domain="late", periods=9)
    assert ends.end.name == "IMPOSSIBLE" and not ends.itinerary


#: A phase detector with three states, named by two resets that divide them all.
CHARGE_PUMP = """
name: pump
states: [phi, z]
parameters: {Ip: 1.0, R: 1.0, C: 1.0, K: 0.5, w0: 0.9, Ts: 1.0, leak: 0.3}
period: Ts
surfaces: {vco: {observable: phi, level: 1}}
modes:
  idle: {field: {phi: w0 + K*z, z: -leak*z}}
  up: {field: {phi: w0 + K*(z + R*Ip), z: Ip/C - leak*z}}
  down: {field: {phi: w0 + K*(z - R*Ip), z: -Ip/C - leak*z}}
resets:
  tick: {to: {idle: {from: down}, up: {from: idle}}}
  vco: {phi: phi - 1, from: [idle, up, down], to: {idle: {from: up}, down: {from: idle}}}
"""


#: Gardner's loop: it is locked where the charge that leaks away comes back while the pump is on.
@pytest.mark.parametrize("w0", [0.9, 1.1])
def test_a_charge_pump_whose_states_are_said_once(tmp_path, w0: float) -> None:
    """A mean of z' and of phi' over a period: (1 - w0) Ts = K (1/(leak C) + R) Ip on."""
    orbit = cf.find_orbit(typed(tmp_path, CHARGE_PUMP), {"w0": w0}, state=[0.5, 0.2])
    on = (1.0 - w0) / (0.5 * (1.0 / 0.3 + 1.0))
    time = {
        exit_: float(end[-1]) for (_, exit_), end in zip(orbit.itinerary, orbit.ends, strict=True)
    }
    assert orbit.period == pytest.approx(1.0, abs=1e-13)
    assert time["vco"] % 1.0 == pytest.approx(on % 1.0, abs=1e-12)
    assert any(mode.startswith("up" if w0 < 1.0 else "down") for mode, _ in orbit.itinerary)


#: A reactor between two thyristors, fired twice a period; each goes out where its current does.
REACTOR = """
name: reactor
states: [v, il, ir]
parameters: {fire: 1.9, Ls: 0.1, Rs: 0.2, C: 0.4, Lr: 0.5}
period: 2*pi
surfaces:
  on1: {observable: "mod(t, T)", level: fire}
  on2: {observable: "mod(t, T)", level: fire + T/2}
  zero: {observable: ir}
modes:
  blocked: {in: {zero: 0}, field: {v: il/C, il: (sin(t) - v - Rs*il)/Ls, ir: 0}}
  forward: {in: {zero: +}, field: {v: (il - ir)/C, il: (sin(t) - v - Rs*il)/Ls, ir: v/Lr}}
  backward: {in: {zero: -}, field: {v: (il - ir)/C, il: (sin(t) - v - Rs*il)/Ls, ir: v/Lr}}
resets:
  on1: {to: forward, from: [blocked]}
  on2: {to: backward, from: [blocked]}
"""


@pytest.mark.parametrize("fire", [1.9, 2.3])
def test_thyristors_that_two_resets_fire(tmp_path, fire: float) -> None:
    """Half a period by scipy: what conducts from the firing to the end of its current is its mirror image."""
    orbit = cf.find_orbit(typed(tmp_path, REACTOR), {"fire": fire})
    (start,) = [
        e for (_, exit_), e in zip(orbit.itinerary, orbit.ends, strict=True) if exit_ == "on1"
    ]

    def conducts(t, y):
        return (y[1] - y[2]) / 0.4, (math.sin(t) - y[0] - 0.2 * y[1]) / 0.1, y[0] / 0.5

    def blocks(t, y):
        return y[1] / 0.4, (math.sin(t) - y[0] - 0.2 * y[1]) / 0.1, 0.0

    def out(t, y):
        return y[2]

    t, on = met(conducts, [*start[1:3], 0.0], out, -1, (fire, fire + math.pi))
    off = after(blocks, [*on[:2], 0.0], (t, fire + math.pi))
    assert off[:2] == pytest.approx(-start[1:3], abs=1e-9)


#: Two relays in turn, with a lag: no rate of x or v jumps, and nothing slides where the two surfaces cross.
TWISTING = """
name: twisting
states: [x, v, u]
parameters: {r1: 2.0, r2: 1.0, tau: 0.1}
autonomous: true
surfaces: {sx: {observable: x, sliding: filippov}, sv: {observable: v, sliding: filippov}}
field: {x: v, v: u, u: (-r1*sign(x) - r2*sign(v) - u)/tau}
modes:
  q1: {in: {sx: +, sv: +}}
  q2: {in: {sx: -, sv: +}}
  q3: {in: {sx: -, sv: -}}
  q4: {in: {sx: +, sv: -}}
symmetry: x -> -x, v -> -v, u -> -u
spread: {x: 0.5, v: 0.5, u: 3}
"""


@pytest.mark.parametrize("tau", [0.05, 0.1])
def test_surfaces_that_cross_where_no_rate_jumps(tmp_path, tau: float) -> None:
    """Levant's twisting controller behind an actuator: amplitudes of order tau^2, by matrix exponentials."""
    orbit = cf.find_orbit(typed(tmp_path, TWISTING), {"tau": tau})
    assert {mode for mode, _ in orbit.itinerary} == {"q1", "q2", "q3", "q4"}
    matrix = np.array([[0, 1, 0], [0, 0, 1], [0, 0, -1 / tau]])

    def after(time: float, state, force: float) -> np.ndarray:
        whole = np.zeros((4, 4))
        whole[:3, :3], whole[2, 3] = matrix, force / tau
        return (expm(whole * time) @ [*state, 1.0])[:3]

    def half(unknown):
        v, u, first, second = unknown
        peak = after(first, [0.0, v, u], -3.0)
        end = after(second, peak, -1.0)
        return peak[1], end[0], end[1] + v, end[2] + u

    places = {mode: end[1:] for (mode, _), end in zip(orbit.itinerary, orbit.ends, strict=True)}
    times = np.diff([end[0] for end in orbit.ends])
    _, v, u = places["q2"]
    guess = [v, u, float(orbit.ends[0][0] + orbit.period - orbit.ends[-1][0]), float(times[0])]
    solved = fsolve(half, guess, xtol=1e-13)
    assert solved[0] == pytest.approx(v, abs=1e-10)
    assert solved[1] == pytest.approx(u, abs=1e-10)
    assert 2.0 * (solved[2] + solved[3]) == pytest.approx(orbit.period, abs=1e-10)
    assert 0.01 < places["q1"][0] / tau**2 < 100.0


def test_a_state_is_given_without_its_clocks(tmp_path) -> None:
    """Just after a tick the first clock shows 0, and another one how far it is ahead."""
    model = typed(tmp_path, CHARGE_PUMP)
    short, whole = (cf.simulate(model, state=s, periods=3) for s in ([0.5, 0.2], [0.5, 0.2, 0.0]))
    assert short.itinerary == whole.itinerary
    assert np.array_equal(short.states, whole.states)
    two = CHARGE_PUMP.replace("phi: w0 + K*z,", "phi: w0 + K*z + 0*((t + 0.3) % Ts),")
    assert (
        cf.simulate(typed(tmp_path, two), state=[0.5, 0.2], periods=0.1).sample([0.0])[0, -1] == 0.3
    )
    with pytest.raises(cf.ParameterError, match="3 finite numbers"):
        cf.simulate(model, state=[0.5], periods=1)


#: Three climates, each left at a threshold of insolation or of ice.
ICE = """
name: ice
states: [v]
parameters: {F: 0.3, i0: 0.0, i1: 0.2, vmax: 0.8, ti: 0.2, tg: 1.2, tG: 0.6}
period: 1
observables: {insolation: F*cos(2*pi*t)}
surfaces:
  start: {observable: insolation, level: i0}
  deep: {observable: v, level: vmax}
  end: {observable: insolation, level: i1}
modes:
  i: {in: {start: +}, field: {v: -v/ti}}
  g: {in: {deep: -}, field: {v: (1 - v)/tg - F*cos(2*pi*t)}}
  G: {in: {end: -}, field: {v: (1 - v)/tG - F*cos(2*pi*t)}}
resets:
  start: {to: g, from: [i]}
  deep: {to: G, from: [g]}
  end: {to: i, from: [G]}
"""


def test_a_touch_that_only_changes_the_mode_jumps(tmp_path) -> None:
    """Paillard's ice ages: glaciation does not end where insolation just comes to its threshold, F = i1."""
    orbit = cf.find_orbit(typed(tmp_path, ICE))
    assert orbit.period == pytest.approx(2.0, rel=1e-12)
    diagram = cf.explore(orbit, "F", (0.15, 0.35))
    (event,) = diagram.bifurcations
    assert event.kind is cf.Kind.GS
    assert event.params["F"] == pytest.approx(0.2, abs=1e-10)
    assert "the map jumps" in event.meaning
    assert diagram.verify().passed


#: A capacitor that is charged in part of each period, and drained in the rest.
LATCHED = """
name: latched
states: [u]
parameters: {Ts: 0.3, peak: 0.7, g: 0.4}
period: Ts
surfaces: {trip: {observable: u, level: peak}}
modes: {on: {in: {trip: -}, field: {u: 1/Ts}}, off: {field: {u: -g*u/Ts}}}
resets: {tick: {to: on}}
spread: {u: 1}
"""


@pytest.mark.parametrize("Ts", [0.01, 7.0])
def test_periods_are_those_of_the_clock(tmp_path, Ts: float) -> None:
    """Eight periods have eight ticks, whatever the unit of time is; they were units of time."""
    model = typed(tmp_path, LATCHED)
    found = cf.simulate(model, {"Ts": Ts}, state=[0.1], periods=8.01)
    assert [k for _, k in found.itinerary].count("tick") == 8
    assert found.last[1] == pytest.approx(8.01 * Ts, rel=1e-12)
    how = {"section": "tick", "periods": 8, "transient": 0}
    assert len(cf.poincare(model, {"Ts": Ts}, [0.1], **how).times) == 8
    swept = cf.sweep(model, "Ts", [Ts, 2 * Ts], both=False, **how).up  # the longest of both periods
    assert max(np.bincount(swept.index)) <= 16
    exponent = cf.lyapunov_exponent(model, {"Ts": Ts}, state=[0.1], transient=20)
    orbit = cf.find_orbit(model, {"Ts": Ts}, state=[0.1])
    assert exponent.periods == round(orbit.period / Ts)
    axes = {"Ts": [0.5 * Ts, Ts], "g": [0.3, 0.4]}
    found = cf.lyapunov_map(model, axes, {"peak": 0.7}, state=[0.1], transient=20)
    assert found.periods[1, 1, 0] == exponent.periods
    assert exponent.followed < 40  # units of time were periods: of 0.01 a hundred ticks
    assert exponent.largest == pytest.approx(
        np.log(max(map(abs, orbit.multipliers))) / orbit.period, rel=1e-9
    )


#: One phase of a switched reluctance motor: current in a band between two angles, then driven down to zero.
RELUCTANCE = """
name: reluctance
states: [th, i]
parameters: {w: 50.0, V: 100.0, R: 1.0, L0: 0.05, L1: 0.03, on: -0.6, off: 0.3, I: 5.0, band: 0.5}
autonomous: true
angles: [th]
define: {L: L0 + L1*cos(th), dL: -L1*sin(th)}
surfaces:
  turn_on: {observable: th, level: on}
  turn_off: {observable: th, level: off}
  over: {observable: i, level: I}
  under: {observable: i, level: I - band}
  none: {observable: i}
modes:
  mag: {in: {over: -}, field: {th: w, i: (V - R*i - w*dL*i)/L}}
  free: {in: {under: +}, field: {th: w, i: (-R*i - w*dL*i)/L}}
  demag: {in: {none: +}, field: {th: w, i: (-V - R*i - w*dL*i)/L}}
  idle: {in: {none: 0}, field: {th: w, i: 0}}
resets:
  turn_on: {to: mag, from: [idle, demag]}
  turn_off: {to: demag, from: [mag, free]}
  over: {to: free, from: [mag]}
  under: {to: mag, from: [free]}
  none: {to: idle, from: [demag]}
spread: {th: 3, i: 5}
"""


@pytest.mark.parametrize("V", [80.0, 120.0])
def test_a_motor_whose_modes_overlap_and_turn(tmp_path, V: float) -> None:
    """Its modes are divided by two angles, go on where a turn begins, and 'idle' slides where a reset leads.

    All three were refused. The flux L i obeys a linear equation between events, which scipy finds.
    """
    model = typed(tmp_path, RELUCTANCE)
    assert [mode.name[:-1] for mode in model.modes[::2]] == ["mag", "free", "demag", "idle"]
    orbit = cf.find_orbit(model, {"V": V}, state=[0.0, 1.0])
    assert orbit.period == pytest.approx(2 * np.pi / 50.0, rel=1e-12)

    def current(volts, t, i, angle, level):
        """Return (time, current) where it takes a level, or the angle is past; the angle is w t."""

        def rate(t, y):
            L, dL = 0.05 + 0.03 * np.cos(50 * t), -0.03 * np.sin(50 * t)
            return [(volts - y[0] - 50 * dL * y[0]) / L]

        def hit(_, y):
            return y[0] - level

        t, (i,) = met(rate, [i + (1e-9 if level == i else 0.0)], hit, span=(t, angle / 50))
        return t, i

    t, i, volts, events = -0.6 / 50, 0.0, V, []
    while t < 0.3 / 50:  # in the band
        t, i = current(volts, t, i, 0.3, 5.0 if volts else 4.5)
        events.append(t)
        volts = 0.0 if volts else V
    events.append(current(-V, t, i, np.pi, 0.0)[0])
    ours = [
        float(end[1] / 50)
        for end, (_, exit_) in zip(orbit.ends, orbit.itinerary, strict=True)
        if exit_ not in ("turn_on", "th+")
    ]
    assert sorted(ours) == pytest.approx(events, abs=1e-10)
