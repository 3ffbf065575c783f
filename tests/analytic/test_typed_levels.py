"""Models with one formula for all states, as textbooks write saturation, dead zones, and Chua's diode."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from by_scipy import after
from scipy.integrate import solve_ivp
from typed import typed

import contfric as cf
from contfric.models.check.report import Severity


def faults(model: cf.Model) -> list[str]:
    """Return the errors and warnings of a check."""
    found = cf.check_model(model).findings
    return [str(f) for f in found if f.severity is not Severity.NOTE]


#: A force of x and v with kinks at two levels d and -d, where v is multiplied by 1, and the same in Python.
LAWS = {
    "max(-d, min(d, x))": lambda x, d: max(-d, min(d, x)),
    "x + 3*sign(x)*max(abs(x) - d, 0)": lambda x, d: x + 3 * np.sign(x) * max(abs(x) - d, 0),
    "2*x - 0.5*(abs(x + d) - abs(x - d))": lambda x, d: 2 * x - 0.5 * (abs(x + d) - abs(x - d)),
    "where(abs(x) < d, x, 2*x - d*sign(x))": lambda x, d: (
        x if abs(x) < d else 2 * x - d * np.sign(x)
    ),
}
FORCED = """
name: forced
states: [x, v]
parameters: {{d: {d}, w: {w}, c: 0.3}}
period: 2*pi/w
define: {{force: "{law}"}}
surfaces: {{up: {{observable: x, level: d}}, down: {{observable: x, level: -d}}}}
field: {{x: v, v: 1.2*cos(w*t) - c*v - force}}
symmetry: x -> -x, v -> -v, t -> t + T/2
"""


@pytest.mark.parametrize("law", LAWS)
def test_modes_between_levels_need_not_be_written(tmp_path: Path, law: str) -> None:
    draw = np.random.default_rng(len(law))
    d, w = float(draw.uniform(0.2, 0.5)), float(draw.uniform(0.8, 1.5))
    model = typed(tmp_path, FORCED.format(d=d, w=w, law=law))
    assert {domain.own_mode for domain in model.domains} >= {"x-", "x0", "x+"}
    assert not faults(model)
    orbit = cf.find_orbit(model)
    begin, y = orbit.joints[0, 0], orbit.joints[0, 1:]

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], 1.2 * np.cos(w * t) - 0.3 * y[1] - LAWS[law](y[0], d)]

    end = after(rates, y, (begin, begin + orbit.period), max_step=0.01 * orbit.period)
    assert end == pytest.approx(y, abs=1e-8)


#: T. Matsumoto, L. O. Chua, M. Komuro, The double scroll, IEEE Trans. Circuits Syst. 32 (1985) 797-818.
CHUA = """
name: chua
states: [x, y, z]
parameters: {alpha: 7.5, beta: 14.28, m0: -1/7, m1: 2/7}
autonomous: true
define: {f: m1*x + 0.5*(m0 - m1)*(abs(x + 1) - abs(x - 1))}
surfaces: {right: {observable: x, level: 1}, left: {observable: x, level: -1}}
field: {x: alpha*(y - f), y: x - y + z, z: -beta*y}
symmetry: x -> -x, y -> -y, z -> -z
spread: {x: 2, y: 0.5, z: 3}
"""


def test_chuas_circuit_doubles_its_period(tmp_path: Path) -> None:
    text = CHUA.replace("-1/7", f"{-1 / 7!r}").replace("2/7", f"{2 / 7!r}")
    branch = cf.continue_orbit(cf.find_orbit(typed(tmp_path, text)), "alpha", (7.5, 8.3))
    [doubling] = [event for event in branch.bifurcations if event.kind is cf.Kind.PD]
    alpha, orbit = doubling.params["alpha"], doubling.orbit

    def rates(t: float, z: np.ndarray) -> np.ndarray:
        slope = -1 / 7 if abs(z[0]) < 1.0 else 2 / 7
        f = slope * z[0] + (0.0 if abs(z[0]) < 1.0 else -3 / 7 * np.sign(z[0]))
        matrix = np.array([[-alpha * slope, alpha, 0.0], [1.0, -1.0, 1.0], [0.0, -14.28, 0.0]])
        own = [alpha * (z[1] - f), z[0] - z[1] + z[2], -14.28 * z[1]]
        return np.concatenate([own, (matrix @ z[3:].reshape(3, 3)).ravel()])

    start = np.concatenate([orbit.joints[0, 1:], np.eye(3).ravel()])
    end = solve_ivp(rates, (0.0, orbit.period), start, rtol=1e-11, atol=1e-12, max_step=0.002)
    assert end.y[:3, -1] == pytest.approx(start[:3], abs=1e-7)
    around = np.linalg.eigvals(end.y[3:, -1].reshape(3, 3))
    assert np.min(np.abs(around + 1.0)) < 1e-6


#: A stick with a dead band moves a rudder whose rate is limited.
PILOT = """
name: pilot
states: [th, q, d]
parameters: {w: 1.5, K: 2.0, a: 10.0, R: 1.0, b: 0.1}
period: 2*pi/w
define:
  e: sin(w*t) - th - 0.4*q
  stick: sign(e)*max(abs(e) - b, 0)
