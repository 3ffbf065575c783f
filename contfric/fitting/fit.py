r"""Parameters from measurements of the steady state.

The weighted residuals :math:`r_i = (Q_i(p) - y_i)/\sigma_i` are functions of the free parameters through
solved periodic orbits, with exact derivatives J. Their sum of squares is minimised by a trust-region
method (``scipy.optimize.least_squares``). At the minimum the covariance of the parameters is :math:`(J^T
J)^{-1}`, to first order, for independent errors of the given standard deviations.

At each trial the orbit of each condition is refined from the last one by Newton's method. Where that is
no longer admissible, or fails, the orbit is found anew by simulation: signatures may change on the way.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from contfric.base.shown import Shown
from contfric.continuation.events import Bifurcation
from contfric.curves.gradient import slope_of
from contfric.curves.moved import moved_event
from contfric.errors import ContfricError, ConvergenceError, ParameterError, items_of, shown
from contfric.fitting.data import Jump, Measured, Series
from contfric.fitting.predict import predicted, signal_of
from contfric.models import ModelSource, load_model
from contfric.models.definition import FloatArray, Model
from contfric.orbit.find import find_orbit
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine
from contfric.quantities.inside import Inside
from contfric.quantities.registry import number_quantity

#: Residual, in standard deviations, of a trial without an orbit: so far off that the step is taken back.
_NO_ORBIT = 1e6
#: Singular value, relative to the largest, below which derivatives depend on each other: orbits and their
#: derivatives are good to 1e-12.
_DEPENDENT = 1e-9
#: Change of the parameters, and of the sum of squares (both relative), at which a fit has converged.
_CONVERGED = 1e-12


@dataclass(frozen=True, eq=False)
class Fit(Shown):
    """What :func:`contfric.fit` found.

    Attributes
    ----------
    params : dict
        All parameters, the free ones as they were found.
    free : tuple of str
        The free ones.
    covariance : ndarray, shape (free, free)
        Of the free ones, in their order.
    residuals : ndarray
        Of all data, in standard deviations.
    jacobian : ndarray, shape (data, free)
        Derivatives of the residuals.
    orbits : tuple of Orbit
        The orbit of each measurement.
    converged : bool
        Whether the search ended at a minimum.
    message : str
        How the search ended.

    Examples
    --------
    >>> import contfric as cf
    >>> data = [cf.Measured("x_max", 1.42, 0.01, {"Omega": 0.5})]
    >>> found = cf.fit("coulomb", data, {"S": 0.31, "S0": 0.4}, ["S"])
    >>> found.free, found.converged
    (('S',), True)
    """

    params: dict[str, float]
    free: tuple[str, ...]
    covariance: FloatArray
    residuals: FloatArray
    jacobian: FloatArray
    orbits: tuple[Orbit, ...]
    converged: bool
    message: str

    @property
    def sigma(self) -> dict[str, float]:
        """Standard deviation of each free parameter."""
        return {
            name: float(np.sqrt(variance))
            for name, variance in zip(self.free, np.diag(self.covariance), strict=True)
        }

    @property
    def chi_square(self) -> float:
        """Sum of the squared residuals; about as many as data less free parameters if the model is right."""
        return float(self.residuals @ self.residuals)

    def __repr__(self) -> str:
        found = ", ".join(
            f"{name} = {self.params[name]:.6g} +- {s:.2g}" for name, s in self.sigma.items()
        )
        return f"<Fit {found}; chi^2 = {self.chi_square:.4g} of {len(self.residuals)} data>"


def fit(
    model: ModelSource,
    data: Sequence[Measured | Series | Jump],
    params: Mapping[str, float],
    free: Sequence[str],
) -> Fit:
    """Find the parameters at which a model's periodic orbits agree best with measurements.

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

    Raises
    ------
    ParameterError
        If the data, the parameters or the free ones are not valid.
    ConvergenceError
        If there is no periodic orbit at the start, or the data do not determine the free parameters.

    Examples
    --------
    >>> import contfric as cf
    >>> data = [cf.Measured("x_max", 1.42, 0.01, {"Omega": w}) for w in (0.5,)]
    >>> found = cf.fit("coulomb", data, {"S": 0.31, "S0": 0.4}, ["S"])
    >>> abs(found.orbits[0].x_max - 1.42) < 1e-9
    True
    """
    from scipy.optimize import least_squares

    found = load_model(model)
    names, start = _checked(found, data, params, free)
    problem = _Problem(found, tuple(data), dict(params), names)
    problem.solve(start)  # an error here is the user's to see
    solution = least_squares(
        lambda x: problem.at(x)[0],
        start,
        lambda x: problem.at(x)[1],
        bounds=problem.bounds(start),
        x_scale="jac",
        xtol=_CONVERGED,
        ftol=_CONVERGED,
        gtol=_CONVERGED,
    )
    residuals, jacobian, orbits = problem.solve(solution.x)
    covariance = _covariance(jacobian)
    if covariance is None:
        raise ConvergenceError(
            f"the data do not determine {', '.join(names)}: their derivatives depend on each other",
            orbits[0],
        )
    return Fit(
        {**orbits[0].params, **problem.values(solution.x)},
        names,
        covariance,
        residuals,
        jacobian,
        orbits,
        bool(solution.success),
        str(solution.message),
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


def _checked(
    model: Model, data: object, params: Mapping[str, Any], free: object
) -> tuple[tuple[str, ...], FloatArray]:
    """Return the free parameters and where they start; refuse what cannot be fitted."""
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


class _Problem:
    """Residuals and derivatives as functions of the free parameters; orbits are kept between trials."""

    def __init__(
        self,
        model: Model,
        data: tuple[Measured | Series | Jump, ...],
        params: dict[str, Any],
        free: tuple[str, ...],
    ) -> None:
        self.model, self.data, self.params, self.free = model, data, params, free
        self.columns = [model.index_of(name) for name in free]
        self.near: dict[tuple[tuple[str, float], ...], Orbit] = {}
        self.events = {k: d.event for k, d in enumerate(data) if isinstance(d, Jump)}
        self.last: tuple[bytes, FloatArray, FloatArray] | None = None

    def values(self, x: FloatArray) -> dict[str, float]:
        """Return the free parameters by name."""
        return {name: float(value) for name, value in zip(self.free, x, strict=True)}

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
                residuals, jacobian, _ = self.solve(x)
            except ContfricError:
                size = sum(len(d) if isinstance(d, Series) else 1 for d in self.data)
                residuals, jacobian = np.full(size, _NO_ORBIT), np.zeros((size, len(x)))
            self.last = key, residuals, jacobian
        return self.last[1], self.last[2]

    def solve(self, x: FloatArray) -> tuple[FloatArray, FloatArray, tuple[Orbit, ...]]:
        """Return residuals, derivatives, and the orbit of each measurement."""
        parts, slopes, orbits = [], [], []
        for k, d in enumerate(self.data):
            if isinstance(d, Jump):
                event = self._event(k, d, {**self.params, **d.params, **self.values(x)})
                by_free = [slope_of(event, d.parameter, name) for name in self.free]
                parts.append(np.array([event.params[d.parameter] - d.value]) / d.sigma)
                slopes.append(np.array([by_free]) / d.sigma)
                orbits.append(event.orbit)
                continue
            orbit = self._orbit({**self.params, **d.params, **self.values(x)}, d)
            values, by_all = predicted(d, orbit)
            measured = d.values if isinstance(d, Series) else np.array([d.value])
            parts.append((values - measured) / d.sigma)
            slopes.append(by_all[:, self.columns] / d.sigma)
            orbits.append(orbit)
        return np.concatenate(parts), np.concatenate(slopes), tuple(orbits)

    def _event(self, number: int, d: Jump, params: dict[str, Any]) -> Bifurcation:
        """Return the event of a jump, moved from where it was last."""
        values = self.model.mapping(self.model.vector({**params, d.parameter: d.value}))
        self.events[number] = moved_event(self.events[number], values)
        return self.events[number]

    def _orbit(self, params: dict[str, Any], d: Measured | Series) -> Orbit:
        """Return the orbit of a condition: refined from the last one, or found by simulation."""
        condition = tuple(sorted((str(k), float(v)) for k, v in d.params.items()))
        vector = self.model.vector(params)
        near = self.near.get(condition)
        if near is not None:
            refined = refine(replace(near, vector=vector))
            if refined.converged and refined.admissible and refined.stable:
                self.near[condition] = refined
                return refined
        found = find_orbit(self.model, params)
        if self.model.symmetry is not None and not found.symmetric:
            # a simulation finds one of two images by chance: the data say which of them was measured
            found = min(found, found.mirror(), key=lambda orbit: self._distance(d, orbit))
        self.near[condition] = found
        return found

    @staticmethod
    def _distance(d: Measured | Series, orbit: Orbit) -> float:
        values, _ = predicted(d, orbit)
        return float(np.sum((values - (d.values if isinstance(d, Series) else d.value)) ** 2))
