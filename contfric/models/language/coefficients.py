"""Formulas of affine modes without computer algebra: coefficients of the parameters, states and harmonics.

An expression of a model is evaluated in an algebra (:class:`contfric.models.language.grammar.Algebra`) of

* *coefficients*: sums ``c1 m1 + c2 m2 + ...`` of numbers times products of powers of parameters and of
  functions of them, such as ``2 k - c/m + cos(beta)``,
* *affine forms*: coefficients of the states, of 1, and of the cosine and sine of each frequency.

It takes a thousandth of the time that sympy takes, and a model of many modes has thousands of formulas.
What is no affine form is refused with the reason, as in :mod:`contfric.models.generated.affine`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from contfric.models.language.grammar import FLOATS, UNARY, Algebra
from contfric.models.language.not_affine import NotAffineError

#: What a coefficient is a sum over: a product of atoms to whole powers.
Product = tuple[tuple["Atom", int], ...]
#: A sum that should vanish leaves this, relative to its largest part: rounding of a few operations.
_ROUNDING = 1e-13
#: Most products of harmonics in one formula: one with more is no sum of a few harmonics.
_MOST = 200


@dataclass(frozen=True, order=True)
class Atom:
    """A parameter (its name), or a function of coefficients.

    Attributes
    ----------
    name : of the parameter or of the function; ``inverse`` and ``power`` among them
    of : arguments of the function
    """

    name: str
    of: tuple[Coefficient, ...] = ()


@dataclass(frozen=True, order=True)
class Coefficient:
    """A function of the parameters: a sum of numbers times products."""

    parts: tuple[tuple[Product, float], ...] = ()

    def __add__(self, other: Coefficient) -> Coefficient:
        found = dict(self.parts)
        for product, c in other.parts:
            before = found.get(product, 0.0)
            total = before + c
            small = _ROUNDING * (abs(before) + abs(c))
            found[product] = 0.0 if abs(total) <= small else total
        return Coefficient(tuple(sorted((p, c) for p, c in found.items() if c != 0.0)))

    def __neg__(self) -> Coefficient:
        return Coefficient(tuple((product, -c) for product, c in self.parts))

    def __sub__(self, other: Coefficient) -> Coefficient:
        return self + -other

    def __mul__(self, other: Coefficient) -> Coefficient:
        found = Coefficient()
        for first, a in self.parts:
            found = found + Coefficient(tuple((_joined(first, p), a * c) for p, c in other.parts))
        return found

    def __bool__(self) -> bool:
        return bool(self.parts)

    @property
    def number(self) -> float | None:
        """The value of one that depends on no parameter, else None."""
        if not self.parts:
            return 0.0
        return self.parts[0][1] if len(self.parts) == 1 and not self.parts[0][0] else None

    def inverse(self) -> Coefficient:
        """Return 1 over it."""
        if len(self.parts) == 1:
            (product, c), *_ = self.parts
            return Coefficient(((tuple((atom, -power) for atom, power in product), 1.0 / c),))
        return self.function("inverse")

    def function(self, name: str, *more: Coefficient) -> Coefficient:
        """Return a function of it, by its name in the language of expressions."""
        return Coefficient((((((Atom(name, (self, *more)), 1),)), 1.0),))


def _joined(first: Product, second: Product) -> Product:
    powers: dict[Atom, int] = {}
    for atom, power in (*first, *second):
        powers[atom] = powers.get(atom, 0) + power
    return tuple(sorted((atom, power) for atom, power in powers.items() if power != 0))


def number(value: float) -> Coefficient:
    """Return a coefficient that is a number."""
    return Coefficient((((), value),)) if value != 0.0 else Coefficient()


def parameter(name: str) -> Coefficient:
    """Return a coefficient that is a parameter."""
    return Coefficient(((((Atom(name), 1),), 1.0),))


ONE, _ZERO = number(1.0), Coefficient()
#: What an affine form has coefficients of: a state, 1 (no name), time, a cosine or a sine with its frequency.
Key = tuple[str, Any]
CONSTANT: Key = ("1", None)
_TIME: Key = ("t", None)


@dataclass(frozen=True)
class Affine:
    """An affine form: coefficients by states, harmonics, and 1."""

    parts: Mapping[Key, Coefficient] = field(default_factory=dict)

    def __hash__(self) -> int:
        return hash(frozenset(self.parts.items()))

    @property
    def constant(self) -> Coefficient | None:
        """The value of one that depends on parameters only, else None."""
        if not self.parts:
            return Coefficient()
        return self.parts[CONSTANT] if set(self.parts) == {CONSTANT} else None

    def __add__(self, other: Affine) -> Affine:
        found = dict(self.parts)
        for key, c in other.parts.items():
            found[key] = found[key] + c if key in found else c
        return Affine({key: c for key, c in found.items() if c})

    def __neg__(self) -> Affine:
        return Affine({key: -c for key, c in self.parts.items()})

    def __sub__(self, other: Affine) -> Affine:
        return self + -other

    def __mul__(self, other: Affine) -> Affine:
        for one, rest in ((self.constant, other), (other.constant, self)):
            if one is not None:
                return rest.scaled(one)
        if len(self.parts) * len(other.parts) > _MOST:
            raise NotAffineError("the excitation has too many harmonics")
        found = Affine()
        for first, a in self.parts.items():
            for second, b in other.parts.items():
                found = found + _product(first, second).scaled(a * b)
        return found

    def scaled(self, by: Coefficient) -> Affine:
        """Return it times a coefficient."""
        return Affine({key: c * by for key, c in self.parts.items()}) if by else Affine()


def constant(value: Coefficient) -> Affine:
    """Return an affine form that depends on the parameters only."""
    return Affine({CONSTANT: value}) if value else Affine()


def _wave(kind: str, frequency: Coefficient, by: Coefficient = ONE) -> Affine:
    """Return the cosine or sine of a frequency, of the sign that comes first."""
    if not frequency:
        return constant(by) if kind == "cos" else Affine()
    if frequency.parts[0][1] < 0.0:
        return Affine({(kind, -frequency): by if kind == "cos" else -by})
    return Affine({(kind, frequency): by})


def _product(first: Key, second: Key) -> Affine:
    """Multiply two of what forms have coefficients of."""
    if first == CONSTANT or second == CONSTANT:
        return Affine({second if first == CONSTANT else first: ONE})
    kinds = first[0], second[0]
    if not {*kinds} <= {"cos", "sin"}:
        raise NotAffineError("a product of states, or of a state and time")
    half = number(0.5)
    apart, together = first[1] - second[1], first[1] + second[1]
    if kinds == ("cos", "cos"):
        return _wave("cos", apart, half) + _wave("cos", together, half)
    if kinds == ("sin", "sin"):
        return _wave("cos", apart, half) - _wave("cos", together, half)
    if kinds == ("sin", "cos"):
        return _wave("sin", together, half) + _wave("sin", apart, half)
    return _wave("sin", together, half) - _wave("sin", apart, half)


def _harmonic(name: str, argument: Affine) -> Affine:
    """Return the cosine or sine of ``w t + phase``."""
    if not set(argument.parts) <= {_TIME, CONSTANT}:
        raise NotAffineError(f"{name} of a state")
    w = argument.parts.get(_TIME, Coefficient())
    phase = argument.parts.get(CONSTANT, Coefficient())
    cos, sin = (_function(kind, phase) for kind in ("cos", "sin"))
    if name == "cos":  # cos(a + b) = cos a cos b - sin a sin b
        return _wave("cos", w, cos) - _wave("sin", w, sin) if sin else _wave("cos", w, cos)
    return _wave("sin", w, cos) + _wave("cos", w, sin) if sin else _wave("sin", w, cos)


def _function(name: str, argument: Coefficient) -> Coefficient:
    value = argument.number
    if value is None:
        return argument.function(name)
    found = FLOATS.functions[name](value)
    if not math.isfinite(found):
        raise NotAffineError(f"{name}({value:g}) has no value")
    return number(found)


def _applied(name: str) -> Any:
    def value(argument: Affine) -> Affine:
        known = argument.constant
        if known is not None:
            return constant(_function(name, known))
        if name in ("cos", "sin"):
            return _harmonic(name, argument)
        raise NotAffineError(f"{name} of a state or of time")

    return value


def _divided(a: Affine, b: Affine) -> Affine:
    by = b.constant
    if not by:
        raise NotAffineError("divided by a state or by time" if by is None else "divided by 0")
    return a.scaled(by.inverse())


def _power(base: Affine, exponent: Affine) -> Affine:
    known, power = base.constant, exponent.constant
    if power is None:
        raise NotAffineError("a state or time in an exponent")
    whole = power.number
    if whole is not None and whole == round(whole) and 0 <= whole <= 8:  # cos**8: 256 products
        found = constant(ONE)
        for _ in range(int(whole)):
            found = found * base
        return found
    if known is None:
        raise NotAffineError("a power of a state or of time")
    if whole is not None and whole == round(whole) and len(known.parts) == 1:
        found = constant(ONE)
        for _ in range(abs(int(whole))):
            found = found.scaled(known.inverse())
        return found
    return constant(known.function("power", power))


def _where(condition: Affine, yes: Affine, no: Affine) -> Affine:
    known = condition.constant
    if known is None:
        raise NotAffineError("its parts change with a condition")
    if known.number is not None:
        return yes if known.number > 0.0 else no
    keys = {*yes.parts, *no.parts}
    either = {key: (yes.parts.get(key, _ZERO), no.parts.get(key, _ZERO)) for key in keys}
    return Affine({key: known.function("where", *pair) for key, pair in either.items()})


#: Affine forms.
AFFINE: Algebra[Affine] = Algebra(
    number=lambda text: constant(number(float(text))),
    functions={name: _applied(name) for name in UNARY},
    where=_where,
    divide=_divided,
    power=_power,
    pi=constant(number(math.pi)),
)


def within(sides: Mapping[Affine, int]) -> Algebra[Affine]:
    """Return the algebra in a mode, where the signs of some affine forms are known.

    There ``sign``, ``abs`` and ``where`` of such a form are affine.
    """

    def side(argument: Affine) -> int:
        return sides.get(argument, 0) or -sides.get(-argument, 0)

    def sign(argument: Affine) -> Affine:
        known = side(argument)
        return constant(number(float(known))) if known else AFFINE.functions["sign"](argument)

    def size(argument: Affine) -> Affine:
        known = side(argument)
        return argument.scaled(number(float(known))) if known else AFFINE.functions["abs"](argument)

    def where(condition: Affine, yes: Affine, no: Affine) -> Affine:
        known = side(condition)
        return (yes if known > 0 else no) if known else _where(condition, yes, no)

    return replace(AFFINE, functions={**AFFINE.functions, "sign": sign, "abs": size}, where=where)


def symbols(states: tuple[str, ...], parameters: tuple[str, ...]) -> dict[str, Affine]:
    """Return the names of expressions as affine forms: time, states and parameters."""
    found = {"t": Affine({_TIME: ONE})}
    found |= {name: Affine({("y", i): ONE}) for i, name in enumerate(states)}
    return found | {name: constant(parameter(name)) for name in parameters}


def checked(form: Affine) -> Affine:
    """Return an affine form that has no ramp of time.

    Raises
    ------
    NotAffineError
        If it has one.
    """
    if _TIME in form.parts:
        raise NotAffineError("it grows with time")
    return form
