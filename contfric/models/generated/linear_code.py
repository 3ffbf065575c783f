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

from contfric.models.generated.affine import AffineForm
from contfric.models.generated.code import VALUES, Lines, Output, write_block
from contfric.models.language.derivatives import derivative

#: Coefficients that are taken out of their array before a loop: more would not stay in registers.
_FEW = 24
#: One over each whole number: a division in each term would cost as much as the rest of it.
_TABLE = (
    "from contfric.flow.linear.system import INVERSE",
    "",
    'unit.tables["INVERSE"] = INVERSE',
    "",
)
#: From a harmonic's frequency to its place among those of the model; place 0 is the constant.
Places = dict[Any, int]


@dataclass(frozen=True)
class CoefficientLayout:
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


def layout_of(rows: Sequence[AffineForm], places: Places) -> CoefficientLayout:
    """Return the layout of some formulas."""
    slopes: list[tuple[int, int, int]] = []
    waves: list[tuple[int, int, int]] = []
    values: list[Any] = []
    for i, row in enumerate(rows):
        for j, e in enumerate(row.slopes):
            if e != 0:
                slopes.append((i, j, len(values)))
                values.append(e)
    for i, row in enumerate(rows):
        for w, a, b in row.waves:
            waves.append((i, places[w], len(values)))
            values += [a, b]
    return CoefficientLayout(tuple(slopes), tuple(waves), tuple(values))


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
        define: Callable[[str, Sequence[Any], str], None],
        states: int,
        parameters: Sequence[Any],
    ) -> None:
        self.code, self.define, self.states, self.parameters = code, define, states, parameters

    def write(
        self,
        pieces: Sequence[CoefficientLayout | None],
        sights: Sequence[CoefficientLayout | None],
        waves: Places,
    ) -> None:
        """Write all helpers; None stands for what is not affine."""
        self._values("frequencies(p, which, out, jac)", None, [tuple(waves)])
        for index, ending, layouts in (("piece", "", pieces), ("c", "_seen", sights)):
            values = [layout.values if layout else () for layout in layouts]
            self._values(f"entries{ending}({index}, p, which, out, jac)", index, values)
            self._blocks(f"audible{ending}({index}, co, on)", index, layouts, _audible)
        self.code.add("", *_TABLE)
        n = self.states
        self._blocks("rates(piece, co, y, c, s, out)", "piece", pieces, _rates(n))
        self._blocks("expand(piece, co, y, c, s, w, h, terms, series)", "piece", pieces, _expand(n))
        self._blocks(
            "vary(piece, co, by, z, waves, w, dw, h, terms, series, out)", "piece", pieces, _vary(n)
        )
        self._blocks("sums(piece, co, d, row, column, own)", "piece", pieces, _sums)
        self._blocks("look(c, co, cs, sn, w, h, terms, series, poly)", "c", sights, _look)
        counts = [len(layout.values) for layout in (*pieces, *sights) if layout]
        self.code.add("", f"ENTRIES, WAVES = {max(counts, default=0)}, {len(waves)}")

    def _values(self, head: str, index: str | None, vectors: Sequence[Sequence[Any]]) -> None:
        """Write vectors of formulas of the parameters, with their derivatives in the rows of ``jac``."""
        self.define(head, [e for vector in vectors for e in vector], _decorator(head))
        blocks = []
        for vector in vectors:
            block = [Output(VALUES, f"out[{i}]", e) for i, e in enumerate(vector)]
            for k, symbol in enumerate(self.parameters):
                slopes = [(i, derivative(e, symbol)) for i, e in enumerate(vector)]
                block += [Output(k, f"jac[j, {i}]", e) for i, e in slopes if e != 0]
            blocks.append(tuple(block))

        def write(block: Any) -> None:
            write_block(self.code, list(block), "jac", ["pass"], None)

        self._branches(index, blocks, write)

    def _blocks(
        self,
        head: str,
        index: str,
        layouts: Sequence[CoefficientLayout | None],
        lines: Callable[..., Any],
    ) -> None:
        """Write lines that depend on the structure of a layout only."""
        self.define(head, [], _decorator(head))
        keys = [layout.structure if layout else ((), ()) for layout in layouts]

        def write(key: Any) -> None:
            found = lines(*key)
            self.code.add(*found)
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


def _decorator(head: str) -> str:
    """Return what makes a kernel of a function."""
    return f'kernel(SIGNATURES["{head.partition("(")[0]}"])'


def _sum(terms: Sequence[str]) -> str:
    return " + ".join(terms) or "0.0"


def _row(i: int, slopes: Any, waves: Any, co: str, y: str, c: str, s: str) -> list[str]:
    """Return the terms of one row of ``A y + b``; the names have places for a number each."""
    found = []  # the waves first: the next term of a state waits for the last one of the states only
    for row, j, k in waves:
        if row == i:
            found.append(f"{co.format(k)} * {c.format(j)}")
            if j > 0:
                found.append(f"{co.format(k + 1)} * {s.format(j)}")
    return found + [f"{co.format(k)} * {y.format(j)}" for row, j, k in slopes if row == i]


