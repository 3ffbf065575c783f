"""Zeros of the field of one region: Newton's method from many starts; a linear system where it is affine."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.equilibria.regions import ModeRegion

#: Newton's method converges within about ten steps, or wanders.
_STEPS, _HALVINGS = 60, 10
#: Relative: a last step this short is at rounding, and a zero has to be reached as well as this.
_SHORT, _CONVERGED = 1e-14, 1e-9
#: A singular value below this share of the largest is zero: rounding of a matrix of moderate size.
_RANK = 1e-11
#: Half-widths that starts are drawn from, in natural sizes: those may be far off where no one gave them.
_WIDTHS = (2.0, 2.0, 20.0)
#: Virtual zeros farther than this, in natural sizes, are left out: a periodic field has them without end.
_FAR = 5.0
#: A component below this share of its size is what rounding left of 0.
_NOTHING = 1e-16


@dataclass(frozen=True, eq=False)
class Zeros:
    """The zeros of a region's field at some parameters.

    Parameters
    ----------
    scale : natural size of each state, shape (n,)
    """

    region: ModeRegion
    p: FloatArray
    scale: FloatArray

    def newton(self, start: FloatArray, damped: bool = True) -> FloatArray | None:
        """Return the zero that Newton's method comes to from a state; None if it comes to none.

        If damped, a step is halved until the residual falls. A singular Jacobian takes the shortest step.
        """
        y, fields = start.copy(), self.region.fields
        residual = fields.value(y, self.p)
        for _ in range(_STEPS):
            step = self._step(y, residual)
            if step is None:
                return None
            length = float(np.max(np.abs(step / self.scale)))
            if length <= _SHORT * (1.0 + float(np.max(np.abs(y / self.scale)))):
                return y + step
            if not damped and length > _CONVERGED:  # near a zero rounding is to be seen
                y = y + step
                residual = fields.value(y, self.p)
                continue
            y, residual, moved = self._damped(y, residual, step)
            if not moved:  # rounding keeps the residual from falling, or there is no zero
                return y if length < _CONVERGED else None
        return None

    def _step(self, y: FloatArray, residual: FloatArray) -> FloatArray | None:
        jac = self.region.fields.jacobian(y, self.p)
        if not (np.all(np.isfinite(jac)) and np.all(np.isfinite(residual))):
            return None
        rows = 1.0 / np.maximum(np.max(np.abs(jac * self.scale), axis=1), 1e-300)
        a, b = jac * self.scale * rows[:, None], -residual * rows
        return np.asarray(np.linalg.lstsq(a, b, rcond=_RANK)[0] * self.scale)

    def _damped(
        self, y: FloatArray, residual: FloatArray, step: FloatArray
    ) -> tuple[FloatArray, FloatArray, bool]:
        size = float(np.linalg.norm(residual / self.scale))
        for k in range(_HALVINGS):
            moved = y + step * 0.5**k
            value = self.region.fields.value(moved, self.p)
            if np.all(np.isfinite(value)) and np.linalg.norm(value / self.scale) < size:
                return moved, value, True
        return y, residual, False

    def null_space(self, y: FloatArray) -> FloatArray:
        """Return unit vectors along which the field does not change to first order, shape (k, n)."""
        jac = self.region.fields.jacobian(y, self.p) * self.scale
        rows = np.max(np.abs(jac), axis=1)
        jac /= np.where(rows > 0.0, rows, 1.0)[:, None]
        _, sizes, vectors = np.linalg.svd(jac)
        found = vectors[sizes <= _RANK * max(1.0, float(sizes[0]))] * self.scale
        return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))

    def affine(self) -> tuple[FloatArray, FloatArray] | None:
        """Return a zero of an affine field and the directions of all others, shape (k, n); None if none."""
        fields, origin = self.region.fields, np.zeros(len(self.scale))
        value = fields.value(origin, self.p)
        step = self._step(origin, value)
        if step is None:
            return None
        again = self._step(step, fields.value(step, self.p))  # one step of refinement
        y = step if again is None else step + again
        terms = np.abs(fields.jacobian(y, self.p)) @ np.abs(y) + np.abs(value)
        if np.any(np.abs(fields.value(y, self.p)) > _CONVERGED * np.maximum(terms, 1e-300)):
            return None
        return y, self.null_space(y)

    def from_starts(self, starts: int, seed: int) -> Iterator[FloatArray]:
        """Yield what Newton's method comes to from the origin and from random states.

        By turns damped and not (which is less sure, and reaches farther), near and far.
        """
        rng = np.random.default_rng(seed)
        low, high = self.region.model.region(self.p)
        middle = 0.5 * (low + high)
        draws = rng.uniform(-1.0, 1.0, (starts, len(self.scale))) * self.scale
        draws[0] = 0.0
        for k, draw in enumerate(draws):
            start = middle + _WIDTHS[k // 2 % len(_WIDTHS)] * draw
            found = self.newton(start, damped=k % 2 == 0)
            if found is None:
                continue
            near = np.all(np.abs(found - middle) <= _FAR * self.scale)
            if near or not self.region.domain_of(found, self.p)[1]:
                y = np.where(np.abs(found) < _NOTHING * self.scale, 0.0, found)
                if self._falls(start, y):
                    yield y

    def _falls(self, start: FloatArray, y: FloatArray) -> bool:
        """Tell a zero from a pole, where steps are short as well if other rows lead to it."""
        fields = self.region.fields
        before, after = (np.linalg.norm(fields.value(at, self.p) / self.scale) for at in (start, y))
        return bool(after <= before and np.all(np.isfinite(fields.jacobian(y, self.p))))
