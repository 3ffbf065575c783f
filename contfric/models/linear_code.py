"""The helpers of affine modes in a generated module: what :mod:`contfric.flow.linear` is bundled from.

Of each affine piece of a mode, and of each affine observable, the coefficients are written as one vector
(the entries of the matrix that are not zero, then the factors of each harmonic), with their derivatives
by the parameters; and the sparse products with it as straight lines of code.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import sympy

from contfric.models.affine import AffineForm
from contfric.models.code import VALUES, Lines, Output, write_block

#: From a harmonic's frequency to its place among those of the model; place 0 is the constant.
Places = dict[Any, int]


@dataclass(frozen=True)
class Layout:
    """Where the coefficients of an affine piece, or observable, are in its vector.

    Attributes
    ----------
    slopes : (row, column, place) of the entries of the matrix
    waves : (row, harmonic, place of the cosine's factor); that of the sine's is the next
    values : the coefficients
    """

    slopes: tuple[tuple[int, int, int], ...]
    waves: tuple[tuple[int, int, int], ...]
    values: tuple[Any, ...]

    @property
    def structure(self) -> tuple[Any, ...]:
        """What the products depend on."""
        return self.slopes, self.waves


def layout_of(rows: Sequence[AffineForm], places: Places) -> Layout:
    """Return the layout of some formulas."""
    slopes, waves, values = [], [], []
    for i, row in enumerate(rows):
        for j, e in enumerate(row.slopes):
            if e != 0:
                slopes.append((i, j, len(values)))
                values.append(e)
    for i, row in enumerate(rows):
        for w, a, b in row.waves:
            waves.append((i, places[w], len(values)))
            values += [a, b]
    return Layout(tuple(slopes), tuple(waves), tuple(values))


def places_of(forms: Sequence[AffineForm]) -> Places:
    """Return the frequencies of some formulas, each with its place."""
    found: Places = {sympy.Integer(0): 0}
    for form in forms:
        for w, _, _ in form.waves:
            found.setdefault(w, len(found))
    return found


class LinearWriter:
    """Writes the helpers of all affine pieces and observables.

    Parameters
    ----------
    define : writes the head of a function, and takes the parameters in formulas out of their array
    states : their number
    parameters : their symbols
    """

    def __init__(
        self,
        code: Lines,
        define: Callable[[str, Sequence[Any]], None],
        states: int,
        parameters: Sequence[Any],
    ) -> None:
        self.code, self.define, self.states, self.parameters = code, define, states, parameters

    def write(
        self, pieces: Sequence[Layout | None], sights: Sequence[Layout | None], waves: Places
    ) -> None:
        """Write all helpers; None stands for what is not affine."""
        self._values("frequencies(p, which, out, jac)", None, [tuple(waves)])
        for index, ending, layouts in (("piece", "", pieces), ("c", "_seen", sights)):
            values = [layout.values if layout else () for layout in layouts]
            self._values(f"entries{ending}({index}, p, which, out, jac)", index, values)
            self._blocks(f"audible{ending}({index}, co, on)", index, layouts, _audible)
        self._blocks("product(piece, co, y, out)", "piece", pieces, _product(self.states))
        self._blocks("load(piece, co, c, s, out)", "piece", pieces, _load)
        self._blocks("sums(piece, co, d, row, column, own)", "piece", pieces, _sums)
        self._blocks("seen(c, co, y, cs, sn)", "c", sights, _seen)
        counts = [len(layout.values) for layout in (*pieces, *sights) if layout]
        self.code.add("", f"ENTRIES, WAVES = {max(counts, default=0)}, {len(waves)}")

    def _values(self, head: str, index: str | None, vectors: Sequence[Sequence[Any]]) -> None:
        """Write vectors of formulas of the parameters, with their derivatives in the rows of ``jac``."""
        self.define(head, [e for vector in vectors for e in vector])
        blocks = []
        for vector in vectors:
            block = [Output(VALUES, f"out[{i}]", e) for i, e in enumerate(vector)]
            for k, symbol in enumerate(self.parameters):
                slopes = [(i, e.diff(symbol)) for i, e in enumerate(vector)]
                block += [Output(k, f"jac[j, {i}]", e) for i, e in slopes if e != 0]
            blocks.append(tuple(block))

        def write(block: Any) -> None:
            write_block(self.code, list(block), "jac", ["pass"], None)

        self._branches(index, blocks, write)

    def _blocks(
        self, head: str, index: str, layouts: Sequence[Layout | None], lines: Callable[..., Any]
    ) -> None:
        """Write lines that depend on the structure of a layout only."""
        self.define(head, [])
        keys = [layout.structure if layout else ((), ()) for layout in layouts]

        def write(key: Any) -> None:
            found = lines(*key)
            self.code.add(*found)
            if not found or not found[-1].startswith("return"):
                self.code.add("return")

        self._branches(index, keys, write)

    def _branches(self, index: str | None, keys: Sequence[Any], write: Callable[..., None]) -> None:
        same: dict[Any, list[int]] = {}
        for i, key in enumerate(keys):
            same.setdefault(key, []).append(i)
        for row, (key, places) in enumerate(same.items()):
            last = row == len(same) - 1
            if not last:
                self.code.open("if " + " or ".join(f"{index} == {i}" for i in places) + ":")
            write(key)
            if not last:
                self.code.close()
        self.code.close()


def _product(count: int) -> Callable[..., list[str]]:
    def lines(slopes: Any, waves: Any) -> list[str]:
        found = []
        for i in range(count):
            terms = [f"co[{k}] * y[{j}]" for row, j, k in slopes if row == i]
            found.append(f"out[{i}] = {' + '.join(terms) or '0.0'}")
        return found

    return lines


def _load(slopes: Any, waves: Any) -> list[str]:
    return [f"out[{i}] += co[{k}] * c[{j}] + co[{k + 1}] * s[{j}]" for i, j, k in waves]


def _audible(slopes: Any, waves: Any) -> list[str]:
    found = []
    for j in sorted({j for _, j, _ in waves}):
        places = [k for _, other, k in waves if other == j]
        terms = [f"co[{k}] != 0.0" for at in places for k in (at, at + 1)]
        found += [f"if {' or '.join(terms)}:", f"    on[{j}] = 1.0"]
    return found


def _sums(slopes: Any, waves: Any) -> list[str]:
    found = []
    for i, j, k in slopes:
        if i == j:
            found.append(f"own[{i}] = abs(co[{k}])")
        else:
            found.append(f"row[{i}] += abs(co[{k}]) * d[{j}]")
            found.append(f"column[{j}] += abs(co[{k}]) / d[{i}]")
    return found


def _seen(slopes: Any, waves: Any) -> list[str]:
    terms = [f"co[{k}] * y[{j}]" for _, j, k in slopes]
    terms += [f"co[{k}] * cs[{j}] + co[{k + 1}] * sn[{j}]" for _, j, k in waves]
    return [f"return {' + '.join(terms) or '0.0'}"]
