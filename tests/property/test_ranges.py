"""States with a range: starts and checks stay within it, and what is positive stays so, however small."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from by_scipy import after
from typed import typed

import contfric as cf
from contfric.errors import ModelError
from contfric.models.check import Severity
from contfric.models.described.reading_back import from_text
from contfric.models.generated.symbols import Formulas
from contfric.models.reading.describe import describe

#: Pulse vaccination: between pulses the infectives fall by ten orders of magnitude and more.
EPIDEMIC = """
name: epidemic
states: [S, I]
parameters: {m: 0.02, b: 1800.0, g: 100.0, p: 0.5, Tv: 2.0}
period: Tv
modes: {all: {field: {S: m - b*S*I - m*S, I: b*S*I - (m + g)*I}}}
resets: {tick: {S: (1 - p)*S}}
"""

#: A neuron that bursts: its gate has no meaning outside of 0 to 1, where the field would lead back.
BURST = """
name: burst
states: [V, h]
parameters: {I0: 0.2, I1: 0.6, f: 0.006}
period: 1/f
define: {I: I0 + I1*cos(2*pi*f*t)}
surfaces: {threshold: {observable: V, level: -35}, gate: {observable: V, level: -60}}
modes:
  low: {in: {gate: -}, field: {V: (I - 0.035*(V + 65))/2, h: (1 - h)/100}}
  high: {in: {gate: +, threshold: -}, field: {V: (I - 0.035*(V + 65) - 0.07*h*(V - 120))/2, h: -h/20}}
