"""Signs of products: known where the sides of a mode say those of the factors. Reid's spring, by scipy."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from sympy import Symbol
from typed import typed

import contfric as cf
from contfric.models.language.formulas import FORMULAS, formula, kinks_in
from contfric.models.language.grammar import Scope, number_of, parse
from contfric.models.language.products import factors

#: A spring that is stiffer while it is loaded (Reid 1956), with a little viscous damping.
REID = """
name: reid
states: [x, v]
parameters: {{g: 0.2, F: 0.5, w: 0.8, c: 0.02}}
period: 2*pi/w
define: {{power: 2*x*v}}
surfaces: {{x: {{observable: x}}, v: {{observable: v, sliding: filippov}}}}
field: {{x: v, v: {law}}}
modes:
  load+: {{in: {{x: +, v: +}}}}
  unload+: {{in: {{x: +, v: -}}}}
  load-: {{in: {{x: -, v: -}}}}
  unload-: {{in: {{x: -, v: +}}}}
symmetry: x -> -x, v -> -v, t -> t + T/2
"""
LAWS = (
    "F*cos(w*t) - c*v - x*(1 + g*sign(power))",
    pytest.param('"F*cos(w*t) - c*v - x*where(-x*v >= 0, 1 - g, 1 + g)"', marks=pytest.mark.slow),
    pytest.param("F*cos(w*t) - c*v - x - g*abs(x*v)/v", marks=pytest.mark.slow),
)


@pytest.mark.parametrize("law", LAWS)
def test_reids_spring(tmp_path: Path, law: str) -> None:
    model = typed(tmp_path, REID.format(law=law))
    report = cf.check_model(model)
    assert report.ok and "has a kink" not in str(report)
    orbit = cf.find_orbit(model)
    passed = {mode for mode, _ in orbit.as_whole().itinerary}
    assert passed == {"load+", "unload+", "load-", "unload-"}

    def field(t: float, y: np.ndarray) -> list[float]:
        return [y[1], 0.5 * np.cos(0.8 * t) - 0.02 * y[1] - y[0] * (1 + 0.2 * np.sign(y[0] * y[1]))]

    t, y = orbit.joints[0, 0], orbit.joints[0, 1:]
    for end in [*orbit.as_whole().joints[1:, 0], t + orbit.period]:  # from kink to kink
        y = solve_ivp(field, (t, end), y, rtol=1e-12, atol=1e-14, max_step=0.1).y[:, -1]
        t = end
    np.testing.assert_allclose(
        y, orbit.joints[0, 1:], atol=2e-8
    )  # a joint is on a jump to rounding


def test_the_sign_of_a_product_is_that_of_its_factors() -> None:
    draw = np.random.default_rng(5)
    for _ in range(60):
        names = draw.permutation(list("abcd"))[: draw.integers(2, 5)]
        text = names[0] + "".join(f"{draw.choice(list('*/'))}{name}" for name in names[1:])
        values = dict(zip("abcd", draw.normal(size=4).tolist(), strict=True))
        assert number_of(f"sign({text})", values) == np.sign(number_of(text, values))
        assert number_of(f"abs({text})", values) == pytest.approx(
            abs(number_of(text, values)), rel=1e-15
        )
        above = number_of(text, values) > 0
        for condition in (f"{text} > 0", f"0 < {text}", f"not {text} <= 0", f"-({text}) < 0"):
            assert number_of(f"where({condition}, 1, 0)", values) == above
    ring = {"p": parse("2*q"), "q": parse("p/3")}
    assert len(factors(ast.Name("p"), ring)) == 3  # 2, p, 3: what is defined by itself ends


def test_a_condition_on_a_product_has_the_kinks_of_its_factors() -> None:
    tree = parse("where(x*v >= 0, 1, 2) + abs(x*sign(v))")
    names = {name: Symbol(name) for name in "xv"}
    kinks = kinks_in(formula(tree, Scope(FORMULAS, {**names})), names.values())
    assert [str(kink) for kink in kinks] == ["v", "x"]
