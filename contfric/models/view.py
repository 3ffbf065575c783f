"""A model's flow at one set of parameters, by names: for Python callers, which need no empty arrays.

The engine's kernels call the functions of :class:`contfric.flow.interface.CompiledFlow` with indices, and
arrays to write to. Here the same functions take names and return what they find.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from contfric.base.attributes import cached_property
from contfric.errors import ContfricError

if TYPE_CHECKING:
    from contfric.base.arrays import FloatArray
    from contfric.models.definition import Model

_NONE = np.empty(0, dtype=np.int64)
_EMPTY, _NOTHING = np.empty(0), np.empty((0, 0))
#: Steps of Newton's method onto surfaces: a dozen where it converges.
_STEPS = 50
#: Places for the stationary points of one segment: enough for nearly all, and where they are not.
_MOST = (512, 65_536)


@dataclass(frozen=True, eq=False)
class FlowView:
    """The flow of a model at some parameters.

    Parameters
    ----------
    model, vector : the model, and its parameters as the engine has them

    Examples
    --------
    >>> from contfric.models import load_model
    >>> model = load_model("coulomb")
    >>> FlowView(model, model.vector({"S0": 0.4})).level("F+")
    0.4
    """

    model: Model
    vector: FloatArray

    @cached_property
    def period(self) -> float:
        """Period of the excitation; 0 without one."""
        return float(self.model.flow.period(self.vector, _NONE, _EMPTY))

    def observe(self, observable: str, t: float, y: FloatArray) -> float:
        """Return the value of an observable."""
        c = self.model.observable_index[observable]
        y = np.ascontiguousarray(y)
        return float(self.model.flow.observe(c, t, y, self.vector, _NONE, _EMPTY))

    def gradient(
        self, observable: str, t: float, y: FloatArray, active: int | None = None
    ) -> FloatArray:
        """Return the derivatives of an observable by time, states, and a parameter, shape (1 + n [+ 1],)."""
        c, which = self.model.observable_index[observable], _which(active)
        grad = np.empty(1 + len(y) + len(which))
        self.model.flow.observe(c, t, np.ascontiguousarray(y), self.vector, which, grad)
        return grad

    def level(self, surface: str) -> float:
        """Return the level of a surface."""
        k = self.model.surface_index[surface]
        return float(self.model.flow.level(k, self.vector, _NONE, _EMPTY))

    def level_slope(self, surface: str, active: int) -> float:
        """Return how the level of a surface changes with a parameter."""
        slope = np.empty(1)
        k = self.model.surface_index[surface]
        self.model.flow.level(k, self.vector, _which(active), slope)
        return float(slope[0])

    def height(self, surface: str, t: float, y: FloatArray) -> float:
        """Return the observable of a surface less its level."""
        observable = self.model.surface_by_name[surface].observable
        return self.observe(observable, t, y) - self.level(surface)

    def rate(self, mode: str, observable: str, t: float, y: FloatArray) -> float:
        """Return the rate of an observable along a mode."""
        m, c = self.model.mode_index[mode], self.model.observable_index[observable]
        y = np.ascontiguousarray(y)
        return float(self.model.flow.rate(m, c, t, y, self.vector, _NONE, _EMPTY))

    def rate_gradient(
        self, mode: str, observable: str, t: float, y: FloatArray, active: int
    ) -> FloatArray:
        """Return the derivatives of a rate by time, states and a parameter, shape (2 + n,)."""
        m, c = self.model.mode_index[mode], self.model.observable_index[observable]
        grad, y = np.empty(2 + len(y)), np.ascontiguousarray(y)
        self.model.flow.rate(m, c, t, y, self.vector, _which(active), grad)
        return grad

    def state(self, mode: str, t: float, y: FloatArray, duration: float) -> FloatArray:
        """Return the state after a duration in a mode, shape (n,)."""
        m, out = self.model.mode_index[mode], np.empty(len(y))
        y = np.ascontiguousarray(y)
        self.model.flow.flow(m, t, y, duration, self.vector, _NONE, out, _NOTHING)
        return out

    def jacobian(
        self, mode: str, t: float, y: FloatArray, duration: float, active: int | None = None
    ) -> FloatArray:
        """Return the derivatives of that state, shape (n, 2 + n [+ 1]).

        By start time, start state, duration, and a parameter.
        """
        m, which, n = self.model.mode_index[mode], _which(active), len(y)
        out, jac = np.empty(n), np.empty((n, 2 + n + len(which)))
        y = np.ascontiguousarray(y)
        self.model.flow.flow(m, t, y, duration, self.vector, which, out, jac)
        return jac

    def first(
        self,
        mode: str,
        observable: str,
        level: float,
        t: float,
        y: FloatArray,
        within: float,
        *,
        on: bool,
    ) -> tuple[float, FloatArray] | None:
        """Return the duration until an observable takes a level, and the state there; None if it does not.

        ``on`` says that it takes it at the start itself, which does not count.
        """
        m, c = self.model.mode_index[mode], self.model.observable_index[observable]
        y, out = np.ascontiguousarray(y), np.empty(len(y))
        duration = float(self.model.flow.hit(m, c, level, on, t, y, within, self.vector, out))
        return None if duration < 0.0 else (duration, out)

    def stationary(
        self, mode: str, observable: str, t: float, y: FloatArray, duration: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return durations to the stationary points of an observable along a segment, and its values.

        Raises
        ------
        ContfricError
            If they do not fit, or the search gives up.
        """
        m, c = self.model.mode_index[mode], self.model.observable_index[observable]
        y = np.ascontiguousarray(y)
        for most in _MOST:
            times, values = np.empty(most), np.empty(most)
            found = int(
                self.model.flow.stationary(m, c, t, y, duration, self.vector, times, values)
            )
            if found >= 0:
                return times[:found], values[:found]
        raise ContfricError(
            f"the stationary points of '{observable}' in mode '{mode}' were not all found within "
            f"{duration:g} from t = {t:g}: more than {_MOST[-1]}, or the search is too long"
        )

    def landed(
        self, surfaces: Sequence[str], t: float, y: FloatArray, within: float
    ) -> FloatArray | None:
        """Return a state on some surfaces, near another one, by Newton's method; None where none is found.

        Parameters
        ----------
        within : heights above the surfaces that count as 0, for states of size 1
        """
        observables = [self.model.surface_by_name[name].observable for name in surfaces]
        for _ in range(_STEPS):
            missed = np.array([self.height(name, t, y) for name in surfaces])
            if np.max(np.abs(missed)) <= within * (1.0 + np.max(np.abs(y))):
                return y
            slopes = np.array([self.gradient(name, t, y)[1:] for name in observables])
            if not (np.all(np.isfinite(slopes)) and np.all(np.isfinite(missed))):
                return None
            y = y - np.linalg.lstsq(slopes, missed, rcond=None)[0]
        return None

    def reset(self, surface: str, t: float, y: FloatArray) -> FloatArray:
        """Return the state after the reset at a surface, shape (n,)."""
        k, out = self.model.surface_index[surface], np.empty(len(y))
        y = np.ascontiguousarray(y)
        self.model.flow.reset(k, t, y, self.vector, _NONE, out, _NOTHING)
        return out

    def reset_jacobian(self, surface: str, t: float, y: FloatArray, active: int) -> FloatArray:
        """Return the derivatives of that state by time, state and a parameter, shape (n, 2 + n)."""
        k, n = self.model.surface_index[surface], len(y)
        out, jac = np.empty(n), np.empty((n, 2 + n))
        y = np.ascontiguousarray(y)
        self.model.flow.reset(k, t, y, self.vector, _which(active), out, jac)
        return jac


def _which(active: int | None) -> np.ndarray:
    return _NONE if active is None else np.array([active], dtype=np.int64)
