"""Angles: states that are the same a turn later.

``angles: [theta]`` puts two surfaces into a model, at ``theta = pi`` and ``theta = -pi``; what meets one goes
on at the other. So a pendulum oscillates and rotates, and its rotations close. Nothing happens to the motion
there: the surfaces are joints of orbits that turn, and bound nothing (:class:`contfric.models.parts.Reset`).
Where a surface of the model lies at pi, such as ``sin(theta) = 0``, they are moved: of two surfaces that are
always met at once it is not known which is first. So they are where a model with excitation may rest at pi (a
rotor that is kicked by ``sin(theta)``): what rests at a cut is on neither side of it. A surface that is met
once only as the angle grows, such as
``theta = pi`` (and not ``sin(theta) = 0``), has to lie between the two.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

from contfric.errors import ModelError
from contfric.models.described.description import wraps_of
from contfric.models.entries import EntryError
from contfric.models.language.grammar import FLOATS, TIME, Scope, parse
from contfric.models.shorthand.clocks import is_clock

#: The key of a model.
ANGLES = "angles"
#: Where an angle may begin again, a turn before and there.
_CUTS = (
    *(("-pi", "pi"), ("2.5 - 2*pi", "2.5"), ("2.0 - 2*pi", "2.0"), ("1.0 - 2*pi", "1.0")),
    *(("4.0 - 2*pi", "4.0"), ("5.0 - 2*pi", "5.0"), ("-0.5", "2*pi - 0.5"), ("0.5", "2*pi + 0.5")),
)
#: A surface lies there if it does so for some states, to rounding.
_STATES, _ON = 3, 1e-9


def with_angles(data: dict[str, Any]) -> dict[str, Any]:
    """Return a model's data with the surfaces and resets of its angles; unchanged without any.

    Raises
    ------
    EntryError
        If an angle is no state, or a surface has the name of one of its own.
    """
    angles, states = data["angles"], data["states"]
    for index, angle in enumerate(angles):
        if angle not in states:
            raise EntryError(
                (ANGLES, index), f"'{angle}' is no state: an angle is one of {', '.join(states)}"
            )
    surfaces, resets = dict(data["surfaces"]), dict(data["resets"])
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
    modes = {name: {**m, "in": {**m["in"], **sides}} for name, m in data["modes"].items()}
    return {**data, "surfaces": surfaces, "resets": resets, "modes": modes}


def _cut(data: Mapping[str, Any], angle: str) -> tuple[str, str]:
    """Return (a turn before, where an angle begins again).

    That is pi, or the first place where no surface lies and nothing rests, and such that all that a growing
    angle meets once is in between.

    Raises
    ------
    EntryError
        If such a surface is met nowhere: it names a place that the angle never comes to.
    """
    heights = {name: _heights(data, angle, entry) for name, entry in data["surfaces"].items()}
    excited = not data.get("autonomous") or any(is_clock(s) for s in data["states"])
    rests = excited and not data.get("symmetry")
    once = {name: height for name, height in heights.items() if _is_met_once(height)}
    missed: dict[tuple[str, str], list[str]] = {}
    for cut in _CUTS:
        low, high = (Scope[float](FLOATS, {}).evaluate(parse(text)) for text in cut)
        missed[cut] = [n for n, height in once.items() if not _is_between(height, low, high)]
        met = any(_is_on(height, high) for height in heights.values())
        if not (missed[cut] or met or (rests and _may_rest(data, angle, high))):
            return cut
    for name in once:
        if all(name in found for found in missed.values()):
            raise EntryError(
                ("surfaces", name),
                f"'{angle}' is an angle, and comes to no place on '{name}': write a level within a turn of "
                f"0, or sin(({angle} - level)/2) = 0",
            )
    return min(_CUTS, key=lambda cut: len(missed[cut]))


#: The height of a surface at an angle, for some values of the other states; nan where it has none.
Heights = Callable[[float], list[float]]


def _heights(data: Mapping[str, Any], angle: str, surface: Mapping[str, Any]) -> Heights:
    """Return the function of an angle that the height of a surface is."""

    def heights(at: float) -> list[float]:
        draw, found = random.Random(1), []
        for _ in range(_STATES):
            y = {name: draw.uniform(-1.0, 1.0) for name in (*data["states"], TIME)}
            observable, level = (
                _value(data, surface[k], {**y, angle: at}) for k in ("observable", "level")
            )
            found.append(observable - level)
        return found

    return heights


def _value(data: Mapping[str, Any], text: str, at: Mapping[str, float]) -> float:
    """Return what an expression is at a state and the default parameters; nan where it has no value."""
    values: dict[str, float] = {n: entry["default"] for n, entry in data["parameters"].items()}
    texts = {**data["define"], **data["observables"]}
    with suppress(ModelError, ArithmeticError, TypeError, ValueError):  # its reader says why
        named = {name: parse(formula) for name, formula in texts.items() if formula != name}
        return float(Scope[float](FLOATS, {**values, **at}, named).evaluate(parse(text)))
    return math.nan


def _may_rest(data: Mapping[str, Any], angle: str, at: float) -> bool:
    """Tell whether a state that rests at an angle, all others but clocks at 0, stays so in some mode."""
    states = [s for s in data["states"] if not is_clock(s)]
    rest = {**dict.fromkeys(data["states"], 0.0), angle: at}

    def keeps(values: Mapping[str, Any], kept: Mapping[str, float]) -> bool:
        """Tell whether expressions have given values, whatever the time is."""
        return all(
            abs(_value(data, values[s], {**rest, TIME: time}) - kept[s]) < _ON
            for s in states
            for time in range(_STATES)
            if s in values
        )

    own = [mode["field"] for mode in data["modes"].values() if "field" in mode]
    fields = [*own, *([data["field"]] if "field" in data else [])]
    return any(keeps(f, dict.fromkeys(states, 0.0)) for f in fields) and all(
        keeps(reset, rest) for reset in data["resets"].values()
    )


def _is_on(heights: Heights, at: float) -> bool:
    """Tell whether a surface is met wherever an angle has a value, whatever the other states are."""
    return all(abs(height) < _ON for height in heights(at))


def _is_met_once(heights: Heights) -> bool:
    """Tell whether a surface says where an angle is and counts its turns: each changes its height by as much.

    It depends on no other state: else it is met at other angles for others.
    """
    here, there, beyond = (heights(1.0 + turn) for turn in (0.0, math.tau, 2.0 * math.tau))
    changes = [(b - a, c - b) for a, b, c in zip(here, there, beyond, strict=True)]
    alone = max(here) - min(here) < _ON
    return alone and all(abs(a) > _ON and abs(a - b) < _ON * abs(a) for a, b in changes)


def _is_between(heights: Heights, low: float, high: float) -> bool:
    """Tell whether a surface is crossed between two angles."""
    return all(a * b < 0.0 for a, b in zip(heights(low), heights(high), strict=True))
