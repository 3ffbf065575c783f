"""Expressions as formulas of sympy, with derivatives that a compiled model can use.

Functions with kinks are classes of their own, so that their derivatives are what motion away from the
kink sees: ``d abs(x) = sign(x)``, ``d sign(x) = 0``, and ``where`` differentiates both of its sides.
(Sympy's own would bring Dirac's delta and Heaviside's step.) A power whose exponent is no whole number is a
class, too: the derivative ``e b**(e - 1)`` is finite at b = 0 where ``e b**e / b`` is not (also with e < 1,
where a factor 0 takes it away), and a little beyond b = 0, where an integrator looks, it goes on as
``-|b|**e``.

This module imports sympy; it is loaded when a model is built for the first time.
"""

from __future__ import annotations

import ast
import itertools
import math
import sys
from collections.abc import Collection, Mapping
from functools import lru_cache
from typing import Any
from zlib import crc32

import sympy

from contfric.errors import ModelError
from contfric.models.language.grammar import UNARY, Algebra, Scope

#: Powers of numbers up to this exponent stay exact; beyond, they are rounded.
_EXACT_POWER = 64
#: The largest ordinary number.
_LARGEST = sys.float_info.max
#: Places at which a formula is evaluated before it is simplified; digits there, and what may be rounding.
_TRIED, _DIGITS, _ROUNDING = 2, 30, 1e-15
#: Kinks inside of another one that are taken apart.
_NESTED = 6
#: Base at which a slope of a power is taken where the base is 0 and the slope may be infinite: what rounding
#: makes of the 0 of a base of size 1. A factor that vanishes there, as in ``abs(v)*abs(v)**0.9``, makes a
#: product of 0, which is its limit, and not ``0*inf``.
_BASE_AT_ZERO = sympy.Rational(1, 2**53)


class Sign(sympy.Function):  # type: ignore[misc]
    """The sign of x: 1, 0 or -1. Its derivative is 0: that of the solution on either side."""

    nargs = 1

    @classmethod
    def eval(cls, x: Any) -> Any:
        """Simplify numbers."""
        return sympy.sign(x) if x.is_number and x.is_real else None

    def fdiff(self, argindex: int = 1) -> Any:
        """Return the derivative."""
        return sympy.Integer(0)


class Abs(sympy.Function):  # type: ignore[misc]
    """The absolute value; its derivative is the sign."""

    nargs = 1

    @classmethod
    def eval(cls, x: Any) -> Any:
        """Simplify numbers."""
        return sympy.Abs(x) if x.is_number and x.is_real else None

    def fdiff(self, argindex: int = 1) -> Any:
        """Return the derivative."""
        return Sign(self.args[0])


class Where(sympy.Function):  # type: ignore[misc]
    """``Where(d, a, b)`` is a if d > 0, else b; the derivative is that of the side that holds."""

    nargs = 3

    @classmethod
    def eval(cls, d: Any, a: Any, b: Any) -> Any:
        """Simplify what is known."""
        if a == b:
            return a
        if d.is_number and d.is_real:
            return a if d > 0 else b
        return None

    def _eval_derivative(self, symbol: Any) -> Any:
        d, a, b = self.args
        return Where(d, a.diff(symbol), b.diff(symbol))


class Power(sympy.Function):  # type: ignore[misc]
    """``b**e`` where the exponent is no whole number."""

    nargs = 2

    @classmethod
    def eval(cls, b: Any, e: Any) -> Any:
        """Become an ordinary power where that is one of a number, or the exponent is whole."""
        return plain_power(b, e) if e.is_Integer or (b.is_number and e.is_number) else None

    def fdiff(self, argindex: int = 1) -> Any:
        """Return the derivative with respect to the base or the exponent."""
        b, e = self.args
        if argindex != 1:
            return PowerLog(b, e)
        finite = e.is_number and e > 1
        return e * Power(b if finite else Where(Abs(b), b, _BASE_AT_ZERO), e - 1)


class PowerLog(sympy.Function):  # type: ignore[misc]
    """``b**e log(b)``, and 0 at b = 0: its limit there for e > 0."""

    nargs = 2

    def fdiff(self, argindex: int = 1) -> Any:
        """Return the derivative with respect to the base; a second one to the exponent is not used."""
        b, e = self.args
        if argindex == 1:
            return e * PowerLog(b, e - 1) + Power(b, e - 1)
        return PowerLog(b, e) * sympy.log(b)


def plain_power(base: Any, exponent: Any) -> Any:
    """Return a power with a number as exponent; huge ones of numbers are not written out."""
    if not (base.is_number and exponent.is_number):
        return base**exponent
    try:
        value = float(base) ** float(exponent)
    except (ArithmeticError, TypeError, ValueError):
        value = math.inf
    if isinstance(value, complex) or not math.isfinite(value):
        raise ModelError(f"the power ({base})**({exponent}) has no finite real value")
    if exponent.is_Rational and abs(exponent) <= _EXACT_POWER:
        return base**exponent
    return sympy.Rational(repr(value))


