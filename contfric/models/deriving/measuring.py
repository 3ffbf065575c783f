"""Decides what the extent of an orbit is measured by: its joints, or an observable of the displacement.

Along a segment on which the rate of the displacement keeps its sign the extrema are at the ends. So it is
in a mode in which that rate is the distance to a surface that ends the mode (x' = v, and v = 0 is
switching), or does not change. In any other model the extrema may lie inside of segments: there the
displacement is made an observable, whose stationary points the flow delivers. It is no surface: it has no
labels and no events.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace

from contfric.errors import ModelError
from contfric.models.definition import Surface
from contfric.models.deriving.sections import joined_modes
from contfric.models.described.description import Description, ModeText
from contfric.models.described.evaluate import Sampler, defaults, floats
from contfric.models.described.regions import engine_order, known_sides
from contfric.models.parts import Observable

#: Rounding in an identity of expressions of moderate size, relative to 1 + the values.
_SAME = 1e-9
#: States at which two expressions must agree to be the same.
_POINTS = 8


def measured(description: Description) -> Description:
    """Return a description in which the displacement is an observable, if its extrema ask for one."""
    try:
        surfaces = engine_order(description)
        needed = not extrema_at_joints(
            Sampler(floats(description), defaults(description)), surfaces
        )
    except (ModelError, ArithmeticError, StopIteration):
        return description  # whoever builds the model says what is wrong, and where
    x = description.states[0]
    if not needed or displacement_of(description):
        return description
    return replace(description, observables=(*description.observables, Observable(x, x)))


def displacement_of(description: Description) -> str:
    """Return the name of the observable that is the displacement, or an empty text."""
    x = description.states[0]
    return next((o.name for o in description.observables if o.formula.strip() == x), "")


def extrema_at_joints(sampler: Sampler, surfaces: list[Surface]) -> bool:
    """Tell whether the displacement can have extrema at the joints of orbits only."""
    description = sampler.evaluator.description
    x = description.states[0]
    if any(texts.get(x, x) != x for texts in description.resets.values()):
        return False
    cuts = {s.name for s in surfaces if s.switching} | set(description.resets)
    first, parts = joined_modes(description), defaultdict(list)
    for mode in description.modes:
        parts[first[mode.name]].append(known_sides(mode, surfaces))
    ends = {name: cuts & _ends(sides) for name, sides in parts.items()}
    return all(_keeps_its_sign(sampler, mode, ends[first[mode.name]]) for mode in description.modes)


def _ends(parts: Sequence[Mapping[str, int]]) -> set[str]:
    """Return the surfaces that have all modes that are one on the same side."""
    return {name for name, side in parts[0].items() if all(p.get(name) == side for p in parts)}


def _keeps_its_sign(sampler: Sampler, mode: ModeText, bounds: set[str]) -> bool:
    """Tell whether the rate of the displacement vanishes nowhere inside of a segment of a mode."""
    evaluator, params = sampler.evaluator, sampler.params
    points = list(sampler.states(_POINTS))
    rates = [evaluator.value(mode.field[0], params, t, y) for t, y in points]
    if max(rates) - min(rates) <= _SAME * (1.0 + abs(rates[0])):
        return True
    for name in bounds:
        heights = [evaluator.height(name, params, t, y) for t, y in points]
        if proportional(rates, heights):
            return True
    return False


def proportional(rates: Sequence[float], heights: Sequence[float]) -> bool:
    """Tell whether rates keep their sign as long as heights do: one is a constant times the other."""
    k = max(range(len(heights)), key=lambda i: abs(heights[i]))
    if not abs(heights[k]) > 0.0 or rates[k] == 0.0:
        return False
    factor = rates[k] / heights[k]
    pairs = zip(rates, heights, strict=True)
    return all(abs(r - factor * h) <= _SAME * (1.0 + abs(r) + abs(factor * h)) for r, h in pairs)
