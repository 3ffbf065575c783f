"""Structures with contacts: ``M q'' + C q' + K q = f(t)``, and what its contacts do, as modes of a model.

A model that has ``coordinates`` in place of states is written out here: its states are the coordinates, the
velocities v1, v2, ... and the stretches of Jenkins elements; its modes are the combinations of the states of
its contacts (:mod:`contfric.models.contacts`), a letter for each, in their order.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from contfric.errors import ModelError
from contfric.models.affine import NotAffineError
from contfric.models.coefficient_texts import text_of
from contfric.models.coefficients import AFFINE, symbols
from contfric.models.contacts import Contact, ContactKind, drift, read_contacts
from contfric.models.entries import EntryError, Part, mapping_in
from contfric.models.grammar import Scope, names_in, number_of, parse
from contfric.models.matrices import Mass, Texts, is_zero, mass_of, matrix_of, summed, times

COORDINATES = "coordinates"
#: What a model of a structure has of its own; everything else is as in any model.
KEYS = (COORDINATES, "mass", "damping", "stiffness", "force", "contacts")
_OTHERS = (
    *("name", "title", "references", "parameters", "constraints", "period", "autonomous", "define"),
    *("observables", "symmetry", "spread", "integration", "max_step"),
)
#: Most combinations of states of contacts: each is a mode with regions of its own.
_MOST_MODES = 243
#: How far the order of a harmonic may be from an odd number: rounding.
_ODD = 1e-9


def with_contacts(data: dict[str, Any]) -> dict[str, Any]:
    """Return a model's data with its structure and contacts written out; unchanged where it has none.

    Raises
    ------
    EntryError
        For the first mistake, with the address of its entry.
    """
    if COORDINATES not in data:
        for key in KEYS[1:]:
            if key in data and "states" not in data:
                raise EntryError(
                    (key,), f"'{key}' needs '{COORDINATES}': write {COORDINATES}: [q1, q2]"
                )
        return data
    top = Part(data)
    top.only((*KEYS, *_OTHERS))
    return _Structure.read(top).data()


@dataclass(frozen=True)
class _Structure:
    """A structure as it is declared.

    Attributes
    ----------
    forces : of the coordinates, without contacts: ``f - C q' - K q``
    """

    top: Part
    coordinates: tuple[str, ...]
    velocities: tuple[str, ...]
    mass: Mass
    forces: tuple[str, ...]
    contacts: tuple[Contact, ...]

    @classmethod
    def read(cls, top: Part) -> _Structure:
        """Read a structure."""
        coordinates = _coordinates(top)
        size = len(coordinates)
        velocities = tuple(f"v{i}" for i in range(1, size + 1))
        params = _defaults(top)
        mass = mass_of(matrix_of("mass", top.data.get("mass"), size, "identity"), params)
        damping, stiffness = (
            matrix_of(key, top.data.get(key), size, "0") for key in ("damping", "stiffness")
        )
        given = top.part("force", "a mapping of coordinates to expressions")
        given.only(coordinates)
        forces = tuple(
            _force(str(given.data.get(q, "0")), i, coordinates, velocities, damping, stiffness)
            for i, q in enumerate(coordinates)
        )
        contacts = read_contacts(
            top.part("contacts", "a mapping of names to contacts"),
            coordinates,
            velocities,
            tuple(params),
            {str(k): str(v) for k, v in mapping_in(top.data, "define").items()},
        )
        found = cls(top, coordinates, velocities, mass, forces, tuple(contacts))
        found.check()
        return found

    # ------------------------------------------------------------------------------- checks

    def check(self) -> None:
        """Refuse what cannot be written out."""
        count = 1
        for contact in self.contacts:
            count *= max(1, len(contact.states))
        if count > _MOST_MODES:
            raise EntryError(
                ("contacts",),
                f"these contacts have {count} combinations of states, and each is a mode: at most "
                f"{_MOST_MODES} can be listed (five contacts of three states)",
            )
        rubbing = [c for c in self.contacts if c.kind is ContactKind.FRICTION]
        for one, other in itertools.combinations(rubbing, 2):
            if not is_zero(self.mobility(one, other)):
                raise EntryError(
                    ("contacts", other.name),
                    f"the loads of '{one.name}' and '{other.name}' depend on each other (W . M^-1 W' is not "
                    "0): friction contacts have to act on masses of their own. A Jenkins element, whose "
                    "force is a state, can be put anywhere",
                )

    def mobility(self, one: Contact, other: Contact) -> str:
        """Return ``W . M^-1 W'`` of two contacts, an expression."""
        moved = self.mass.of({i: repr(w) for i, w in other.direction.items()})
        return summed([times(repr(w), moved[i]) for i, w in one.direction.items() if i in moved])

    # ---------------------------------------------------------------------------- expressions

    def load(self, contact: Contact, closed: tuple[Contact, ...]) -> str:
        """Return the load that friction carries where it sticks, with some springs closed."""
        pulls: dict[int, list[str]] = {i: [f"f_{q}"] for i, q in enumerate(self.coordinates)}
        for other in self.contacts:
            if other.kind is ContactKind.JENKINS or other in closed:
                for i, w in other.direction.items():
                    pulls[i].append(times(repr(w), other.pull("c")))
        moved = self.mass.of({i: summed(parts) for i, parts in pulls.items()})
        along = summed(
            [times(repr(w), moved[i]) for i, w in contact.direction.items() if i in moved]
        )
        apart = drift(contact)
        free = along if is_zero(apart) else f"{along} - ({apart})"
        return f"({free})/({self.mobility(contact, contact)})"

    @cached_property
    def springs(self) -> dict[str, tuple[Contact, ...]]:
        """The springs that the load of each friction contact depends on."""
        every = [c for c in self.contacts if c.kind is ContactKind.SPRING]
        return {
            c.name: tuple(s for s in every if not is_zero(self.mobility(c, s)))
            for c in self.contacts
            if c.kind is ContactKind.FRICTION
        }

    def closed(self, contact: Contact, states: Mapping[str, str]) -> tuple[Contact, ...]:
        """Return the springs that are closed in a mode, of those that a load depends on."""
        return tuple(s for s in self.springs[contact.name] if states[s.name] == "c")

    # -------------------------------------------------------------------- parts of the model

    def data(self) -> dict[str, Any]:
        """Return the model in the schema of all models."""
        kept = {key: value for key, value in self.top.data.items() if key not in KEYS}
        stretches = [c.name for c in self.contacts if c.kind is ContactKind.JENKINS]
        states = [*self.coordinates, *self.velocities, *stretches]
        define = {**mapping_in(kept, "define")}
        define |= {f"f_{q}": force for q, force in zip(self.coordinates, self.forces, strict=True)}
        observables, surfaces = self._surfaces()
        found = {
            **kept,
            "states": states,
            "define": define,
            "observables": {**mapping_in(kept, "observables"), **observables},
            "surfaces": surfaces,
            "modes": self._modes(),
            "departures": [d for c in self.contacts for d in self._departures(c)],
            "spread": {**dict.fromkeys(states, "1"), **mapping_in(kept, "spread")},
        }
        resets = self._resets()
        found |= {"resets": resets} if resets else {}
        if "symmetry" not in kept and self._is_symmetric():
            images = [f"{name} -> -{name}" for name in states]
            found["symmetry"] = ", ".join(
                [*images, *(["t -> t + T/2"] if "period" in kept else [])]
            )
        return found

    def _is_symmetric(self) -> bool:
        """Tell whether the motion of the opposite states half a period later is one, too, at the defaults."""
        params = _defaults(self.top)
        if any(c.kind in (ContactKind.SPRING, ContactKind.IMPACT) for c in self.contacts):
            return False
        names = (*self.coordinates, *self.velocities)
        define = {k: parse(str(v)) for k, v in mapping_in(self.top.data, "define").items()}
        scope = Scope(AFFINE, symbols(names, tuple(params)), define)
        period = self.top.data.get("period")
        try:
            forms = [
                *(scope.evaluate(parse(f)) for f in self.forces),
                *(c.form for c in self.contacts),
            ]
            turn = number_of(str(period), params) / math.tau if period else math.nan
            waves = [key[1] for form in forms for key in form.parts if key[0] != "y"]
            orders = [number_of(text_of(w), params) * turn if w else 0.0 for w in waves]
        except (NotAffineError, ModelError):
            return False
        return all(abs(math.remainder(order - 1.0, 2.0)) < _ODD for order in orders)

    def _surfaces(self) -> tuple[dict[str, str], dict[str, Any]]:
        observables: dict[str, str] = {}
        surfaces: dict[str, Any] = {}

        def add(name: str, observable: str, text: str, level: str) -> None:
            if text in (*self.coordinates, *self.velocities) or text == observable:
                observable = text  # a state needs no second name
            else:
                observables[observable] = text
            surfaces[name] = {"observable": observable, "level": level}

        for c in self.contacts:
            if c.kind is ContactKind.FRICTION:
                add(c.name, f"{c.name}_velocity", c.texts["velocity"], "0")
                self._limits(c, add)
            elif c.kind is ContactKind.JENKINS:
                level = f"({c.texts['limit']})/({c.texts['stiffness']})"
                add(c.name, f"{c.name}_velocity", self._speed(c), "0")
                add(f"{c.name}+", c.name, c.name, level)
                add(f"{c.name}-", c.name, c.name, f"-{level}")
            else:
                add(c.name, f"{c.name}_gap", c.texts["gap"], "0")
        return observables, surfaces

    def _limits(self, c: Contact, add: Any) -> None:
        static = c.texts.get("static", c.texts["kinetic"])
        fixed = names_in(parse(static)) <= {*_defaults(self.top), "pi"}
        for closed in _subsets(self.springs[c.name]):
            name, load = (
                "_".join([f"{c.name}_load", *(s.name for s in closed)]),
                self.load(c, closed),
            )
            for sign, other in ("+", "-"), ("-", "+"):
                surface = _limit(c, closed, sign)
                if fixed:
                    add(surface, name, load, f"{sign}({static})")
                else:  # a limit that moves
                    side = "high" if sign == "+" else "low"
                    add(surface, f"{name}_{side}", f"{load} {other} ({static})", "0")

    def _speed(self, c: Contact) -> str:
        """Return the velocity along a direction of coordinates."""
        return summed([times(repr(w), self.velocities[i]) for i, w in c.direction.items()])

    def _modes(self) -> dict[str, Any]:
        found = {}
        acting = [c for c in self.contacts if c.states]
        for letters in itertools.product(*(c.states for c in acting)):
            states = {c.name: letter for c, letter in zip(acting, letters, strict=True)}
            name = "".join(letters) or "free"
            found[name] = {"in": self._sides(states), "field": self._field(states)}
        return found

    def _sides(self, states: Mapping[str, str]) -> dict[str, str]:
        sides: dict[str, str] = {}
        for c in self.contacts:
            state = states.get(c.name, "")
            if c.kind is ContactKind.IMPACT:
                sides[c.name] = "+"
            elif c.kind is ContactKind.SPRING:
                sides[c.name] = "+" if state == "o" else "-"
            elif c.kind is ContactKind.JENKINS:
                limits = {"s": {"+": "-", "-": "+"}, "p": {"+": "0"}, "n": {"-": "0"}}[state]
                sides |= {f"{c.name}{sign}": side for sign, side in limits.items()}
                if state != "s":
                    sides[c.name] = "+" if state == "p" else "-"
            elif state == "s":
                closed = self.closed(c, states)
                sides |= {c.name: "0", _limit(c, closed, "+"): "-", _limit(c, closed, "-"): "+"}
            else:
                sides[c.name] = "+" if state == "p" else "-"
        return sides

    def _field(self, states: Mapping[str, str]) -> dict[str, str]:
        pulls: dict[int, list[str]] = {i: [f"f_{q}"] for i, q in enumerate(self.coordinates)}
        for c in self.contacts:
            stuck = c.kind is ContactKind.FRICTION and states[c.name] == "s"
            pull = (
                f"-({self.load(c, self.closed(c, states))})"
                if stuck
                else c.pull(states.get(c.name, ""))
            )
            for i, w in c.direction.items():
                pulls[i].append(times(repr(w), pull))
        moved = self.mass.of({i: summed(parts) for i, parts in pulls.items()})
        field = dict(zip(self.coordinates, self.velocities, strict=True))
        field |= {v: moved.get(i, "0") for i, v in enumerate(self.velocities)}
        for c in self.contacts:
            state = states.get(c.name, "")
            if c.kind is ContactKind.FRICTION and state == "s":
                self._hold(c, field)
            elif c.kind is ContactKind.JENKINS:
                field[c.name] = self._speed(c) if state == "s" else "0"
        return field

    def _hold(self, c: Contact, field: dict[str, str]) -> None:
        """Write the rate of one velocity by those of the others, so that the constraint holds exactly."""
        pivot = max(c.direction, key=lambda i: abs(c.direction[i]))
        others = [o for o in self.contacts if o is not c and pivot in o.direction]
        if any(o.kind is ContactKind.FRICTION for o in others):
            return  # two constraints share the coordinate
        by = c.direction[pivot]
        parts = [
            times(repr(-w / by), field[self.velocities[i]])
            for i, w in c.direction.items()
            if i != pivot
        ]
        field[self.velocities[pivot]] = summed([*parts, times(repr(1.0 / by), drift(c))])

    def _departures(self, c: Contact) -> list[dict[str, Any]]:
        """Return where motion on the surfaces of a contact leaves to."""
        if c.kind is ContactKind.JENKINS:  # when the velocity changes its sign the slider sticks
            return [
                {
                    "where": {f"{c.name}{sign}": "0", c.name: other},
                    "leaves": {f"{c.name}{sign}": other},
                }
                for sign, other in (("+", "-"), ("-", "+"))
            ]
        if c.kind is not ContactKind.FRICTION:
            return []
        found = []
        for closed in _subsets(self.springs[c.name]):
            gaps = {s.name: "-" if s in closed else "+" for s in self.springs[c.name]}
            for sign in "+-":  # friction that has reached its limit slides
                where = {c.name: "0", _limit(c, closed, sign): sign, **gaps}
                found.append({"where": where, "leaves": {c.name: sign}})
        return found

    def _resets(self) -> dict[str, dict[str, str]]:
        found = {}
        for c in self.contacts:
            if c.kind is ContactKind.IMPACT:
                kick = f"-(1 + ({c.texts['restitution']}))*({self._approach(c)})/({self.mobility(c, c)})"
                moved = self.mass.of({i: repr(w) for i, w in c.direction.items()})
                found[c.name] = {
                    self.velocities[i]: f"{self.velocities[i]} + {times(w, kick)}"
                    for i, w in moved.items()
                }
        return found

    def _approach(self, c: Contact) -> str:
        """Return the rate of a gap: the wall may move."""
        given = drift(c)  # minus the rate of what is given: a gap is W . q + g(t)
        return self._speed(c) if is_zero(given) else f"{self._speed(c)} - ({given})"


