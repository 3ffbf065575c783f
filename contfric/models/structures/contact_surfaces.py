"""Surfaces of a structure with contacts: velocities that vanish, limits of loads, closing gaps."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, TypeVar

from contfric.models.language.grammar import names_in, parse
from contfric.models.structures.contacts import Contact, ContactKind, factor_of
from contfric.models.structures.shared_loads import Limit, Setting, load_name
from contfric.models.structures.structure import Structure, defaults_of

_T = TypeVar("_T")


class ContactSurfaces:
    """The surfaces of the contacts of a structure, and the observables that they are levels of."""

    def __init__(self, structure: Structure) -> None:
        self.structure, self.contacts = structure, structure.contacts

    def listed(self) -> tuple[dict[str, str], dict[str, Any]]:
        """Return the formulas of the observables, and the surfaces that a model lists."""
        observables: dict[str, str] = {}
        surfaces: dict[str, Any] = {}

        states = (*self.structure.coordinates, *self.structure.velocities)

        def add(name: str, observable: str, text: str, level: str) -> None:
            if text in states or text == observable:
                observable = text  # a state needs no second name
            else:
                observables[observable] = text
            surfaces[name] = {"observable": observable, "level": level}

        for c in self.contacts:
            if c.kind is ContactKind.FRICTION:
                add(c.name, f"w_{c.name}", c.texts["velocity"], "0")
                self._limits(c, add)
            elif c.kind is ContactKind.JENKINS:
                level = f"({c.texts['limit']})/({c.texts['stiffness']})"
                if self.stop_of(c)[0] == c.name:
                    add(c.name, f"w_{c.name}", self.structure.speed(c), "0")
                add(f"{c.name}+", c.name, c.name, level)
                add(f"{c.name}-", c.name, c.name, f"-{level}")
            else:
                add(c.name, f"g_{c.name}", c.texts["gap"], "0")
                if self.section == f"w_{c.name}":
                    add(self.section, self.section, self.structure.approach(c), "0")
        return observables, surfaces

    def _limits(self, c: Contact, add: Any) -> None:
        fixed = self.is_fixed(c)
        for setting in self._settings(c):
            texts = self.load_texts(c, setting, fixed)
            for limit in (Limit(c, "+", setting), Limit(c, "-", setting)):
                add(limit.name, *texts[limit.sign])

    def _settings(self, c: Contact) -> list[Setting]:
        """Return the settings of a load that are listed: of contacts that share it, that where all stick."""
        if self.structure.loads.couples(c):
            quiet = {other.name: other.states[0] for other in self.contacts if other.states}
            return [self.structure.loads.setting(c, quiet)]
        springs = self.structure.springs[c.name]
        return [tuple((s, "c") for s in closed) for closed in subsets(springs)]

    def load_texts(
        self, c: Contact, setting: Setting, fixed: bool
    ) -> dict[str, tuple[str, str, str]]:
        """Return (observable, its formula, level) of both limits of a load.

        Parameters
        ----------
        fixed : whether the limit is a number, else the level is 0
        """
        static, load = c.texts.get("static", c.texts["kinetic"]), self.structure.load(c, setting)
        name = load_name(c, setting)
        if fixed:
            return {sign: (name, load, f"{sign}({static})") for sign in "+-"}
        return {
            "+": (f"{name}_high", f"{load} - ({static})", "0"),
            "-": (f"{name}_low", f"{load} + ({static})", "0"),
        }

    def is_fixed(self, c: Contact) -> bool:
        """Tell whether the static limit of a contact depends on parameters only."""
        static = c.texts.get("static", c.texts["kinetic"])
        return names_in(parse(static)) <= {*defaults_of(self.structure.data), "pi"}

    def stop_of(self, c: Contact) -> tuple[str, Mapping[str, str]]:
        """Return the surface on which the velocity of an element vanishes, and its sides where it slides.

        Jenkins elements that are stretched along one direction share that of the first.
        """
        for other in self.contacts:
            if other.kind is ContactKind.JENKINS and (factor := factor_of(other, c)):
                ways = "+-" if factor > 0.0 else "-+"
                return other.name, dict(zip("pn", ways, strict=True))
        raise AssertionError(c.name)  # its own direction is one of them

    @cached_property
    def section(self) -> str:
        """The surface of the velocity by which an orbit is found along which no contact changes; or none."""
        if "period" not in self.structure.data:  # where nothing acts nothing moves
            return ""
        elastic = [c for c in self.contacts if c.kind is ContactKind.JENKINS]
        gaps = [c for c in self.contacts if c.kind is ContactKind.SPRING]
        return elastic[0].name if elastic else f"w_{gaps[0].name}" if gaps else ""


def subsets(items: Sequence[_T]) -> list[tuple[_T, ...]]:
    """Return all subsets, the smaller ones first."""
    return [s for k in range(len(items) + 1) for s in itertools.combinations(items, k)]
