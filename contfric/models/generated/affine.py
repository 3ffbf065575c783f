"""Finds the affine modes of a model: ``y' = A(p) y`` plus constants and harmonics of time.

A solution in such a mode has a closed form (:mod:`contfric.flow.linear`). What is looked at are the formulas
themselves: a mode is affine if the derivatives of its rates by the states depend on the parameters only, and
what is left at the state 0 is a sum of ``a cos(w t) + b sin(w t)``; products of harmonics are multiplied out.

This module imports sympy; it is loaded when a model is built for the first time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import sympy

from contfric.models.language.formulas import kinks_in
from contfric.models.language.not_affine import NotAffineError

#: A harmonic: its frequency (0: a constant), and the factors of cosine and sine.
Wave = tuple[Any, Any, Any]
#: Most products that a formula is multiplied out to: one with more is no sum of a few harmonics.
_MOST = 200


@dataclass(frozen=True)
class AffineForm:
    """One formula ``g . y + sum(a cos(w t) + b sin(w t))``; frequency 0 is the constant."""

    slopes: tuple[Any, ...]
    waves: tuple[Wave, ...]


def affine_form(expression: Any, t: Any, states: Sequence[Any], names: Sequence[str]) -> AffineForm:
    """Return the affine form of a formula.

    Parameters
    ----------
    names : of the states, for the message

    Raises
    ------
    NotAffineError
        With the reason.
    """
    moving, slopes = set(states), []
    if kinks_in(expression, moving):
        raise NotAffineError("its parts change where the sign of a state changes")
    for state, name in zip(states, names, strict=True):
        slope = sympy.expand(expression.diff(state))
        if slope.free_symbols & moving:
            raise NotAffineError(f"not linear in {name}")
        if t in slope.free_symbols:
            raise NotAffineError(f"the factor of {name} depends on time")
        slopes.append(slope)
    rest = sympy.sympify(expression.xreplace(dict.fromkeys(states, sympy.Integer(0))))
    return AffineForm(tuple(slopes), _collected(_waves(rest, t), t))


def _waves(e: Any, t: Any) -> list[tuple[Any, Any, Any]]:
    """Return a formula of time as a sum of (argument, factor of cosine, factor of sine)."""
    if t not in e.free_symbols:
        return [(sympy.Integer(0), e, sympy.Integer(0))]
    if isinstance(e, sympy.Add):
        return [wave for part in e.args for wave in _waves(part, t)]
    if isinstance(e, sympy.Mul):
        found = _waves(e.args[0], t)
        for part in e.args[1:]:
            found = _product(found, _waves(part, t))
        return found
    if isinstance(e, sympy.Pow) and e.exp.is_Integer and 0 < e.exp <= 8:  # cos**8: 256 products
        base = _waves(e.base, t)
        found = base
        for _ in range(int(e.exp) - 1):
            found = _merged(_product(found, base))
        return found
    if isinstance(e, (sympy.cos, sympy.sin)):
        argument = sympy.expand(e.args[0])
        if t not in argument.diff(t).free_symbols:
            one, none = sympy.Integer(1), sympy.Integer(0)
            return [(argument, one, none) if isinstance(e, sympy.cos) else (argument, none, one)]
    raise NotAffineError("the excitation is no sum of harmonics of time")


def _product(left: list[Wave], right: list[Wave]) -> list[Wave]:
    """Multiply two sums of harmonics."""
    if len(left) * len(right) > _MOST:
        raise NotAffineError("the excitation has too many harmonics")
    half = sympy.Rational(1, 2)
    found = []
    for x, a, b in left:
        for y, c, d in right:
            if x == 0 or y == 0:
                found.append((x + y, a * c, a * d if x == 0 else b * c))
                continue
            found.append((sympy.expand(x - y), half * (a * c + b * d), half * (b * c - a * d)))
            found.append((sympy.expand(x + y), half * (a * c - b * d), half * (b * c + a * d)))
    return found


def _merged(waves: list[Wave]) -> list[Wave]:
    """Add up the harmonics of the same argument."""
    sums: dict[Any, tuple[Any, Any]] = {}
    for argument, a, b in waves:
        before = sums.get(argument, (sympy.Integer(0), sympy.Integer(0)))
        sums[argument] = before[0] + a, before[1] + b
    return [(argument, a, b) for argument, (a, b) in sums.items()]


def _collected(waves: list[Wave], t: Any) -> tuple[Wave, ...]:
    """Return the harmonics by their frequencies: phases go to the factors."""
    sums: dict[Any, tuple[Any, Any]] = {}
    for argument, a, sine in waves:
        w, phase, b = argument.diff(t), argument.xreplace({t: sympy.Integer(0)}), sine
        if w.could_extract_minus_sign():  # cos(-x) = cos(x), sin(-x) = -sin(x)
            w, phase, b = -w, -phase, -sine
        c, s = sympy.cos(phase), sympy.sin(phase)
        before = sums.get(w, (sympy.Integer(0), sympy.Integer(0)))
        other = sympy.Integer(0) if w == 0 else b * c - a * s
        sums[w] = before[0] + a * c + b * s, before[1] + other
    return tuple((w, a, b) for w, (a, b) in sums.items() if (a, b) != (0, 0))
