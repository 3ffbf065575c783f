"""Compiled values and derivatives against the formulas themselves.

The formulas of a described model are evaluated in 60 digits, straight from their text, and differentiated by
differences: neither sympy nor the generated code takes part. A model without a description is held against
differences of its own compiled functions, in ordinary numbers.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

import mpmath
import numpy as np

from contfric.errors import ParameterError
from contfric.models.build import field_of
from contfric.models.check.digits import DIGITS, digits, slopes
from contfric.models.check.probe import Probe
from contfric.models.check.report import ModelReport, Topic
from contfric.models.definition import FloatArray, Model
from contfric.models.describe import from_text
from contfric.models.evaluate import Evaluator

#: States per function: a wrong formula is wrong almost everywhere.
_STATES = 5
#: Steps of a difference and of a difference of differences, in 60 digits: right to 1e-18.
_INNER, _OUTER = mpmath.mpf(10) ** -18, mpmath.mpf(10) ** -9
#: Rounding of compiled formulas, relative to the largest number among those compared.
_SAME = 1e-9
#: The same for differences in ordinary numbers, and their step (the cube root of the rounding error).
_COARSE, _COARSE_STEP = 1e-5, 6e-6

Jacobian = tuple[FloatArray, FloatArray]
#: Returns the points at which the functions of a mode (None: of all states) are compared.
Points = Callable[[str | None], list[FloatArray]]
#: Fields in many digits that are kept: those at the points of the differences of one mode.
_KEPT = 256


@dataclass(frozen=True)
class Case:
    """One compiled function of (t, state, parameters), and its formula.

    ``compiled`` returns values (m,) and derivatives (m, variables) at a point; ``formula`` the values.
    ``mode`` is the mode whose states it is compared at, None for all states.
    """

    what: str
    compiled: Callable[[FloatArray], Jacobian]
    formula: Callable[[list[Any]], list[Any]]
    mode: str | None = None
    step: Any = _INNER


def check_derivatives(report: ModelReport, probe: Probe) -> None:
    """Compare every compiled function with its formula, or with its own differences."""
    model = probe.model
    near = Probe(model, _nearby(model, probe))
    points = cache(lambda mode: list(_points(near, mode)))  # looked for among many states
    _rates_along(report, near, points)
    for case in _described(near) if model.definition else _closed(near):
        has_value = [
            _compare(report, model, case, point, bool(model.definition))
            for point in points(case.mode)
        ]
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
    found = 0
    for t, y in probe.states(400):
        place = (t, y) if mode is None else probe.inside(mode, t, y)
        if place is None:
            continue
        yield np.array([place[0], *place[1], *probe.vector])
        found += 1
        if found == (_STATES if mode is None else probe.share(_STATES)):
            return


def _compare(
    report: ModelReport, model: Model, case: Case, point: FloatArray, described: bool
) -> bool:
    """Compare at one point; return whether the formula has a value there."""
    names = ["t", *model.states, *model.parameter_names]
    values, jac = case.compiled(point)
    if described:
        with mpmath.workdps(DIGITS):
            place = [mpmath.mpf(float(x)) for x in point]
            try:
                exact = np.array([float(v) for v in case.formula(place)])
                # relative to a small variable: an inertia of 1e-5, a capacity
                steps = [case.step * (min(1, abs(x)) or 1) for x in place]
                slope = np.array(slopes(case.formula, place, steps), dtype=np.float64)
            except (TypeError, ValueError, ArithmeticError):
                return False
    else:
        exact = values
        steps = [_COARSE_STEP] * len(point)
        slope = np.array(slopes(lambda p: list(case.compiled(np.array(p))[0]), list(point), steps))
    tolerance = _SAME if described else _COARSE
    scale = 1.0 + max(np.abs(exact).max(), np.abs(slope).max())
    report.count(Topic.DERIVATIVES)
    wrong = np.abs(values - exact) > tolerance * scale
    if wrong.any() or not np.isfinite(values).all():
        report.error(
            Topic.DERIVATIVES,
            f"{case.what}: compiled {values.tolist()}, the formula gives {exact.tolist()} at "
            f"{_shown(names, point)}",
        )
        return True
    off = ~(np.abs(jac - slope) <= tolerance * scale)
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


# -------------------------------------------------------------------- models with a description


def _described(probe: Probe) -> list[Case]:
    model, description = probe.model, from_text(probe.model.definition)
    exact, field = digits(description), field_of(model)
    split = _Split(model)
    fields = lru_cache(maxsize=_KEPT)(_Fields(split, exact))
    found = [_observable(split, exact, o.name, c) for c, o in enumerate(model.observables)]
    for m, mode in enumerate(model.modes):
        found.append(_field(split, exact, field, mode.name, m))
        found += [
            _rate(split, exact, fields, (mode.name, m), (o.name, c))
            for c, o in enumerate(model.observables)
        ]
    found += [
        _reset(split, exact, description.resets[s.name], s.name, k)
        for k, s in enumerate(model.surfaces)
        if s.name in description.resets
    ]
    return [*found, *_levels(split, exact, description.period)]


@dataclass(frozen=True)
class _Split:
    """Points taken apart, and compiled functions put together again."""

    model: Model

    @property
    def every(self) -> Any:
        return np.arange(len(self.model.parameters), dtype=np.int64)

    def parts(self, point: Any) -> tuple[Any, Any, Any]:
        n = len(self.model.states)
        return point[0], point[1 : 1 + n], point[1 + n :]

    def named(self, point: Any) -> tuple[Any, Any, dict[str, Any]]:
        t, y, p = self.parts(point)
        return t, y, dict(zip(self.model.parameter_names, p, strict=True))

    def scalar(self, function: Callable[..., float]) -> Callable[[FloatArray], Jacobian]:
        """``function(t, y, p, which, grad)`` as a vector function of one value."""

        def compiled(point: FloatArray) -> Jacobian:
            t, y, p = self.parts(point)
            grad = np.empty(len(point))
            value = function(t, y.copy(), p.copy(), self.every, grad)
            return np.array([value]), grad[None, :]

        return compiled

    def vector(self, function: Callable[..., None]) -> Callable[[FloatArray], Jacobian]:
        """``function(t, y, p, which, out, jac)`` as a vector function."""

        def compiled(point: FloatArray) -> Jacobian:
            t, y, p = self.parts(point)
            out, jac = np.empty(len(y)), np.empty((len(y), len(point)))
            function(t, y.copy(), p.copy(), self.every, out, jac)
            return out, jac

        return compiled

    def of_parameters(self, function: Callable[..., float]) -> Callable[[FloatArray], Jacobian]:
        """``function(p, which, grad)`` as a vector function of one value."""

        def compiled(point: FloatArray) -> Jacobian:
            grad = np.zeros(len(point))
            own = np.empty(len(self.model.parameters))
            value = function(self.parts(point)[2].copy(), self.every, own)
            grad[len(point) - len(own) :] = own
            return np.array([value]), grad[None, :]

        return compiled


def _observable(split: _Split, exact: Evaluator[Any], name: str, c: int) -> Case:
    def formula(point: list[Any]) -> list[Any]:
        t, y, p = split.named(point)
        return [exact.observable(name, p, t, y)]

    observe = split.model.flow.observe
    return Case(f"observable '{name}'", split.scalar(lambda *a: observe(c, *a)), formula)


def _field(split: _Split, exact: Evaluator[Any], field: Any, name: str, m: int) -> Case:
    def formula(point: list[Any]) -> list[Any]:
        t, y, p = split.named(point)
        return exact.field(name, p, t, y)

    what = f"field of mode '{name}'"
    return Case(what, split.vector(lambda *a: field(m, *a)), formula, name)


@dataclass(frozen=True)
class _Fields:
    """Fields in many digits, at points: the rates of all observables of a mode need the same ones."""

    split: _Split
    exact: Evaluator[Any]

    def __call__(self, mode: str, *point: Any) -> list[Any]:
        t, y, p = self.split.named(point)
        return self.exact.field(mode, p, t, y)


def _rate(
    split: _Split,
    exact: Evaluator[Any],
    fields: Callable[..., list[Any]],
    mode_at: tuple[str, int],
    observable_at: tuple[str, int],
) -> Case:
    (mode, m), (observable, c) = mode_at, observable_at

    def formula(point: list[Any]) -> list[Any]:
        t, y, p = split.named(point)
        velocity = [mpmath.mpf(1), *fields(mode, *point)]

        def along(h: Any) -> Any:
            place = [a + h * b for a, b in zip([t, *y], velocity, strict=True)]
            return exact.observable(observable, p, place[0], place[1:])

        return [(along(_INNER) - along(-_INNER)) / (2 * _INNER)]

    rate = split.model.flow.rate
    what = f"rate of '{observable}' in mode '{mode}'"
    return Case(what, split.scalar(lambda *a: rate(m, c, *a)), formula, mode, _OUTER)


def _reset(split: _Split, exact: Evaluator[Any], texts: Any, surface: str, k: int) -> Case:
    def formula(point: list[Any]) -> list[Any]:
        t, y, p = split.named(point)
        return [exact.value(texts.get(s, s), p, t, y) for s in split.model.states]

    reset = split.model.flow.reset
    return Case(f"reset at '{surface}'", split.vector(lambda *a: reset(k, *a)), formula)


def _levels(split: _Split, exact: Evaluator[Any], period: str) -> list[Case]:
    def of(text: str) -> Callable[[list[Any]], list[Any]]:
        return lambda point: [exact.value(text, split.named(point)[2])]

    flow, found = split.model.flow, []
    for k, surface in enumerate(split.model.surfaces):
        compiled = split.of_parameters(lambda *a, k=k: flow.level(k, *a))
        found.append(Case(f"level of surface '{surface.name}'", compiled, of(surface.level)))
    compiled = split.of_parameters(flow.period)
    return [*found, Case("period", compiled, of(period or "0"))]


# ----------------------------------------------------------------- models of compiled functions


def _closed(probe: Probe) -> list[Case]:
    model, split = probe.model, _Split(probe.model)
    flow, none = model.flow, list
    found = []
    for c, o in enumerate(model.observables):
        compiled = split.scalar(lambda *a, c=c: flow.observe(c, *a))
        found.append(Case(f"observable '{o.name}'", compiled, none))
        for m, mode in enumerate(model.modes):
            compiled = split.scalar(lambda *a, m=m, c=c: flow.rate(m, c, *a))
            what = f"rate of '{o.name}' in mode '{mode.name}'"
            found.append(Case(what, compiled, none, mode.name))
    for k, surface in enumerate(model.surfaces):
        compiled = split.of_parameters(lambda *a, k=k: flow.level(k, *a))
        found.append(Case(f"level of surface '{surface.name}'", compiled, none))
    return [*found, Case("period", split.of_parameters(flow.period), none)]
