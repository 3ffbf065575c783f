"""Models of control and circuits as textbooks write them: sampled switches, SI units, detectors of phase.

The references are matrix exponentials, closed forms, or scipy's integrator: no code of the engine.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from by_scipy import met
from scipy.linalg import expm
from typed import typed

import contfric as cf

THERMOSTAT = """
name: sampled
states: [temp]
parameters: {c: 1.0, q: 2.0, set: 1.0, Ts: 0.1}
period: Ts
surfaces: {warm: {observable: temp, level: set}}
modes:
  on: {field: {temp: q - c*temp}}
  off: {field: {temp: -c*temp}}
resets: {tick: {to: {on: {warm: -}, off: {warm: +}}}}
"""


def test_a_sampled_thermostat_lives_between_two_jumps(tmp_path: Path) -> None:
    """One tick on, one off: y = q (1 - E)/(1 - E^2) E^(0 or 1), E = exp(-c Ts); the level is between."""
    model = typed(tmp_path, THERMOSTAT)
    assert cf.check_model(model).ok
    orbit = cf.find_orbit(model)
    assert orbit.period == pytest.approx(0.2, abs=1e-12)
    shrunk = math.exp(-0.1)
    assert orbit.multipliers == pytest.approx([shrunk**2], abs=1e-12)
    top = 2.0 * (1 - shrunk) / (1 - shrunk**2)
    diagram = cf.explore(orbit, "set", (0.9, 1.1))
    ends = sorted(b.params["set"] for b in diagram.bifurcations)
    assert ends == pytest.approx([top * shrunk, top], abs=1e-11)
    for event in diagram.bifurcations:  # beyond them another mode follows at once: the map jumps
        assert event.kind is cf.Kind.SS
        assert "another mode" in event.meaning
    assert diagram.verify().passed


RELAY = """
name: sampled_relay
states: [x, v]
parameters: {zeta: 0.3, h: 0.4, Ts: 0.7}
period: Ts
surfaces: {sign: {observable: x + 0.5*v}}
modes:
  plus: {field: {x: v, v: -2*zeta*v - x + h}}
  minus: {field: {x: v, v: -2*zeta*v - x - h}}
resets: {tick: {to: {minus: {sign: +}, plus: {sign: -}}}}
"""


MIRROR = "symmetry: x -> -x, v -> -v"


@pytest.mark.parametrize("more", ["", MIRROR])
@pytest.mark.parametrize("Ts", [0.7, 1.3])
def test_a_sampled_relay_repeats_its_samples(tmp_path: Path, Ts: float, more: str) -> None:
    """The samples of the orbit, and their signs, are those of the map from tick to tick."""
    model = typed(tmp_path, RELAY + more)
    assert cf.check_model(model).ok
    orbit = cf.find_orbit(model, {"Ts": Ts})
    matrix = np.array([[0.0, 1.0], [-1.0, -0.6]])
    step = expm(matrix * Ts)
    ticks = orbit.ends[np.array([exit_ == "tick" for _, exit_ in orbit.itinerary])]
    y = ticks[0, 1:3]
    for _ in range(len(ticks)):
        force = -0.4 if y[0] + 0.5 * y[1] > 0.0 else 0.4
        rest = np.array([force, 0.0])
        y = rest + step @ (y - rest)
    assert np.allclose(y, ticks[0, 1:3], atol=1e-10)


def test_the_clock_of_a_symmetric_relay_is_its_own_image(tmp_path: Path) -> None:
    """The states change their signs, the clock does not: half of an orbit has half of its ticks.

    Both modes hold everywhere: which is the image of which is told by their fields.
    """
    model = typed(tmp_path, RELAY + MIRROR)
    assert model.symmetry is not None and model.symmetry.kept == {"tick"}
    for domain, image in model.mirror_domain.items():
        assert model.mirror_domain[image] == domain
        assert model.domain_by_name[domain].own_mode != model.domain_by_name[image].own_mode
    orbit = cf.find_orbit(model)
    plain = cf.find_orbit(typed(tmp_path, RELAY))
    assert orbit.symmetric and orbit.period == pytest.approx(plain.period, abs=1e-11)
    assert np.sort(orbit.multipliers) == pytest.approx(np.sort(plain.multipliers), abs=1e-10)
    half = orbit.as_half()
    ticks = [
        sum(exit_ == "tick" for _, exit_ in itinerary)
        for itinerary in (half.system.itinerary, orbit.itinerary)
    ]
    assert half.system.half and 2 * ticks[0] == ticks[1]
    assert half.as_whole().residual < 1e-10
    with pytest.raises(cf.ModelError, match="not one of the surfaces"):
        typed(tmp_path, RELAY + "symmetry: x -> -x")


def test_the_modes_of_a_reset_are_read_in_three_ways(tmp_path: Path) -> None:
    """One name, a list of names (the first that holds), or names with the sides where each is chosen."""
    for to, wanted in (
        ("on", {"on": {}}),
        ("[off, on]", {"off": {}, "on": {}}),
        ("{on: {warm: -}, off: {warm: +}}", {"on": {"warm": -1}, "off": {"warm": 1}}),
    ):
        text = THERMOSTAT.replace("{on: {warm: -}, off: {warm: +}}", to)
        text = text.replace("on: {field", "on: {in: {warm: -}, field")
        reset = typed(tmp_path, text).reset_by_surface["tick"]
        assert {lead.mode: dict(lead.where) for lead in reset.leads} == wanted
    with pytest.raises(cf.ModelError, match="no mode 'hot'"):
        typed(tmp_path, THERMOSTAT.replace("{on: {warm: -}", "{hot: {warm: -}"))
    with pytest.raises(cf.ModelError, match="no surface 'cold'"):
        typed(tmp_path, THERMOSTAT.replace("{on: {warm: -}", "{on: {cold: -}"))


CUK = """
name: cuk
states: [i1, i2, u1, u2]
parameters: {E: 15.0, L: 16.0e-3, C: 47.0e-6, R: 75.0, T: 200.0e-6, k: 0.5}
period: T
surfaces: {pulse: {observable: "mod(t, T)", level: k*T}}
modes:
  on: {in: {pulse: -}, field: {i1: E/L, i2: (u1 - u2)/L, u1: -i2/C, u2: (i2 - u2/R)/C}}
  off: {in: {pulse: +}, field: {i1: (E - u1)/L, i2: -u2/L, u1: i1/C, u2: (i2 - u2/R)/C}}