resets: {threshold: {V: -50}}
"""


def written(folder: Path, text: str, spread: str = "") -> cf.Model:
    return typed(folder, text + (f"spread: {spread}\n" if spread else ""))


def pulsed(p: dict[str, float], y: np.ndarray) -> np.ndarray:
    """Return the susceptibles and the logarithm of the infectives one period after a pulse, by scipy."""

    def field(_t: float, y: np.ndarray) -> list[float]:
        s, infectives = y[0], math.exp(y[1])
        return [p["m"] - p["b"] * s * infectives - p["m"] * s, p["b"] * s - p["m"] - p["g"]]

    s, infectives = after(field, y, (0, p["Tv"]))
    return np.array([(1 - p["p"]) * s, infectives])


@pytest.mark.parametrize(("p", "period"), [(0.5, 2.0), (0.505, 2.02), (0.4, 1.5)])
def test_positive_states_keep_their_digits(tmp_path: Path, p: float, period: float) -> None:
    model = written(tmp_path, EPIDEMIC, "{S: [0, 1], I: [0, 0.01]}")
    orbit = cf.find_orbit(model, {"p": p, "Tv": period})
    params = {**model.defaults, "p": p, "Tv": period}
    susceptible, infectives = orbit.joints[0, 1:3]
    start = np.array([(1 - p) * susceptible, math.log(infectives)])
    assert round(orbit.period / period) == 1
    np.testing.assert_allclose(pulsed(params, start), start, rtol=1e-8)
    motion = cf.simulate(model, params, state=[0.06, 1e-4], periods=20)
    assert np.all(motion.states[:, 1] > 0.0)
    assert np.min(motion.sample(np.linspace(0, 10 * period, 200))[:, 1]) < 1e-7


def test_starts_leave_what_stays_zero(tmp_path: Path) -> None:
    model = written(tmp_path, EPIDEMIC)
    assert cf.simulate(model, periods=1).begin[1][1] > 0.0
    for name in ("coulomb", "relay"):  # nothing of them stays at 0
        begin = cf.simulate(name, periods=1).begin[1]
        assert np.count_nonzero(begin) == 1


@pytest.mark.parametrize("seed", range(4))
def test_starts_and_checks_stay_within_ranges(tmp_path: Path, seed: int) -> None:
    draw = np.random.default_rng(seed)
    low = draw.uniform(-90, -70)
    model = written(tmp_path, BURST, f"{{V: [{low!r}, -35], h: [0, 1]}}")
    report = cf.check_model(model)
    assert report.ok, str(report)
    assert not [f for f in report.findings if f.severity is Severity.WARNING], str(report)
    y = cf.simulate(model, periods=1).begin[1]
    assert low < y[0] < -35 and 0 < y[1] < 1


def test_faults_that_nothing_meets_are_warnings(tmp_path: Path) -> None:
    text = BURST.replace("(1 - h)/100", "(1 - h)/2")  # h > 0 long before the gate
    report = cf.check_model(written(tmp_path, text, "{V: [-80, -75]}"))
    assert report.ok, str(report)
    assert any("simulations came to such a state" in f.message for f in report.findings)
    report = cf.check_model(written(tmp_path, BURST, "{V: 80}"))  # starts with h < 0 do come there
    assert any("from starts in the spread came" in f.message for f in report.findings)


def test_ranges_have_units_and_names(tmp_path: Path) -> None:
    text = EPIDEMIC.replace("p: 0.5", "p: 0.5, most: 0.02") + "units: {I: 0.001}\n"
    model = written(tmp_path, text, "{I: [most/20, most], S: 3}")
    low, high = model.region(model.vector({"most": 0.04}), 2.0)
    k, s = model.states.index("I"), model.states.index("S")
    np.testing.assert_allclose([low[k], high[k], low[s], high[s]], [2, 40, -6, 6])


@pytest.mark.parametrize(
    ("entry", "says"), [("[0, 1, 2]", "a lowest and"), ("[1, 0]", "from 1 to 0")]
)
def test_ranges_that_are_none(tmp_path: Path, entry: str, says: str) -> None:
    with pytest.raises(ModelError, match=says):
        written(tmp_path, EPIDEMIC, f"{{I: {entry}}}")


@pytest.mark.parametrize("seed", range(6))
def test_what_is_driven_away_from_0_has_its_own_tolerance(seed: int) -> None:
    """A chain of states, each fed by the one before; the first by itself, or from outside in some modes.

    Those that stay 0 together are known to a share of themselves. One that is fed from outside is not, nor
    what it feeds: it would begin at 0 with steps of 1e-17, and take twenty before the first of a size.
    """
    draw = np.random.default_rng(seed)
    n, fed = 4, int(draw.integers(0, 5))  # the first that is fed from outside; 4: none
    rates = {
        f"c{k}": f"a*c{k - 1}*(1 + c{n - 1}) - c{k}" if k else "a*c0 - c0**2" for k in range(n)
    }
    modes = {"all": {"field": rates | ({f"c{fed}": f"{rates[f'c{fed}']} + b"} if fed < n else {})}}
    data = {
        "name": "chain",
        "states": [*rates],
        "parameters": {"a": 1.5, "b": 0.3},
        "autonomous": True,
        "surfaces": {"high": {"observable": "c0", "level": 2}},
        "modes": modes,
        "spread": {name: [0, 1] for name in rates},
    }
    assert Formulas(describe(data)).positive() == list(range(fed))


def test_a_reset_to_0_takes_no_tiny_steps(tmp_path: Path) -> None:
    """A weight on a spring lets go of a drop, and falls from rest: three steps, and not twenty."""
    text = """
name: faucet
states: [x, v, m]
parameters: {k: 475.0, g: 980.0, R: 0.6, xc: 0.25, q: 0.6}
autonomous: true
surfaces: {drop: {observable: x, level: xc}}
modes: {hang: {in: {drop: -}, field: {x: v, v: g - (k*x + v)/m, m: R}}}
resets: {drop: {m: q*m, v: 0, x: 0.2}}
"""
    ranges = "{x: [0, 0.25], v: [0, 4], m: [0.02, 0.3]}"
    model = written(tmp_path, text, ranges)
    flow = model.flow_factory.definition  # type: ignore[attr-defined]
    assert Formulas(from_text(flow)).positive() == []
    orbit, params = cf.find_orbit(model), model.defaults
    _, x, v, m = orbit.joints[0]

    def field(_t: float, y: np.ndarray) -> list[float]:
        fall = params["g"] - (params["k"] * y[0] + y[1]) / y[2]
        return [y[1], fall, params["R"]]

    start = [0.2, 0.0, params["q"] * m]
    end = after(field, start, (0, orbit.period), atol=1e-14)
    np.testing.assert_allclose(end, [x, v, m], rtol=1e-9)
