"""One condition of a fit: the orbit, or the event, of some data, and its predictions.

A condition is solved from where it was in the last trial, and by a simulation where that fails, so that
signatures may change on the way. It depends on nothing else: any process can solve it, to the same bits.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor, Future
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeAlias

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.curves.sensitivity.gradient import slope_of
from contfric.curves.sensitivity.moved_event import moved_event
from contfric.errors import ContfricError
from contfric.events.bifurcation import Bifurcation
from contfric.fitting.data import Jump, Measured, Series
from contfric.fitting.predict import predicted
from contfric.models.definition import Model
from contfric.orbit.finding.find import find_orbit
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine
from contfric.quantities.registry import quantity_of
from contfric.remember.journal import remembered

Datum: TypeAlias = Measured | Series | Jump
Near: TypeAlias = Orbit | Bifurcation | None


class Prediction(NamedTuple):
    """What a condition says to its data.

    Attributes
    ----------
    near : its orbit or event, from which the next trial starts
    residuals : of each datum, in standard deviations
    slopes : their derivatives by the free parameters, shape (values, free)
    """

    near: Orbit | Bifurcation
    residuals: tuple[FloatArray, ...]
    slopes: tuple[FloatArray, ...]

    @property
    def orbit(self) -> Orbit:
        """The orbit, that of the event for a jump."""
        return self.near.orbit if isinstance(self.near, Bifurcation) else self.near


@dataclass(frozen=True, eq=False)
class FitCondition:
    """Data that were measured at the same parameters; a jump is one by itself.

    Attributes
    ----------
    model : Model
    data : what was measured there
    free : names of the free parameters
    """

    model: Model
    data: tuple[Datum, ...]
    free: tuple[str, ...]

    def answer(self, params: Mapping[str, float], near: Near) -> Prediction:
        """Solve it at some parameters, from where it was.

        Raises
        ------
        ContfricError
            If there is no orbit or no event.
        """
        first = self.data[0]
        params = {**params, **first.params}
        return (
            self._of_jump(first, params, near)
            if isinstance(first, Jump)
            else self._of_orbit(params, near)
        )

    def _of_jump(self, jump: Jump, params: Mapping[str, float], near: Near) -> Prediction:
        values = self.model.mapping(self.model.vector({**params, jump.parameter: jump.value}))
        event = moved_event(near if isinstance(near, Bifurcation) else jump.event, values)
        by_free = np.array([[slope_of(event, jump.parameter, name) for name in self.free]])
        missed = np.array([event.params[jump.parameter] - jump.value])
        return Prediction(event, (missed / jump.sigma,), (by_free / jump.sigma,))

    def _of_orbit(self, params: Mapping[str, float], near: Near) -> Prediction:
        orbit = self._refined(params, near)
        if orbit is not None:
            return self._compared(orbit)
        orbit = find_orbit(self.model, params)
        images = [orbit]
        if self.model.symmetry is not None and not orbit.symmetric:
            # a simulation finds one of two images by chance: the data say which of them was measured
            images.append(orbit.mirror())
        return min(
            map(self._compared, images), key=lambda a: sum(float(r @ r) for r in a.residuals)
        )

    def _refined(self, params: Mapping[str, float], near: Near) -> Orbit | None:
        if not isinstance(near, Orbit):
            return None
        refined = refine(replace(near, vector=self.model.vector(params)))
        fits = refined.converged and refined.admissible and refined.stable
        return refined if fits else None

    def _compared(self, orbit: Orbit) -> Prediction:
        columns = [self.model.index_of(name) for name in self.free]
        residuals, slopes = [], []
        for datum in self.data:
            assert not isinstance(datum, Jump)
            values, by_all = predicted(datum, orbit)
            measured = datum.values if isinstance(datum, Series) else datum.value
            residuals.append((values - measured) / datum.sigma)
            slopes.append(by_all[:, columns] / datum.sigma)
        return Prediction(orbit, tuple(residuals), tuple(slopes))


def attempt(condition: FitCondition, params: Mapping[str, float], near: Near) -> Prediction | None:
    """Solve a condition in a worker; None where it fails, which the caller finds again, with the reason."""
    try:
        return condition.answer(params, near)
    except ContfricError:
        return None


@remembered(without=("executor",))
def answers_of(
    conditions: tuple[FitCondition, ...],
    params: Mapping[str, float],
    near: tuple[Near, ...],
    executor: Executor | None,
) -> list[Prediction]:
    """Return what the conditions say at some parameters; what an executor does not solve is solved here.

    Raises
    ------
    ContfricError
        If one of them has no orbit.
    """
    pairs = list(zip(conditions, near, strict=True))
    asked = [_submitted(executor, condition, params, last) for condition, last in pairs]
    return [
        _result(future) or condition.answer(params, last)
        for (condition, last), future in zip(pairs, asked, strict=True)
    ]


def _submitted(
    executor: Executor | None, condition: FitCondition, params: Mapping[str, float], near: Near
) -> Future[Prediction | None] | None:
    if executor is None:
        return None
    try:
        return executor.submit(attempt, condition, dict(params), near)
    except RuntimeError:  # it was shut down, or is broken
        return None


def _result(future: Future[Prediction | None] | None) -> Prediction | None:
    """Return what a worker has found; None if that is nothing, or was lost with its worker."""
    try:
        return None if future is None else future.result()
    except Exception:  # executors of others raise errors of their own
        return None


def conditions_of(
    model: Model, data: tuple[Datum, ...], free: tuple[str, ...]
) -> list[tuple[FitCondition, list[int]]]:
    """Return the conditions of some data, each with the numbers of its data."""
    groups: dict[tuple[object, ...], list[int]] = {}
    for k, datum in enumerate(data):
        own = (k,) if isinstance(datum, Jump) else ()
        values = sorted((str(name), float(value)) for name, value in datum.params.items())
        groups.setdefault((*own, *values), []).append(k)
    asked = [_with_function(datum, model) for datum in data]
    return [
        (FitCondition(model, tuple(asked[k] for k in numbers), free), numbers)
        for numbers in groups.values()
    ]


def _with_function(datum: Datum, model: Model) -> Datum:
    """Return a datum with the function itself that it names: what is kept of it depends on its code."""
    if not isinstance(datum, Measured):
        return datum
    function = quantity_of(datum.quantity, model).function
    return datum if function is None else replace(datum, quantity=function)