"""


def test_a_converter_in_seconds_is_found_without_units(tmp_path: Path) -> None:
    """Its 5,000 ticks a second are not followed for 200 seconds before the first look."""
    orbit = cf.find_orbit(typed(tmp_path, CUK))
    L, C, R, T = 16e-3, 47e-6, 75.0, 2e-4
    on = np.array(
        [[0, 0, 0, 0], [0, 0, 1 / L, -1 / L], [0, -1 / C, 0, 0], [0, 1 / C, 0, -1 / (R * C)]]
    )
    off = np.array(
        [[0, 0, -1 / L, 0], [0, 0, 0, -1 / L], [1 / C, 0, 0, 0], [0, 1 / C, 0, -1 / (R * C)]]
    )
    whole = expm(off * T / 2) @ expm(on * T / 2)
    assert np.allclose(
        np.sort_complex(orbit.multipliers), np.sort_complex(np.linalg.eigvals(whole)), atol=1e-9
    )


ROOMS = """
name: rooms
states: [T1, T2]
parameters: {Ta: 5.0, a: AA, k: KK, q: QQ, lo: 19.0, hi: 21.0}
autonomous: true
surfaces: {hot: {observable: T2, level: hi}, cold: {observable: T2, level: lo}}
modes:
  heat: {in: {hot: -}, field: {T1: -a*(T1 - Ta) - k*(T1 - T2) + q, T2: -a*(T2 - Ta) - k*(T2 - T1)}}
  cool: {in: {cold: +}, field: {T1: -a*(T1 - Ta) - k*(T1 - T2), T2: -a*(T2 - Ta) - k*(T2 - T1)}}
"""


def test_two_heated_rooms_in_hours_and_in_seconds(tmp_path: Path) -> None:
    """A cycle of 66,000 units of time is found as one of 18 is."""
    periods = []
    for unit in (1.0, 3600.0):
        text = ROOMS
        for name, value in (("AA", 0.1), ("KK", 0.3), ("QQ", 4.0)):
            text = text.replace(name, repr(value / unit))
        periods.append(cf.find_orbit(typed(tmp_path, text)).period / unit)
    assert periods[1] == pytest.approx(periods[0], rel=1e-10)


PLL = """
name: pll
states: [th, z]
parameters: {dw: 1.2, K: 1.0, tau: 2.0}
autonomous: true
angles: [th]
surfaces: {detector: {observable: sin(th), sliding: filippov}}
field: {th: dw - z, z: (K*sign(sin(th)) - z)/tau}
modes: {lead: {in: {detector: +}}, lag: {in: {detector: -}}}
"""


def test_a_loop_that_slips_its_phase_against_scipy(tmp_path: Path) -> None:
    """sin(th) = 0 lies where an angle begins again; it is no affine observable; and nothing slides on it."""
    orbit = cf.find_orbit(typed(tmp_path, PLL))

    def half(sign: float, z: float) -> tuple[float, float]:
        """Return time and z when the phase has changed by pi."""

        def ahead(_t, y):
            return y[0] - math.pi

        time, end = met(lambda _t, y: (1.2 - y[1], (sign - y[1]) / 2.0), (0.0, z), ahead, 1.0)
        return time, float(end[1])

    z, period = 0.0, 0.0
    for _ in range(60):
        first, z = half(1.0, z)
        second, z = half(-1.0, z)
        period = first + second
    assert orbit.period == pytest.approx(period, abs=1e-9)


MOTOR = """
name: motor
states: [i, th, w]
parameters:
  {R: 2.0, L: 2.0e-3, K: 0.05, J: 2.0e-5, b: 1.0e-5, Tc: 0.012, Ts: 0.015, kp: 8.0, f: 2.0, A: 0.3}
