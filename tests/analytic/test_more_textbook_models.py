"""Hybrid systems as their textbooks write them, against automata that scipy integrates event by event.

Each is typed anew on both sides. The classes that they stand for: modes that overlap in a forced model, a
surface at a place of an angle, two belts (parallel surfaces that slide), resets that only change the mode.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import contfric as cf

Field = Callable[[float, np.ndarray], Sequence[float]]
#: (height, sense in which it is crossed, next mode or what chooses it, map of the state)
Switch = tuple[Callable[[float, np.ndarray], float], int, Any, Callable[[float, np.ndarray], Any]]
_TIGHT = {"rtol": 1e-11, "atol": 1e-12, "method": "DOP853"}


def same(t: float, y: np.ndarray) -> np.ndarray:
    """Return the state: only the mode changes."""
    return y


def automaton(
    modes: Mapping[str, tuple[Field, Sequence[Switch]]],
    mode: str,
    y: Sequence[float],
    count: int,
    longest: float = 200.0,
) -> list[tuple[float, str, np.ndarray]]:
    """Return (time, mode that is entered, state) of some switches."""
    t, state, found = 0.0, np.array(y, dtype=float), []
    while len(found) < count:
        field, switches = modes[mode]
        events = []
        for height, sense, _, _ in switches:

            def event(t: float, y: np.ndarray, height: Any = height) -> float:
                return float(height(t, y))

            event.terminal, event.direction = True, sense  # type: ignore[attr-defined]
            events.append(event)
        run = solve_ivp(
            field, (t, t + longest), state, events=events, max_step=0.05 * longest, **_TIGHT
        )
        k = next(k for k, times in enumerate(run.t_events) if len(times))
        _, _, target, mapped = switches[k]
        t = float(run.t_events[k][0])
        mode = target if isinstance(target, str) else target(t, run.y_events[k][0])
        state = np.array(mapped(t, run.y_events[k][0]), dtype=float)
        found.append((t, mode, state))
        # off the surface, in the time in which scipy would find it again
        step = 1e-10
        state = state + step * np.array(modes[mode][0](t, state))
        t += step
    return found


def lag(found: Sequence[tuple[float, str, np.ndarray]], most: int = 12) -> tuple[int, float]:
    """Return the number of switches and the time after which the end of a run repeats itself."""
    t, mode, y = found[-1]
    for k in range(1, most):
        before = found[-1 - k]
        if before[1] == mode and np.max(np.abs(before[2] - y)) < 1e-7 * (1 + np.max(np.abs(y))):
            return k, t - before[0]
    raise AssertionError("not periodic")


def model_of(tmp_path: Any, text: str) -> cf.Model:
    (tmp_path / "model.yaml").write_text(text, encoding="utf-8")
    return cf.load_model(tmp_path / "model.yaml")


GEARS = """
name: gears
states: [v]
parameters: {F1: 3.0, F2: 1.5, c: 0.05, hill: 1.6, W: 0.5, up: 12.0, down: 8.0}
period: 2*pi/W
surfaces: {su: {observable: v, level: up}, sd: {observable: v, level: down}}
modes:
  first: {in: {su: -}, field: {v: F1 - c*v - hill*sin(W*t)}}
  second: {in: {sd: +}, field: {v: F2 - c*v - hill*sin(W*t)}}
