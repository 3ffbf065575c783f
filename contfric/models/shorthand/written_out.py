"""Expands the short forms of a model: ties, shifts, clocks, angles, units, sliding, observables.

Each is put into the data of a model, before it is read, as if it had been typed: nothing behind knows of it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from itertools import product
from typing import Any

from contfric.errors import ModelError
from contfric.models.described.description import Description
from contfric.models.described.reset_modes import FROM, TO, named_parts
from contfric.models.entries import EntryError, as_identifier
from contfric.models.language.grammar import PERIOD, RESERVED
from contfric.models.shorthand.angles import with_angles
from contfric.models.shorthand.between import modes_between
from contfric.models.shorthand.centre import centred
from contfric.models.shorthand.clocks import value_at_defaults, with_clock
from contfric.models.shorthand.tied import with_ties_put_in
from contfric.models.shorthand.units import in_units


def expanded(data: dict[str, Any], read: Callable[[dict[str, Any]], Description]) -> Description:
    """Return the description of a model, with all that it says in short.

    Parameters
    ----------
    data : in the form of :mod:`contfric.models.reading.schema`
    read : reads what is written out

    Raises
    ------
    EntryError
        For the first mistake, with the address of its entry.
    """
    if not data["surfaces"] and not data["modes"] and "field" in data:
        data = {**data, **_smooth(data)}
    elif (
        not data["modes"]
        and "field" in data
        and not data["surfaces"].keys() & data["resets"].keys()
    ):
        data = {**data, "modes": modes_between(data)}
    elif not data["surfaces"] and len(data["modes"]) == 1:
        data = {**data, **_smooth_mode(data)}
    data = centred(_with_observables(_with_period(with_ties_put_in(data))))
    data, parts = _divided_by_resets(data)
    walls, data = _asked(data, "resets", "chatter")
    whole = _going_on(with_angles(with_clock(data)), data, parts)
    surfaces, plain = _asked(whole, "surfaces", "sliding")
    plain = in_units(plain, read)
    found = read(plain)
    if surfaces:
        from contfric.models.shorthand.filippov import sliding_parts

        plain = plain | sliding_parts(found, surfaces, _with_fields(plain))
        found = read(plain)
    if walls:
        from contfric.models.shorthand.chatter import chatter_parts

        plain = plain | chatter_parts(found, walls, _with_fields(plain))
        found = read(plain)
    return _divided(found, plain, read)


def _smooth(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the modes of a smooth model: one, or two at a section where nothing else can be a joint.

    Along any cycle the first state stands still somewhere.
    """
    rate = data["field"].get(data["states"][0])
    if not data.get("autonomous") or data["angles"] or rate is None:
        return {"modes": {"smooth": {"in": {}}}}
    sides = {"smooth": "+", "smooth-": "-"}
    return {
        "surfaces": {"section": {"observable": rate, "level": "0"}},
        "modes": {mode: {"in": {"section": side}} for mode, side in sides.items()},
    }


