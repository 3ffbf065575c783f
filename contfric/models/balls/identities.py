"""Identities in the parameters of a declared model, found symbolically: ball arithmetic does not see them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import sympy

from contfric.models.balls.model import Closure, Pairs, SignedPairs

if TYPE_CHECKING:
    from contfric.models.balls.declared import AffineModel


def moved(row: list[Any], n: int, frequencies: Sequence[Any]) -> list[Any]:
    """Return the rate of an observable with the states held fixed."""
    rate = [sympy.Integer(0)] * len(row)
    for k, w in enumerate(frequencies):
        at = n + 1 + 2 * k
        rate[at], rate[at + 1] = w * row[at + 1], -w * row[at]
    return rate


@lru_cache(maxsize=4096)
def alike(affine: AffineModel, surface: str, mode: str) -> str | None:
    """Return the surface that is met where the observable of another one is stationary on its own.

    The rate along the mode is a multiple of the row of that surface (where a load is the negative of an
    acceleration), but for a multiple of its own row: that of a velocity, by damping.
    """
    n, (row,), field = affine.states, affine.surfaces[surface], affine.fields[mode]
    still = moved(row, n, affine.frequencies)
    rate = [sum(row[i] * field[i][j] for i in range(n)) + c for j, c in enumerate(still)]
    rest = _without(rate, row)
    if not any(rest):
        return None
    for name, (other,) in affine.surfaces.items():
        left = _without(other, row)
        pairs = list(zip(rest, left, strict=True))
        same = any(all(sympy.expand(a + sign * b) == 0 for a, b in pairs) for sign in (1, -1))
        if same or not any(_without(rest, left)):
            return name
    return None


def _without(row: list[Any], other: list[Any]) -> list[Any]:
    """Return a row less the multiple of another one that makes it 0 where that one is a number.

    A formula there is not divided by: it may be 0 at some parameters.
    """
    at = next((j for j, c in enumerate(other) if sympy.sympify(c).is_number and c != 0), None)
    factor = 0 if at is None else row[at] / other[at]
    return [sympy.expand(a - factor * b) for a, b in zip(row, other, strict=True)]


@lru_cache(maxsize=256)
def mirrored(affine: AffineModel, closure: Closure, modes: Pairs, surfaces: SignedPairs) -> bool:
    """Tell whether a symmetry of half a period maps fields, surfaces and resets to those of the images.

    In symbols: ``M' D = K M``, ``g' D = -g`` or g, and ``R' D = K R``, D = diag(K, 1, (-1)^n_k), as in
    :mod:`contfric.certify.equations.closing`.
    """
    n, turns = affine.states, affine.turns
    k = sympy.Matrix(n, n, [sympy.Rational(c) for row in closure for c in row])
    waves = [(-1) ** turn for turn in turns for _ in range(2)]
    d = sympy.diag(k, 1, *waves)

    def gap(group: Mapping[str, list[list[Any]]], name: str, to: str, factor: Any) -> Any:
        return sympy.Matrix(group[to]) * d - factor * sympy.Matrix(group[name])

    if any((name in affine.resets) != (to in affine.resets) for name, to, _ in surfaces):
        return False
    gaps = [gap(affine.fields, mode, to, k) for mode, to in modes]
    gaps += [gap(affine.surfaces, name, to, sign) for name, to, sign in surfaces]
    gaps += [gap(affine.resets, name, to, k) for name, to, _ in surfaces if name in affine.resets]
    return all(sympy.expand(x) == 0 for rows in gaps for x in rows)