"""


def test_a_forced_motion_stays_in_one_of_modes_that_overlap(tmp_path) -> None:
    """In second gear for good: v = F2/c - Re(...) in closed form; it ends where the valley of v is `down`."""
    model = model_of(tmp_path, GEARS)
    assert cf.check_model(model).ok
    p = model.defaults
    swing = p["hill"] / np.hypot(p["c"], p["W"])
    orbit = cf.find_orbit(model)
    assert orbit.x_min == pytest.approx(p["F2"] / p["c"] - swing, abs=1e-11)
    assert orbit.multipliers[0] == pytest.approx(np.exp(-p["c"] * orbit.period), abs=1e-12)
    diagram = cf.explore(orbit, "F2", (0.3, 1.6))
    [graze] = [b for b in diagram.bifurcations if b.kind is cf.Kind.GS]
    assert graze.params["F2"] == pytest.approx(p["c"] * (p["down"] + swing), abs=1e-11)
    assert "stays in 'first'" in graze.meaning and "jumps" in graze.meaning
    [loose] = diagram.loose_ends
    assert "jumps" in str(loose)
    assert diagram.verify().passed


@pytest.mark.parametrize("F2", [0.2, 0.4, 0.5])
def test_gears_are_shifted(tmp_path, F2: float) -> None:
    model = model_of(tmp_path, GEARS)
    p = {**model.defaults, "F2": F2}

    def drive(force: float) -> Field:
        return lambda t, y: [force - p["c"] * y[0] - p["hill"] * np.sin(p["W"] * t)]

    modes: dict[str, Any] = {
        "first": (drive(p["F1"]), [(lambda t, y: y[0] - p["up"], 1, "second", same)]),
        "second": (drive(F2), [(lambda t, y: y[0] - p["down"], -1, "first", same)]),
    }
    found = automaton(modes, "first", [1.0], 60)
    switches, time = lag(found)
    orbit = cf.find_orbit(model, {"F2": F2})
    assert orbit.period * 1.0 == pytest.approx(time, abs=1e-6)
    phases = sorted(t % (2 * np.pi / p["W"]) for t, _, _ in found[-switches:])
    joints = [
        b[0] % (2 * np.pi / p["W"])
        for (mode, _), b, e in zip(
            orbit.itinerary, np.roll(orbit.begins, -1, axis=0), orbit.ends, strict=True
        )
        if min(abs(e[1] - p["up"]), abs(e[1] - p["down"])) < 1e-9
        and orbit.model.whole_mode(mode) == ("first" if abs(e[1] - p["up"]) < 1e-9 else "second")
    ]
    assert sorted(joints) == pytest.approx(phases, abs=1e-6)


THETA = """
name: theta
states: [th, a]
parameters: {I: 0.3, tau: 5.0, d: 0.2}
autonomous: true
angles: [th]
surfaces: {spike: {observable: th, level: pi}}
modes: {n: {field: {th: "1 - cos(th) + (1 + cos(th))*(I - a)", a: -a/tau}}}
resets: {spike: {a: a + d}}
"""


@pytest.mark.parametrize("current", [0.1, 0.3, 0.6])
def test_a_reset_at_a_place_of_an_angle(tmp_path, current: float) -> None:
    """A theta neuron that adapts: its reset at pi was never met, for the angle began again before."""
    model = model_of(tmp_path, THETA)

    def turn(t: float, y: np.ndarray) -> Sequence[float]:
        return [1 - np.cos(y[0]) + (1 + np.cos(y[0])) * (current - y[1]), -y[1] / 5.0]

    def spike(t: float, y: np.ndarray) -> np.ndarray:
        return np.array([y[0] - 2 * np.pi, y[1] + 0.2])

    modes: dict[str, Any] = {"n": (turn, [(lambda t, y: y[0] - np.pi, 1, "n", spike)])}
    found = automaton(modes, "n", [0.0, 0.0], 60)
    _, time = lag(found)
    orbit = cf.find_orbit(model, {"I": current})
    assert orbit.period == pytest.approx(time, abs=1e-6)
    assert max(orbit.begins[:, 2]) == pytest.approx(found[-1][2][1], abs=1e-6)


def test_a_place_that_an_angle_never_comes_to_is_refused(tmp_path) -> None:
    with pytest.raises(cf.ModelError, match="comes to no place on 'spike'"):
        model_of(tmp_path, THETA.replace("level: pi", "level: 20"))


BELTS = """
name: two-belts
states: [x, v]
parameters: {v1: 0.2, v2: 0.6, F1: 1.0, F2: 0.6, c: 1.5}
autonomous: true
surfaces:
  belt1: {observable: v, level: v1, sliding: filippov}
  belt2: {observable: v, level: v2, sliding: filippov}
