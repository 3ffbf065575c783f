"""Units of a structure whose modes are made when a solution visits them.

Modes that are not written out cannot be rewritten: the structure itself is. With coordinates of one unit U,
``q = U Q`` and ``t = U_t T``,

    (U/U_t^2) M Q'' + (U/U_t) C Q' + U K Q = f ,

so that forces, loads and limits of contacts stay in the units of the file, and gaps, velocities and
stretches are divided by their units. Work is a force times ``U`` (:mod:`..structures.contact_laws`).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from contfric.models.entries import AUTO, EntryError, known_keys
from contfric.models.language.grammar import TIME
from contfric.models.shorthand.sizes import chosen_units
from contfric.models.shorthand.tied import Substitution
from contfric.models.shorthand.units import APPLIED, KEY, Read, measured
from contfric.models.structures.contacts import ContactKind
from contfric.models.structures.matrices import is_zero, matrix_of, summed, times
from contfric.models.structures.structure import Structure

#: Powers of the units of length and time in each matrix.
_MATRICES = {"mass": (1, -2), "damping": (1, -1), "stiffness": (1, 0)}
#: Expressions of a contact that are lengths, velocities, and forces over a length.
_LENGTHS, _VELOCITY, _STIFFNESS = ("gap", "displacement"), "velocity", "stiffness"


def structure_in_units(data: dict[str, Any], read: Read) -> dict[str, Any]:
    """Return a structure in its own units; unchanged where it has none, or its modes are listed.

    Parameters
    ----------
    data : in the form of :mod:`contfric.models.reading.schema`
    read : reads what is written out

    Raises
    ------
    EntryError
        If a unit is wrong, or coordinates have several.
    """
    if not data[KEY]:
        return data
    structure = Structure.read(data)
    if not structure.composes:
        return data
    units = _units(structure, read)
    length, time = units[structure.coordinates[0]], units[TIME]
    put = Substitution({name: f"({unit!r}*{name})" for name, unit in units.items()})
    whole = measured({**data, "states": [n for n in units if n != TIME]}, units)
    found = {**data, **{k: whole[k] for k in whole if k != "states"}, KEY: {}, APPLIED: units}
    for key, (of_length, of_time) in _MATRICES.items():
        rows = matrix_of(key, data[key], len(structure.coordinates))
        factor = length**of_length * time**of_time
        found[key] = [[_scaled(put.text(text), factor) for text in row] for row in rows]
    found["force"] = {q: put.text(text) for q, text in data["force"].items()}
    found["contacts"] = {n: _contact(c, put, length, time) for n, c in data["contacts"].items()}
    return found


def _units(structure: Structure, read: Read) -> dict[str, float]:
    """Return the units of coordinates, velocities, stretches and time."""
    given, names = structure.data[KEY], structure.coordinates
    if AUTO in given:
        chosen = natural_units(structure, read)
        given = {q: chosen[q] for q in names} | {TIME: chosen[TIME]}
    known_keys(given, (*names, TIME), (KEY,))
    lengths, time = {given.get(q, 1.0) for q in names}, given.get(TIME, 1.0)
    if len(lengths) > 1:
        raise EntryError(
            (KEY,), "coordinates of a structure with many, or shared, contacts have one unit"
        )
    [length] = lengths
    own = [c.name for c in structure.contacts if c.kind is ContactKind.JENKINS]
    return {
        **dict.fromkeys(names, length),
        **dict.fromkeys(structure.velocities, length / time),
        **dict.fromkeys(own, length),
        TIME: time,
    }


def natural_units(structure: Structure, read: Read) -> dict[str, float]:
    """Return what forces move coordinates and velocities by, the largest of each, and the time in which.

    Raises
    ------
    EntryError
        If nothing moves them.
    """
    alike = [*structure.coordinates], structure.velocities
    known = structure.data.get("spread", {})  # what a visited mode is made from has none
    return chosen_units(read(_smooth(structure)), known, (), alike)


def _smooth(structure: Structure) -> dict[str, Any]:
    """Return the structure as a model in which all friction slides up, and nothing else acts."""
    data, names = structure.data, structure.coordinates
    pulls = {i: [force] for i, force in enumerate(structure.forces)}
    for contact in structure.loads.rubbing:
        for i, w in contact.direction.items():
            pulls[i].append(times(repr(w), contact.pull("p")))
    moved = structure.mass.of({i: summed(parts) for i, parts in pulls.items()})
    field = dict(zip(names, structure.velocities, strict=True))
    field |= {v: moved.get(i, "0") for i, v in enumerate(structure.velocities)}
    own = ("name", "parameters", "define", "period", "autonomous")
    kept = {key: data[key] for key in own if key in data}
    spread = {name: size for name, size in data.get("spread", {}).items() if name in field}
    mode = {"smooth": {"in": {}, "field": field}}
    return {**kept, "states": [*field], "modes": mode, "spread": spread}


def _contact(contact: Mapping[str, Any], put: Substitution, length: float, time: float) -> Any:
    """Return a contact in units; where it rests is said in those of the file."""
    found = {**contact}
    for key, text in contact.items():
        if key in ("kind", "at", "chatter") or not isinstance(text, str):
            continue
        factor = {_VELOCITY: time / length, _STIFFNESS: length}.get(key, 1.0)
        found[key] = _scaled(put.text(text), 1.0 / length if key in _LENGTHS else factor)
    return found


def _scaled(text: str, factor: float) -> str:
    """Return an expression times a number."""
    if factor == 1.0 or is_zero(text):
        return text
    try:
        return repr(float(text) * factor)
    except ValueError:
        return f"{factor!r}*({text})"
