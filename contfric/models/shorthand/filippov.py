"""Sliding that is derived: ``sliding: filippov`` on a switching surface.

Where the fields f+ and f- on the sides of a surface h = 0 both lead to it, at the rates
``r+ = h_t + h_y f+ < 0`` and ``r- = h_t + h_y f- > 0``, motion stays on it with the convex combination that
keeps h (A. F. Filippov, Differential Equations with Discontinuous Righthand Sides, Kluwer 1988)::

    f = (r- f+ - r+ f-) / (r- - r+)

Where ``r- - r+`` is never positive nothing slides: motion passes the surface, or leaves it on both sides, and
no mode is added. Where it depends on parameters only, their defaults tell.

Where two surfaces cross, see :mod:`contfric.models.shorthand.crossing`.

The mode, its region ``r+ < 0 < r-`` and the surfaces that end it are put into the model as if they had
been typed. Where r- less r+ depends on parameters only, both ends are levels of one observable.

This module imports sympy, and is loaded where a model asks for it.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from typing import Any

import sympy

from contfric.models.described.description import Description, ModeText
from contfric.models.described.evaluate import Sampler, defaults, floats
from contfric.models.described.regions import combinations, engine_order
from contfric.models.entries import EntryError, as_identifier
from contfric.models.generated.symbols import Formulas
from contfric.models.shorthand.crossing import crossing_parts

#: States at which the heights of two surfaces must differ by the same, and rounding of that.
_POINTS, _SAME = 8, 1e-9
#: The key of a surface, and its value.
SLIDING, FILIPPOV = "sliding", "filippov"


def sliding_parts(
    description: Description, surfaces: tuple[str, ...], data: Mapping[str, Any]
) -> dict[str, Any]:
    """Return modes, observables and surfaces of a model with the sliding modes of some surfaces.

    Parameters
    ----------
    description : the model without them
    surfaces : where sliding is derived

    Raises
    ------
    EntryError
        If a surface has not a mode on each side, or a reset acts where solutions would slide.
    """
    formulas = Formulas(description)
    if description.kinks:
        raise EntryError(
            ("kinks",),
            "sliding is derived where fields are smooth near their surfaces: no 'kinks'",
        )
    found: dict[str, Any] = {k: dict(data[k]) for k in ("observables", "surfaces", "modes")}
    pairs = [(s, above, below) for s in surfaces for above, below in _pairs(description, s)]
    slidings = [_Sliding(formulas, *pair, _name(*pair, pairs)) for pair in pairs]
    for sliding, pair in zip(slidings, pairs, strict=True):
        if sliding.somewhere:
            _refuse_reset(description, *pair)
    # what all pass, as no solution is driven back to it, is crossed by what slides on others
    heights: dict[str, Any] = {}
    slid = {sliding.surface for sliding in slidings if sliding.somewhere}
    held = tuple(s for s in surfaces if s in slid)
    if crossing := _crossing(description, held, [pair for pair in pairs if pair[0] in slid]):
        return crossing_parts(description, crossing, data)
    for sliding in slidings:
        if sliding.name in found["modes"]:
            raise EntryError(
                ("modes", sliding.name),
                f"'{sliding.name}' is the name of the sliding mode on '{sliding.surface}'",
            )
        if sliding.somewhere:
            _add(found, sliding, heights)
    return found


def _refuse_reset(description: Description, surface: str, above: ModeText, below: ModeText) -> None:
    """Refuse a reset at a surface in a mode next to sliding: solutions are mapped before they slide."""
    both = (above.name, below.name)
    acts = [mode for mode in both if mode in description.acts.get(surface, both)]
    if surface in description.resets and acts:
        raise EntryError(
            ("surfaces", surface, SLIDING),
            f"a reset acts at '{surface}' in {' and '.join(acts)}: a solution that meets the surface is "
            "mapped, and does not slide. Leave out one of the two",
        )


def _crossing(
    description: Description,
    surfaces: tuple[str, ...],
    pairs: list[tuple[str, ModeText, ModeText]],
) -> tuple[str, str] | None:
    """Return the two surfaces that cross where motion may slide on both; None if none do.

    Raises
    ------
    EntryError
        If others slide, too: what follows a group of more than two is not derived.
    """
    found = {
        tuple(sorted((surface, other), key=surfaces.index))
        for surface, above, below in pairs
        for other in surfaces
        if other != surface
        and above.sides.get(other, below.sides.get(other, 0)) != 0
        and not _are_parallel(description, surface, other)
    }
    if not found:
        return None
    [(one, other), *more] = sorted(found)
    if more or len(surfaces) > 2:
        raise EntryError(
            ("surfaces", one, SLIDING),
            f"'{one}' and '{other}' cross each other, and {len(surfaces)} surfaces slide: sliding on two "
            "that cross is derived where no others slide. Write the sliding modes yourself",
        )
    return one, other


def _are_parallel(description: Description, one: str, other: str) -> bool:
    """Tell whether two surfaces have no state in common: two belts, whose heights differ by a number."""
    sampler = Sampler(floats(description), defaults(description))
    height = sampler.evaluator.height
    apart = [
        height(one, sampler.params, t, y) - height(other, sampler.params, t, y)
        for t, y in sampler.states(_POINTS)
    ]
    size = abs(apart[0])
    return size > 0.0 and max(abs(a - apart[0]) for a in apart) <= _SAME * (1.0 + size)


def _pairs(description: Description, surface: str) -> Iterator[tuple[ModeText, ModeText]]:
    """Yield the modes above and below a surface whose regions meet there."""
    ordered = engine_order(description)
    above, below = (
        [m for m in description.modes if m.sides.get(surface) == side and 0 not in m.sides.values()]
        for side in (1, -1)
    )
    pairs = [
        (a, b)
        for a, b in itertools.product(above, below)
        if all(b.sides.get(s, v) == v for s, v in a.sides.items() if s != surface)
        and combinations(ordered, {**a.sides, **b.sides})  # two levels may leave no region to both
    ]
    if not pairs:
        raise EntryError(
            ("surfaces", surface, SLIDING),
            f"sliding on '{surface}' is derived from the fields on its sides: give it a mode on each side "
            f"({surface}: + and {surface}: -)",
        )
    yield from pairs


def _name(
    surface: str, above: ModeText, below: ModeText, pairs: list[tuple[str, ModeText, ModeText]]
) -> str:
    if len(pairs) == 1:
        return "slide"
    if [s for s, _, _ in pairs].count(surface) == 1:
        return f"slide_{surface}"
    stems = {mode.name.rstrip("+-") for mode in (above, below)}
    among = [s for s, a, b in pairs if {m.name.rstrip("+-") for m in (a, b)} == stems]
    short = len(stems) == 1 and among == [surface] and "" not in stems
    return f"slide_{stems.pop()}" if short else f"slide_{surface}_{above.name}_{below.name}"


def _known_on(formulas: Formulas, height: Any) -> dict[Any, Any]:
    """Return a state as the others give it on a surface; nothing where its observable is linear in none.

    What is derived counts on the surface only. Off it the field of the other side may have a pole, such as
    friction that falls with the speed, read backwards.
    """
    for state in formulas.y:
        slope = sympy.diff(height, state)
        if slope.is_number and slope != 0:
            return {state: sympy.expand(state - height / slope)}
    return {}


class _Sliding:
    """The sliding mode of a surface between two modes: field and rates, as formulas and as texts.

    ``somewhere`` is false where nothing ever slides: there is no field then.
    """

    def __init__(
        self, formulas: Formulas, surface: str, above: ModeText, below: ModeText, name: str
    ) -> None:
        description = formulas.description
        self.surface, self.name, self.text = surface, name, formulas.text
        self.sides = {s: v for s, v in {**above.sides, **below.sides}.items() if s != surface}
        names = [m.name for m in description.modes]
        fields, height = formulas.fields, formulas.heights()[surface]
        up, down = (fields[names.index(mode.name)] for mode in (above, below))
        on = _known_on(formulas, height)
        self.rate_up, self.rate_down = (formulas.rate(height, f).subs(on) for f in (up, down))
        self.apart = sympy.simplify(self.rate_down - self.rate_up)
        self.constant = not self.apart.free_symbols & set(formulas.moving)
        largest = self.apart.subs(formulas.defaults) if self.constant else self.apart
        self.somewhere = not largest.is_nonpositive
        self.pairs = [(a.subs(on), b.subs(on)) for a, b in zip(up, down, strict=True)]
        self.states = description.states

    def field(self) -> list[Any]:
        """Return the convex combination of the fields on both sides that keeps the surface."""
        return [
            a
            if sympy.expand(a - b) == 0
            else sympy.simplify((self.rate_down * a - self.rate_up * b) / self.apart)
            for a, b in self.pairs
        ]


def _add(found: dict[str, Any], sliding: _Sliding, heights: dict[str, Any]) -> None:
    """Put a sliding mode into the parts of a model: its observables, the surfaces that end it, the mode.

    Where two modes slide on one surface, a field on a side of it may end both: that is one surface. Were it
    two, states would be sought between them, and the image of one under a symmetry could be either.

    Parameters
    ----------
    heights : the surfaces of the modes before it, with the rate that vanishes there
    """
    own, stem = sliding.name, as_identifier(sliding.name)
    sides: dict[str, Any] = {**sliding.sides, sliding.surface: 0}
    ends = ((f"{own}-", "-", sliding.rate_up), (f"{own}+", "+", sliding.rate_down))
    new = []
    for name, side, rate in ends:
        same, sense = _known_end(heights, rate)
        if not same:
            new.append((name, rate))
        sides[same or name] = side if sense > 0 else {"-": "+", "+": "-"}[side]
    up = f"{stem}_rate"
    for name, rate in new:
        if sliding.constant and name == f"{own}+" and up in found["observables"]:
            entry = {"observable": up, "level": f"-({sliding.text(sliding.apart)})"}
        else:
            entry = {"observable": up if name == f"{own}-" else f"{stem}_below", "level": "0"}
            found["observables"][entry["observable"]] = sliding.text(rate)
        found["surfaces"][name] = entry
        heights[name] = rate
    found["modes"][own] = {
        "in": sides,
        "field": dict(zip(sliding.states, map(sliding.text, sliding.field()), strict=True)),
        "derived": True,
    }


def _known_end(heights: Mapping[str, Any], rate: Any) -> tuple[str, int]:
    """Return the surface where a rate vanishes, and whether its sides are the rate's own (1) or not (-1)."""
    for name, height in heights.items():
        for sense in (1, -1):
            if sympy.expand(height - sense * rate) == 0:
                return name, sense
    return "", 1
