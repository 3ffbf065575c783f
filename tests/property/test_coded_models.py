"""Models whose formulas are tables of numbers: the same functions as those of generated code."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from by_scipy import misses

import contfric as cf
from contfric.errors import ModelError
from contfric.models.generated.build import load_module
from contfric.models.generated.formula_tables import Forms, forms_of
from contfric.models.generated.table_flow import CodedFlow
from contfric.models.language.coefficients import AFFINE, Affine, symbols
from contfric.models.language.grammar import FLOATS, Scope, parse
from contfric.models.language.not_affine import NotAffineError
from contfric.simulation.simulate import simulate
from contfric.simulation.tables import tables

#: Affine models of all kinds: sliding, impacts, clocks in SI units, resets to another mode, relays.
MODELS = (
    *("coulomb-yaml", "impact", "impact-friction", "buck", "relay-sliding"),
    *("thermostat", "dead-band", "jenkins", "rocking-block"),
)
POINTS = 12


def flows(name: str) -> tuple[cf.Model, Any, Any]:
    model = cf.load_model(name)
    coded = CodedFlow(Forms(model.description)).flow
    return model, coded, load_module(model.definition).compiled_flow(1e-12)


def close(a: Any, b: Any, within: float = 1e-12) -> None:
    a, b = np.asarray(a), np.asarray(b)
    scale = (
        np.maximum(1.0, np.abs(b))
        if b.ndim == 0
        else max(1.0, float(np.max(np.abs(b), initial=0.0)))
    )
    assert np.all(np.abs(a - b) <= within * scale)


@pytest.mark.parametrize("name", MODELS)
def test_tables_and_code_are_the_same_functions(name: str) -> None:
    model, coded, generated = flows(name)
    rng, vector = np.random.default_rng(1), model.vector({})
    n, every = len(model.states), np.arange(len(vector))
    widths = model.spread(model.mapping(vector))
    for _ in range(POINTS):
        p = vector * (1.0 + 0.1 * rng.uniform(size=len(vector)))
        unit = generated.period(p, every, np.empty(len(vector))) or model.defaults.get("Ts", 3.0)
        t, y, dt = (
            rng.uniform(0.0, 2.0 * unit),
            widths * rng.normal(size=n),
            unit * rng.uniform(0.1, 1.0),
        )
        for m, c in itertools.product(range(len(model.modes)), range(len(model.observables))):
            both = [_along(flow, m, c, t, y, dt, p, every) for flow in (coded, generated)]
            for a, b in zip(*both, strict=True):
                close(a, b)
            close(*(_stationary(flow, m, c, t, y, dt, p) for flow in (coded, generated)), 1e-9)
        for k, surface in enumerate(model.surfaces):
            both = [_of_surface(flow, k, t, y, p, every) for flow in (coded, generated)]
            for a, b in zip(*both, strict=True):
                close(a, b)
            if surface.name in model.reset_by_surface:
                images = [_reset(flow, k, t, y, p, every) for flow in (coded, generated)]
                close(*images)


def _along(flow: Any, m: int, c: int, t: float, y: Any, dt: float, p: Any, every: Any) -> list[Any]:
    """Return all that a flow says of a mode and an observable; derivatives times what they are by."""
    n, count = len(y), len(p)
    end, jac = np.empty(n), np.zeros((n, 2 + n + count))
    flow.flow(m, t, y, dt, p, every, end, jac)
    grad, rate_grad, at = np.zeros(1 + n + count), np.zeros(1 + n + count), np.empty(n)
    value, rate = flow.observe(c, t, y, p, every, grad), flow.rate(m, c, t, y, p, every, rate_grad)
    hit = flow.hit(m, c, 0.9 * value + 0.01, False, t, y, dt, p, at)
    by = np.array([dt, *np.ones(n), dt, *p])
    seen = np.delete(by, 1 + n)
    return [
        end,
        jac * by,
        value,
        grad * seen,
        rate * dt,
        rate_grad * seen * dt,
        hit,
    ]


def _stationary(flow: Any, m: int, c: int, t: float, y: Any, dt: float, p: Any) -> Any:
    """Return the number of stationary points, and their times: as sharp as the rate is steep there."""
    times, values = np.zeros(64), np.zeros(64)
    found = flow.stationary(m, c, t, y, dt, p, times, values)
    return np.array([found, *times / dt])


def _of_surface(flow: Any, k: int, t: float, y: Any, p: Any, every: Any) -> list[Any]:
    grad, by = np.zeros(len(p)), np.zeros(len(p))
    return [flow.level(k, p, every, grad), grad, flow.period(p, every, by), by]


def _reset(flow: Any, k: int, t: float, y: Any, p: Any, every: Any) -> Any:
    after, jac = np.empty(len(y)), np.zeros((len(y), 1 + len(y) + len(p)))
    flow.reset(k, t, y, p, every, after, jac)
    return np.column_stack([after, jac])


# ------------------------------------------------------------------------------- coefficients

EXPRESSIONS = (
    "2*k*x - c/k*v + cos(beta)*cos(Omega*t + beta)",
    "(k + c)**3*x/(1 + c) - sqrt(k)*sin(2*Omega*t)*cos(Omega*t)",
    "min(k, c)*v + max(k, 1.5)*cos(Omega*t)**3 + exp(-c)*x/k**2",
    "where(k > c, x, v) - atan(k*c)*(x - v)/2 + k**c*sin(beta - Omega*t)",
    "abs(c - k)*x + sign(k - c)*v - tanh(c) + log(k)*cos(-3*Omega*t)",
)
STATES, PARAMETERS = ("x", "v"), ("k", "c", "beta", "Omega")


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_an_expression_and_its_affine_form_have_the_same_values(text: str) -> None:
    form = Scope(AFFINE, symbols(STATES, PARAMETERS)).evaluate(parse(text))
    rng = np.random.default_rng(3)
    for _ in range(20):
        drawn = map(float, rng.uniform(0.2, 2.5, 7))
        values = dict(zip((*STATES, *PARAMETERS, "t"), drawn, strict=True))
        exact = Scope(FLOATS, dict(values)).evaluate(parse(text))
        assert _value(form, values) == pytest.approx(exact, rel=1e-12, abs=1e-12)


def _value(form: Affine, values: dict[str, float]) -> float:
    total = 0.0
    for (kind, which), c in form.parts.items():
        by = _coefficient(c, values)
        if kind == "y":
            by *= values[STATES[which]]
        elif kind in ("cos", "sin"):
            by *= getattr(math, kind)(_coefficient(which, values) * values["t"])
        total += by
    return total


def _coefficient(c: Any, values: dict[str, float]) -> float:
    return sum(w * math.prod(_atom(a, values) ** k for a, k in product) for product, w in c.parts)


def _atom(atom: Any, values: dict[str, float]) -> float:
    if not atom.of:
        return values[atom.name]
    given = [_coefficient(c, values) for c in atom.of]
    if atom.name == "where":
        return given[1] if given[0] > 0.0 else given[2]
    if atom.name in ("inverse", "power"):
        return 1.0 / given[0] if atom.name == "inverse" else given[0] ** given[1]
    return FLOATS.functions[atom.name](given[0])


@pytest.mark.parametrize(
    "text", ["x*v", "x**2", "sin(x)", "t*x", "1/x", "sin(t**2)", "exp(t)", "abs(x)"]
)
def test_what_is_not_affine_is_refused(text: str) -> None:
    with pytest.raises(NotAffineError):
        Scope(AFFINE, symbols(STATES, PARAMETERS)).evaluate(parse(text))


# ----------------------------------------------------------------------------- many contacts


def chain(count: int, contacts: int) -> dict[str, Any]:
    """Masses in a row, the first of them with friction: static limit above the kinetic one."""
    numbers = range(1, count + 1)
    define = {}
    for i in numbers:
        force = f"-k*x{i}" + (f" - k*(x{i} - x{i - 1})" if i > 1 else "")
        force += f" - k*(x{i} - x{i + 1})" if i < count else ""
        define[f"g{i}"] = force + (" + cos(Omega*t)" if i == 1 else "")
    surfaces: dict[str, Any] = {}
    for i in range(1, contacts + 1):
        surfaces[f"v{i}"] = {"observable": f"v{i}", "level": "0"}
        surfaces |= {f"F{i}{s}": {"observable": f"u{i}", "level": f"{s}S0"} for s in "+-"}
    modes = {}
    for states in itertools.product("+-0", repeat=contacts):
        inside, field = {}, {}
        for i in numbers:
            state = states[i - 1] if i <= contacts else ""
            rest = state == "0"
            inside |= {f"v{i}": state} if state else {}
            inside |= {f"F{i}+": "-", f"F{i}-": "+"} if rest else {}
            friction = {"+": " - S", "-": " + S"}.get(state, "")
            field |= {f"x{i}": "0" if rest else f"v{i}"}
            field |= {f"v{i}": "0" if rest else f"g{i} - c*v{i}{friction}"}
        name = "m" + "".join({"+": "p", "-": "n", "0": "s"}[s] for s in states)
        modes[name] = {"in": inside, "field": field}
    states = [f"{x}{i}" for x in "xv" for i in numbers]
    return {
        "name": f"chain-{count}",
        "states": states,
        "parameters": {"Omega": 0.9, "S": 0.25, "S0": 0.3, "k": 1.0, "c": 0.02},
        "constraints": ["Omega > 0", "S0 >= S"],
        "period": "2*pi/Omega",
        "define": define,
        "observables": {f"u{i}": f"g{i}" for i in range(1, contacts + 1)},
        "surfaces": surfaces,
        "modes": modes,
        "spread": dict.fromkeys(states, "2"),
    }


@pytest.fixture(scope="module")
def three() -> cf.Model:
    from contfric.models.reading.files import from_data

    return from_data(chain(4, 3))


def test_a_model_of_many_modes_is_not_compiled(three: cf.Model) -> None:
    assert forms_of(three.definition) is not None
    assert three.integrated == {}
    assert len(three.modes) == 27 + 1  # the phase divides the one in which all contacts stick


def test_its_orbit_is_that_of_the_equations(three: cf.Model) -> None:
    """Each segment by scipy's integrator, from the expressions: nothing of the tables is used."""
    orbit = cf.find_orbit(three, three.defaults)
    evaluator_fields = {m.name: m.field for m in three.description.modes}
    names = three.description.names

    def field_of(mode: str) -> Any:
        def rates(t: float, y: Any) -> list[float]:
            values = {**orbit.params, "t": t, **dict(zip(three.states, map(float, y), strict=True))}
            scope = names.scope(FLOATS, values)
            return [scope.evaluate(parse(text)) for text in evaluator_fields[mode]]

        return rates

    assert misses(orbit, field_of) < 1e-8
    assert len({mode for mode, _ in orbit.itinerary}) >= 6