field: {x: v, v: "-x - F1*sign(v - v1)/(1 + c*abs(v - v1)) - F2*sign(v - v2)/(1 + c*abs(v - v2))"}
modes:
  slow: {in: {belt1: -, belt2: -}}
  mid: {in: {belt1: +, belt2: -}}
  fast: {in: {belt1: +, belt2: +}}
"""


@pytest.mark.parametrize("v2", [0.3, 0.6, 1.2])
def test_a_block_between_two_belts(tmp_path, v2: float) -> None:
    """It sticks to the slow belt until x = F2/(1 + c (v2 - v1)) + F1, and slips back."""
    model = model_of(tmp_path, BELTS)
    p = {**model.defaults, "v2": v2}
    pull = p["F2"] / (1 + p["c"] * (v2 - p["v1"]))

    def slip(t: float, y: np.ndarray) -> Sequence[float]:
        one, two = (F / (1 + p["c"] * (b - y[1])) for F, b in ((p["F1"], p["v1"]), (p["F2"], v2)))
        return [y[1], -y[0] + one + two]

    modes: dict[str, Any] = {
        "stick": (
            lambda t, y: [p["v1"], 0.0],
            [(lambda t, y: y[0] - p["F1"] - pull, 1, "slip", same)],
        ),
        "slip": (slip, [(lambda t, y: y[1] - p["v1"], 1, "stick", same)]),
    }
    _, time = lag(automaton(modes, "stick", [0.0, p["v1"]], 12))
    orbit = cf.find_orbit(model, {"v2": v2})
    assert orbit.period == pytest.approx(time, abs=1e-6)
    assert abs(orbit.multipliers[0]) < 1e-12


def test_a_derived_limit_has_no_pole_off_its_surface(tmp_path) -> None:
    """Friction of the other side, read backwards, has one: a diagram took minutes, or did not end."""
    model = model_of(tmp_path, BELTS)
    assert not [f for f in cf.check_model(model).findings if "pole" in f.message]
    diagram = cf.explore(cf.find_orbit(model), "v2", (0.3, 1.2))
    assert [len(diagram.branches), len(diagram.loose_ends)] == [1, 0]


SERVER = """
name: server
states: [x1, x2, x3]
parameters: {r1: 0.25, r2: 0.3, r3: 0.45}
autonomous: true
surfaces: {e1: {observable: x1}, e2: {observable: x2}, e3: {observable: x3}}
modes:
  s1: {in: {e1: +}, field: {x1: r1 - 1, x2: r2, x3: r3}}
  s2: {in: {e2: +}, field: {x1: r1, x2: r2 - 1, x3: r3}}
  s3: {in: {e3: +}, field: {x1: r1, x2: r2, x3: r3 - 1}}
resets: {e1: {to: s2, from: [s1]}, e2: {to: s3, from: [s2]}, e3: {to: s1, from: [s3]}}
"""


def test_a_reset_that_only_changes_the_mode(tmp_path) -> None:
    """One server, three buffers, in turn: what is in them stays, r1 + r2 + r3 = 1.

    A cycle that serves buffer k for a_k: (1 - r_k) a_k = r_k (the rest of the cycle), so a_k = r_k T. Sum
    of the contents in the beginning of a service of 1: x1 = (1 - r1) r1 T, x2 = r2 ((r1 + r3) T + ...) ...
    """
    model = model_of(tmp_path, SERVER)
    orbit = cf.find_orbit(model)
    lasts = {
        mode: e[0] - b[0]
        for (mode, _), b, e in zip(orbit.itinerary, orbit.cycle, orbit.ends, strict=True)
    }
    shares = [lasts[name] / orbit.period for name in ("s1", "s2", "s3")]
    assert shares == pytest.approx([0.25, 0.3, 0.45], abs=1e-12)
    assert np.any(np.abs(orbit.multipliers - 1.0) < 1e-12)  # the sum of all contents


TANKS = """
name: tanks
states: [h1, h2]
parameters: {q: 2.0, k1: 0.6, k2: 0.8, lo: 1.0, hi: 1.4}
autonomous: true
surfaces: {high: {observable: h2, level: hi}, low: {observable: h2, level: lo}}
define: {flow: k1*sign(h1 - h2)*sqrt(abs(h1 - h2))}
modes:
  pump: {in: {high: -}, field: {h1: q - flow, h2: flow - k2*sqrt(h2)}}
  wait: {in: {low: +}, field: {h1: -flow, h2: flow - k2*sqrt(h2)}}
