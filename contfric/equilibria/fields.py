r"""The field of a mode, on surfaces as well, with its derivatives.

A mode that moves freely has its own field ``f(y, p)``. A mode that lies on surfaces ``h(y, p) = 0`` has a
field that is tangent to them there; away from them it means nothing. It is taken together with an attraction
to them,

.. math:: g = f - N h, \qquad N = h_y^T (h_y h_y^T)^{-1}.

On the surfaces g is f, and :math:`g_y = f_y - N h_y`: directions within them keep the eigenvalues of f, and
each direction off them adds one eigenvalue -1. So equilibria, folds and Hopf points on surfaces are those
of an ordinary field in all states, by one set of formulas, and the centre manifold of a Hopf point on
surfaces lies in them.

sympy is imported where formulas are asked for: results are saved and loaded without it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.attributes import kept

Function = Callable[..., np.ndarray]


@dataclass(frozen=True, eq=False)
class Fields:
    """Formulas of a mode: its field, and what vanishes on the surfaces that it lies on.

    Attributes
    ----------
    states, parameters : symbols
    field : one formula a state
    on : formulas of (observable - level), one for each surface that the mode lies on
    affine : whether field and surfaces are affine in the states
    """

    states: tuple[Any, ...]
    parameters: tuple[Any, ...]
    field: tuple[Any, ...]
    on: tuple[Any, ...]
    affine: bool

    @cached_property
    def _attracted(self) -> list[Any]:
        """The field g."""
        if not self.on:
            return list(self.field)
        from contfric.models.generated.symbols import step_off

        return [f - b for f, b in zip(self.field, step_off(self.on, self.states), strict=True)]

    def _function(self, formulas: Any, *more: Sequence[Any]) -> Function:
        from contfric.models.language.numbers import function_of_numbers

        return function_of_numbers([self.states, self.parameters, *more], formulas)

    @cached_property
    def value(self) -> Function:
        """The field g as a function of (y, p), shape (n,)."""
        return self._function(self._attracted)

    @cached_property
    def jacobian(self) -> Function:
        """Its derivatives by the states as a function of (y, p), shape (n, n)."""
        return self._function([[g.diff(s) for s in self.states] for g in self._attracted])

    @cached_property
    def _gradients(self) -> Function:
        """Gradients of the heights above the own surfaces."""
        return self._function([[h.diff(s) for s in self.states] for h in self.on])

    def _directions(self, name: str) -> Sequence[Any]:
        """Return the symbols of a direction of the states."""
        from sympy import symbols

        return symbols(f"{name}:{len(self.states)}")  # type: ignore[no-any-return]

    def _along(self, formulas: Sequence[Any], symbols: Sequence[Any]) -> list[Any]:
        """Return the derivatives of formulas in a direction."""
        pairs = list(zip(self.states, symbols, strict=True))
        return [sum(g.diff(s) * u for s, u in pairs) for g in formulas]

    @cached_property
    def second(self) -> Function:
        """The second derivative of g in two directions, ``B(u, v)``, as a function of (y, p, u, v)."""
        u, v = map(self._directions, "uv")
        return self._function(self._along(self._along(self._attracted, u), v), u, v)

    @cached_property
    def third(self) -> Function:
        """The third derivative of g in three directions, ``C(u, v, w)``, as a function of (y, p, u, v, w)."""
        u, v, w = map(self._directions, "uvw")
        formulas = self._along(self._along(self._along(self._attracted, u), v), w)
        return self._function(formulas, u, v, w)

    @kept
    def _parametric(self, active: int) -> tuple[Function, Function]:
        """Return the derivative by a parameter, and that of it in a direction."""
        u = self._directions("u")
        formulas = [g.diff(self.parameters[active]) for g in self._attracted]
        return self._function(formulas), self._function(self._along(formulas, u), u)

    def slope(self, y: FloatArray, p: FloatArray, active: int) -> FloatArray:
        """Return the derivatives of g by one parameter, shape (n,)."""
        return self._parametric(active)[0](y, p)

    def mixed(self, y: FloatArray, p: FloatArray, active: int, u: Any) -> Any:
        """Return the derivative of g by a parameter and in a direction, shape (n,)."""
        return self._parametric(active)[1](y, p, u)

    def tangents(self, y: FloatArray, p: FloatArray) -> FloatArray:
        """Return an orthonormal basis of the directions within the own surfaces, shape (n, n - k)."""
        n, k = len(self.states), len(self.on)
        if k == 0:
            return np.eye(n)
        return np.asarray(np.linalg.svd(self._gradients(y, p))[2][k:].T)

    def eigenvalues(self, y: FloatArray, p: FloatArray) -> Any:
        """Return the eigenvalues within the own surfaces, the largest real part first, shape (n - k,)."""
        basis = self.tangents(y, p)
        found = np.linalg.eigvals(basis.T @ self.jacobian(y, p) @ basis).astype(np.complex128)
        return found[np.lexsort((-found.imag, -found.real))]