period: 1/f
define: {U: kp*(A*sin(2*pi*f*t) - th)}
surfaces:
  w: {observable: w}
  T+: {observable: K*i, level: Ts}
  T-: {observable: K*i, level: -Ts}
field: {i: (U - R*i - K*w)/L, th: w, w: (K*i - b*w - Tc*sign(w))/J}
modes:
  forward: {in: {w: +}}
  backward: {in: {w: -}}
  stuck: {in: {w: 0, T+: -, T-: +}, field: {i: (U - R*i)/L, th: 0, w: 0}}
"""


def test_a_motor_in_si_units_is_no_error(tmp_path: Path) -> None:
    """Derivatives by an inertia of 1e-5 are compared over steps of its size; surfaces may be named T+."""
    report = cf.check_model(typed(tmp_path, MOTOR))
    assert report.ok, report


CAM = """
name: cam
states: [q, v]
parameters: {W: 2.0, lift: 40.0}
period: 2*pi/W
surfaces: {cam: {observable: q - lift*cos(W*t)}}
modes: {flight: {in: {cam: +}, field: {q: v, v: -q - 0.1*v - 80}}}
resets: {cam: {v: -1.3*lift*W*sin(W*t) - 0.3*v, chatter: true}}
"""


def test_a_start_is_looked_for_beyond_a_spread_that_nobody_wrote(tmp_path: Path) -> None:
    assert cf.find_orbit(typed(tmp_path, CAM)).admissible


INTERLEAVED = """
name: interleaved
states: [i1, i2, u]
parameters: {E: 24.0, L: 2.0e-3, C: 47.0e-6, R: 8.0, T: 4.0e-4, D: 0.4, a: 0.5}
period: T
surfaces:
  one: {observable: "mod(t, T)", level: D*T}
  two: {observable: "mod(t + a*T, T)", level: D*T}
modes:
  both: {in: {one: -, two: -}, field: {i1: (E - u)/L, i2: (E - u)/L, u: (i1 + i2 - u/R)/C}}
  first: {in: {one: -, two: +}, field: {i1: (E - u)/L, i2: -u/L, u: (i1 + i2 - u/R)/C}}
  second: {in: {one: +, two: -}, field: {i1: -u/L, i2: (E - u)/L, u: (i1 + i2 - u/R)/C}}
  none: {in: {one: +, two: +}, field: {i1: -u/L, i2: -u/L, u: (i1 + i2 - u/R)/C}}
units: {t: 1.0e-4}
"""


@pytest.mark.parametrize("shift", ["t + a*T", "t - (1 - a)*T", "T + t - (T - a*T)"])
def test_two_converters_whose_clocks_are_apart(tmp_path: Path, shift: str) -> None:
    """With a resistance of the coils, a period is one affine map in each of four phases."""
    text = INTERLEAVED.replace("t + a*T", shift)
    for state in ("i1", "i2"):  # 1 ohm in each coil
        text = text.replace(f"{state}: (E - u)/L", f"{state}: (E - u - {state})/L")
        text = text.replace(f"{state}: -u/L", f"{state}: (-u - {state})/L")
    model = typed(tmp_path, text)
    orbit = cf.find_orbit(model)
    assert orbit.period == pytest.approx(4.0, abs=1e-12)
    L, C, R, T, D, a = 2e-3, 47e-6, 8.0, 4e-4, 0.4, 0.5
    matrix = np.array([[-1 / L, 0, -1 / L], [0, -1 / L, -1 / L], [1 / C, 1 / C, -1 / (R * C)]])
    whole, offset, now = np.eye(3), np.zeros(3), 0.0
    for until, on in ((D * T, (1, 0)), (a * T, (0, 0)), ((a + D) * T, (0, 1)), (T, (0, 0))):
        step = expm(matrix * (until - now))
        rest = -np.linalg.solve(matrix, 24.0 / L * np.array([*on, 0.0]))
        whole, offset, now = step @ whole, rest + step @ (offset - rest), until
    tick = next(k for k, (_, exit_) in enumerate(orbit.itinerary) if exit_ == "tick")
    exact = np.linalg.solve(np.eye(3) - whole, offset)
    assert np.allclose(orbit.ends[tick, 1:4], exact, atol=1e-9)
    found = np.sort(np.abs(orbit.multipliers))[-3:]
    assert np.allclose(found, np.sort(np.abs(np.linalg.eigvals(whole))), atol=1e-9)
    diagram = cf.explore(orbit, "a", (0.45, 0.55))
    assert not diagram.loose_ends