def _power(base: Any, exponent: Any) -> Any:
    return plain_power(base, exponent) if exponent.is_Integer else Power(base, exponent)


#: Expressions as formulas; decimal numbers are exact fractions until the code is written.
FORMULAS: Algebra[Any] = Algebra(
    number=sympy.Rational,
    functions={
        **{name: getattr(sympy, name) for name in UNARY if name not in ("abs", "sign")},
        "abs": Abs,
        "sign": Sign,
    },
    where=Where,
    divide=lambda a, b: a / b,
    power=_power,
    pi=sympy.pi,
)


def formula(tree: ast.expr, scope: Scope[Any]) -> Any:
    """Return an expression as a formula of the symbols in a scope.

    Raises
    ------
    ModelError
        If it has no finite real value, such as ``1/0`` or ``sqrt(-1)``.
    """
    found = sympy.sympify(scope.evaluate(tree))
    if found.has(sympy.zoo, sympy.oo, -sympy.oo, sympy.nan, sympy.I):
        raise ModelError(f"'{ast.unparse(tree)}' has no finite real value")
    if any(abs(number) > _LARGEST for number in found.atoms(sympy.Number)):
        raise ModelError(f"'{ast.unparse(tree)}' has a number that is too large")
    return found


def resolved(expression: Any, signs: Mapping[Any, int], moving: Collection[Any]) -> Any:
    """Return a formula where the signs of some parts are known: kinks that a mode does not see.

    What is a known part times a factor of parameters, ``s/phi - 1`` of ``s - phi``, has its sign times that
    of the factor; what depends on such a sign is looked at for either. Above d and -d, as a dead zone has
    them, x is their mean; between them ``abs(x) - d`` has one sign, whichever x has.

    Parameters
    ----------
    signs : from a formula to its sign, +1 or -1
    moving : the symbols that are no parameters
    """
    moved = set(moving)
    known = {x: sign for x, sign in signs.items() if x.free_symbols & moved}

    def ratio(x: Any) -> Any:
        """Return the sign of a known part, or of the sum of two that have theirs, times a factor."""
        sums = (
            (s * x1 + r * x2, 1) for (x1, s), (x2, r) in itertools.combinations(known.items(), 2)
        )
        factors = (
            (_factor(x, k, tuple(moving)), s) for k, s in itertools.chain(known.items(), sums)
        )
        factor, s = next(((f, s) for f, s in factors if f != 0), (sympy.Integer(0), 0))
        minus = factor.could_extract_minus_sign()
        return -s * Sign(-factor) if minus else s * Sign(factor)

    def side(x: Any) -> Any:
        if not x.free_symbols & moved:
            return Sign(x)
        chosen = next((w for w in x.atoms(Where) if not w.args[0].free_symbols & moved), None)
        if chosen is not None:
            up, down = (side(x.xreplace({chosen: part})) for part in chosen.args[1:])
            return 0 if 0 in (up, down) else Where(chosen.args[0], up, down)
        kinks = [k for k in x.atoms(Abs, Sign, Where) if k.args[0].free_symbols & moved]
        if (found := ratio(x)) != 0 or not kinks:
            return found
        inner = min(kinks, key=str)
        up, down = (side(x.xreplace({inner: part})) for part in _either(inner))
        return up if up == down else 0

    swaps: dict[Any, Any] = {}
    for part in expression.atoms(Sign, Abs, Where):
        s = side(part.args[0]) if part.args[0].free_symbols & moved else 0
        if s == 0:
            continue
        if isinstance(part, Sign):
            swaps[part] = s
        elif isinstance(part, Abs):
            swaps[part] = s * part.args[0]
        else:
            swaps[part] = Where(s, *part.args[1:])
    return resolved(expression.xreplace(swaps), signs, moving) if swaps else expression


def _either(kink: Any) -> tuple[Any, Any]:
    """Return what a kink is on one side, and on the other."""
    if isinstance(kink, Where):
        return kink.args[1], kink.args[2]
    size = kink.args[0] if isinstance(kink, Abs) else sympy.Integer(1)
    return size, -size


@lru_cache(maxsize=4096)
def _factor(x: Any, known: Any, moving: tuple[Any, ...]) -> Any:
    """Return x over another formula if only parameters are in that, else 0: most differ at two places."""
    if (x.free_symbols ^ known.free_symbols) & set(moving):
        return sympy.Integer(0)
    ratios = [_at(x, moving, shift) / _at(known, moving, shift) for shift in range(_TRIED)]
    if all(r.is_Float for r in ratios) and max(ratios) - min(ratios) > _ROUNDING * abs(ratios[0]):
        return sympy.Integer(0)
    ratio = sympy.cancel(x / known)
    return sympy.Integer(0) if ratio.free_symbols & set(moving) else ratio


def _at(formula: Any, moving: Collection[Any], shift: int) -> Any:
    """Return the value of a formula at numbers, the same for the same symbols; ``moving`` are shifted.

    No number where it has none.
    """
    numbers = {
        s: sympy.Rational(crc32(str(s).encode()) % 97 + 13 * (1 + shift * (s in moving)), 31)
        for s in formula.free_symbols
    }
    try:
        return sympy.N(formula.xreplace(numbers), _DIGITS)
    except ModelError:  # the root of a number that is negative there
        return sympy.nan


