r"""Parameters from measurements of the steady state.

The weighted residuals :math:`r_i = (Q_i(p) - y_i)/\sigma_i` are functions of the free parameters through
solved periodic orbits, with exact derivatives J. Their sum of squares is minimised by a trust-region
method (``scipy.optimize.least_squares``). At the minimum the covariance of the parameters is :math:`(J^T
J)^{-1}`, to first order, for independent errors of the given standard deviations.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.interrupts import whole
from contfric.base.named import Named
from contfric.chaos.running import Progress, check_executor
from contfric.errors import (
    ContfricError,
    ConvergenceError,
    ParameterError,
    function_of,
    items_of,
    shown,
)
from contfric.fitting.condition import Datum, Near, Prediction, answers_of, conditions_of
from contfric.fitting.data import Jump, Measured, Series
from contfric.fitting.predict import signal_of
from contfric.fitting.result import INTERRUPTED, Fit
from contfric.models import ModelSource, load_model
from contfric.models.definition import Model
from contfric.orbit.orbit import Orbit
from contfric.quantities.inside import Inside
from contfric.quantities.registry import number_quantity
from contfric.remember.folder import kept_in

#: Residual, in standard deviations, of a trial without an orbit: so far off that the step is taken back.
_NO_ORBIT = 1e6
#: Singular value, relative to the largest, below which derivatives depend on each other: orbits and their
#: derivatives are good to 1e-12.
_DEPENDENT = 1e-9
#: Change of the parameters, and of the sum of squares (both relative), at which a fit has converged.
_CONVERGED = 1e-12
#: Sums of squares at the same parameters that differ by more (relative to 1 + the sum) are of two orbits: it
#: grows by 1 over a standard deviation of a parameter.
_SAME = 1e-3
_SEVERAL = (
    "the sum of squares depends on the trial before: there are several orbits at the same parameters, as "
    "where a contact that never slips keeps its offset"
)


def fit(
    model: ModelSource,
    data: Sequence[Measured | Series | Jump],
    params: Mapping[str, float],
    free: Sequence[str],
    *,
    executor: Executor | None = None,
    folder: str | Path | None = None,
    progress: Progress | None = None,
) -> Fit:
    """Find the parameters at which a model's periodic orbits agree best with measurements.

    Ctrl-C ends the search; the best trial until then is returned, with ``complete`` False.

    Parameters
    ----------
    model : str, path or Model
        As for :func:`contfric.load_model`.
    data : sequence of Measured, Series or Jump
        What was measured; each may have parameters of its own, such as the frequency.
    params : dict
        All other parameters, and where the free ones start.
    free : sequence of str
        Which of them are found.
    executor : any :class:`concurrent.futures.Executor`, optional
        Solves conditions side by side. It helps where orbits are expensive: those of the closed form take
        less time than their way to another process.
    folder : path, optional
        Where finished trials are kept; the same call goes on from them.
    progress : callable, optional
        Called with one line of text for each trial.

    Returns
    -------
    Fit
        ``params`` with the fitted values, ``sigma`` with their standard deviations, their ``covariance``, and
        whether the search has ``converged``.

    Raises
    ------
    ParameterError
        If the data, the parameters or the free ones are not valid.
    ConvergenceError
        If there is no periodic orbit at the start, or the data do not determine the free parameters.
    ResultFileError
        If the folder cannot be written, or another version of contfric has written to it.

    Examples
    --------
    >>> import contfric as cf
    >>> data = [cf.Measured("x_max", 1.42, 0.01, {"Omega": w}) for w in (0.5,)]
    >>> found = cf.fit("coulomb", data, {"S": 0.31, "S0": 0.4}, ["S"])
    >>> abs(found.orbits[0].x_max - 1.42) < 1e-9
    True
    """
    model = load_model(model)
    check_executor(executor)
    function_of("progress", progress)
    params = model.given_params(params)
    names, start = check_fit(model, data, params, free)
    problem = _Problem(model, tuple(data), dict(params), names, executor, progress)
    with kept_in(folder):
        problem.solve(start)  # an error here is the user's to see
        success, message = problem.search(start)
    best = problem.best
    assert best is not None
    covariance = _covariance(best.jacobian)
    if covariance is None:
        raise ConvergenceError(
            f"the data do not determine {', '.join(names)}: their derivatives depend on each other",
            best.orbits[0],
        )
    values = Named({**best.orbits[0].params, **problem.values(best.x)})
    return Fit(
        values,
        names,
        problem.data,
        covariance,
        best.residuals,
        best.jacobian,
        best.orbits,
        success,
        message,
    )


def _covariance(jacobian: FloatArray) -> FloatArray | None:
    """Return the covariance of the parameters; None if the data do not determine them."""
    scale = np.linalg.norm(jacobian, axis=0)
    if len(jacobian) < len(scale) or not np.all(scale > 0.0):
        return None
    _, sizes, right = np.linalg.svd(jacobian / scale, full_matrices=False)
    if sizes[-1] < _DEPENDENT * sizes[0]:
        return None
    half = right.T / sizes / scale[:, None]
    return np.asarray(half @ half.T, dtype=np.float64)


def check_fit(
    model: Model, data: object, params: Mapping[str, Any], free: object
) -> tuple[tuple[str, ...], FloatArray]:
    """Return the free parameters and where they start.

    Raises
    ------
    ParameterError
        If that cannot be fitted.
    """
    every = items_of(data)
    if not every or not all(isinstance(d, (Measured, Series, Jump)) for d in every):
        raise ParameterError(
            f"data are a list of contfric.Measured, contfric.Series and contfric.Jump, got {shown(data)}"
        )
    names = items_of(free)
    if not names or len(set(names)) != len(names):
        raise ParameterError(
            f"free is a list of parameters, such as ['S', 'S0'], got {shown(free)}"
        )
    values = model.check_params(params)
    inside = Inside(model)
    for d in every:
        model.check_params({**params, **d.params})
        for name in names:
            model.index_of(name)
            if name in d.params:
                raise ParameterError(f"'{name}' is free, and a measurement gives it a value")
            if isinstance(d, Jump) and name == d.parameter:
                raise ParameterError(f"'{name}' is free, and a jump is measured along it")
        if isinstance(d, Jump):
            _check_jump(model, d)
            continue
        if isinstance(d, Series):
            if model.autonomous:
                raise ParameterError(
                    "a series needs the phase of an excitation: fit quantities of cycles without one"
                )
            signal_of(d.signal, inside)
        else:
            number_quantity(d.quantity, model, "a measurement")
    return tuple(names), np.array([values[name] for name in names])


def _check_jump(model: Model, d: Jump) -> None:
    if d.event.orbit.model.name != model.name:
        raise ParameterError(
            f"{d.event!r} is one of the model '{d.event.orbit.model.name}', not of '{model.name}'"
        )


class _Trial(NamedTuple):
    """A point of the search: residuals, their derivatives, and the orbit of each datum."""

    x: FloatArray
    residuals: FloatArray
    jacobian: FloatArray
    orbits: tuple[Orbit, ...]

    @property
    def chi_square(self) -> float:
        """The sum of squares."""
        return float(self.residuals @ self.residuals)


class _Problem:
    """Residuals and derivatives as functions of the free parameters; orbits are kept between trials."""

    def __init__(
        self,
        model: Model,
        data: tuple[Datum, ...],
        params: dict[str, Any],
        free: tuple[str, ...],
        executor: Executor | None,
        progress: Progress | None,
    ) -> None:
        self.model, self.data, self.params, self.free = model, data, params, free
        self.conditions = conditions_of(model, data, free)
        self.near: list[Near] = [None] * len(self.conditions)
        self.best: _Trial | None = None
        self.last: tuple[bytes, FloatArray, FloatArray] | None = None
        self.trials = 0
        self._executor, self._progress = executor, progress

    def values(self, x: FloatArray) -> dict[str, float]:
        """Return the free parameters by name."""
        return {name: float(value) for name, value in zip(self.free, x, strict=True)}

    def search(self, start: FloatArray) -> tuple[bool, str]:
        """Minimise the sum of squares; return whether that is done, and how it ended."""
        least_squares = whole("scipy.optimize").least_squares

        try:
            found = least_squares(
                lambda x: self.at(x)[0],
                start,
                lambda x: self.at(x)[1],
                bounds=self.bounds(start),
                x_scale="jac",
                xtol=_CONVERGED,
                ftol=_CONVERGED,
                gtol=_CONVERGED,
            )
        except KeyboardInterrupt:
            return False, INTERRUPTED
        least, self.best = self.best, None  # of equal sums of squares the last one was accepted
        again = self.solve(found.x).chi_square
        if abs(again - 2.0 * found.cost) > _SAME * (1.0 + again):
            self.best = min((t for t in (least, self.best) if t), key=lambda t: t.chi_square)
            return False, _SEVERAL
        return bool(found.success), str(found.message)

    def bounds(self, start: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return limits of single parameters; a constraint of two free ones is met by orbits that fail."""
        low, high = np.full(len(start), -np.inf), np.full(len(start), np.inf)
        params = {**self.model.defaults, **self.params, **self.values(start)}
        for k, name in enumerate(self.free):
            for constraint in self.model.constraints:
                c = constraint.coefficients.get(name, 0.0)
                others = set(constraint.coefficients) & set(self.free) - {name}
                if c == 0.0 or others:
                    continue
                limit = params[name] - constraint.value(params) / c
                if c > 0.0:
                    low[k] = max(low[k], limit)
                else:
                    high[k] = min(high[k], limit)
        slack = 1e-12 * (1.0 + np.abs(start))  # a start on its limit is inside
        return np.minimum(low, start - slack), np.maximum(high, start + slack)

    def at(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return residuals and derivatives; far off where there is no orbit: the step is taken back."""
        key = np.asarray(x).tobytes()
        if self.last is None or self.last[0] != key:
            try:
                trial = self.solve(x)
                residuals, jacobian = trial.residuals, trial.jacobian
            except ContfricError:
                size = sum(len(d) if isinstance(d, Series) else 1 for d in self.data)
                residuals, jacobian = np.full(size, _NO_ORBIT), np.zeros((size, len(x)))
            self.last = key, residuals, jacobian
            self.trials += 1
            if self._progress is not None:
                text = ", ".join(f"{name} = {value:.6g}" for name, value in self.values(x).items())
                self._progress(
                    f"fit: trial {self.trials}, chi^2 = {residuals @ residuals:.6g} at {text}"
                )
        return self.last[1], self.last[2]

    def solve(self, x: FloatArray) -> _Trial:
        """Solve every condition at a point of the search.

        Raises
        ------
        ContfricError
            If one of them has no orbit.
        """
        parts: dict[int, tuple[FloatArray, FloatArray, Orbit]] = {}
        for k, answer in enumerate(self._answers(x)):
            self.near[k] = answer.near
            numbers = self.conditions[k][1]
            for number, *part in zip(numbers, answer.residuals, answer.slopes, strict=True):
                parts[number] = (part[0], part[1], answer.orbit)
        residuals, slopes, orbits = zip(*(parts[k] for k in range(len(self.data))), strict=True)
        trial = _Trial(x, np.concatenate(residuals), np.concatenate(slopes), orbits)
        if self.best is None or trial.chi_square < self.best.chi_square:
            self.best = trial
        return trial

    def _answers(self, x: FloatArray) -> list[Prediction]:
        conditions = tuple(condition for condition, _ in self.conditions)
        params = {**self.params, **self.values(x)}
        return answers_of(conditions, params, tuple(self.near), self._executor)
