"""Models that are declared by their equations, as matrices in balls.

A mode is affine if its formulas are (:mod:`contfric.models.generated.affine`). The frequencies of all
formulas are the harmonics of the extended state. That the period is one of the formulas is no statement of
the author: ``w T / (2 pi)`` must be a whole number, for every frequency w, identically in the parameters.

Numbers in formulas are taken as they are stored: a decimal of a model's file is the binary number next to it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any

import sympy
from flint import arb, arb_mat

from contfric.errors import ParameterError
from contfric.models.balls.identities import alike, mirrored, moved
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import zeros
from contfric.models.definition import Model
from contfric.models.deriving.visited_modes import composition_of
from contfric.models.described.description import Description
from contfric.models.described.reading_back import from_text
from contfric.models.generated.affine import AffineForm
from contfric.models.generated.symbols import Formulas
from contfric.models.parts import Observable


@dataclass(frozen=True, eq=False)
class AffineModel:
    """A declared model whose modes, surfaces and resets are affine, in symbols.

    Attributes
    ----------
    parameters : symbols of the parameters by name
    frequencies : distinct frequencies of all formulas, in symbols
    fields, surfaces, resets : rows of the extended state, in symbols
    period : in symbols; 0 without excitation
    turns : how often each frequency turns in a period
    kept : surfaces and modes of a structure that move on them by :func:`_keeping`
    """

    states: int
    parameters: dict[str, Any]
    frequencies: tuple[Any, ...]
    fields: dict[str, list[list[Any]]]
    surfaces: dict[str, list[list[Any]]]
    resets: dict[str, list[list[Any]]]
    period: Any
    turns: tuple[int, ...]
    kept: frozenset[tuple[str, str]] = frozenset()


def declared_balls(model: Model, params: Mapping[str, arb], free: str | None = None) -> BallModel:
    """Return a declared model at given parameters; with slopes if one of them is free.

    Raises
    ------
    ParameterError
        If the model is not affine, or has a function that is not enclosed.
    """
    if not model.definition:
        raise not_offered(model.name, "it is not declared by its equations")
    if model.integrated:
        named = "; ".join(f"mode {mode}: {why}" for mode, why in model.integrated.items())
        raise not_offered(model.name, f"it is integrated numerically ({named})")
    affine = affine_of(model)
    values = {affine.parameters[name]: ball for name, ball in params.items()}
    try:
        if free is None:
            return _evaluated(affine, values)
        symbol = affine.parameters[free]
        slopes = _evaluated(_differentiated(affine, symbol), values, one=0)
        return _evaluated(affine, values, slopes)
    except NotEnclosedError as error:
        raise not_offered(model.name, f"{error} is not enclosed") from None


def affine_of(model: Model) -> AffineModel:
    """Return a declared model in symbols; of a structure its modes that were visited."""
    modes = tuple(mode.name for mode in model.modes) if model.composed else ()
    return affine_model(model.definition, modes, tuple(model.surface_by_name) if modes else ())


def not_offered(name: str, why: str) -> ParameterError:
    """Return the error for a model that proofs are not offered for."""
    return ParameterError(
        f"model '{name}': no proof is offered, as {why}; "
        "proofs are for models whose modes all move in closed form"
    )


@lru_cache(maxsize=32)
def affine_model(
    definition: str, visited: tuple[str, ...] = (), seen: tuple[str, ...] = ()
) -> AffineModel:
    """Return a declared model in symbols.

    Parameters
    ----------
    visited, seen : modes and surfaces of a structure whose modes are made when they are visited

    Raises
    ------
    ParameterError
        If it is not affine: the message names what is not.
    """
    description = from_text(definition)
    if visited:
        description = _written_out(definition, visited, seen)
    formulas, name = Formulas(description), description.name
    if description.kinks:
        raise not_offered(name, f"its fields have kinks ({', '.join(description.kinks)})")
    fields = {}
    for mode, rates in zip(description.modes, formulas.fields, strict=True):
        fields[mode.name] = _affine(formulas, rates, f"mode {mode.name}", name)
    heights = formulas.heights().items()
    surfaces = {surface: _affine(formulas, [above], surface, name) for surface, above in heights}
    resets = {
        surface.name: _affine(formulas, image, f"the reset at {surface.name}", name)
        for surface, image in zip(description.surfaces, formulas.resets(), strict=True)
        if surface.name in description.resets
    }
    period = formulas.period()
    every = [
        form for group in (fields, surfaces, resets) for forms in group.values() for form in forms
    ]
    frequencies = _frequencies(every)
    turns = _turns(frequencies, period, name)
    symbols = {p.name: s for p, s in zip(description.parameters, formulas.p, strict=True)}
    n = len(description.states)

    def rows(group: Mapping[str, Sequence[AffineForm]]) -> dict[str, list[list[Any]]]:
        return {key: [_row(form, n, frequencies) for form in forms] for key, forms in group.items()}

    moves, heights_of, kept = rows(fields), rows(surfaces), list[tuple[str, str]]()
    for mode in description.modes if visited else ():
        on = [name for name, side in mode.sides.items() if side == 0]
        kept += [(name, mode.name) for name in on]
        on_rows = [heights_of[name][0] for name in on]
        moves[mode.name] = _keeping(on_rows, moves[mode.name], frequencies)
    return AffineModel(
        n, symbols, frequencies, moves, heights_of, rows(resets), period, turns, frozenset(kept)
    )


def _keeping(kept: list[list[Any]], rows: list[list[Any]], frequencies: Sequence[Any]) -> list[Any]:
    """Return the rows of a field that keeps some surfaces exactly.

    A structure's formulas have the inverse of its mass matrix as it was rounded: a contact would not rest by
    them, but leave with 1e-17. Its rows are solved for as many states as there are surfaces.
    """
    n, found = len(rows), list(rows)
    if not kept:
        return found
    rates = [[*row[:n], *moved(row, n, frequencies)] for row in kept]
    reduced, pivots = sympy.Matrix(rates).rref()
    for r, pivot in enumerate(pivots):
        others = [j for j in range(n) if j not in pivots]
        found[pivot] = [
            -reduced[r, n + c] - sum(reduced[r, j] * rows[j][c] for j in others)
            for c in range(len(rows[0]))
        ]
    return found


def _written_out(definition: str, modes: Sequence[str], surfaces: Sequence[str]) -> Description:
    """Return a structure with some of its modes, and the limits of shared loads that they come to."""
    composition, description = composition_of(definition), from_text(definition)
    loads = {name: text for mode in modes for name, text in composition.loads_in(mode).items()}
    limits = [composition.surface(name) for name in surfaces if name not in composition.declared]
    seen = {o.name: o for o in description.observables}
    seen |= {limit.observable: Observable(limit.observable, text) for limit, text in limits}
    return replace(
        description,
        define=(*description.define, *loads.items()),
        observables=tuple(seen.values()),
        surfaces=(*description.surfaces, *(limit for limit, _ in limits)),
        modes=tuple(map(composition.text, modes)),
    )


def _affine(formulas: Formulas, texts: list[Any], what: str, name: str) -> list[AffineForm]:
    found = formulas.affine(texts)
    if isinstance(found, str):
        raise not_offered(name, f"{what} is not affine ({found})")
    return found


def _frequencies(forms: list[AffineForm]) -> tuple[Any, ...]:
    found: list[Any] = []
    for form in forms:
        for w, _, _ in form.waves:
            if w != 0 and w not in found:
                found.append(w)
    return tuple(found)


def _turns(frequencies: tuple[Any, ...], period: Any, name: str) -> tuple[int, ...]:
    found = []
    for w in frequencies:
        turns = sympy.simplify(w * period / (2 * sympy.pi))
        if not turns.is_Integer:
            raise not_offered(name, f"its period is not shown to be one of the frequency {w}")
        found.append(int(turns))
    return tuple(found)


def _row(form: AffineForm, n: int, frequencies: tuple[Any, ...]) -> list[Any]:
    row = [*form.slopes, *[sympy.Integer(0)] * (1 + 2 * len(frequencies))]
    for w, cosine, sine in form.waves:
        if w == 0:
            row[n] += cosine
        else:
            at = n + 1 + 2 * frequencies.index(w)
            row[at] += cosine
            row[at + 1] += sine
    return row


@lru_cache(maxsize=128)  # Newton's method for an event asks at every step
def _differentiated(affine: AffineModel, symbol: Any) -> AffineModel:
    def derivative(group: dict[str, list[list[Any]]]) -> dict[str, list[list[Any]]]:
        return {
            key: [[sympy.diff(e, symbol) for e in row] for row in rows]
            for key, rows in group.items()
        }

    return AffineModel(
        affine.states,
        affine.parameters,
        tuple(sympy.diff(w, symbol) for w in affine.frequencies),
        derivative(affine.fields),
        derivative(affine.surfaces),
        derivative(affine.resets),
        sympy.diff(affine.period, symbol),
        affine.turns,
    )


def _evaluated(
    affine: AffineModel, values: Mapping[Any, arb], slopes: BallModel | None = None, one: int = 1
) -> BallModel:
    n, frequencies = affine.states, [in_balls(w, values) for w in affine.frequencies]
    size = n + 1 + 2 * len(frequencies)

    def balls(rows: list[list[Any]]) -> list[list[arb]]:
        return [[in_balls(sympy.sympify(e), values) for e in row] for row in rows]

    def field(rows: list[list[Any]]) -> arb_mat:
        found = zeros(size, size)
        found[:n] = balls(rows)
        for k, w in enumerate(frequencies):
            at = n + 1 + 2 * k
            found[at][at + 1], found[at + 1][at] = -w, w
        return arb_mat(found)

    def reset(rows: list[list[Any]]) -> arb_mat:
        found = zeros(size, size)
        found[:n] = balls(rows)
        for k in range(n, size):  # the harmonics stay, at every value of a parameter
            found[k][k] = arb(one)
        return arb_mat(found)

    return BallModel(
        n,
        frequencies,
        {name: field(rows) for name, rows in affine.fields.items()},
        {name: arb_mat(balls(rows)) for name, rows in affine.surfaces.items()},
        in_balls(sympy.sympify(affine.period), values),
        list(affine.turns),
        {name: reset(rows) for name, rows in affine.resets.items()},
        slopes,
        partial(alike, affine) if one else None,
        partial(mirrored, affine) if one else None,
        kept=affine.kept if one else frozenset(),
    )


class NotEnclosedError(Exception):
    """A formula has a function that is not enclosed; the message names it."""


_FUNCTIONS: dict[str, Callable[..., arb]] = {
    name: lambda x, name=name: getattr(x, name)()
    for name in ("sin", "cos", "tan", "exp", "log", "sinh", "cosh", "tanh", "atan", "asin", "acos")
}


def in_balls(e: Any, values: Mapping[Any, arb]) -> arb:
    """Return a formula's value in a ball.

    Parameters
    ----------
    e : formula of sympy
    values : ball of each symbol

    Raises
    ------
    NotEnclosedError
        If it has a function that is not enclosed.

    Examples
    --------
    >>> import sympy
    >>> in_balls(sympy.Rational(1, 2) + sympy.cos(0), {}) == 1.5
    True
    """
    if e in values:
        return values[e]
    if e.is_Rational:
        return arb(int(e.p)) / int(e.q)
    if e.is_Float:
        return arb(float(e))
    if e is sympy.pi:
        return arb.pi()
    if e is sympy.E:
        return arb(1).exp()
    if isinstance(e, (sympy.Add, sympy.Mul)):
        found = [in_balls(part, values) for part in e.args]
        total = found[0]
        for part in found[1:]:
            total = total + part if isinstance(e, sympy.Add) else total * part
        return total
    if isinstance(e, sympy.Pow):
        return _power(in_balls(e.base, values), e.exp)
    name = type(e).__name__
    if name == "Abs":
        return abs(in_balls(e.args[0], values))
    if name == "Sign":
        return _sign(in_balls(e.args[0], values))
    if name in _FUNCTIONS and len(e.args) == 1:
        return _FUNCTIONS[name](in_balls(e.args[0], values))
    raise NotEnclosedError(name)


def _power(base: arb, exponent: Any) -> arb:
    if exponent.is_Integer:
        return base ** int(exponent)
    if exponent == sympy.Rational(1, 2):
        return base.sqrt()
    if exponent == sympy.Rational(-1, 2):
        return base.rsqrt()
    raise NotEnclosedError(f"the power {exponent}")


def _sign(x: arb) -> arb:
    if x > 0:
        return arb(1)
    if x < 0:
        return arb(-1)
    return arb(0) if x.is_zero() else arb(0, 1)