# --------------------------------------------------------------------------------------- rules


@pytest.mark.parametrize("name", ["coulomb", "belt", "dead-band", "impact-friction", "pendulum"])
def test_the_rules_say_what_the_transitions_say(name: str) -> None:
    model = cf.load_model(name)
    table, asked = tables(model), 0
    for domain in model.domains:
        for k, surface in enumerate(model.surfaces):
            if surface.name in model.reset_by_surface:
                continue
            code = sum(
                1 << j for j, s in enumerate(model.surfaces) if j != k and domain.signs[s.name] > 0
            )
            place = model.mode_index[domain.own_mode] * len(model.surfaces) + k
            rows = table.rules[table.first[place] : table.first[place + 1]]
            follows = next((int(to) for mask, value, to in rows if code & mask == value), -1)
            target = model.transitions.get((domain.name, surface.name))
            wanted = (
                -1 if target is None else model.mode_index[model.domain_by_name[target].own_mode]
            )
            assert follows == wanted
            asked += wanted >= 0
    assert asked >= 8


def test_too_many_surfaces_are_refused() -> None:
    lines = {f"line{i}": {"observable": "x", "level": str(i)} for i in range(70)}
    data = {
        "name": "many",
        "states": ["x", "v"],
        "parameters": {"k": 1.0},
        "autonomous": True,
        "surfaces": lines,
        "modes": {"only": {"in": {}, "field": {"x": "v", "v": "-k*x"}}},
    }
    from contfric.models.reading.files import from_data

    with pytest.raises(ModelError, match="has 70 surfaces, a simulation takes 62"):
        simulate(from_data(data), {}, state=[1.0, 0.0])
