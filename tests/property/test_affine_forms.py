"""Which formulas are affine: found in their symbols, and equal to what they were."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from by_scipy import after

import contfric as cf
from contfric.models.generated.affine import affine_form
from contfric.models.language.formulas import FORMULAS, formula
from contfric.models.language.grammar import Scope, number_of, parse
from contfric.models.language.not_affine import NotAffineError

NAMES = ("t", "x", "v", "w", "p")
VALUES = dict(zip(NAMES, (0.37, 0.7, -0.2, 1.3, 0.45), strict=True))


def form_of(text: str) -> Any:
    t, x, v, *rest = sympy.symbols(NAMES)
    scope = Scope(FORMULAS, dict(zip(NAMES, (t, x, v, *rest), strict=True)))
    return affine_form(formula(parse(text), scope), t, (x, v), ("x", "v"))


def value_of(form: Any) -> float:
    """The formula put together again from its parts."""
    numbers = {sympy.Symbol(name): value for name, value in VALUES.items()}

    def at(e: Any) -> float:
        return float(sympy.lambdify(list(numbers), e, [{"Abs": abs}, "math"])(*numbers.values()))

    g, h = (at(slope) for slope in form.slopes)
    total = g * VALUES["x"] + h * VALUES["v"]
    for w, a, b in form.waves:
        phase = at(w) * VALUES["t"]
        total += at(a) * math.cos(phase) + at(b) * math.sin(phase)
    return total


@pytest.mark.parametrize(
    "text",
    [
        "x*p + cos(w*t)**2*sin(3*w*t + p) + 3",
        "x**2 - x*(x - 1)",
        "(cos(w*t) + p*cos(3*w*t))**2 - v/p",
        "(1 + cos(p - w*t))*sin(w*t + p)",
        "sin(-w*t)*cos(2 - 3*t) - x*exp(p)",
        "cos(w*(t - 1))**4 + sqrt(p)*x",
        "sin(p)*x - cos(p)*v",
        "0",
    ],
)
def test_affine_formulas_are_put_together_again(text: str) -> None:
    assert value_of(form_of(text)) == pytest.approx(number_of(text, VALUES), rel=1e-13, abs=1e-13)


@pytest.mark.parametrize("seed", range(20))
def test_random_products_of_harmonics(seed: int) -> None:
    rng = np.random.default_rng(seed)

    def wave() -> str:
        kind = "cos" if rng.integers(2) else "sin"
        return f"({rng.normal():.3f} + {kind}({rng.integers(-3, 4)}*w*t + {rng.normal():.3f}*p))"

    text = f"{wave()}*{wave()} - {wave()}**2*{rng.normal():.3f} + v*{rng.normal():.3f} - x*p"
    assert value_of(form_of(text)) == pytest.approx(number_of(text, VALUES), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("x**2", "not linear in x"),
        ("x*v", "not linear in x"),
        ("sin(v)", "not linear in v"),
        ("abs(x)", "sign of a state"),
        ("where(v > 0, x, 2*x)", "sign of a state"),
        ("max(x, 0)", "sign of a state"),
        ("cos(w*t)*x", "factor of x depends on time"),
        ("cos(w*t**2)", "no sum of harmonics"),
        ("exp(-t)", "no sum of harmonics"),
        ("abs(cos(w*t))", "no sum of harmonics"),
        ("1/(2 + cos(w*t))", "no sum of harmonics"),
    ],
)
def test_what_is_not_affine_says_why(text: str, reason: str) -> None:
    with pytest.raises(NotAffineError, match=reason):
        form_of(text)


@pytest.mark.parametrize(
    ("name", "closed"),
    [
        ("coulomb-yaml", ("slide+", "slide-", "stick")),
        ("impact", ("up", "down")),
        ("dead-band", ("fast+", "band", "fast-", "hold+", "hold-")),
        ("popp", ()),
        ("bang-bang", ()),
        ("belt-lugre", ()),
    ],
)
def test_models_say_which_modes_are_closed_forms(name: str, closed: tuple[str, ...]) -> None:
    model = cf.load_model(name)
    assert model.closed_form == closed
    assert set(model.integrated) == {m.name for m in model.modes} - set(closed)
    assert all(mode in repr(model) for mode in (*closed, *model.integrated))


def test_a_model_may_have_modes_of_both_kinds() -> None:
    """Linear below a contact, cubic above it: the orbit is that of another integrator."""
    path = Path(__file__).parents[1] / "models" / "half_linear.yaml"
    orbit = cf.find_orbit(path, {})
    model, p = orbit.model, orbit.params
    assert model.closed_form == ("free",) and set(model.integrated) == {"pressed"}

    def field(t: float, y: list[float]) -> list[float]:
        force = p["F"] * np.cos(p["w"] * t) - y[0] - 2.0 * p["zeta"] * y[1]
        return [y[1], force - p["k"] * max(y[0] - p["gap"], 0.0) ** 3]

    start = orbit.cycle[0]
    # the field is smooth to its second derivative at the contact
    end = after(field, start[1:], (start[0], start[0] + orbit.period))
    assert np.max(np.abs(end - start[1:])) < 1e-9
    assert orbit.converged and orbit.admissible
