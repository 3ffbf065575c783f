"""The result of a fit: parameters with covariance, and the predictions for each measurement."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.extras import need_pandas
from contfric.base.named import Named
from contfric.base.tabled import Columns, Tabled
from contfric.errors import ParameterError, shown
from contfric.fitting.condition import Datum
from contfric.fitting.data import Jump, Series
from contfric.models.definition import Model
from contfric.orbit.orbit import Orbit
from contfric.quantities.registry import name_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

#: What the message of a fit is that Ctrl-C ended.
INTERRUPTED = "interrupted"
#: A sum of squares that errors of the given sizes exceed less often than this is called too large: one right
#: fit in ten thousand is.
_UNLIKELY = 1e-4
#: A fit that is nearer to a limit of the model than this share of a standard deviation is at it.
_AT_LIMIT = 1e-3


@dataclass(frozen=True, eq=False)
class Fit(Tabled):
    """What :func:`contfric.fit` found.

    Attributes
    ----------
    params : dict
        All parameters, the free ones as they were found.
    free : tuple of str
        The free ones.
    data : tuple of Measured, Series or Jump
        What was measured.
    covariance : ndarray, shape (free, free)
        Of the free ones, in their order.
    residuals : ndarray
        Of all data, in standard deviations.
    jacobian : ndarray, shape (data, free)
        Derivatives of the residuals.
    orbits : tuple of Orbit
        The orbit of each datum, that of the event for a jump.
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
    data: tuple[Datum, ...]
    covariance: FloatArray
    residuals: FloatArray
    jacobian: FloatArray
    orbits: tuple[Orbit, ...]
    converged: bool
    message: str

    @property
    def model(self) -> Model:
        """The model that moves."""
        return self.orbits[0].model

    @property
    def complete(self) -> bool:
        """Whether the search ended by itself; False after an interrupt."""
        return self.message != INTERRUPTED

    @property
    def sigma(self) -> dict[str, float]:
        """Standard deviation of each free parameter."""
        return Named(zip(self.free, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def chi_square(self) -> float:
        """Sum of the squared residuals; about as many as data less free parameters if the model is right."""
        return float(self.residuals @ self.residuals)

    @property
    def reduced_chi_square(self) -> float:
        """The same by data less free parameters: about 1 if the model is right; nan without any to spare."""
        spare = len(self.residuals) - len(self.free)
        return self.chi_square / spare if spare else float("nan")

    @property
    def notes(self) -> tuple[str, ...]:
        """What makes the fit doubtful, one line each: not converged, at a limit, or it misses its data."""
        found = [] if self.converged else [f"not converged: {self.message}"]
        found += [
            f"at a limit: the model needs {text}, and the fit ends there; standard deviations hold for "
            "parameters inside of their limits"
            for text in self._limits()
        ]
        spare = max(1, len(self.residuals) - len(self.free))
        from scipy.special import chdtrc

        if not chdtrc(spare, self.chi_square) >= _UNLIKELY:
            found.append(
                f"the fit misses its data: chi^2 = {self.chi_square:.4g} where about {spare} is expected; "
                "the standard deviations of the parameters do not hold (a wrong model, data of another "
                "branch, another minimum, or a sigma that is too small)"
            )
        return tuple(found)

    def _limits(self) -> tuple[str, ...]:
        """Return the inequalities of the model that keep the free parameters from going on."""
        by_free = dict(zip(self.free, np.diag(self.covariance).tolist(), strict=True))
        found: dict[str, None] = {}
        for orbit, limit in product(self.orbits, self.model.constraints):
            own = {name: c for name, c in limit.coefficients.items() if name in by_free and c}
            spread = sum(c * c * by_free[name] for name, c in own.items()) ** 0.5
            if own and limit.value(orbit.params) <= _AT_LIMIT * spread:
                found[limit.text] = None
        return tuple(found)

    def columns(self) -> Columns:
        """Return one row for each measured value, with what the model says and all parameters there."""
        sizes = [len(d) if isinstance(d, Series) else 1 for d in self.data]
        at = np.repeat(np.arange(len(sizes)), sizes)
        times = [d.times if isinstance(d, Series) else [np.nan] for d in self.data]
        values = np.concatenate(
            [d.values if isinstance(d, Series) else [d.value] for d in self.data]
        )
        sigma = np.array([d.sigma for d in self.data])[at]
        params = np.array([orbit.vector for orbit in self.orbits])[at]
        return {
            "datum": at + 1,
            "what": np.array([what_of(d) for d in self.data])[at],
            "t": np.concatenate([np.asarray(t, dtype=np.float64) for t in times]),
            "value": values,
            "sigma": sigma,
            "fitted": values + sigma * self.residuals,
            "residual": self.residuals,
            **dict(zip(self.model.parameter_names, params.T, strict=True)),
        }

    def found(self) -> Columns:
        """Return one row for each free parameter: value, standard deviation, correlations."""
        sigma = np.sqrt(np.diag(self.covariance))
        together = self.covariance / np.outer(sigma, sigma)
        return {
            "parameter": np.array(self.free),
            "value": np.array([self.params[name] for name in self.free]),
            "sigma": sigma,
            **{f"correlation_{name}": row for name, row in zip(self.free, together, strict=True)},
        }

    def to_dataframe(self, table: str = "data") -> pd.DataFrame:
        """Return a table (needs pandas): "data", or the free "parameters" with their correlations.

        Raises
        ------
        ParameterError
            If there is no such table.
        """
        need_pandas()
        import pandas as pd

        tables: dict[str, Any] = {"data": self.columns, "parameters": self.found}
        if table not in [*tables]:
            raise ParameterError(f"a table of a fit is data or parameters, got {shown(table)}")
        return pd.DataFrame(tables[table]())

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw series with the fitted solution; without any, measured and fitted values."""
        from contfric.plot.fit import plot_fit

        return plot_fit(self, ax=ax)

    def __repr__(self) -> str:
        found = ", ".join(
            f"{name} = {self.params[name]:.6g} +- {s:.2g}" for name, s in self.sigma.items()
        )
        doubts = "".join(f"; {note.partition(':')[0]}" for note in self.notes)
        return f"<Fit {found}; chi^2 = {self.chi_square:.4g} of {len(self.residuals)} data{doubts}>"


def what_of(datum: Datum) -> str:
    """Return what was measured, in a word: a quantity, a signal, or an event."""
    if isinstance(datum, Jump):
        return f"{datum.parameter} of {datum.event.label}"
    return datum.signal if isinstance(datum, Series) else name_of(datum.quantity)