def _rates(count: int) -> Callable[..., list[str]]:
    def lines(slopes: Any, waves: Any) -> list[str]:
        names = ("co[{}]", "y[{}]", "c[{}]", "s[{}]")
        return [f"out[{i}] = {_sum(_row(i, slopes, waves, *names))}" for i in range(count)]

    return lines


def _coefficients(slopes: Any, waves: Any, array: str, name: str) -> tuple[list[str], str]:
    """Return lines that take few coefficients out of their array, and how they are called then."""
    places = [k for *_, k in slopes] + [at for _, j, k in waves for at in (k, k + 1)[: 1 + (j > 0)]]
    if len(places) > _FEW:
        return [], array + "[{}]"
    return [f"{name}{k} = {array}[{k}]" for k in places], name + "{}"


def _turn(used: Sequence[int]) -> list[str]:
    """Return lines that replace the terms of cosines and sines by the next ones."""
    found = []
    for j in used:
        if j == 0:  # a constant has no other terms
            found.append("c0 = 0.0")
        else:
            found += [f"g = f * w{j}", f"c{j}, s{j} = -g * s{j}, g * c{j}"]
    return found


def _waves_of(waves: Any, c: str, s: str) -> tuple[list[int], list[str]]:
    """Return the harmonics in use, and lines that take them out of their arrays."""
    used = sorted({j for _, j, _ in waves})
    found = [f"c{j} = {c}[{j}]" for j in used]
    for j in used[used[:1] == [0] :]:
        found += [f"s{j} = {s}[{j}]", f"w{j} = w[{j}]"]
    return used, found


def _expand(count: int) -> Callable[..., list[str]]:
    def lines(slopes: Any, waves: Any) -> list[str]:
        used, found = _waves_of(waves, "c", "s")
        few, co = _coefficients(slopes, waves, "co", "a")
        names = (co, "y{}", "c{}", "s{}")
        found += few + [f"y{i} = y[{i}]" for i in range(count)]
        found += [f"series[0, {i}] = y{i}" for i in range(count)]
        found += ["for k in range(terms):", "    f = h * INVERSE[k + 1]"]
        body = [f"z{i} = f * ({_sum(_row(i, slopes, waves, *names))})" for i in range(count)]
        body += [f"y{i} = z{i}" for i in range(count)]
        body += [f"series[k + 1, {i}] = y{i}" for i in range(count)]
        return found + [f"    {line}" for line in body + _turn(used)]

    return lines


def _vary(count: int) -> Callable[..., list[str]]:
    def lines(slopes: Any, waves: Any) -> list[str]:
        used, found = _waves_of(waves, "waves[0]", "waves[1]")
        harmonics = used[used[:1] == [0] :]
        for j in harmonics:  # derivatives by the parameter: those by the frequency times its own
            found += [f"u{j} = waves[2, {j}]", f"v{j} = waves[3, {j}]", f"d{j} = dw[{j}]"]
        few, co = _coefficients(slopes, waves, "co", "a")
        own, by = _coefficients(slopes, waves, "by", "b")
        found += few + own + [f"z{i} = z[{i}]" for i in range(count)]
        found += [f"out[0, {i}] = z{i}" for i in range(count)]
        found += ["for k in range(terms):", "    f = h * INVERSE[k + 1]"]
        moved = [(i, j, k) for i, j, k in waves if j > 0]
        body = []
        for i in range(count):
            terms = _row(i, slopes, waves, by, "series[k, {}]", "c{}", "s{}")
            terms += [
                f"d{j} * ({co.format(k)} * u{j} + {co.format(k + 1)} * v{j})"
                for row, j, k in moved
                if row == i
            ]
            terms += _row(i, slopes, (), co, "z{}", "", "")
            body.append(f"x{i} = f * ({_sum(terms)})")
        body += [f"z{i} = x{i}" for i in range(count)]
        body += [f"out[k + 1, {i}] = z{i}" for i in range(count)]
        for j in harmonics:
            body.append(f"u{j}, v{j} = -f * (s{j} + w{j} * v{j}), f * (c{j} + w{j} * u{j})")
        return found + [f"    {line}" for line in body + _turn(used)]

    return lines


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


def _look(slopes: Any, waves: Any) -> list[str]:
    used, found = _waves_of(waves, "cs", "sn")
    few, co = _coefficients(slopes, waves, "co", "a")
    terms = _row(0, slopes, waves, co, "series[k, {}]", "c{}", "s{}")
    found += [*few, "for k in range(terms + 1):", f"    poly[k] = {_sum(terms)}"]
    turn = _turn(used)
    if turn:
        found.append("    f = h * INVERSE[k + 1]")
    return found + [f"    {line}" for line in turn]
