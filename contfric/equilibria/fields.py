r"""The field of one mode as functions of state and parameters, with the derivatives that equilibria need.

A mode that moves freely has its own field ``f(y, p)``. A mode that lies on surfaces ``h(y, p) = 0`` has a
field that is tangent to them there; away from them it means nothing. It is taken together with an attraction
to them,

.. math:: g = f - c N h, \qquad N = h_y^T (h_y h_y^T)^{-1}.

On the surfaces g is f, and :math:`g_y = f_y - c N h_y`: directions within them keep the eigenvalues of f, and
each direction off them adds one eigenvalue ``-c``. So equilibria, folds and Hopf points on surfaces are those
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

from contfric.models.definition import FloatArray


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
    def _pull(self) -> Any:
        import sympy

        return sympy.Symbol("pull", positive=True)

    @cached_property
    def _attracted(self) -> list[Any]:
        """The field g."""
        if not self.on:
            return list(self.field)
        from sympy import Matrix

        slopes = Matrix([[h.diff(s) for s in self.states] for h in self.on])
        back = slopes.T * (slopes * slopes.T).inv() * Matrix(self.on)
        return [f - self._pull * b for f, b in zip(self.field, back, strict=True)]

    def _function(self, formulas: Any, *more: Sequence[Any]) -> Callable[..., Any]:
        from contfric.models.numbers import function_of_numbers

        args = [list(self.states), list(self.parameters), self._pull, *map(list, more)]
        return function_of_numbers(args, formulas)

    @cached_property
    def _values(self) -> Callable[..., Any]:
        return self._function(self._attracted)

    @cached_property
    def _slopes(self) -> Callable[..., Any]:
        return self._function([[g.diff(s) for s in self.states] for g in self._attracted])

    @cached_property
    def _heights(self) -> Callable[..., Any]:
        """Heights above the own surfaces, and their gradients."""
        return self._function([[h, *(h.diff(s) for s in self.states)] for h in self.on])

    def _directions(self, name: str) -> Sequence[Any]:
        """Return the symbols of a direction of the states."""
        from sympy import symbols

        return symbols(f"{name}:{len(self.states)}")  # type: ignore[no-any-return]

    def _along(self, formulas: Sequence[Any], symbols: Sequence[Any]) -> list[Any]:
        """Return the derivatives of formulas in a direction."""
        pairs = list(zip(self.states, symbols, strict=True))
        return [sum(g.diff(s) * u for s, u in pairs) for g in formulas]

    @cached_property
    def _second(self) -> Callable[..., Any]:
        u, v = map(self._directions, "uv")
        return self._function(self._along(self._along(self._attracted, u), v), u, v)

    @cached_property
    def _third(self) -> Callable[..., Any]:
        u, v, w = map(self._directions, "uvw")
        formulas = self._along(self._along(self._along(self._attracted, u), v), w)
        return self._function(formulas, u, v, w)

    @cached_property
    def _by_parameter(self) -> dict[int, tuple[Callable[..., Any], Callable[..., Any]]]:
        return {}

    def _parametric(self, active: int) -> tuple[Callable[..., Any], Callable[..., Any]]:
        """Return the derivative by a parameter, and that of it in a direction."""
        if active not in self._by_parameter:
            u = self._directions("u")
            formulas = [g.diff(self.parameters[active]) for g in self._attracted]
            mixed = self._function(self._along(formulas, u), u)
            self._by_parameter[active] = self._function(formulas), mixed
        return self._by_parameter[active]

    def value(self, y: FloatArray, p: FloatArray, pull: float = 1.0) -> FloatArray:
        """Return g, shape (n,)."""
        with np.errstate(all="ignore"):
            return np.array(self._values(y, p, pull), dtype=np.float64)

    def jacobian(self, y: FloatArray, p: FloatArray, pull: float = 1.0) -> FloatArray:
        """Return the derivatives of g by the states, shape (n, n)."""
        with np.errstate(all="ignore"):
            return np.array(self._slopes(y, p, pull), dtype=np.float64)

    def slope(self, y: FloatArray, p: FloatArray, active: int, pull: float = 1.0) -> FloatArray:
        """Return the derivatives of g by one parameter, shape (n,)."""
        with np.errstate(all="ignore"):
            return np.array(self._parametric(active)[0](y, p, pull), dtype=np.float64)

    def mixed(self, y: FloatArray, p: FloatArray, active: int, pull: float, u: Any) -> Any:
        """Return the derivative of g by a parameter and in a direction, shape (n,)."""
        with np.errstate(all="ignore"):
            return np.array(self._parametric(active)[1](y, p, pull, u), dtype=np.complex128)

    def second(self, y: FloatArray, p: FloatArray, pull: float, u: Any, v: Any) -> Any:
        """Return the second derivative of g in two directions, ``B(u, v)``, shape (n,)."""
        with np.errstate(all="ignore"):
            return np.array(self._second(y, p, pull, u, v), dtype=np.complex128)

    def third(self, y: FloatArray, p: FloatArray, pull: float, u: Any, v: Any, w: Any) -> Any:
        """Return the third derivative of g in three directions, ``C(u, v, w)``, shape (n,)."""
        with np.errstate(all="ignore"):
            return np.array(self._third(y, p, pull, u, v, w), dtype=np.complex128)

    def tangents(self, y: FloatArray, p: FloatArray) -> FloatArray:
        """Return an orthonormal basis of the directions within the own surfaces, shape (n, n - k)."""
        n, k = len(self.states), len(self.on)
        if k == 0:
            return np.eye(n)
        slopes = np.array(self._heights(y, p, 1.0), dtype=np.float64)[:, 1:]
        return np.asarray(np.linalg.svd(slopes)[2][k:].T)

    def off(self, y: FloatArray, p: FloatArray) -> FloatArray:
        """Return the heights above the own surfaces, shape (k,)."""
        with np.errstate(all="ignore"):
            return np.array([row[0] for row in self._heights(y, p, 1.0)], dtype=np.float64)

    def eigenvalues(self, y: FloatArray, p: FloatArray) -> Any:
        """Return the eigenvalues within the own surfaces, the largest real part first, shape (n - k,)."""
        basis = self.tangents(y, p)
        found = np.linalg.eigvals(basis.T @ self.jacobian(y, p) @ basis).astype(np.complex128)
        return found[np.lexsort((-found.imag, -found.real))]