def kinks_in(expression: Any, moving: Collection[Any]) -> list[Any]:
    """Return what changes its sign at the kinks and jumps of a formula, if it depends on ``moving``."""
    parts = (part.args[0] for part in _bending(expression))
    signs = {
        sign: sympy.Integer(1) for sign in expression.atoms(Sign)
    }  # where only these change, they are parts
    return sorted({x for x in parts if x.xreplace(signs).free_symbols & set(moving)}, key=str)


def branches_of(kink: Any) -> set[Any]:
    """Return what a formula is on the sides of the kinks inside of it: of ``min(x, 1) - c`` two.

    Examples
    --------
    >>> x = sympy.Symbol("x")
    >>> sorted(map(str, branches_of(Where(x - 1, 1, x) - 2)))
    ['-1', 'x - 2']
    """
    inner = sorted(kink.atoms(Abs, Sign, Where), key=str)
    if not inner or len(inner) > _NESTED:
        return {kink}
    return {p for part in _either(inner[0]) for p in branches_of(kink.xreplace({inner[0]: part}))}


def _bending(expression: Any) -> set[Any]:
    """Return the parts of a formula that may give it a kink or a jump where their argument is 0.

    A kink of a condition is none of what it decides: ``where(abs(x) > 1, a, b)`` changes at 1 and -1, and not
    at 0. A jump of it is one.
    """
    found, seen = set(), set()
    left = [(expression, False)]
    while left:
        part, decides = left.pop()
        if (part, decides) in seen:
            continue
        seen.add((part, decides))
        if isinstance(part, (Sign, Abs, Where)) and not (decides and _is_continuous(part)):
            found.add(part)
        first = decides or isinstance(part, Where)
        left += [(x, decides or (first and k == 0)) for k, x in enumerate(part.args)]
    return found


def _is_continuous(part: Any) -> bool:
    """Tell whether a part does not jump: the size of something, or the larger or smaller of two."""
    if isinstance(part, Where):
        d, a, b = part.args
        return bool(d in (a - b, b - a))
    return isinstance(part, Abs)


#: Functions that have values and limits at all numbers, and no jumps.
_CONTINUOUS = (
    *(sympy.Add, sympy.Mul, Abs, sympy.sin, sympy.cos, sympy.exp),
    *(sympy.sinh, sympy.cosh, sympy.tanh, sympy.atan),
)


#: Those that are never steep where their arguments are not, and of these the ones without kinks.
_GENTLE = (sympy.Add, sympy.Mul, Abs, sympy.sin, sympy.cos)
_SMOOTH = (sympy.Add, sympy.Mul, sympy.sin, sympy.cos)


def cannot_jump(expression: Any, moving: Collection[Any]) -> bool:
    """Tell whether a formula is continuous wherever ``moving`` are: all that depends on them is."""
    return _made_of(_CONTINUOUS, expression, frozenset(moving))


def is_gentle(expression: Any, moving: Collection[Any]) -> bool:
    """Tell whether a formula neither jumps nor is as steep as a jump: polynomials, sines, sizes of them."""
    return _made_of(_GENTLE, expression, frozenset(moving))


def is_smooth(expression: Any, moving: Collection[Any]) -> bool:
    """Tell whether the slopes of a formula are so, too: polynomials and sines."""
    return _made_of(_SMOOTH, expression, frozenset(moving))


def _made_of(functions: tuple[Any, ...], expression: Any, moving: frozenset[Any]) -> bool:
    """Tell whether all of a formula that depends on ``moving`` is made of functions and whole powers."""
    if not expression.free_symbols & moving or expression.is_Symbol:
        return True
    whole = expression.is_Pow and expression.exp.is_Integer and expression.exp > 0
    known = whole or isinstance(expression, functions)
    return known and all(_made_of(functions, part, moving) for part in expression.args)


def may_have_kinks(expression: Any, moving: Collection[Any]) -> bool:
    """Tell whether a formula has a function of ``moving`` whose slope may jump without a sign that tells.

    Where its argument only touches the end of what the function is defined for: ``acos(cos(t))``, and
    ``sqrt(x**2)``, which is not simplified, as x has no sign.
    """
    roots = {p for p in expression.atoms(sympy.Pow) if not p.exp.is_Integer}
    found = roots | expression.atoms(Power, sympy.asin, sympy.acos)
    return any(part.free_symbols & set(moving) for part in found)


def vanishes(expression: Any) -> bool:
    """Tell whether a formula is 0 everywhere.

    One that is not is not 0 at some numbers, most often the first ones, which takes a thousandth of the time.
    """
    if not expression.free_symbols:
        return bool(sympy.simplify(expression) == 0)
    for shift in range(_TRIED):
        there = _at(expression, expression.free_symbols, shift)
        if there.is_Float and abs(there) > _ROUNDING:
            return False
    return bool(sympy.simplify(expression) == 0)