def _smooth_mode(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the same of the only mode of a model without excitation, which keeps its name."""
    [(name, mode)] = data["modes"].items()
    field = mode.get("field") or data.get("field", {})
    parts = _smooth({**data, "field": field})
    if "surfaces" not in parts:
        return {}
    modes = zip((name, f"{name}-"), parts["modes"].values(), strict=True)
    return {**parts, "modes": {own: {**mode, **sides} for own, sides in modes}}


def _divided(
    found: Description, data: Mapping[str, Any], read: Callable[[dict[str, Any]], Description]
) -> Description:
    """Return a description in which modes that an orbit may stay in are divided by the phase."""
    from contfric.models.deriving.phases import phase_parts

    divided = found
    with suppress(ModelError, ArithmeticError, StopIteration):  # whoever builds the model says why
        parts = phase_parts(found, _with_fields(data))
        divided = read({**data, **parts}) if parts else found
    if not divided.surfaces:
        raise EntryError((), "nothing moves: a model without surfaces has one mode, and a field")
    return divided


#: The parts of modes that resets divide.
Parts = Mapping[str, tuple[str, ...]]


def _with_period(data: dict[str, Any]) -> dict[str, Any]:
    """Return a model in which the period stands for T in levels: a switch at ``T/2``."""
    if PERIOD in data["parameters"] or PERIOD in data["define"] or "period" not in data:
        return data
    period = f"({data['period']})"
    surfaces = {
        name: {**entry, "level": re.sub(rf"\b{PERIOD}\b", lambda _: period, entry["level"])}
        for name, entry in data["surfaces"].items()
    }
    return {**data, "surfaces": surfaces}


def _with_observables(data: dict[str, Any]) -> dict[str, Any]:
    """Return a model in which an expression that a surface is the zero of has a name: that of the surface."""
    observables, parts = dict(data["observables"]), data["define"]
    # a surface may be called sign
    taken = {*data["states"], *data["parameters"], *parts, *RESERVED}
    named: dict[str, Any] = {}
    known: dict[str, str] = {}
    for name, entry in data["surfaces"].items():
        named[name] = entry
        text = entry["observable"]
        if text.isidentifier() and text not in parts:
            continue
        if text in known:  # levels of one expression are ordered
            named[name] = {**entry, "observable": known[text]}
            continue
        own = as_identifier(name)
        while own in taken or own in observables:
            own += "_"
        known[text] = own
        observables[own] = text
        named[name] = {**entry, "observable": own}
    return {**data, "surfaces": named, "observables": observables}


def _divided_by_resets(data: dict[str, Any]) -> tuple[dict[str, Any], Parts]:
    """Return a model in which a reset acts in modes that lie on both sides of its surface, and their parts.

    A clock is struck as its balance passes the middle on the way up: ``from: [up]`` at ``x = 0``. Each mode
    that a reset names, and that says no side of its surface, is two: ``up-`` below it and ``up+`` above; four
    where two resets name it. A reset at a place of an angle acts in all modes, if none has a side: rotations
    pass it.
    """
    modes, resets, surfaces = dict(data["modes"]), dict(data["resets"]), data["surfaces"]
    named = {domain["mode"] for domain in data["domains"].values()}
    divides: dict[str, list[str]] = {}  # the surfaces that divide each mode
    for surface, entry in resets.items():
        asked = entry.get(FROM)
        sided = any(surface in mode["in"] for mode in modes.values())
        at = surfaces.get(surface, {}).get("observable")
        if asked is None and not sided and at in data["angles"]:
            asked = [*modes]
            resets[surface] = {**entry, FROM: asked}
        for name in asked or ():
            sides = modes[name]["in"] if name in modes else {surface: 0}
            if surface not in sides and name not in named:
                divides.setdefault(name, []).append(surface)
    parts: dict[str, tuple[str, ...]] = {}
    for name, between in divides.items():
        signs = [s for s in product("-+", repeat=len(between)) if _is_somewhere(s, between, data)]
        own = [f"{name}{''.join(sides)}" for sides in signs]
        if not modes.keys() & {*own}:
            whole, parts[name] = modes[name], tuple(own)
            inside = [{**whole["in"], **dict(zip(between, s, strict=True))} for s in signs]
            divided = {n: {**whole, "in": sides} for n, sides in zip(own, inside, strict=True)}
            modes = {  # in their order: of modes that overlap a start is in the first
                n: m
                for old, entry in modes.items()
                for n, m in (divided if old == name else {old: entry}).items()
            }
    if parts:
        resets = named_parts(resets, parts)
    return {**data, "modes": modes, "resets": resets}, parts


def _going_on(data: dict[str, Any], before: Mapping[str, Any], parts: Parts) -> dict[str, Any]:
    """Return a model in which what is divided goes on, in any of its parts, where a turn or a period begins.

    Other modes may hold there, too, if they overlap; the user did not write these resets.
    """
    own, resets = before["resets"], data["resets"]
    goes_on = [{part: {FROM: [*all_]}} for all_ in parts.values() for part in all_]
    fresh = {s: {**entry, TO: goes_on} for s, entry in resets.items() if s not in own and goes_on}
    return {**data, "resets": {**resets, **fresh}} if fresh else data


def _is_somewhere(sides: Sequence[str], surfaces: Sequence[str], data: Mapping[str, Any]) -> bool:
    """Return whether a state can have some sides of surfaces: not below one level and above a higher one."""
    found: dict[object, tuple[list[float], list[float]]] = {}
    for side, name in zip(sides, surfaces, strict=True):
        entry = data["surfaces"].get(name, {})
        # whoever reads the level says what is wrong
        with suppress(ModelError, ArithmeticError, SyntaxError):
            level = value_at_defaults(entry.get("level", "0"), data)
            found.setdefault(entry.get("observable"), ([], []))[side == "+"].append(level)
    return all(not (above and below) or max(above) < min(below) for below, above in found.values())


def _asked(data: dict[str, Any], kind: str, key: str) -> tuple[tuple[str, ...], dict[str, Any]]:
    """Return the surfaces or resets whose entries ask for something derived, and the model without that."""
    entries = data[kind]
    asked = tuple(name for name, entry in entries.items() if entry.get(key))
    plain = {n: {k: v for k, v in e.items() if k != key} for n, e in entries.items()}
    return asked, {**data, kind: plain}


def _with_fields(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return a model's data in which no mode relies on the common field."""
    common = data.get("field")
    modes = {name: {"field": common, **mode} for name, mode in data["modes"].items()}
    return {**data, "modes": modes} if common else dict(data)
