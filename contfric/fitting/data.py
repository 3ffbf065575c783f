"""Measured data for a fit: values of quantities, and time series of periodic motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.errors import ParameterError, mapping_of, real_number, shown

if TYPE_CHECKING:
    from contfric.events.bifurcation import Bifurcation
    from contfric.quantities.registry import QuantityLike


def _positive(sigma: object) -> float:
    """Return a standard deviation that a user gave."""
    return real_number("sigma", sigma, least=1e-300, wanted="is a standard deviation, a number")


@dataclass(frozen=True)
class Measured:
    """One measured value of a quantity of the steady state.

    Parameters
    ----------
    quantity : str or callable
        What was measured, by its name or as an expression, such as ``"x_max"``, or a function of an orbit.
    value : float
        What came out.
    sigma : float
        Its standard deviation.
    params : dict, optional
        Parameters at which it was measured, where they differ from those of the fit, such as the frequency.

    Examples
    --------
    >>> Measured("x_max", 1.42, 0.01, {"Omega": 0.5}).quantity
    'x_max'
    """

    quantity: QuantityLike
    value: float
    sigma: float
    params: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        real_number("value", self.value)
        _positive(self.sigma)
        mapping_of("params", self.params, "{'Omega': 0.5}")


@dataclass(frozen=True)
class Jump:
    """Where a jump was measured: the place of an event, such as a fold, along the parameter that it lies on.

    Parameters
    ----------
    event : Bifurcation
        The event of a diagram that the jump is taken for; the fit moves it with the free parameters.
    value : float
        Where it was measured: a value of the parameter along which the event was located.
    sigma : float
        Its standard deviation.
    params : dict, optional
        As for :class:`Measured`.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.54, "S": 0.32, "S0": 0.4})
    >>> fold = cf.continue_orbit(orbit, "Omega", (0.53, 0.55)).bifurcations[-1]
    >>> Jump(fold, 0.542, 0.001).parameter
    'Omega'
    """

    event: Bifurcation
    value: float
    sigma: float
    params: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        from contfric.events.bifurcation import Bifurcation

        if not isinstance(self.event, Bifurcation):
            raise ParameterError(f"a jump is taken for a Bifurcation, got {shown(self.event)}")
        real_number("value", self.value)
        _positive(self.sigma)
        mapping_of("params", self.params, "{'S': 0.3}")

    @property
    def parameter(self) -> str:
        """The parameter along which the event was located."""
        from contfric.curves.sensitivity.gradient import parameter_of

        return parameter_of(self.event)


@dataclass(frozen=True, eq=False)
class Series:
    """A measured time series of the steady state; times are those of the model, by its excitation.

    Parameters
    ----------
    signal : str
        What was measured: an expression of time, states, observables and parameters, such as ``"x"``.
    times, values : sequences of float
        When, and what came out.
    sigma : float
        Standard deviation of each value.
    params : dict, optional
        As for :class:`Measured`.

    Examples
    --------
    >>> len(Series("x", [0.0, 0.1], [1.0, 1.1], 0.01))
    2
    """

    signal: str
    times: Sequence[float] | FloatArray
    values: Sequence[float] | FloatArray
    sigma: float
    params: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("times", "values"):
            try:
                found = np.asarray(getattr(self, name), dtype=np.float64)
            except (TypeError, ValueError):
                found = np.array(np.nan)
            if found.ndim != 1 or not len(found) or not np.all(np.isfinite(found)):
                raise ParameterError(
                    f"{name} of a series are finite numbers, got {shown(getattr(self, name))}"
                )
            object.__setattr__(self, name, found)
        if len(self.times) != len(self.values):
            raise ParameterError(
                f"a series has a value for each time, got {len(self.times)} times and "
                f"{len(self.values)} values"
            )
        _positive(self.sigma)
        mapping_of("params", self.params, "{'Omega': 0.5}")

    def __len__(self) -> int:
        return len(self.times)