def _subsets(springs: tuple[Contact, ...]) -> list[tuple[Contact, ...]]:
    return [s for k in range(len(springs) + 1) for s in itertools.combinations(springs, k)]


def _limit(contact: Contact, closed: tuple[Contact, ...], sign: str) -> str:
    """Return the name of a surface: a load's limit, with the springs that are closed."""
    return "".join([contact.name, sign, *(s.name for s in closed)])


def _coordinates(top: Part) -> tuple[str, ...]:
    value = top.data[COORDINATES]
    if isinstance(value, Mapping) and len(value) == 1:  # q: 20
        (name, count), *_ = value.items()
        if isinstance(count, int) and not isinstance(count, bool) and count >= 1:
            return tuple(f"{name}{i}" for i in range(1, count + 1))
    if (
        not isinstance(value, (list, tuple))
        or not value
        or not all(isinstance(q, str) for q in value)
    ):
        top.fail(
            COORDINATES,
            f"'{COORDINATES}' is a list of names such as [q1, q2], or {{q: 20}}, got {value!r}",
        )
    return tuple(value)


def _defaults(top: Part) -> dict[str, float]:
    found = {}
    for name, value in mapping_in(top.data, "parameters").items():
        given = value.get("default") if isinstance(value, Mapping) else value
        if isinstance(given, (int, float)) and not isinstance(given, bool):
            found[name] = float(given)
    return found


def _force(
    given: str,
    i: int,
    coordinates: tuple[str, ...],
    velocities: tuple[str, ...],
    damping: Texts,
    stiffness: Texts,
) -> str:
    parts = [] if is_zero(given) else [given]
    for texts, names in ((damping, velocities), (stiffness, coordinates)):
        parts += [
            f"-{times(text, name)}"
            for text, name in zip(texts[i], names, strict=True)
            if not is_zero(text)
        ]
    return summed(parts)