surfaces:
  e+: {observable: e, level: b}
  e-: {observable: e, level: -b}
  r+: {observable: a*(K*stick - d), level: R}
  r-: {observable: a*(K*stick - d), level: -R}
field: {th: q, q: 1.5*d - q, d: "max(-R, min(R, a*(K*stick - d)))"}
symmetry: th -> -th, q -> -q, d -> -d, t -> t + T/2
"""


def test_levels_of_two_observables_cross_without_a_two_fold(tmp_path: Path) -> None:
    model = typed(tmp_path, PILOT)
    names = {domain.own_mode for domain in model.domains}
    assert names >= {f"e{e}r{r}" for e in "-0+" for r in "-0+"}
    assert (
        cf.find_two_folds(model, starts=20) == ()
    )  # the field is continuous: solutions are unique


def test_more_modes_than_can_be_meant_are_refused(tmp_path: Path) -> None:
    states = [f"x{k}" for k in range(7)]
    text = f"""
name: many
states: [{", ".join(states)}]
parameters: {{w: 1.0}}
period: 2*pi/w
surfaces: {{{", ".join(f"s{k}: {{observable: x{k}}}" for k in range(7))}}}
field: {{{", ".join(f"x{k}: cos(w*t) - abs(x{k})" for k in range(7))}}}
"""
    with pytest.raises(cf.ModelError, match="more than 64 modes"):
        typed(tmp_path, text)


#: The slip of a braked wheel, kept between two thresholds (Burckhardt's friction on dry asphalt).
BRAKE = """
name: brake
states: [slip, torque]
parameters: {{r: 0.3, J: 1.0, N: 3000.0, v: 20.0, up: 8000.0, o: {o}}}
autonomous: true
define: {{mu: 1.28*(1 - exp(-23.99*(slip - o))) - 0.52*(slip - o)}}
surfaces: {{high: {{observable: slip - o, level: 0.25}}, low: {{observable: slip - o, level: 0.08}}}}
modes:
  apply: {{in: {{high: -}}, field: {{slip: r/(J*v)*(torque - r*N*mu), torque: up}}}}
  release: {{in: {{low: +}}, field: {{slip: r/(J*v)*(torque - r*N*mu), torque: -up}}}}
units: auto
spread: {{slip: [{o}, {o} + 0.5], torque: [0, 2000]}}
"""


@pytest.mark.parametrize("o", [0.0, -1.3, 0.7])
def test_the_unit_of_time_is_that_of_the_range_of_states(tmp_path: Path, o: float) -> None:
    model = typed(tmp_path, BRAKE.format(o=o))
    unit = dict(model.units)["t"]
    assert unit == pytest.approx(0.558)  # wherever the range begins
    found = cf.find_orbit(model)
    # scipy: a slip of 0.25 is met every 0.2785238428 s (solve_ivp, 1e-12)
    assert unit * found.period == pytest.approx(0.2785238428, abs=1e-9)


@pytest.mark.parametrize("ticks", [2e-5, 0.3, 700.0])
def test_the_unit_of_time_is_that_of_the_clock(tmp_path: Path, ticks: float) -> None:
    text = f"""
name: doses
states: [level]
parameters: {{k: {0.2 / ticks!r}, dose: 3.0, Ts: {ticks!r}}}
period: Ts
modes: {{decays: {{field: {{level: -k*level}}}}}}
resets: {{tick: {{level: level + dose}}}}
units: auto
spread: {{level: 5}}
"""
    model = typed(tmp_path, text)
    assert dict(model.units)["t"] == pytest.approx(ticks / (2 * np.pi), rel=5e-3)
    orbit = cf.find_orbit(model)
    most = 3.0 / (1.0 - np.exp(-0.2))
    assert orbit.x_max * dict(model.units)["level"] == pytest.approx(most, rel=1e-9)
    assert not faults(model)
