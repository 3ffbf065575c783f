r"""Chatter that is derived: ``chatter: true`` in a reset that is an impact.

Motion meets the wall h = 0 and is sent back with ``h' -> -e h'``. Where it is pressed to the wall
(``h'' < 0`` along its flight) infinitely many impacts follow each other in finite time, and then it rests on
the wall, by a force that acts in the direction in which the impacts do, and keeps ``h = h' = 0``::

    y' = f(t, y) - h''(t, y) d(y),    h'' = (d/dt + f . d/dy)^2 h,    (dh'/dy) . d = 1,

with d the direction of the change ``R(t, y) - y`` that the reset makes. The force vanishes where ``h''``
does: there the mass leaves the wall. The mode, its field and the surface that ends it are put into the model
as if they had been typed; its flow begins with the impacts (:mod:`contfric.flow.chatter`).

Impacts may pass the surface, ``h' -> e h'``, with a flight on either side: a block that rocks from one foot
to the other. It rests upright where it is pressed from both sides, ``h'' < 0`` above and ``h'' > 0`` below,
and the contact is the same from both: ``f - h'' d`` of the one flight is that of the other. It is left to
either side.

This module imports sympy, and is loaded where a model asks for it.
"""

from __future__ import annotations

import random
from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from typing import Any

import sympy

from contfric.models.definition import Model
from contfric.models.deriving.sections import joined_modes
from contfric.models.described.description import Description, ModeText
from contfric.models.described.evaluate import defaults
from contfric.models.described.reading_back import described, from_text
from contfric.models.entries import EntryError
from contfric.models.generated.symbols import Formulas
from contfric.models.language.formulas import vanishes

#: The key of a reset.
CHATTER = "chatter"
#: Models that are kept with chatter: those of one study, and some more.
_MODELS = 16
#: Rounding in an identity of formulas, relative to 1 + the values; and states at which it must hold.
_SAME, _PLACES = 1e-9, 8


def chatter_parts(
    description: Description, surfaces: tuple[str, ...], data: Mapping[str, Any]
) -> dict[str, Any]:
    """Return modes, observables and surfaces of a model with the modes of chatter at some walls.

    Parameters
    ----------
    description : the model without them
    surfaces : the walls

    Raises
    ------
    EntryError
        If a reset is no impact of one mode.
    """
    formulas = Formulas(description)
    found: dict[str, Any] = {k: dict(data[k]) for k in ("observables", "surfaces", "modes")}
    chatters = {}
    for surface in surfaces:
        name = CHATTER if len(surfaces) == 1 else f"{CHATTER}_{surface}"
        ways = [_Wall(formulas, surface, flight) for flight in _flights(description, surface)]
        lifts = [f"{surface}_lift", f"{surface}_lift_below"][: len(ways)]
        named = [("modes", name), *((k, n) for n in lifts for k in ("surfaces", "observables"))]
        for kind, taken in named:
            if taken in found[kind]:
                raise EntryError(
                    (kind, taken), f"'{taken}' is a name of the chatter at '{surface}'"
                )
        sides: dict[str, int | str] = {}
        for lift, way in zip(lifts, ways, strict=True):
            found["observables"][lift] = formulas.text(way.lift)
            found["surfaces"][lift] = {"observable": lift, "level": "0"}
            sides |= {s: side for s, side in way.flight.sides.items() if s != description.phase}
            sides[lift] = "-" if way.side > 0 else "+"
        ways[0].check_same(ways[-1])
        found["modes"][name] = {
            "in": {**sides, surface: 0},
            "field": dict(zip(description.states, map(formulas.text, ways[0].field), strict=True)),
            "rank": len(description.states) - 2,
        }
        chatters[surface] = {"mode": name, "flight": ways[0].flight.name, "lift": lifts[0]}
        if len(ways) > 1:
            chatters[surface] |= {"other": ways[1].flight.name, "other_lift": lifts[1]}
    return {**found, "chatters": chatters}


def with_chatter(model: Model) -> Model | None:
    """Return a model with chatter at all of its walls for which that is derived, or None."""
    if not model.definition or model.composed or model.chatters:
        return None
    walls = tuple(r.surface for r in model.resets if r.lands.get(r.surface) in (1, -1))
    return _with_chatter_at(model.definition, walls)


@lru_cache(maxsize=_MODELS)
def _with_chatter_at(definition: str, walls: tuple[str, ...]) -> Model | None:
    """Return the model of a definition with chatter at walls: to derive it takes longer than most orbits."""
    from contfric.models.deriving.derive import model_from

    data = from_text(definition).data()
    for surface in walls:
        asked = {**data["resets"], surface: {**data["resets"][surface], CHATTER: True}}
        with suppress(EntryError):
            described({**data, "resets": asked})
            data["resets"] = asked
    found = described(data)
    return model_from(found) if found.chatters else None


