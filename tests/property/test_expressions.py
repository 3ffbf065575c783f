"""The language of expressions: safe, and the same in numbers, in many digits and in formulas."""

from __future__ import annotations

import math
import random

import mpmath
import numpy as np
import pytest
import sympy
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from contfric.errors import ModelError
from contfric.models.check.derivatives import MANY_DIGITS, slopes
from contfric.models.generated.build import load_module
from contfric.models.generated.code import printed
from contfric.models.generated.symbols import Formulas
from contfric.models.language.formulas import FORMULAS, formula, kinks_in, vanishes
from contfric.models.language.grammar import FLOATS, Scope, names_in, number_of, parse
from contfric.models.reading.describe import describe
from contfric.models.reading.oscillator import Symbols

NAMES = ("x", "v", "t", "a", "b")

leaves = st.one_of(
    st.sampled_from(NAMES),
    st.floats(0.1, 3.0).map(lambda value: repr(round(value, 3))),
    st.integers(1, 4).map(str),
)


def grown(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    pair = st.tuples(inner, inner)
    return st.one_of(
        pair.flatmap(lambda ab: st.sampled_from([f"({ab[0]} {o} {ab[1]})" for o in "+-*"])),
        pair.map(lambda ab: f"({ab[0]})/(2 + ({ab[1]})**2)"),
        inner.flatmap(
            lambda a: st.sampled_from(
                [f"{f}({a})" for f in ("sin", "cos", "tanh", "atan", "abs", "-")]
            )
        ),
        inner.map(lambda a: f"sqrt(1 + ({a})**2)"),
        inner.map(lambda a: f"log(2 + sin({a}))"),
        inner.map(lambda a: f"exp(-abs({a}))"),
        pair.map(lambda ab: f"(1.5 + cos({ab[0]}))**(tanh({ab[1]}))"),
        st.tuples(inner, inner, inner).map(lambda p: f"where({p[0]} > {p[1]}, {p[2]}, {p[0]})"),
        pair.flatmap(
            lambda ab: st.sampled_from([f"{f}({ab[0]}, {ab[1]})" for f in ("min", "max")])
        ),
    )


expressions = st.recursive(leaves, grown, max_leaves=8)


def many_digits(text: str, point: list[object]) -> object:
    return Scope(MANY_DIGITS, dict(zip(NAMES, point, strict=True))).evaluate(parse(text))


@settings(deadline=None, max_examples=60, derandomize=True)
@given(expressions, st.integers(0, 2**31))
def test_formulas_and_numbers_agree(text: str, seed: int) -> None:
    """The same tree in ordinary numbers, in 60 digits, and as a formula with exact derivatives."""
    draw = random.Random(seed)  # not from hypothesis, which likes kinks
    point = [draw.uniform(-2, 2) for _ in NAMES]
    symbols = {name: sympy.Symbol(name) for name in NAMES}
    found = formula(parse(text), Scope(FORMULAS, dict(symbols)))
    with mpmath.workdps(60):
        place = [mpmath.mpf(p) for p in point]
        exact = float(many_digits(text, place))
        slope = slopes(
            lambda p: [many_digits(text, p)], place, [mpmath.mpf(10) ** -18] * len(place)
        )[0]
    assume(abs(exact) < 1e6 and max(abs(s) for s in slope) < 1e6)
    assert number_of(text, dict(zip(NAMES, point, strict=True))) == pytest.approx(exact, rel=1e-9)
    helpers = {
        "math": math,
        "sign": lambda x: float(np.sign(x)),
        "power": lambda b, e: b**e,
        "power_log": lambda b, e: b**e * math.log(b),
    }
    values = dict(zip(NAMES, point, strict=True))
    for name, want in zip(NAMES, slope, strict=True):
        code = printed(found.diff(symbols[name]))
        have = eval(code, {"__builtins__": {"abs": abs}}, {**helpers, **values})
        assert have == pytest.approx(float(want), rel=1e-7, abs=1e-7)


@settings(deadline=None, max_examples=300)
@given(st.text(alphabet="xvabt012.()[]{}+-*/^<>=!,'\" _lmdnioref:@\\", max_size=24))
def test_any_text_is_read_or_refused(text: str) -> None:
    """Nothing else can happen: no other error, and no value but of names that were given."""
    try:
        tree = parse(text)
        names = names_in(tree)
        Scope(FLOATS, dict.fromkeys(names, 0.7)).evaluate(tree)
    except (ModelError, ArithmeticError):
        pass


FORBIDDEN = [
    "__import__('os').system('true')",
    "x.__class__.__mro__",
    "().__class__",
    "open('a')",
    "eval('1')",
    "exec('1')",
    "print(x)",
    "(lambda: 1)()",
    "[x for x in (1, 2)]",
    "x[0]",
    "{1: 2}",
    "f'{x}'",
    "'a'*3",
    "x if v else a",
    "(x := 1)",
    "not x",
    "x and v",
    "x == v",
    "x @ v",
    "x % v",
    "x // v",
    "x << 2",
    "~x",
    "1j",
    "True",
    "None",
    "...",
    "sin(x, v)",
    "sin(*x)",
    "sin(x=1)",
    "sin",
    "sin(sin)",
    "where(x, 1, 2)",
    "where(x == 1, 1, 2)",
    "min(x)",
    "sqrt",
    "1e999",
    "9" * 400,
    "2**10**10",
    "9**9**9**9",
    "x" * 6000,
    "(" * 300 + "x" + ")" * 300,
    "-" * 3000 + "x",
    "await x",
    "yield x",
    "x; v",
    "x\n\nimport os",
    "x #",
    "",
    "  ",
]


@pytest.mark.parametrize("text", FORBIDDEN, ids=[t[:24] for t in FORBIDDEN])
def test_what_is_not_on_the_list_is_refused(text: str) -> None:
    if text == "x #":
        assert names_in(parse(text)) == {"x"}  # a comment, as in YAML: it does nothing
        return
    with pytest.raises(ModelError):
        formula(parse(text), Scope(FORMULAS, {name: sympy.Symbol(name) for name in NAMES}))


def test_conditions_are_exact_at_their_limits() -> None:
    for text, want in {
        "where(x > 1, 1, 2)": 2,
        "where(x >= 1, 1, 2)": 1,
        "where(x < 1, 1, 2)": 2,
        "where(x <= 1, 1, 2)": 1,
        "where(0 < x <= 1, 1, 2)": 1,
        "where(0 < x < 1, 1, 2)": 2,
        "where(x > 1 or x >= 1, 1, 2)": 1,
        "where(x >= 1 and not x > 1, 1, 2)": 1,
        "where(not (x >= 1), 1, 2)": 2,
    }.items():
        assert number_of(text, {"x": 1.0}) == want, text


RANDOM_MODEL = {
    "name": "random",
    "states": ["x", "v"],
    "period": "2*pi/a",
    "parameters": {"a": 0.7, "b": 1.3},
    "surfaces": {"stop": {"observable": "v"}, "w": {"observable": "w"}},
    "stop_surface": "stop",
}
EVERY = np.arange(2, dtype=np.int64)


@settings(deadline=None, max_examples=3, derandomize=True)
@given(expressions, expressions)
def test_compiled_fields_of_random_models(rate: str, observable: str) -> None:
    """Compiled values and derivatives, second ones inside the rate, against 60 digits."""
    data = {
        **RANDOM_MODEL,
        "observables": {"w": observable},
        "modes": {"all": {"field": {"x": "v", "v": rate}}},
    }
    module = load_module(describe(data).text)
    rng = np.random.default_rng(5)
    for _ in range(3):
        t, y, p = rng.uniform(0, 3), rng.uniform(-2, 2, 2), rng.uniform(0.5, 2, 2)
        out, jac = np.empty(2), np.empty((2, 5))
        module.field_of(0, t, y, p, EVERY, out, jac)
        grad = np.empty(5)
        value = module.observe(0, t, y, p, EVERY, grad)
        rated = np.empty(5)
        module.rate(0, 0, t, y, p, EVERY, rated)
        with mpmath.workdps(60):
            place = [mpmath.mpf(float(z)) for z in (*y, t, *p)]
            step, wide = mpmath.mpf(10) ** -18, mpmath.mpf(10) ** -9

            def along(point: list[object], step: object = step) -> list[object]:
                v, f = point[1], many_digits(rate, point)
                ends = [
                    many_digits(
                        observable,
                        [z + h * d for z, d in zip(point, (v, f, 1, 0, 0), strict=True)],
                    )
                    for h in (step, -step)
                ]
                return [(ends[0] - ends[1]) / (2 * step)]

            exact = slopes(lambda q: [many_digits(rate, q)], place, [step] * len(place))[0]
            exact_grad = slopes(lambda q: [many_digits(observable, q)], place, [step] * len(place))[
                0
            ]
            exact_rate = slopes(along, place, [wide] * len(place))[0]
            order = [2, 0, 1, 3, 4]  # t, x, v, a, b
            assert out[1] == pytest.approx(float(many_digits(rate, place)), rel=1e-9, abs=1e-9)
            assert value == pytest.approx(float(many_digits(observable, place)), rel=1e-9, abs=1e-9)
            for have, want in ((jac[1], exact), (grad, exact_grad), (rated, exact_rate)):
                wanted = np.array([float(want[i]) for i in order])
                size = 1.0 + float(np.abs(wanted).max())
                np.testing.assert_allclose(have, wanted, rtol=1e-7, atol=1e-7 * size)


def test_symbols_say_what_they_have() -> None:
    y = Symbols("state", {"x": 1, "v": 2})
    assert (y.x, y["v"], list(y)) == (1, 2, [1, 2])
    with pytest.raises(ModelError, match=r"did you mean 'v'"):
        _ = y.vw


@pytest.mark.parametrize("seed", range(2))
def test_what_vanishes_is_told(seed: int) -> None:
    """Products written out, and sums of angles: they vanish less themselves, and not by a millionth."""
    rng = random.Random(seed)
    x, y, z = sympy.symbols("s0 s1 p0")
    a, b = (rng.choice((x, y, z, x * y, y - z)) for _ in range(2))
    k = sympy.Rational(rng.randint(-9, 9), rng.randint(1, 9))
    same = (
        sympy.expand((a + k * b) ** 3) - (a + k * b) ** 3,
        sympy.sin(a + b) - sympy.sin(a) * sympy.cos(b) - sympy.cos(a) * sympy.sin(b),
        sympy.sqrt(x**2 + 1) ** 4 - (x**2 + 1) ** 2,
        (a**2 - b**2) / (x + 3) - (a - b) * (a + b) / (x + 3),
    )
    assert all(vanishes(e) for e in same)
    assert not any(vanishes(e + sympy.Rational(1, 10**6) * rng.choice((x, y, z, 1))) for e in same)


@pytest.mark.parametrize("seed", range(5))
def test_a_factor_of_parameters_hides_no_kink(seed: int) -> None:
    """``sat(q*h)`` between surfaces h = 1/q and -1/q, q of parameters, of either sign, in all modes."""
    rng = random.Random(seed)
    factor, level = rng.choice([("1/a", "a"), ("b/a", "a/b"), ("2*b", "1/(2*b)"), ("-1/a", "-a")])
    h = rng.choice(["x - c*sin(t)", "v + c*x", "x*v - c"])
    sat = rng.choice([f"min(1, max(-1, ({h})*({factor})))", f"max(-1, min(1, ({factor})*({h})))"])
    negative = factor.startswith("-")
    data = {
        "name": "saturated",
        "states": ["x", "v"],
        "parameters": {"a": -0.4 if negative else 0.4, "b": 1.3, "c": 0.7},
        "period": "2*pi",
        "surfaces": {
            "up": {"observable": h, "level": level},
            "low": {"observable": h, "level": f"-({level})"},
        },
        "field": {"x": "v", "v": f"-x - {sat} - abs(c*({h} - ({level})))/c"},
        "modes": {
            "above": {"in": {"up": "+"}},
            "within": {"in": {"up": "-", "low": "+"}},
            "below": {"in": {"low": "-"}},
        },
    }
    description = describe(data)
    formulas = Formulas(description)
    moving = (formulas.t, *formulas.y)
    assert not any(kinks_in(f, moving) for field in formulas.fields for f in field)
    module, values = load_module(description.motion), [p.default for p in description.parameters]
    surfaces = {s.name: s for s in description.surfaces}
    for _ in range(20):
        t, y = rng.uniform(0, 6), np.array([rng.uniform(-2, 2), rng.uniform(-2, 2)])
        named = dict(zip(("t", "x", "v", "a", "b", "c"), (t, *y, *values), strict=True))
        scope = Scope(FLOATS, named, {})
        height = scope.evaluate(parse(h))
        sides = {n: height > scope.evaluate(parse(s.level)) for n, s in surfaces.items()}
        mode = 0 if sides["up"] else 1 if sides["low"] else 2
        names = [m.name for m in description.modes]
        k, out = names.index(("above", "within", "below")[mode]), np.empty(2)
        module.field_of(k, t, y, np.array(values), EVERY[:0], out, np.empty((0, 0)))
        assert out[1] == pytest.approx(scope.evaluate(parse(data["field"]["v"])), abs=1e-12)
