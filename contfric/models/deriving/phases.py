"""A section where no surface is met: orbits along which nothing happens, in a model that is excited.

An orbit needs a joint. One that stays in one mode (below a grazing, off a wall, pressed against it all the
time) has none, unless a surface divides that mode. So each mode in which an orbit may stay is divided by the
phase of the excitation, ``sin(2 pi t / T - 1) = 0``: it is crossed twice a period whatever motion does, never
touched, and is its own image half a period later. To all else it is not there: a section is no joint of
orbits that meet other surfaces (:mod:`contfric.models.deriving.sections`), and what labels name leaves it
out.

No orbit stays in a mode that ends at known times, or of which the region fixes the sign of the rate of a
state (a slide, ``x' = v > 0``), nor where a state that is no angle has a constant rate.

Without excitation a cycle has no phase, but each state of it stands still somewhere. Where a solution is seen
to stay in a mode, the rate of a state in that mode is the section (:func:`with_phase`): of the first state
whose rate has no kink.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from contfric.base.attributes import kept
from contfric.errors import ModelError
from contfric.models.deriving.measuring import proportional
from contfric.models.deriving.sections import has_kinks, joined_modes
from contfric.models.described.description import Description, ModeText
from contfric.models.described.evaluate import Sampler, defaults, floats
from contfric.models.described.reading_back import described, from_text
from contfric.models.described.regions import domains_of, engine_order, known_sides
from contfric.models.described.reset_modes import named_parts
from contfric.models.parts import MOST_SURFACES
from contfric.models.structures.contact_laws import KEY as FORCES
from contfric.models.structures.contacts import Contact, ContactKind

if TYPE_CHECKING:
    from contfric.models.definition import Model

#: The key of what has been divided, and the name of the observable and the surface.
KEY = "phase"
#: The same of a section without excitation.
SECTION = "section"
#: What the name of the second part of a mode of a structure with many contacts ends with.
PART = "-"
#: Rounding in an identity of expressions of moderate size, relative to 1 + the values.
_SAME = 1e-9
#: States at which two expressions must agree to be the same.
_POINTS = 8
#: Where in a period: at no time at which solutions start, forces are largest, or simulations end.
_LATE = 1
#: The phase doubles the regions of a model, which takes time where they are many: three friction contacts
#: have 343, six gaps 64, four friction contacts 2401 (two seconds more to load). Models with more are divided
#: once a solution stays in a mode for ever (:func:`with_phase`).
_MOST_REGIONS = 343
#: Models that are kept with their phase.
_MODELS = 16


def with_phase(model: Model, mode: str) -> Model | None:
    """Return a model with a section in a mode in which a solution stays; None where it cannot have one.

    With excitation the phase divides all modes in which an orbit may stay, however many regions there are.
    """
    if not model.definition or model.phase:
        return None
    return _with_phase(model.definition, mode if model.autonomous else "")


@lru_cache(maxsize=_MODELS)
def _with_phase(definition: str, mode: str) -> Model | None:
    from contfric.models.deriving.derive import model_from

    description = from_text(definition)
    data = description.data()
    if not mode:
        parts = phase_parts(description, data, however_many=True)
        return model_from(described({**data, **parts})) if parts else None
    for state in description.states:
        parts = _rate_parts(description, data, mode, state)
        with suppress(ModelError):  # its symmetry leads to no section
            if parts:
                return model_from(described({**data, **parts}))
    return None


def _rate_parts(
    description: Description, data: Mapping[str, Any], mode: str, state: str
) -> dict[str, Any]:
    """Return the parts of a model's data with the rate of a state as a section in all modes that have it."""
    if state in description.angles or mode not in data["modes"]:
        return {}
    rate = data["modes"][mode]["field"][state]
    staying = [
        m.name for m in _staying(description) if data["modes"][m.name]["field"][state] == rate
    ]
    if mode not in staying or has_kinks(description, [rate]):
        return {}
    return _in_parts(data, staying, _section_of(description, data, SECTION, rate))


def phase_parts(
    description: Description, data: Mapping[str, Any], however_many: bool = False
) -> dict[str, Any]:
    """Return the parts of a model's data in which its modes are divided; none where none has to be.

    Parameters
    ----------
    data : with the field of each mode in it
    however_many : even if its regions are many
    """
    if not description.period or description.phase:
        return {}
    phase = f"sin(2*pi*t/({description.period}) - {_LATE})"
    if description.structure:  # which modes it divides is told when they are visited
        surfaces = len(description.surfaces)
        return _section_of(description, data, KEY, phase) if surfaces < MOST_SURFACES else {}
    if not however_many and _has_many(description):
        return {}
    staying = [mode.name for mode in _staying(description)]
    return _in_parts(data, staying, _section_of(description, data, KEY, phase)) if staying else {}


def _in_parts(
    data: Mapping[str, Any], staying: Sequence[str], added: dict[str, Any]
) -> dict[str, Any]:
    """Return the parts of a model's data in which a section divides some modes."""
    name = added[KEY]
    modes: dict[str, Any] = {}
    parts: dict[str, tuple[str, ...]] = {}
    for mode, entry in data["modes"].items():
        if mode not in staying:
            modes[mode] = entry
            continue
        other = f"{mode}-"
        while other in data["modes"] or other in modes:
            other += "-"
        parts[mode] = mode, other
        for part, side in (mode, "+"), (other, "-"):
            modes[part] = {**entry, "in": {**(entry.get("in") or {}), name: side}}
    named = {
        key: {**entry, "in": {**(entry.get("in") or {}), name: "+"}}
        for key, entry in (data.get("domains") or {}).items()
    }
    forces = {
        contact: {**laws, "modes": _with_parts(laws["modes"], parts)}
        for contact, laws in (data.get(FORCES) or {}).items()
    }
    return {
        **({"domains": named} if named else {}),
        **({FORCES: forces} if forces else {}),
        **added,
        "modes": modes,
        "resets": named_parts(data.get("resets") or {}, parts),
    }


