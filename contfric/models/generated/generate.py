"""The compiled functions of a described model, written as a module of Python.

Each function comes from formulas and their exact derivatives; the rate of an observable along a mode,
``o_t + o_y . f``, has the second derivatives of the observable in its gradient. What the user wrote never
stands in the module: names are replaced by ``t``, ``s0 ...`` (states) and ``p0 ...``.

This module imports sympy; it is loaded when a model is built for the first time.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from contfric.models.described.description import Description
from contfric.models.generated.affine import AffineForm
from contfric.models.generated.code import SLOPES, VALUES, Lines, Output, write_block
from contfric.models.generated.linear_code import (
    CoefficientLayout,
    LinearWriter,
    layout_of,
    places_of,
)
from contfric.models.generated.motion import motion_code
from contfric.models.generated.symbols import Formulas, moves_in_closed_form
from contfric.models.language.derivatives import derivative
from contfric.models.language.formulas import vanishes

_HEAD = '''"""Compiled functions of a model, generated from its definition; not to be edited.

Digest of the sources that it was generated with: {digest}
"""

import math

from contfric.compiled import (
    f8,
    field_signature,
    i8,
    level_signature,
    observe_signature,
    period_signature,
    rate_signature,
    reset_signature,
    scale_signature,
    vector,
)
from contfric.flow.integrated import AffineModes, Functions
from contfric.flow.layouts import AFFINE as SIGNATURES
from contfric.models.generated.unit import GeneratedUnit

unit = GeneratedUnit(__name__, __file__)
kernel, helper = unit.kernel, unit.helper


@helper(f8(f8))
def sign(x):
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@helper(f8(f8, f8))
def power(base, exponent):
    if base >= 0.0 or exponent == math.floor(exponent):
        return base**exponent
    return -((-base) ** exponent)


@helper(f8(f8, f8))
def power_log(base, exponent):
    return power(base, exponent) * math.log(abs(base)) if base != 0.0 else 0.0

'''


def module_source(description: Description, digest: str) -> str:
    """Return the module of a model.

    Parameters
    ----------
    digest : of the sources that the module depends on
    """
    formulas = Formulas(description)
    order = [s.name for s in formulas.surfaces]
    names = [s.name for s in description.surfaces]
    code = Lines()
    code.add(_HEAD.format(digest=digest))
    writer = _Writer(code, formulas)
    closed, seen = writer.linear()
    writer.vectors("field", "mode", "out", formulas.fields)
    writer.scalars("observe_at(c, t, y, p, which, grad)", "c", formulas.observables())
    rates = formulas.rates()
    writer.rates(rates)
    levels, resets = formulas.levels(), formulas.resets()
    writer.of_parameters("level(k, p, which, grad)", "k", [levels[names.index(n)] for n in order])
    writer.of_parameters("period(p, which, grad)", None, [formulas.period()])
    writer.vectors("reset", "k", "y1", [resets[names.index(n)] for n in order])
    writer.vectors("onto", "mode", "y1", formulas.projections())
    writer.scales(formulas.scales(), formulas.positive())
    timed = [
        c for c, o in enumerate(formulas.observables()) if not o.free_symbols & set(formulas.y)
    ]
    idle = _idle(description, rates)
    code.add(motion_code(description, idle, timed, closed, seen))
    return str(code)


def _idle(description: Description, rates: list[list[Any]]) -> list[tuple[int, int]]:
    """Return the pairs (mode, observable) for which the observable does not change along the mode.

    Only a mode that slides can hide a zero in a long formula.
    """
    pieces = 1 << len(description.kinks)
    return [
        (m, c)
        for m, mode in enumerate(description.modes)
        for c, every in enumerate(zip(*rates[m * pieces : (m + 1) * pieces], strict=True))
        if all(rate == 0 or (0 in mode.sides.values() and vanishes(rate)) for rate in every)
    ]


#: The functions with their signatures; those of them that take the piece of a mode.
_KINDS = {
    "field": "field",
    "observe_at": "observe",
    "rate_at": "rate",
    "level": "level",
    "period": "period",
    "reset": "reset",
    "onto": "field",
    "size_of": "scale",
}
_OF_PIECES = {"field", "observe_at", "rate_at"}


class _Writer:
    """Writes the functions of a model."""

    def __init__(self, code: Lines, formulas: Formulas) -> None:
        self.code, self.f = code, formulas

    def linear(self) -> tuple[list[int], list[int]]:
        """Write the helpers of what is affine; return the pieces and the observables that are."""
        forms = self.f.affine_fields()
        if not moves_in_closed_form(self.f.description, forms):
            return [], []
        sights = [self.f.affine([o]) for o in self.f.observables()]
        every = [
            form for found in (*forms, *sights) if not isinstance(found, str) for form in found
        ]
        places = places_of(every)

        def layouts(found: list[list[AffineForm] | str]) -> list[CoefficientLayout | None]:
            return [None if isinstance(f, str) else layout_of(f, places) for f in found]

        pieces, seen = layouts(forms), layouts(sights)
        if any(pieces):
            LinearWriter(self.code, self._head, len(self.f.y), self.f.p).write(pieces, seen, places)
        return [i for i, x in enumerate(pieces) if x], [c for c, x in enumerate(seen) if x]

    def vectors(self, name: str, index: str, target: str, rows: list[list[Any]]) -> None:
        """Write a vector function of state, one block for each index."""
        n = len(self.f.y)

        def outputs(row: list[Any]) -> list[Output]:
            found = [Output(VALUES, f"{target}[{i}]", e) for i, e in enumerate(row)]
            for i, e in enumerate(row):
                found += [
                    Output(SLOPES, f"jac[{i}, {m}]", derivative(e, s))
                    for m, s in enumerate((self.f.t, *self.f.y))
                ]
                found += [
                    Output(k, f"jac[{i}, {1 + n} + j]", derivative(e, s))
                    for k, s in enumerate(self.f.p)
                ]
            return _without_idle(found)

        columns = [f"jac[{i}, {1 + n} + j] = 0.0" for i in range(n)]
        head = f"{name}({index}, t, y, p, which, {target}, jac)"
        self._blocks(head, index, [outputs(row) for row in rows], "jac", columns, None)

    def scalars(self, head: str, index: str, values: list[Any]) -> None:
        """Write a scalar function of state with its gradient."""
        idle = [f"grad[{1 + len(self.f.y)} + j] = 0.0"]
        self._blocks(head, index, [self._gradient(e) for e in values], "grad", idle, "value")

    def rates(self, rows: list[list[Any]]) -> None:
        """Write the rates of all observables along all modes."""
        flat = [e for row in rows for e in row]
        self.scalars("rate_at(mode, c, t, y, p, which, grad)", f"mode * {len(rows[0])} + c", flat)

    def _gradient(self, e: Any) -> list[Output]:
        n = len(self.f.y)
        found = [Output(VALUES, "value", e)]
        found += [
            Output(SLOPES, f"grad[{m}]", derivative(e, s))
            for m, s in enumerate((self.f.t, *self.f.y))
        ]
        found += [Output(k, f"grad[{1 + n} + j]", derivative(e, s)) for k, s in enumerate(self.f.p)]
        return _without_idle(found)

    def of_parameters(self, head: str, index: str | None, values: list[Any]) -> None:
        """Write a scalar function of the parameters alone."""
        blocks = [
            _without_idle(
                [
                    Output(VALUES, "value", e),
                    *(Output(k, "grad[j]", derivative(e, s)) for k, s in enumerate(self.f.p)),
                ]
            )
            for e in values
        ]
        self._blocks(head, index, blocks, "grad", ["grad[j] = 0.0"], "value")

    def scales(self, values: list[Any], positive: list[int]) -> None:
        """Write the sizes of states, the units of their tolerances: at most 1; negative of positive ones."""
        blocks = [[Output(VALUES, "value", e)] for e in values]
        self._blocks("size_of(i, p)", "i", blocks, "", [], "value")
        self.code.add("", "@kernel(scale_signature)")
        self.code.open("def scale_of(i, p):")
        self.code.add("size = abs(size_of(i, p))", "size = size if 0.0 < size < 1.0 else 1.0")
        known = " or ".join(f"i == {k}" for k in positive)
        self.code.add(f"return -size if {known} else size" if known else "return size")
        self.code.close()

    def _define(self, head: str, blocks: list[list[Output]]) -> None:
        """Write the head of a function, and take what its formulas need out of the arrays."""
        formulas = [o.expression for outputs in blocks for o in outputs]
        self._head(head, formulas, self._decorator(head.partition("(")[0]))

    def _decorator(self, name: str) -> str:
        """Return what a function is: a kernel, or a helper of others where these look for the piece first."""
        inside = name == "size_of" or (self.f.description.kinks and name in _OF_PIECES)
        return f"{'helper' if inside else 'kernel'}({_KINDS[name]}_signature)"

    def _head(self, head: str, formulas: Sequence[Any], decorator: str) -> None:
        self.code.add("", f"@{decorator}")
        self.code.open(f"def {head}:")
        used = {s for e in formulas for s in e.free_symbols}
        self.code.add(*(f"{s} = y[{i}]" for i, s in enumerate(self.f.y) if s in used))
        self.code.add(*(f"{s} = p[{i}]" for i, s in enumerate(self.f.p) if s in used))

    def _blocks(
        self,
        head: str,
        index: str | None,
        blocks: list[list[Output]],
        workspace: str,
        columns: list[str],
        result: str | None,
    ) -> None:
        """Write one block for each index, or for each few that share it; the last for all that are left."""
        self._define(head, blocks)
        same: dict[tuple[Output, ...], list[int]] = {}
        for i, outputs in enumerate(blocks):  # two modes with one field share a block
            same.setdefault(tuple(outputs), []).append(i)
        for row, (block, places) in enumerate(same.items()):
            last = row == len(same) - 1
            if not last:
                self.code.open("if " + " or ".join(f"{index} == {i}" for i in places) + ":")
            write_block(self.code, list(block), workspace, columns, result)
            if not last:
                self.code.close()
        self.code.close()


def _without_idle(outputs: list[Output]) -> list[Output]:
    """Leave out the parameters that nothing depends on."""
    busy = {o.section for o in outputs if o.section >= 0 and o.expression != 0}
    return [o for o in outputs if o.section < 0 or o.section in busy]