"""


@pytest.mark.parametrize("low", [0.8, 1.0, 1.2])
def test_fields_without_a_value_at_some_states(tmp_path, low: float) -> None:
    """Two tanks and a pump: no level is negative, but states that were sampled were."""
    model = model_of(tmp_path, TANKS)

    def levels(q: float) -> Field:
        def field(t: float, y: np.ndarray) -> Sequence[float]:
            flow = 0.6 * np.sign(y[0] - y[1]) * np.sqrt(abs(y[0] - y[1]))
            return [q - flow, flow - 0.8 * np.sqrt(y[1])]

        return field

    modes: dict[str, Any] = {
        "pump": (levels(2.0), [(lambda t, y: y[1] - 1.4, 1, "wait", same)]),
        "wait": (levels(0.0), [(lambda t, y: y[1] - low, -1, "pump", same)]),
    }
    _, time = lag(automaton(modes, "pump", [1.0, 0.5], 40))
    assert cf.find_orbit(model, {"lo": low}).period == pytest.approx(time, abs=1e-6)


SAITO = """
name: saito
states: [x, y]
parameters: {d: 0.03, p: 1.0}
autonomous: true
surfaces: {hi: {observable: x, level: 1}, lo: {observable: x, level: -1}}
modes:
  plus: {in: {lo: +}, field: {x: y, y: 2*d*y - (x - p)}}
  minus: {in: {hi: -}, field: {x: y, y: 2*d*y - (x + p)}}
symmetry: x -> -x, y -> -y
"""


def test_a_start_is_no_equilibrium_and_slow_chaos_is_chaos(tmp_path) -> None:
    """The default start, x = 1, is the focus of a mode; and few switches happen in 100 units of time."""
    with pytest.raises(cf.AperiodicError, match="chaotic"):
        cf.find_orbit(model_of(tmp_path, SAITO))


def test_a_motion_inside_of_one_mode_is_no_equilibrium(tmp_path) -> None:
    """Prey below the threshold go round for ever."""
    text = """
name: pest
states: [x, y]
parameters: {ET: 2.0, p: 0.4}
autonomous: true
surfaces: {threshold: {observable: x, level: ET}}
modes: {free: {in: {threshold: -}, field: {x: x*(1 - y), y: y*(0.6*x - 0.4)}}}
resets: {threshold: {x: (1 - p)*x}}
"""
    orbit = cf.find_orbit(model_of(tmp_path, text), state=[0.5, 0.8])
    kept = [0.6 * x - 0.4 * math.log(x) + y - math.log(y) for _, x, y in orbit.joints]
    assert kept == pytest.approx(
        [0.3 - 0.4 * math.log(0.5) + 0.8 - math.log(0.8)] * len(kept), rel=1e-9
    )


def test_a_state_that_is_held_meets_no_surface_of_its_own(tmp_path) -> None:
    """A neuron that is refractory stands at V = 0: what would be beyond its threshold is no error."""
    text = """
name: refractory
states: [V, s]
parameters: {I: 1.3, A: 0.3, W: 3.0, ref: 0.4}
period: 2*pi/W
surfaces: {threshold: {observable: V, level: 1}, ready: {observable: s, level: ref}}
modes:
  integrate: {in: {threshold: -, ready: +}, field: {V: -V + I + A*cos(W*t), s: 1}}
  refractory: {in: {ready: -}, field: {V: 0, s: 1}}
