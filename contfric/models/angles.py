"""Angles: states that are the same a turn later.

``angles: [theta]`` puts two surfaces into a model, at ``theta = pi`` and ``theta = -pi``; what meets one goes
on at the other. So a pendulum oscillates and rotates, and its rotations close. Nothing happens to the motion
there: the surfaces are joints of orbits that turn, and bound nothing (:class:`contfric.models.parts.Reset`).
Where a surface of the model lies at pi, such as ``sin(theta) = 0``, they are moved: of two surfaces that are
always met at once it is not known which is first.
"""

from __future__ import annotations

import random
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from contfric.errors import ModelError
from contfric.models.entries import EntryError, Part, mapping_in
from contfric.models.grammar import FLOATS, TIME, Scope, parse

#: The key of a model.
ANGLES = "angles"
#: Where an angle may begin again, a turn before and there.
_CUTS = (("-pi", "pi"), ("2.5 - 2*pi", "2.5"), ("2.0 - 2*pi", "2.0"), ("1.0 - 2*pi", "1.0"))
#: A surface lies there if it does so for some states, to rounding.
_STATES, _ON = 3, 1e-9


def wraps_of(angle: str) -> dict[str, int]:
    """Return the surfaces of an angle, and the side of each on which motion lies."""
    return {f"{angle}+": -1, f"{angle}-": 1}


def with_angles(data: dict[str, Any]) -> dict[str, Any]:
    """Return a model's data with the surfaces and resets of its angles; unchanged without any.

    Raises
    ------
    EntryError
        If an angle is no state, or a surface has the name of one of its own.
    """
    part = Part(data)
    angles, states = part.texts(ANGLES), [str(s) for s in data.get("states") or ()]
    for index, angle in enumerate(angles):
        if angle not in states:
            raise EntryError(
                (ANGLES, index), f"'{angle}' is no state: an angle is one of {', '.join(states)}"
            )
    surfaces, resets = mapping_in(data, "surfaces"), mapping_in(data, "resets")
    wanted = {s: angle for angle in angles for s in wraps_of(angle)}
    if not wanted or all(name in resets for name in wanted):  # a model that was stored has them
        return data
    for name in wanted:
        if name in surfaces:
            raise EntryError(
                ("surfaces", name), f"'{name}' is the surface at which an angle begins again"
            )
    sides: dict[str, int] = {}
    cuts = {angle: _cut(data, angle) for angle in angles}
    for name, angle in wanted.items():
        side = wraps_of(angle)[name]
        sides[name] = side
        surfaces[name] = {"observable": angle, "level": cuts[angle][side < 0]}
        resets[name] = {angle: f"{angle} {'-' if side < 0 else '+'} 2*pi"}
    modes = {
        name: {**mode, "in": {**mapping_in(mode, "in"), **sides}}
        if isinstance(mode, Mapping)
        else mode
        for name, mode in mapping_in(data, "modes").items()
    }
    return {**data, "surfaces": surfaces, "resets": resets, "modes": modes}


def _cut(data: Mapping[str, Any], angle: str) -> tuple[str, str]:
    """Return (a turn before, where an angle begins again): pi, or the first place where no surface lies."""
    return next((cut for cut in _CUTS if not _is_met_at(data, angle, cut[1])), _CUTS[0])


def _is_met_at(data: Mapping[str, Any], angle: str, cut: str) -> bool:
    """Tell whether some surface is met wherever an angle has a value, whatever the other states are."""
    values: dict[str, Any] = {
        name: value.get("default") if isinstance(value, Mapping) else value
        for name, value in mapping_in(data, "parameters").items()
    }
    texts = {**mapping_in(data, "define"), **mapping_in(data, "observables")}
    draw, at = random.Random(1), Scope[float](FLOATS, {}).evaluate(parse(cut))

    def height(surface: Mapping[str, Any]) -> float:
        named = {name: parse(str(text)) for name, text in texts.items() if str(text) != name}
        y = {name: draw.uniform(-1.0, 1.0) for name in (*map(str, data["states"]), TIME)}
        scope = Scope[float](FLOATS, {**values, **y, angle: at}, named)
        observable, level = (parse(str(surface.get(key, 0))) for key in ("observable", "level"))
        return float(scope.evaluate(observable) - scope.evaluate(level))

    for surface in mapping_in(data, "surfaces").values():
        with suppress(ModelError, ArithmeticError, TypeError, ValueError):  # its reader says why
            if all(abs(height(surface)) < _ON for _ in range(_STATES)):
                return True
    return False
