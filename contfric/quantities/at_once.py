"""Several quantities of one orbit with their derivatives: all that is integrated for them in one pass.

The solution at the nodes of an integral, with its derivatives, costs more than the expressions that are
integrated. So expressions of one orbit share their nodes: a part is resolved where all of them are. Values
agree with those of each alone to what both are resolved to, and not to the last bit.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

from contfric.models.language.quantity_texts import Functional
from contfric.quantities.extreme import integrated, is_compiled
from contfric.quantities.functionals import Asked, Measuring, Totals
from contfric.quantities.inside import Inside, inside_of
from contfric.quantities.measure import NumberWithGradient, differentiated
from contfric.quantities.motion import Directions, OrbitMotion, goes_on
from contfric.quantities.registry import Quantity
from contfric.quantities.tape import Tape

if TYPE_CHECKING:
    from contfric.orbit.orbit import Orbit

#: Sets of expressions whose operations are kept: a loop over orbits asks for the same ones.
_KEPT = 64


def differentiated_at_once(
    quantities: Sequence[Quantity], orbit: Orbit, directions: Directions
) -> list[NumberWithGradient]:
    """Return quantities of an orbit with their derivatives in some directions.

    Raises
    ------
    ParameterError
        If one is a function or a list of numbers, which have no derivatives here.
    """
    measuring = Measuring(OrbitMotion(orbit, directions), inside_of(orbit.model))
    known = dict(_totals(measuring, quantities))
    return [differentiated(quantity, orbit, directions, known) for quantity in quantities]


def _totals(measuring: Measuring, quantities: Sequence[Quantity]) -> Iterable[tuple[Asked, Totals]]:
    """Yield what is integrated for functionals, of those that compiled code integrates together.

    Waves of one rate can be in one pass, and all that has none with any of them.
    """
    asked = list(dict.fromkeys(measuring.asked(f) for q in quantities for f in _functionals(q)))
    rates = list(dict.fromkeys(rate for _, rate in asked if rate)) or [0.0]
    for number, rate in enumerate(rates):
        group = [each for each in asked if each[1] == rate or (not number and not each[1])]
        yield from _in_one_pass(measuring, group, rate)


def _in_one_pass(
    measuring: Measuring, group: list[Asked], rate: float
) -> Iterable[tuple[Asked, Totals]]:
    """Yield the integrals of a group; nothing where it is one alone, or compiled code leaves them.

    That may leave what has kinks to panels, and an integrated model carries none of that along.
    """
    smooth = [each for each in group if not len(measuring.inside.tape(each[0]).noted)]
    if goes_on(measuring.motion.orbit.model):
        group = smooth
    if len(group) < 2:
        return
    found = measuring.integrals(_tape(measuring.inside, tuple(f for f, _ in group)), rate)
    if found is None:
        if len(smooth) < len(group):
            yield from _in_one_pass(measuring, smooth, rate)
        return
    values, slopes = found
    at = 0
    for each in group:
        rows = range(at, at + (2 if each[1] else 1))
        at = rows.stop
        yield each, (values[rows.start : at], slopes[[*rows, -1]])


def _functionals(quantity: Quantity) -> list[Functional]:
    """Return the functionals of a quantity that compiled code integrates."""
    whole = integrated(quantity)
    parsed = quantity.parsed
    every = [whole] if whole else [] if parsed is None else list(parsed.functionals.values())
    return [functional for functional in every if is_compiled(functional, quantity.model)]


@lru_cache(_KEPT)
def _tape(inside: Inside, asked: tuple[Functional, ...]) -> Tape:
    return inside.tape_of_all(asked)
