"""The law of a piecewise-linear model, as a certificate file states it: a hybrid automaton.

In a mode ``w' = M w``, w = (y, 1, cos(k omega t), sin(k omega t), ...), as long as surfaces, rows ``g w``,
are on the sides that it names. Where one is met, a transition leads on: to another mode, or by a map of y.
Entries are formulas of the parameters: known to as many digits as are asked for, and exactly where rational.
"""

from __future__ import annotations

import ast
import operator
from typing import Any

from flint import arb, arb_mat, fmpq

from contfric.verify.motion import Refused, see

FUNCTIONS = ("sin", "cos", "tan", "exp", "log", "sinh", "cosh", "tanh", "atan", "asin", "acos")
SUM, PRODUCT = {ast.Add: operator.add, ast.Sub: operator.sub}, {ast.Mult: operator.mul}
OPERATIONS: dict[type[ast.operator], Any] = SUM | PRODUCT | {ast.Div: operator.truediv}
ENTRIES = {"states", "frequency", "harmonics", "modes", "surfaces", "maps", "transitions"}
LARGEST_POWER = 64
Number = Any  # an exact fraction, or a ball


def value(text: Any, names: dict[str, Number]) -> Number:
    """Return the value of a formula: a fraction if it is one, else a ball."""
    see(isinstance(text, str | int) and len(str(text)) < 10_000, "entries are formulas")

    def of(node: ast.expr) -> Number:
        match node:
            case ast.Constant(value=int() | float() as number):
                return fraction(number)
            case ast.Name(id=name) if name in names:
                return names[name]
            case ast.Name(id="pi"):
                return arb.pi()
            case ast.UnaryOp(op=ast.USub(), operand=x):
                return -of(x)
            case ast.BinOp(left=x, op=ast.Pow(), right=y):
                return power(of(x), of(y))
            case ast.BinOp(left=x, op=op, right=y) if type(op) in OPERATIONS:
                return OPERATIONS[type(op)](of(x), of(y))
            case ast.Call(func=ast.Name(id="sqrt"), args=[x]):
                return power(of(x), fmpq(1, 2))
            case ast.Call(func=ast.Name(id="Abs"), args=[x]):
                return abs(of(x))
            case ast.Call(func=ast.Name(id=name), args=[x]) if name in FUNCTIONS:
                return getattr(arb(of(x)), name)()
        raise Refused(f"{ast.unparse(node)[:40]!r} is no formula of the parameters")

    return of(ast.parse(str(text), mode="eval").body)


def fraction(number: float) -> fmpq:
    """Return a number of a file, exactly."""
    return fmpq(*number.as_integer_ratio())


def power(x: Number, exponent: Number) -> Number:
    """Return a power with an exponent that is a whole number or a half of one."""
    see(isinstance(exponent, fmpq) and exponent.q in (1, 2), "exponents are whole or half numbers")
    see(abs(exponent) <= LARGEST_POWER, "exponents are small")
    return x ** int(exponent) if exponent.q == 1 else arb(x).sqrt() ** int(exponent.p)


def is_zero(x: Number) -> bool:
    """Tell whether a number is exactly zero."""
    return x == 0 if isinstance(x, fmpq) else bool(x.is_zero())


def times(row: list[Number], matrix: list[list[Number]]) -> list[Number]:
    """Return a row times a matrix, exact where they are."""
    pairs = [(c, other) for c, other in zip(row, matrix, strict=True) if not is_zero(c)]
    return [
        sum((c * o[j] for c, o in pairs if not is_zero(o[j])), fmpq(0))
        for j in range(len(matrix[0]))
    ]


def in_span(row: list[Number], others: list[list[Number]]) -> bool:
    """Tell whether a row is a combination of others, exactly."""
    if any(row is other for other in others):
        return True
    others, left = [list(other) for other in others], list(row)
    while others:
        own = others.pop()
        pivot = next((j for j, c in enumerate(own) if not is_zero(c)), None)
        if pivot is None or (isinstance(own[pivot], arb) and 0 in own[pivot]):
            continue
        for other in (*others, left):
            factor = other[pivot] / own[pivot]
            other[:] = [
                c if is_zero(o) or is_zero(factor) else c - factor * o
                for c, o in zip(other, own, strict=True)
            ]
            other[pivot] = fmpq(0)
    return all(is_zero(c) for c in left)


class Law:
    """The law of a file: fields, surfaces and maps as rows of the extended state, and transitions."""

    def __init__(self, data: Any, params: Any) -> None:
        names = {name: fraction(number) for name, number in params.items()}
        self.states, self.harmonics = data["states"][:], data["harmonics"][:]
        self.autonomous, self.n = data["frequency"] is None, len(self.states)
        waves = [f"{f}({k})" for k in self.harmonics for f in ("cos", "sin")]
        self.columns = [*self.states, "1", *waves]
        self.size, keys = len(self.columns), range(len(self.columns))
        whole = all(type(k) is int and k > 0 for k in self.harmonics)
        see(set(data) == ENTRIES and whole, "a law has no other entries")
        see(len(set(self.columns)) == self.size > self.n > 0, "states have their own names")
        self.omega = fmpq(1) if self.autonomous else value(data["frequency"], names)
        see(
            arb(self.omega) * (not self.autonomous or not waves),
            "harmonics have a frequency",
            False,
        )
        turns = [[fmpq(0)] * self.size for _ in keys[self.n :]]
        for j, k in enumerate(self.harmonics):
            turns[1 + 2 * j][self.n + 2 + 2 * j] = -k * self.omega
            turns[2 + 2 * j][self.n + 1 + 2 * j] = k * self.omega
        still = [[fmpq(int(j == k)) for j in keys] for k in keys[self.n :]]

        def row(entries: Any) -> list[Number]:
            see(set(entries) <= set(self.columns), "rows are of the states and harmonics")
            return [value(entries.get(name, 0), names) for name in self.columns]

        def matrix(rows: Any, rest: list[list[Number]]) -> list[list[Number]]:
            see(list(rows) == self.states, "there is a row for each state")
            return [*map(row, rows.values()), *rest]

        self.surfaces = {name: row(entries) for name, entries in data["surfaces"].items()}
        self.modes = {name: matrix(mode["field"], turns) for name, mode in data["modes"].items()}
        self.sides = {name: mode["inside"] for name, mode in data["modes"].items()}
        self.maps = {name: matrix(rows, still) for name, rows in data["maps"].items()}
        self.transitions = data["transitions"][:]
        known = all(len(mode) == 2 for mode in data["modes"].values())
        known = known and all(len(one) == 6 for one in self.transitions)
        see(known, "modes and transitions state nothing else")
        given = [
            *self.sides.values(),
            *(one[k] for one in self.transitions for k in ("when", "after")),
        ]
        signs = all(type(side) is int and abs(side) < 2 for each in given for side in each.values())
        see(signs, "sides are signs")


def dot(row: list[Number], w: arb_mat) -> arb:
    """Return a surface's value at an extended state."""
    return sum((arb(c) * w[j, 0] for j, c in enumerate(row) if not is_zero(c)), arb(0))


def is_kept(row: list[Number], matrix: list[list[Number]]) -> bool:
    """Tell whether a surface's value does not change in a mode, exactly."""
    return all(is_zero(c) for c in times(row, matrix))
