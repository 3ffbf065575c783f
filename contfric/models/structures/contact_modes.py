"""Structures with contacts written out: the states of the contacts, and their combinations as modes.

A model that has ``coordinates`` in place of states is written out here: its states are the coordinates, the
velocities v1, v2, ... and the stretches of Jenkins elements; its modes are the combinations of the states of
its contacts (:mod:`contfric.models.structures.contacts`), a letter for each, in their order.
"""

from __future__ import annotations

import ast
import itertools
import math
import random
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from contfric.errors import ModelError
from contfric.models.entries import AUTO, known_keys
from contfric.models.language.coefficient_texts import text_of
from contfric.models.language.coefficients import AFFINE, symbols
from contfric.models.language.grammar import FLOATS, TIME, Scope, number_of, parse
from contfric.models.language.not_affine import NotAffineError
from contfric.models.structures.contact_laws import laws_of
from contfric.models.structures.contact_ranges import constraints_of
from contfric.models.structures.contact_surfaces import ContactSurfaces, subsets
from contfric.models.structures.contacts import Contact, ContactKind, drift
from contfric.models.structures.matrices import summed, times
from contfric.models.structures.names import COORDINATES, STRUCTURE
from contfric.models.structures.shared_loads import Limit, Setting, load_name
from contfric.models.structures.structure import Structure, defaults_of

#: What a model of a structure has of its own; everything else is as in any model.
_OWN = (COORDINATES, "mass", "damping", "stiffness", "force", "contacts")
#: What a structure is not made from: it stands in the model itself.
_APART = ("title", "references", "symmetry", "spread", "quantities", "max_step", "integration")
#: How far the order of a harmonic may be from an odd number: rounding.
_ODD = 1e-9
#: What limits the force of a contact, and how many states tell whether it is an even function of them.
_LIMITS, _TRIES = ("kinetic", "static", "limit"), 5


def with_contacts(data: dict[str, Any]) -> dict[str, Any]:
    """Return the model of a structure with its contacts written out.

    Raises
    ------
    EntryError
        For the first mistake, with the address of its entry.
    """
    structure = Structure.read(data)
    composes = structure.composes
    if not composes:
        structure.check_count()
    found = Combinations(structure).data(only_quiet=composes)
    return (
        {**found, STRUCTURE: {k: v for k, v in data.items() if k not in _APART}}
        if composes
        else found
    )