resets: {threshold: {V: 0, s: 0}}
"""
    model = model_of(tmp_path, text)
    assert cf.check_model(model).ok
    modes: dict[str, Any] = {
        "integrate": (
            lambda t, y: [-y[0] + 1.3 + 0.3 * np.cos(3 * t), 1.0],
            [(lambda t, y: y[0] - 1, 1, "refractory", lambda t, y: [0.0, 0.0])],
        ),
        "refractory": (lambda t, y: [0.0, 1.0], [(lambda t, y: y[1] - 0.4, 1, "integrate", same)]),
    }
    found = automaton(modes, "integrate", [0.0, 0.5], 80)
    _, time = lag(found)
    orbit = cf.find_orbit(model)
    assert orbit.period == pytest.approx(time, abs=1e-6)


def test_a_parametric_excitation_asks_for_no_units(tmp_path) -> None:
    """A pendulum whose pivot shakes: at rest the excitation moves nothing, which is rounding of 0."""
    text = """
name: pivot
states: [th, w]
parameters: {a: 0.5, W: 2.0, mu: 0.1}
period: 2*pi/W
angles: [th]
surfaces: {stop: {observable: w, sliding: filippov}}
field: {th: w, w: -(1 + a*cos(W*t))*sin(th) - mu*sign(w)}
modes: {up: {in: {stop: +}}, down: {in: {stop: -}}}
"""
    report = cf.check_model(model_of(tmp_path, text))
    assert report.ok and "units" not in str(report)


def test_chaos_of_a_converter_beyond_a_corner_collision() -> None:
    """The unstable orbit of 4 periods meets the corner of the ramp; the attractor is chaotic after it, too.

    The exponents add up to the trace of the field, -1/(R C), whatever the solution does.
    """
    p = cf.load_model("buck").defaults
    with pytest.raises(cf.AperiodicError, match="chaotic"):
        cf.find_orbit("buck", {"E": 34.8})
    found = cf.lyapunov_exponent("buck", {"E": 34.8})
    assert found.exponents[0] > 0.1
    trace = -1e-4 / (p["R"] * p["C"])  # times are in 0.1 ms
    assert found.exponents[0] + found.exponents[1] == pytest.approx(trace, abs=1e-4)


HEATER = """
name: heater
states: [temp, s]
parameters: {q: 2.0, c: 0.3, low: 1.0, high: 1.4, wait: 0.2}
autonomous: true
surfaces:
  hot: {observable: temp, level: high}
  cold: {observable: temp, level: low}
  ready: {observable: s, level: wait}
modes:
  heats: {in: {ready: -}, field: {temp: q - c*temp, s: 1}}
  may_stop: {in: {ready: +, hot: -}, field: {temp: q - c*temp, s: 1}}
  cools: {in: {ready: -}, field: {temp: -c*temp, s: 1}}
  may_start: {in: {ready: +, cold: +}, field: {temp: -c*temp, s: 1}}
resets:
  ready: {to: {may_stop: {from: heats}, may_start: {from: cools}}}
  hot: {s: 0, to: cools, from: [may_stop]}
  cold: {s: 0, to: heats, from: [may_start]}
"""


def test_the_next_mode_depends_on_the_one_before(tmp_path) -> None:
    """A waiting time that is shorter than both ways changes nothing: a thermostat in closed form."""
    model = model_of(tmp_path, HEATER)
    assert cf.load_model(tmp_path / "model.yaml").definition == model.definition
    orbit = cf.find_orbit(model)
    end = 2.0 / 0.3
    wanted = (np.log((end - 1.0) / (end - 1.4)) + np.log(1.4)) / 0.3
    assert orbit.period == pytest.approx(wanted, abs=1e-11)
    assert [mode for mode, _ in orbit.itinerary].count("may_stop") == 1


@pytest.mark.parametrize("seed", range(4))
def test_a_reset_at_a_corner_is_one_event_from_either_side(tmp_path, seed: int) -> None:
    """Where the upper level is met just as the time to wait is over: the clock starts anew, or goes on.

    The solutions of the two branches differ by that clock, and the event has that of the first one.
    """
    draw = np.random.default_rng([19, seed])
    model = model_of(tmp_path, HEATER)
    params = {"q": draw.uniform(1.8, 2.2), "c": draw.uniform(0.25, 0.35)}
    diagram = cf.explore(cf.find_orbit(model, params), "wait", (0.05, 1.0))
    end = params["q"] / params["c"]
    corner = np.log((end - 1.0) / (end - 1.4)) / params["c"]
    assert [b.params["wait"] for b in diagram.bifurcations] == [pytest.approx(corner, abs=1e-9)]
    assert diagram.verify().faults == ()


@pytest.mark.parametrize("zone", [0.05, 0.1, 0.2])
def test_levels_of_one_expression_are_ordered(tmp_path, zone: float) -> None:
    """A servo with a dead zone and friction: no state is above the upper level and below the lower one."""
    text = """