def _section_of(
    description: Description, data: Mapping[str, Any], called: str, formula: str
) -> dict[str, Any]:
    """Return the parts of a model's data in which it has a section, the zero of a formula."""
    names = description.names
    taken = {
        *names.states,
        *names.parameters,
        *names.parts,
        *(s.name for s in description.surfaces),
    }
    name = next(n for n in (called + "_" * k for k in range(len(taken) + 1)) if n not in taken)
    return {
        "observables": {**(data.get("observables") or {}), name: formula},
        "surfaces": {**(data.get("surfaces") or {}), name: {"observable": name, "level": "0"}},
        KEY: name,
    }


def _has_many(description: Description) -> bool:
    """Tell whether a model has more regions than are doubled."""
    if len(description.modes) > _MOST_REGIONS:
        return True
    return len(domains_of(description, engine_order(description))) > _MOST_REGIONS


def _with_parts(laws: Mapping[str, str], parts: Mapping[str, Sequence[str]]) -> dict[str, str]:
    """Return which law of a contact holds in each mode, where modes are in parts."""
    return {part: law for mode, law in laws.items() for part in parts.get(mode, (mode,))}


def _staying(description: Description) -> list[ModeText]:
    """Return the modes in which an orbit may stay and that no section divides."""
    surfaces = engine_order(description)
    sampler = Sampler(floats(description), defaults(description))
    timed = {s.name for s in surfaces if _is_timed(sampler, s.name)}
    parts = Counter(joined_modes(description).values())
    resting = {own.mode for own in description.chatters}  # each is one mode, by its name
    return [
        mode
        for mode in description.modes
        if mode.name not in resting
        and parts[joined_modes(description)[mode.name]] == 1
        and not timed & mode.sides.keys()
        and _may_stay(sampler, mode, known_sides(mode, surfaces))
    ]


def _is_timed(sampler: Sampler, surface: str) -> bool:
    """Tell whether a surface is met at times that do not depend on the motion."""
    (t, first), *others = sampler.states(_POINTS)
    apart = [sampler.evaluator.height(surface, sampler.params, t, y) for _, y in others]
    at = sampler.evaluator.height(surface, sampler.params, t, first)
    return all(abs(h - at) <= _SAME * (1.0 + abs(at)) for h in apart)


def _may_stay(sampler: Sampler, mode: ModeText, sides: Mapping[str, int]) -> bool:
    """Tell whether no rate of a mode keeps its sign all over the region."""
    evaluator, params = sampler.evaluator, sampler.params
    points, moves = list(sampler.states(_POINTS)), False
    heights, rested = (
        [
            [evaluator.height(s, params, t, y) for t, y in points]
            for s, side in sides.items()
            if (side == 0) is on
        ]
        for on in (False, True)
    )
    for state, text in zip(evaluator.description.states, mode.field, strict=True):
        rates = [evaluator.value(text, params, t, y) for t, y in points]
        if max(rates) - min(rates) <= _SAME * (1.0 + abs(rates[0])):
            if abs(rates[0]) > _SAME and state not in evaluator.description.angles:
                return False
            continue
        moves = True
        if any(proportional(rates, height) for height in rested):
            continue  # the velocity of what rests on a surface
        if any(proportional(rates, height) for height in heights):
            return False
    return moves


class PhaseParts:
    """Which modes of a structure with many contacts the phase divides, and the names of the parts.

    The first part has the name of the mode, the second that name with :data:`PART`. Which modes are divided
    follows from the states of their contacts.

    Parameters
    ----------
    acting : the contacts that have states, a letter of a mode's name for each
    coordinates : how many the structure has
    surface : the surface of the phase; empty if no mode is divided
    """

    def __init__(self, acting: Sequence[Contact], coordinates: int, surface: str) -> None:
        self._acting, self._coordinates, self._surface = acting, coordinates, surface

    def whole(self, name: str) -> str:
        """Return the mode that a mode is a part of, most often itself."""
        return name.removesuffix(PART)

    def is_divided(self, name: str) -> bool:
        """Tell whether the phase divides a mode: one in which an orbit may stay."""
        return bool(self._surface) and self._may_stay(self.whole(name))

    def part(self, name: str, side: int) -> str:
        """Return the part of a mode on one side of the phase; the mode itself if that is not divided."""
        whole = self.whole(name)
        return whole + PART if side < 0 and self.is_divided(whole) else whole

    def side(self, name: str) -> int:
        """Return the side of the phase that a part of a mode lies on; 0 of a mode that is not divided."""
        return (-1 if name.endswith(PART) else 1) * self.is_divided(name)

    @kept
    def _may_stay(self, whole: str) -> bool:
        """Tell whether something moves in a mode, and no contact slides to one side for ever.

        Where the velocity of a contact is that of masses alone, what slides in one direction goes away.
        """
        states = list(zip(self._acting, whole, strict=True))
        held = sum(letter == "s" for c, letter in states if c.kind is ContactKind.FRICTION)
        if held == self._coordinates:
            return False
        sliding = (c for c, letter in states if letter in ("p", "n"))
        return all(c.kind is ContactKind.FRICTION and _is_carried(c) for c in sliding)


def _is_carried(contact: Contact) -> bool:
    """Tell whether the velocity of a contact has a given part, as that of a belt."""
    return any(kind != "y" for kind, _ in contact.form.parts)