class Combinations:
    """The parts of a model that a structure with contacts is."""

    def __init__(self, structure: Structure) -> None:
        self.structure, self._data = structure, structure.data
        self.coordinates, self.velocities = structure.coordinates, structure.velocities
        self.contacts, self.mass = structure.contacts, structure.mass
        self.surfaces = ContactSurfaces(structure)
        self.states: dict[str, Mapping[str, str]] = {}

    def data(self, only_quiet: bool = False) -> dict[str, Any]:
        """Return the model in the schema of all models.

        Parameters
        ----------
        only_quiet : only the mode in which no contact acts: others come when they are visited
        """
        kept = {key: value for key, value in self._data.items() if key not in _OWN}
        stretches = [c.name for c in self.contacts if c.kind is ContactKind.JENKINS]
        states = [*self.coordinates, *self.velocities, *stretches]
        forces = zip(self.coordinates, self.structure.forces, strict=True)
        define = {**kept["define"], **{f"f_{q}": force for q, force in forces}}
        observables, surfaces = self.surfaces.listed()
        modes = self._quiet() if only_quiet else self._modes()
        found = {
            **kept,
            "states": states,
            "define": define,
            "observables": {**kept["observables"], **observables},
            "surfaces": surfaces,
            "modes": modes,
            "forces": laws_of(self.structure, self.states),
            "departures": [] if only_quiet else departures_of(self.surfaces),
        }
        if kept["units"]:
            alike = [[*self.coordinates, *stretches], [*self.velocities]]
            found |= {"units": self._units(stretches), "alike": alike}
        if ranges := dict(constraints_of(self.contacts, defaults_of(self._data))):
            found["constraints"] = ranges | kept["constraints"]
        resets = resets_of(self.structure)
        found |= {"resets": resets} if resets else {}
        if "symmetry" not in kept and self._is_symmetric():
            images = [f"{name} -> -{name}" for name in states]
            found["symmetry"] = ", ".join(
                [*images, *(["t -> t + T/2"] if "period" in kept else [])]
            )
        return found

    def _units(self, stretches: Sequence[str]) -> dict[str, Any]:
        """Return the units that are given, and what follows for velocities and stretches."""
        given: dict[str, Any] = self._data["units"]
        if AUTO in given:
            return given
        known_keys(given, (*self.coordinates, *self.velocities, *stretches, TIME), ("units",))
        time, lengths = given.get(TIME, 1.0), [given.get(q, 1.0) for q in self.coordinates]
        found: dict[str, Any] = {v: q / time for v, q in zip(self.velocities, lengths, strict=True)}
        return {**found, **dict.fromkeys(stretches, max(lengths)), **given}

    def _is_symmetric(self) -> bool:
        """Tell whether the motion of the opposite states half a period later is one, too, at the defaults."""
        params = defaults_of(self._data)
        if any(c.kind in (ContactKind.SPRING, ContactKind.IMPACT) for c in self.contacts):
            return False
        scope = Scope(AFFINE, symbols(self._moving, tuple(params)), self._define)
        period = self._data.get("period")
        try:
            forms = [
                *(scope.evaluate(parse(f)) for f in self.structure.forces),
                *(c.form for c in self.contacts),
            ]
            turn = number_of(period, params) / math.tau if period else math.nan
            waves = [key[1] for form in forms for key in form.parts if key[0] != "y"]
            orders = [number_of(text_of(w), params) * turn if w else 0.0 for w in waves]
        except (NotAffineError, ModelError):
            return False
        odd = all(abs(math.remainder(order - 1.0, 2.0)) < _ODD for order in orders)
        return odd and self._limits_are_even(params)

    @property
    def _moving(self) -> tuple[str, ...]:
        return (*self.coordinates, *self.velocities)

    @property
    def _define(self) -> dict[str, ast.expr]:
        return {k: parse(text) for k, text in self._data["define"].items()}

    def _limits_are_even(self, params: Mapping[str, float]) -> bool:
        """Tell whether limits of friction are those of the opposite states half a period later.

        They are any functions, so they are compared at random states and times. A load that follows a
        coordinate, or the excitation, is another one there.
        """
        texts = {c.texts[key] for c in self.contacts for key in _LIMITS if key in c.texts}
        period = self._data.get("period")
        span, draw = number_of(period, params) if period else 0.0, random.Random(2)
        define = self._define
        for _ in range(_TRIES):
            t, at = span * draw.random(), {name: draw.gauss(0.0, 1.0) for name in self._moving}
            opposite = {name: -value for name, value in at.items()}
            here = Scope(FLOATS, {**params, **at, TIME: t}, define)
            there = Scope(FLOATS, {**params, **opposite, TIME: t + 0.5 * span}, define)
            for text in texts:
                value, image = here.evaluate(parse(text)), there.evaluate(parse(text))
                if not abs(image - value) <= _ODD * (abs(value) + abs(image)):
                    return False
        return True

    def _contradicts(self, states: Mapping[str, str]) -> bool:
        """Tell whether elements along one direction slide opposite ways."""
        sides: dict[str, set[str]] = {}
        for c in self.contacts:
            if c.kind is ContactKind.JENKINS and states[c.name] != "s":
                stop, ways = self.surfaces.stop_of(c)
                sides.setdefault(stop, set()).add(ways[states[c.name]])
        return any(len(found) > 1 for found in sides.values())

    def _quiet(self) -> dict[str, Any]:
        states = {c.name: c.states[0] for c in self.contacts if c.states}
        name = "".join(states.values())
        self.states[name] = states
        return {name: {"in": self.sides(states), "field": self.field(states, self._listed_load)}}

    def _listed_load(self, c: Contact, setting: Setting) -> str:
        """Return the load of a contact: the observable that it is, if its limit is a number."""
        named = self.structure.loads.couples(c) and self.surfaces.is_fixed(c)
        return load_name(c, setting) if named else self.structure.load(c, setting)

    def _modes(self) -> dict[str, Any]:
        found = {}
        acting = [c for c in self.contacts if c.states]
        for letters in itertools.product(*(c.states for c in acting)):
            states = {c.name: letter for c, letter in zip(acting, letters, strict=True)}
            if self._contradicts(states):
                continue
            name = "".join(letters) or "free"
            found[name] = {"in": self.sides(states), "field": self.field(states)}
            self.states[name] = states
        self._divide(found)
        return found

    def _divide(self, modes: dict[str, Any]) -> None:
        """Divide the mode in which no contact acts, so that an orbit that stays in it meets a section."""
        section = self.surfaces.section
        quiet = "".join(c.states[0] for c in self.contacts if c.states) or "free"
        if section:
            sides = modes[quiet]["in"]
            for name, side in (quiet, "+"), (f"{quiet}-", "-"):
                modes[name] = {**modes[quiet], "in": {**sides, section: side}}
                self.states[name] = self.states[quiet]

    def sides(self, states: Mapping[str, str]) -> dict[str, str]:
        """Return the sides of surfaces that contacts in some states lie on, and no others."""
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
                    stop, ways = self.surfaces.stop_of(c)
                    sides[stop] = ways[state]
            elif state == "s":
                upper = Limit(c, "+", self.structure.loads.setting(c, states))
                sides |= {c.name: "0", upper.name: "-", upper.other.name: "+"}
            else:
                sides[c.name] = "+" if state == "p" else "-"
        return sides

    def field(
        self, states: Mapping[str, str], load: Callable[[Contact, Setting], str] | None = None
    ) -> dict[str, str]:
        """Return the rates of all states of the model while the contacts are in some states.

        Parameters
        ----------
        load : what stands for the load of a contact, itself by default
        """
        pulls: dict[int, list[str]] = {i: [f"f_{q}"] for i, q in enumerate(self.coordinates)}
        for c in self.contacts:
            pull = c.pull(states.get(c.name, ""))
            if c.kind is ContactKind.FRICTION and states[c.name] == "s":
                pull = f"-({(load or self.structure.load)(c, self.structure.loads.setting(c, states))})"
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
                field[c.name] = self.structure.speed(c) if state == "s" else "0"
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