def _flights(description: Description, surface: str) -> list[ModeText]:
    """Return the modes that the impacts at a wall are in, at most one above and one below."""
    named = description.acts.get(surface, ())
    found = [
        mode
        for mode in description.modes
        if mode.sides.get(surface, 0) != 0 and (not named or mode.name in named)
    ]
    first = joined_modes(description)
    wholes = {
        side: {first[mode.name] for mode in found if mode.sides[surface] == side}
        for side in (1, -1)
    }
    slides = any(0 in mode.sides.values() for mode in found)
    if found and not slides and all(len(names) <= 1 for names in wholes.values()):
        names = [name for own in wholes.values() for name in own]
        return [mode for name in names for mode in description.modes if mode.name == name]
    raise EntryError(
        ("resets", surface, CHATTER),
        f"chatter at '{surface}' is derived where its impacts are in one mode on a side of it, which does "
        f"not slide, and they are in {', '.join(mode.name for mode in found) or 'none'}",
    )


class _Wall:
    """A wall: the field of contact, and the acceleration that leaves it, as formulas and as texts."""

    def __init__(self, formulas: Formulas, surface: str, flight: ModeText) -> None:
        description = formulas.description
        self._formulas, self.surface, self.flight = formulas, surface, flight
        self.side = flight.sides[surface]
        [own] = [s for s in description.surfaces if s.name == surface]
        field = formulas.fields[[m.name for m in description.modes].index(flight.name)]
        height = formulas.heights()[surface]
        self._rate = formulas.rate(height, field)
        self.lift = sympy.simplify(formulas.rate(self._rate, field))
        self._image = formulas.resets()[description.surfaces.index(own)]
        slopes = [self._rate.diff(s) for s in formulas.y]
        changes = [
            [image.diff(s) - int(i == j) for j, s in enumerate(formulas.y)]
            for i, image in enumerate(self._image)
        ]
        column = next((j for j, slope in enumerate(slopes) if slope != 0), None)
        if column is None or description.kinks:
            raise self._refused("the rate of the gap does not depend on the states")
        along = [row[column] for row in changes]
        size = sum(slope * a for slope, a in zip(slopes, along, strict=True))
        if vanishes(size):
            raise self._refused("the reset does not change the rate of the gap")
        direction = [sympy.simplify(a / size) for a in along]
        self.field = [
            sympy.simplify(f - self.lift * d) for f, d in zip(field, direction, strict=True)
        ]
        self._check(height, column)

    def check_same(self, other: _Wall) -> None:
        """Refuse flights on both sides whose contacts are not the same."""
        if not all(vanishes(a - b) for a, b in zip(self.field, other.field, strict=True)):
            raise self._refused("at rest on it the fields of both sides do not agree")

    def _check(self, above: Any, column: int) -> None:
        """Refuse a reset that is no impact: it moves states at rest on the wall, or takes others off it."""
        f, draw = self._formulas, random.Random(1)
        values = defaults(f.description)
        symbols = (f.t, *f.y, *f.p)
        fixed = [values[p.name] for p in f.description.parameters]
        rates, heights, images = (
            sympy.lambdify(symbols, formula, "math") for formula in (self._rate, above, self._image)
        )
        for _ in range(_PLACES):
            t, y = draw.uniform(0.0, 3.0), [draw.uniform(-1.0, 1.0) for _ in f.y]
            for _ in range(50):  # secants: affine in the state, most often
                at, moved = rates(t, *y, *fixed), list(y)
                moved[column] += 1e-4
                slope = (rates(t, *moved, *fixed) - at) / 1e-4
                if slope == 0.0 or abs(at) < 1e-12:
                    break
                y[column] -= at / slope
            size = 1.0 + max(map(abs, y))
            if abs(rates(t, *y, *fixed)) > _SAME * size:
                continue
            image = images(t, *y, *fixed)
            if max(abs(a - b) for a, b in zip(image, y, strict=True)) > _SAME * size:
                raise self._refused("it moves a state that rests on the wall")
            y[column] += 1.0
            image = images(t, *y, *fixed)
            if abs(heights(t, *image, *fixed) - heights(t, *y, *fixed)) > _SAME * size:
                raise self._refused("it takes states off the wall")

    def _refused(self, why: str) -> EntryError:
        return EntryError(
            ("resets", self.surface, CHATTER),
            f"the reset at '{self.surface}' is no impact that can chatter: {why}",
        )