name: dead-zone
states: [x, v]
parameters: {K: 4.0, z: 0.1, c: 0.4, f: 0.2, A: 0.5, W: 1.5}
period: 2*pi/W
define: {err: A*cos(W*t) - x}
surfaces:
  e+: {observable: err, level: z}
  e-: {observable: err, level: -z}
  stop: {observable: v, sliding: filippov}
modes:
  push+: {in: {e+: +, stop: +}, field: {x: v, v: K*(err - z) - c*v - f}}
  push-: {in: {e+: +, stop: -}, field: {x: v, v: K*(err - z) - c*v + f}}
  idle+: {in: {e+: -, e-: +, stop: +}, field: {x: v, v: -c*v - f}}
  idle-: {in: {e+: -, e-: +, stop: -}, field: {x: v, v: -c*v + f}}
  pull+: {in: {e-: -, stop: +}, field: {x: v, v: K*(err + z) - c*v - f}}
  pull-: {in: {e-: -, stop: -}, field: {x: v, v: K*(err + z) - c*v + f}}
"""
    model = model_of(tmp_path, text)
    assert not any(d.signs["e+"] > 0 > d.signs["e-"] for d in model.domains)
    orbit = cf.find_orbit(model, {"z": zone}, state=[0.4, 0.0])

    def drive(t: float, y: np.ndarray) -> float:
        error = 0.5 * np.cos(1.5 * t) - y[0]
        return float(4.0 * np.sign(error) * max(0.0, abs(error) - zone))

    def moving(side: int) -> Field:
        return lambda t, y: [y[1], drive(t, y) - 0.4 * y[1] - 0.2 * side]

    def stops(t: float, y: np.ndarray) -> str:
        """It stays at rest while the drive is below the friction."""
        force = drive(t, y)
        return "rest" if abs(force) < 0.2 else "up" if force > 0.0 else "down"

    modes: dict[str, Any] = {
        "up": (moving(1), [(lambda t, y: y[1], -1, stops, lambda t, y: [y[0], 0.0])]),
        "down": (moving(-1), [(lambda t, y: y[1], 1, stops, lambda t, y: [y[0], 0.0])]),
        "rest": (
            lambda t, y: [0.0, 0.0],
            [
                (lambda t, y: drive(t, y) - 0.2, 1, "up", same),
                (lambda t, y: drive(t, y) + 0.2, -1, "down", same),
            ],
        ),
    }
    found = automaton(modes, "rest", [0.0, 0.0], 60, longest=20.0)
    assert max(y[0] for _, _, y in found[-10:]) == pytest.approx(orbit.x_max, abs=1e-6)


@pytest.mark.parametrize("mu", [0.5, 1.0, 2.0])
def test_a_smooth_model_without_excitation_needs_no_surface(tmp_path, mu: float) -> None:
    """Van der Pol's oscillator, by its states, parameters and field alone."""
    text = """
name: vdp
states: [x, y]
parameters: {mu: 1.0}
autonomous: true
field: {x: y, y: mu*(1 - x**2)*y - x}
"""
    model = model_of(tmp_path, text)
    assert cf.check_model(model).ok

    def field(t: float, y: np.ndarray) -> Sequence[float]:
        return [y[1], mu * (1 - y[0] ** 2) * y[1] - y[0]]

    modes: dict[str, Any] = {"whole": (field, [(lambda t, y: y[1], 1, "whole", same)])}
    found = automaton(modes, "whole", [1.0, 0.5], 30, longest=40.0)
    orbit = cf.find_orbit(model, {"mu": mu})
    assert orbit.period == pytest.approx(found[-1][0] - found[-2][0], abs=1e-7)
    assert orbit.x_min == pytest.approx(found[-1][2][0], abs=1e-7)
