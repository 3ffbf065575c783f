r"""An expression as a list of operations that compiled code evaluates, and differentiates backwards.

The value of operation k is :math:`w_k`, made of those before it. With :math:`\bar w_k = \partial
g/\partial w_k` of the expression g, the last of them, one pass backwards gives all derivatives of g
(reverse mode; A. Griewank and A. Walther, Evaluating Derivatives, SIAM 2008, chapter 3):

.. math:: \bar w_j \mathrel{+}= \bar w_k \frac{\partial w_k}{\partial w_j}

for every argument j of k, from the last k to the first. What it costs does not grow with the number of states
and parameters.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from contfric.models.language.grammar import TIME as TIME_NAME
from contfric.models.language.grammar import UNARY, Algebra, Scope
from contfric.quantities.codes import (
    ADD,
    CONSTANT,
    DIVIDE,
    FIRST_FUNCTION,
    MULTIPLY,
    NEGATE,
    OBSERVABLE,
    PARAMETER,
    POWER,
    STATE,
    SUBTRACT,
    TIME,
    WHERE,
)

if TYPE_CHECKING:
    from contfric.base.arrays import FloatArray
    from contfric.models.definition import Model


class Tape(NamedTuple):
    """Expressions as operations, as the compiled engine takes them.

    Attributes
    ----------
    operations : what each of them does, and its arguments, shape (K, 4)
    constants : numbers that stand in the expressions
    outputs : which operations are the expressions, shape (L,)
    noted : which operations are arguments of ``abs``, ``sign`` and ``where``: expressions have kinks or jumps
        where one changes its sign
    """

    operations: NDArray[np.int64]
    constants: FloatArray
    outputs: NDArray[np.int64]
    noted: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Recorded:
    """The value of an operation, while the operations of an expression are written down."""

    recorder: Recorder
    index: int

    def _with(self, operation: int, other: Recorded) -> Recorded:
        return self.recorder.add(operation, self.index, other.index)

    def __neg__(self) -> Recorded:
        return self.recorder.add(NEGATE, self.index)

    def __add__(self, other: Recorded) -> Recorded:
        return self._with(ADD, other)

    def __sub__(self, other: Recorded) -> Recorded:
        return self._with(SUBTRACT, other)

    def __mul__(self, other: Recorded) -> Recorded:
        return self._with(MULTIPLY, other)

    def __truediv__(self, other: Recorded) -> Recorded:
        return self._with(DIVIDE, other)

    def __pow__(self, other: Recorded) -> Recorded:
        return self._with(POWER, other)


@dataclass(eq=False)
class Recorder:
    """Operations that are written down, each once."""

    rows: dict[tuple[int, int, int, int], int] = field(default_factory=dict)
    constants: list[float] = field(default_factory=list)
    noted: dict[int, None] = field(default_factory=dict)

    def add(self, operation: int, a: int = 0, b: int = 0, c: int = 0) -> Recorded:
        """Write an operation down; return its value."""
        return Recorded(self, self.rows.setdefault((operation, a, b, c), len(self.rows)))

    def constant(self, value: float | str) -> Recorded:
        """Write a number down."""
        number = float(value)
        if number not in self.constants:
            self.constants.append(number)
        return self.add(CONSTANT, self.constants.index(number))

    def apply(self, name: str, x: Recorded) -> Recorded:
        """Write a function of one argument down."""
        if name in ("abs", "sign"):
            self.noted[x.index] = None
        return self.add(FIRST_FUNCTION + UNARY.index(name), x.index)

    def where(self, d: Recorded, a: Recorded, b: Recorded) -> Recorded:
        """Write a choice down: a where d > 0, else b."""
        self.noted[d.index] = None
        return self.add(WHERE, d.index, a.index, b.index)

    def algebra(self) -> Algebra[Recorded]:
        """Return the algebra in which evaluating is writing down."""
        functions = {name: partial(self.apply, name) for name in UNARY}
        return Algebra(
            self.constant,
            functions,
            self.where,
            Recorded.__truediv__,
            Recorded.__pow__,
            self.constant(math.pi),
        )

    def tape(self, outputs: Iterable[Recorded]) -> Tape:
        """Return what has been written down."""
        return Tape(
            np.array(list(self.rows), dtype=np.int64).reshape(-1, 4),
            np.array(self.constants),
            np.array([output.index for output in outputs], dtype=np.int64),
            np.array(list(self.noted), dtype=np.int64),
        )


def tape_of(
    model: Model,
    asked: Iterable[tuple[ast.expr, str]],
    definitions: Mapping[str, ast.expr],
    observables: Iterable[str],
) -> Tape:
    """Return expressions along an orbit as one tape: squares for ``rms``, times two waves for a harmonic.

    The rate of the waves follows the parameters of the model, as one more.

    Parameters
    ----------
    asked : each expression, and the kind of its functional
    """
    recorder, count = Recorder(), len(model.parameter_names)
    values = {TIME_NAME: recorder.add(TIME)}
    values |= {name: recorder.add(STATE, k) for k, name in enumerate(model.states)}
    values |= {name: recorder.add(PARAMETER, k) for k, name in enumerate(model.parameter_names)}
    values |= {name: recorder.add(OBSERVABLE, model.observable_index[name]) for name in observables}
    scope, outputs = Scope(recorder.algebra(), values, definitions), []
    for tree, kind in asked:
        found = scope.evaluate(tree)
        if kind in ("amplitude", "phase"):
            angle = values[TIME_NAME] * recorder.add(PARAMETER, count)
            outputs += [found * recorder.apply(wave, angle) for wave in ("cos", "sin")]
        else:
            outputs.append(found * found if kind == "rms" else found)
    return _needed(recorder, outputs)


def _needed(recorder: Recorder, outputs: list[Recorded]) -> Tape:
    """Return the tape without what its outputs do not depend on."""
    whole = recorder.tape(outputs)
    used = np.zeros(len(whole.operations), dtype=bool)
    used[whole.outputs] = True
    for k in reversed(range(len(used))):
        if used[k]:
            used[_arguments(whole.operations[k])] = True
    place = np.cumsum(used) - 1
    kept = whole.operations[used]
    for row in kept:
        row[1 : 1 + len(_arguments(row))] = place[_arguments(row)]
    noted = whole.noted[used[whole.noted]]
    return Tape(kept, whole.constants, place[whole.outputs], place[noted])


def _arguments(row: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the operations that one is made of."""
    operation = row[0]
    if operation <= OBSERVABLE:
        return row[:0]
    count = 1 if operation == NEGATE or operation >= FIRST_FUNCTION else 2
    return row[1 : 4 if operation == WHERE else 1 + count]
