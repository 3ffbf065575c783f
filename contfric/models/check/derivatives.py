"""Compiled values and derivatives against the formulas themselves.

The formulas of a described model are evaluated in 60 digits, straight from their text, and differentiated by
differences: neither sympy nor the generated code takes part.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

import mpmath
import numpy as np

from contfric.base.arrays import FloatArray
from contfric.errors import ParameterError
from contfric.models.check.probe import Probe, field_of
from contfric.models.check.report import ModelReport, Topic
from contfric.models.definition import Model
from contfric.models.described.description import Description
from contfric.models.described.evaluate import Evaluator
from contfric.models.language.grammar import UNARY, Algebra
from contfric.models.tied import declaration

#: States per function: a wrong formula is wrong almost everywhere.
_STATES = 5
#: Steps of a difference and of a difference of differences, in 60 digits: right to 1e-18.
_INNER, _OUTER = mpmath.mpf(10) ** -18, mpmath.mpf(10) ** -9
#: Rounding of compiled formulas, relative to the largest number among those compared.
_SAME = 1e-9

Jacobian = tuple[FloatArray, FloatArray]
Compiled = Callable[[FloatArray], Jacobian]
Formula = Callable[[list[Any]], list[Any]]
#: Returns the points at which the functions of a mode (None: of all states) are compared.
Points = Callable[[str | None], list[FloatArray]]
#: Fields in many digits that are kept: those at the points of the differences of one mode.
_KEPT = 256
#: Enough for differences of differences with 15 good digits.
DIGITS = 60

MANY_DIGITS: Algebra[Any] = Algebra(
    number=mpmath.mpf,
    functions={
        **{name: getattr(mpmath, name) for name in UNARY if name not in ("abs", "sign")},
        "abs": abs,
        "sign": mpmath.sign,
    },
    where=lambda d, a, b: a if d > 0 else b,
    divide=lambda a, b: a / b,
    power=lambda base, exponent: base**exponent,
    pi=mpmath.pi,
)


@dataclass(frozen=True)
class Case:
    """One compiled function of (t, state, parameters), and its formula.

    ``compiled`` returns values (m,) and derivatives (m, variables) at a point; ``formula`` the values.
    ``mode`` is the mode whose states it is compared at, None for all states. ``names`` are those that the
    formula depends on, in any way.
    """

    what: str
    compiled: Compiled
    formula: Formula
    names: frozenset[str]
    mode: str | None = None
    step: Any = _INNER


def check_derivatives(report: ModelReport, probe: Probe) -> None:
    """Compare every compiled function with its formula; of a model without formulas only rates."""
    model = probe.model
    near = Probe(model, _nearby(model, probe))
    points = cache(lambda mode: list(_points(near, mode)))  # looked for among many states
    _rates_along(report, near, points)
    for case in _cases(near):
        has_value = [_compare(report, model, case, point) for point in points(case.mode)]
        if not all(has_value):
            report.warn(
                Topic.DERIVATIVES,
                f"{case.what} has no real value at {has_value.count(False)} of {len(has_value)} states: "
                "keep the formula defined in the whole region, or make 'spread' smaller",
            )


def _rates_along(report: ModelReport, probe: Probe, points: Points) -> None:
    """Compare the rate of each observable with its gradient along the field of the flow."""
    for mode in probe.model.modes:
        for point in points(mode.name):
            t, y = float(point[0]), point[1 : 1 + len(probe.model.states)].copy()
            velocity = np.array([1.0, *probe.field(mode.name, t, y)])
            for surface in probe.model.surfaces:
                report.count(Topic.DERIVATIVES)
                rate = probe.rate(mode.name, surface.name, t, y)
                along = float(probe.slope(surface.name, t, y) @ velocity)
                if not abs(rate - along) <= _SAME * (1.0 + np.abs(velocity).max()):
                    report.error(
                        Topic.DERIVATIVES,
                        f"the rate of '{surface.observable}' in mode '{mode.name}' is compiled as "
                        f"{rate:.12g}, its gradient along the flow gives {along:.12g}",
                    )
                    break


def _nearby(model: Model, probe: Probe) -> dict[str, float]:
    """Return parameters near the defaults: terms with a coefficient of zero are seen, too."""
    draw, values = random.Random(probe.seed), model.mapping(probe.vector)
    moved = {
        name: value * (1.0 + 0.1 * draw.random()) + (0.05 * draw.random() if value == 0.0 else 0.0)
        for name, value in values.items()
    }
    try:
        return model.check_params(moved)
    except ParameterError:
        return values


def _points(probe: Probe, mode: str | None) -> Iterator[FloatArray]:
    """Yield (t, state, parameters), in the region of a mode if one is given."""
    places = (
        probe.states(_STATES) if mode is None else probe.places(mode, 400, probe.share(_STATES))
    )
    for t, y in places:
        yield np.array([t, *y, *probe.vector])


def _compare(report: ModelReport, model: Model, case: Case, point: FloatArray) -> bool:
    """Compare at one point; return whether the formula has a value there."""
    names = ["t", *model.states, *model.parameter_names]
    values, jac = case.compiled(point)
    with mpmath.workdps(DIGITS):
        place = [mpmath.mpf(float(x)) for x in point]
        try:
            exact = np.array([float(v) for v in case.formula(place)])
            # relative to a small variable: an inertia of 1e-5, a capacity
            steps = [case.step * (min(1, abs(x)) or 1) for x in place]
            own = [i for i, name in enumerate(names) if name in case.names]
            slope = np.zeros((len(exact), len(point)))
            if own:  # by what does not occur the derivative is 0
                slope[:, own] = np.array(slopes(case.formula, place, steps, own), dtype=np.float64)
        except (TypeError, ValueError, ArithmeticError):
            return False
    scale = 1.0 + max(np.abs(exact).max(), np.abs(slope).max())
    report.count(Topic.DERIVATIVES)
    wrong = np.abs(values - exact) > _SAME * scale
    if wrong.any() or not np.isfinite(values).all():
        report.error(
            Topic.DERIVATIVES,
            f"{case.what}: compiled {values.tolist()}, the formula gives {exact.tolist()} at "
            f"{_shown(names, point)}",
        )
        return True
    off = ~(np.abs(jac - slope) <= _SAME * scale)
    if off.any():
        row, column = (int(i) for i in np.argwhere(off)[0])
        report.error(
            Topic.DERIVATIVES,
            f"{case.what}: its derivative by {names[column]} is compiled as {jac[row, column]:.12g}, "
            f"differences give {slope[row, column]:.12g} at {_shown(names, point)}",
        )
    return True


def _shown(names: list[str], point: FloatArray) -> str:
    return ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, point, strict=True))


# --------------------------------------------------------------------------------------- cases


def _cases(probe: Probe) -> list[Case]:
    """Return the compiled functions of a model, each with its formula; none of a model without formulas."""
    model, declared = probe.model, declaration(probe.model)
    if declared is None:
        return []
    flow, ends, cases = model.flow, model.surfaces, _Cases(model, declared.description)
    found = []
    for c, o in enumerate(model.observables):
        compiled, names = cases.scalar(flow.observe, c), cases.names_of_observable(o.name)
        found.append(Case(f"observable '{o.name}'", compiled, cases.observable(o.name), names))
    for m, mode in enumerate(model.modes):
        found += cases.field(m, mode.name)
        for c, o in enumerate(model.observables):
            what, rate = f"rate of '{o.name}' in mode '{mode.name}'", cases.scalar(flow.rate, m, c)
            formula, names = cases.rate(mode.name, o.name), cases.names_of_rate(mode.name, o.name)
            found.append(Case(what, rate, formula, names, mode.name, _OUTER))
    found += [reset for k, surface in enumerate(ends) for reset in cases.reset(k, surface.name)]
    for k, s in enumerate(ends):
        found.append(cases.of_parameters(f"level of surface '{s.name}'", s.level, flow.level, k))
    period = cases.description.period or "0"
    return [*found, cases.of_parameters("period", period, flow.period)]


class _Cases:
    """Points taken apart, compiled functions put together again, and formulas in many digits."""

    def __init__(self, model: Model, description: Description) -> None:
        self.model, self.description = model, description
        self.exact = digits(description)
        # the rates of all observables of a mode need the same fields
        self._fields = lru_cache(maxsize=_KEPT)(self._field_at)

    @property
    def every(self) -> Any:
        return np.arange(len(self.model.parameters), dtype=np.int64)

    def parts(self, point: Any) -> tuple[Any, Any, Any]:
        n = len(self.model.states)
        return point[0], point[1 : 1 + n], point[1 + n :]

    def scalar(self, function: Callable[..., float], *index: int) -> Compiled:
        """``function(*index, t, y, p, which, grad)`` as a vector function of one value."""

        def compiled(point: FloatArray) -> Jacobian:
            t, y, p = self.parts(point)
            grad = np.empty(len(point))
            value = function(*index, t, y.copy(), p.copy(), self.every, grad)
            return np.array([value]), grad[None, :]

        return compiled

    def vector(self, function: Callable[..., None], *index: int) -> Compiled:
        """``function(*index, t, y, p, which, out, jac)`` as a vector function."""

        def compiled(point: FloatArray) -> Jacobian:
            t, y, p = self.parts(point)
            out, jac = np.empty(len(y)), np.empty((len(y), len(point)))
            function(*index, t, y.copy(), p.copy(), self.every, out, jac)
            return out, jac

        return compiled

    def of_parameters(
        self, what: str, text: str, function: Callable[..., float], *index: int
    ) -> Case:
        """Return ``function(*index, p, which, grad)`` with its formula."""

        def compiled(point: FloatArray) -> Jacobian:
            grad = np.zeros(len(point))
            own = np.empty(len(self.model.parameters))
            value = function(*index, self.parts(point)[2].copy(), self.every, own)
            grad[len(point) - len(own) :] = own
            return np.array([value]), grad[None, :]

        def formula(point: list[Any]) -> list[Any]:
            return [self.exact.value(text, self._at(point)[0])]

        return Case(what, compiled, formula, self.names(text))

    def _at(self, point: Any) -> tuple[dict[str, Any], Any, Any]:
        t, y, p = self.parts(point)
        return dict(zip(self.model.parameter_names, p, strict=True)), t, y

    def _field_at(self, mode: str, *point: Any) -> list[Any]:
        return self.exact.field(mode, *self._at(point))

    def names(self, *texts: str) -> frozenset[str]:
        return frozenset[str]().union(*map(self.description.names.leaves_of, texts))

    def names_of_observable(self, name: str) -> frozenset[str]:
        return self.names(self.exact.formula_of(name))

    def names_of_rate(self, mode: str, observable: str) -> frozenset[str]:
        own = self.names_of_observable(observable)
        rates = zip(self.model.states, self.exact.rates_of(mode), strict=True)
        return own | self.names(*(rate for state, rate in rates if state in own))

    def observable(self, name: str) -> Formula:
        return lambda point: [self.exact.observable(name, *self._at(point))]

    def rate(self, mode: str, observable: str) -> Formula:
        def formula(point: list[Any]) -> list[Any]:
            (p, t, y), velocity = self._at(point), [mpmath.mpf(1), *self._fields(mode, *point)]

            def along(h: Any) -> Any:
                place = [a + h * b for a, b in zip([t, *y], velocity, strict=True)]
                return self.exact.observable(observable, p, place[0], place[1:])

            return [(along(_INNER) - along(-_INNER)) / (2 * _INNER)]

        return formula

    def field(self, m: int, mode: str) -> list[Case]:
        if not self.model.definition:  # its flow has no function for it
            return []
        compiled = self.vector(field_of(self.model), m)
        names = self.names(*self.exact.rates_of(mode))
        what, formula = f"field of mode '{mode}'", lambda point: self._field_at(mode, *point)
        return [Case(what, compiled, formula, names, mode)]

    def reset(self, k: int, surface: str) -> list[Case]:
        if surface not in self.description.resets:
            return []
        texts = self.description.resets[surface]

        def formula(point: list[Any]) -> list[Any]:
            at = self._at(point)
            return [self.exact.value(texts.get(s, s), *at) for s in self.model.states]

        compiled = self.vector(self.model.flow.reset, k)
        names = self.names(*(texts.get(s, s) for s in self.model.states))
        return [Case(f"reset at '{surface}'", compiled, formula, names)]


def digits(description: Description) -> Evaluator[Any]:
    """Return a description in many digits; evaluate within ``mpmath.workdps(DIGITS)``."""
    return Evaluator(description, MANY_DIGITS)


def slopes(
    function: Any, point: list[Any], steps: Sequence[Any], own: Sequence[int] | None = None
) -> list[list[Any]]:
    """Return the derivatives of a vector function by differences, one row a value; a step a variable.

    ``own`` are those of the variables that it is differentiated by, all if left out.
    """
    columns = []
    for i in range(len(point)) if own is None else own:
        ahead, behind, step = list(point), list(point), steps[i]
        ahead[i] += step
        behind[i] -= step
        up, down = function(ahead), function(behind)
        columns.append([(a - b) / (2 * step) for a, b in zip(up, down, strict=True)])
    return [list(row) for row in zip(*columns, strict=True)]