def departures_of(surfaces: ContactSurfaces) -> list[dict[str, Any]]:
    """Return where motion on the surfaces of all contacts leaves to."""
    return [found for c in surfaces.contacts for found in _departures(surfaces, c)]


def _departures(surfaces: ContactSurfaces, c: Contact) -> list[dict[str, Any]]:
    if c.kind is ContactKind.JENKINS:
        return _stops(surfaces, c) if surfaces.stop_of(c)[0] == c.name else []
    if c.kind is not ContactKind.FRICTION:
        return []
    found, springs = [], surfaces.structure.springs[c.name]
    for closed in subsets(springs):
        gaps = {s.name: "-" if s in closed else "+" for s in springs}
        for sign in "+-":  # friction that has reached its limit slides
            limit = Limit(c, sign, tuple((s, "c") for s in closed))
            where = {c.name: "0", limit.name: sign, **gaps}
            found.append({"where": where, "leaves": {c.name: sign}})
    return found


def _stops(surfaces: ContactSurfaces, first: Contact) -> list[dict[str, Any]]:
    """Return what sticks when a velocity changes its sign: all elements along it that slide, at once."""
    along = [
        (c, ways)
        for c in surfaces.contacts
        if c.kind is ContactKind.JENKINS
        for stop, ways in [surfaces.stop_of(c)]
        if stop == first.name
    ]
    found = []
    for sliding in reversed(subsets(along)):  # the largest set that slides is all of them
        for side in "+-" if sliding else "":
            limits = [
                (f"{c.name}{'+' if ways['p'] == side else '-'}", "+-"[ways["p"] == side])
                for c, ways in sliding
            ]
            where = {**dict.fromkeys((name for name, _ in limits), "0")}
            found.append(
                {
                    "where": where | {first.name: "-" if side == "+" else "+"},
                    "leaves": dict(limits),
                }
            )
    return found


def resets_of(structure: Structure) -> dict[str, dict[str, Any]]:
    """Return what an impact does to the velocities, of each contact that has impacts."""
    found: dict[str, dict[str, Any]] = {}
    for c in structure.contacts:
        if c.kind is ContactKind.IMPACT:
            over = structure.mobility(c, c)
            kick = f"-(1 + ({c.texts['restitution']}))*({structure.approach(c)})/({over})"
            moved = structure.mass.of({i: repr(w) for i, w in c.direction.items()})
            found[c.name] = {
                structure.velocities[i]: f"{structure.velocities[i]} + {times(w, kick)}"
                for i, w in moved.items()
            }
            if c.chatter:
                found[c.name]["chatter"] = True
    return found
