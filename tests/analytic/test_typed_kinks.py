"""Kinks within kinks, as textbooks write dead zones and saturation: known by the sides of two levels."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from sympy import Float, Symbol
from typed import typed

import contfric as cf
from contfric.models.language.formulas import FORMULAS, formula, kinks_in, resolved
from contfric.models.language.grammar import Scope, number_of, parse

#: A restoring force that begins beyond d, the same within d and beyond, and one with a limit.
LAWS = (
    "sign(x)*max(abs(x) - d, 0)",
    "where(abs(x) > d, x - d*sign(x), 0)",
    "max(-d, min(d, x))",
    "where(1 > abs(x)/d, x, 2*x)",
    "x - where(abs(2*x) < 2*d, x, d*sign(x))",
)
#: Sides of the levels d and -d above, between and below them, with where that is in units of d.
BANDS = {(1, 1): (1.0, 3.0), (-1, 1): (-1.0, 1.0), (-1, -1): (-3.0, -1.0)}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("sides", BANDS)
def test_what_two_levels_decide(law: str, sides: tuple[int, int]) -> None:
    draw = np.random.default_rng(7)
    x, d = Symbol("x"), Symbol("d")
    whole = formula(parse(law), Scope(FORMULAS, {"x": x, "d": d}))
    known = resolved(whole, {x - d: sides[0], x + d: sides[1]}, (x,))
    assert kinks_in(whole, (x,)) and not kinks_in(known, (x,))
    for _ in range(20):
        half = float(draw.uniform(0.1, 2.0))
        at = {"x": half * float(draw.uniform(*BANDS[sides])), "d": half}
        value = float(known.xreplace({x: Float(at["x"], 30), d: Float(half, 30)}))
        assert value == pytest.approx(number_of(law, at), abs=1e-14)


def test_what_one_level_does_not_decide_is_left() -> None:
    x, d = Symbol("x"), Symbol("d")
    whole = formula(parse(LAWS[0]), Scope(FORMULAS, {"x": x, "d": d}))
    assert kinks_in(resolved(whole, {x - d: 1}, (x,)), (x,))  # d may be below 0
    assert kinks_in(resolved(whole, {x + d: 1}, (x,)), (x,))


#: A mass with play, with the force as textbooks write it.
PLAY = """
name: play
states: [x, v]
parameters: {d: 0.4, k: 3.0, w: 1.1, c: 0.2}
period: 2*pi/w
surfaces: {up: {observable: x, level: d}, down: {observable: x, level: -d}}
field: {x: v, v: "cos(w*t) - c*v - k*sign(x)*max(abs(x) - d, 0)"}
modes: {above: {in: {up: +}}, between: {in: {up: -, down: +}}, below: {in: {down: -}}}
symmetry: x -> -x, v -> -v, t -> t + T/2
"""


def test_a_dead_zone_is_solved_in_closed_form(tmp_path: Path) -> None:
    model = typed(tmp_path, PLAY)
    report = str(cf.check_model(model))
    assert "has a kink" not in report and "integrated" not in report
    orbit = cf.find_orbit(model)

    def field(t: float, y: np.ndarray) -> list[float]:
        spring = 3.0 * np.sign(y[0]) * max(abs(y[0]) - 0.4, 0.0)
        return [y[1], np.cos(1.1 * t) - 0.2 * y[1] - spring]

    t, y = orbit.joints[0, 0], orbit.joints[0, 1:]
    for end in [*orbit.as_whole().joints[1:, 0], t + orbit.period]:
        y = solve_ivp(field, (t, end), y, rtol=1e-12, atol=1e-14, method="DOP853").y[:, -1]
        t = end
    np.testing.assert_allclose(y, orbit.joints[0, 1:], atol=1e-9)
