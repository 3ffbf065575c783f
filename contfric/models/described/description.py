"""A user's model as plain data: what a YAML file, a class and a results file all come down to.

:func:`contfric.models.reading.describe.describe` reads a mapping in the schema of the YAML files, checks
every entry, and gives a :class:`Description`. :meth:`Description.data` gives such a mapping back, so that a
description can be stored anywhere (:attr:`Description.text`) and read again with the same checks.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import Any, TypeAlias

from contfric.models.definition import Surface
from contfric.models.language.names import Names
from contfric.models.parts import Chatter, Departure, Lead, Observable, Parameter
from contfric.models.structures.contact_laws import KEY as LAWS
from contfric.models.structures.contact_laws import ContactLaws, written
from contfric.models.structures.names import STRUCTURE

#: Expressions of the lowest and the highest value of a state; nothing where it has no range.
Range: TypeAlias = tuple[str, str] | tuple[()]


def wraps_of(angle: str) -> dict[str, int]:
    """Return the surfaces at which an angle begins again, and the side of each on which motion lies."""
    return {f"{angle}+": -1, f"{angle}-": 1}


@dataclass(frozen=True)
class ModeText:
    """A mode: its field, one expression a state, and the sides of surfaces that it lies on."""

    name: str
    field: tuple[str, ...]
    sides: Mapping[str, int]
    rank: int | None = None
    derived: bool = False


@dataclass(frozen=True)
class DomainText:
    """A domain that was named: its mode and the sides of surfaces."""

    name: str
    mode: str
    sides: Mapping[str, int]
    label: str = ""


@dataclass(frozen=True, eq=False)
class Description:
    """A model as plain data; all formulas are texts in the language of expressions.

    Attributes
    ----------
    constraints : (text, meaning) of each
    period : expression of the excitation's period; empty for an autonomous model
    define : (name, expression) of each named part
    modes, domains, departures : as declared; what can be derived is derived from them
    resets : surface -> state -> expression
    leads : surface -> modes after the reset, the first that holds, where they are said
    acts : surface -> modes in which the reset acts, where they are said
    chatters : modes that begin with infinitely many impacts
    symmetry : name (a state or t) -> expression of its image; None without one
    stop_surface : empty if it is to be found
    kinks : observables at whose zeros the fields have kinks, and are continuous
    angles : states that are the same a turn later
    spread : expression of the half-width of starts, one a state
    ranges : expressions of the lowest and highest value of each state that has a range, () of others
    method, tolerance : how motion is integrated (:mod:`contfric.flow.integrated`)
    max_step : largest step of a continuation where the user gives none; None for the engine's
    quantities : (name, expression) of each quantity that the file declares
    laws : what the contacts of a structure carry and dissipate
    units : (state or t, its unit): all formulas are in these (:mod:`contfric.models.shorthand.units`)
    origins : (state, what it is measured from in all formulas), of a symmetry with a shift
    phase : surface of the phase that divides modes (:mod:`contfric.models.deriving.phases`); empty without
    one
    structure : what modes are made from when they are visited; empty where all are listed
    """

    name: str
    title: str
    references: tuple[str, ...]
    states: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    constraints: tuple[tuple[str, str], ...]
    period: str
    define: tuple[tuple[str, str], ...]
    observables: tuple[Observable, ...]
    surfaces: tuple[Surface, ...]
    modes: tuple[ModeText, ...]
    domains: tuple[DomainText, ...] = ()
    departures: tuple[Departure, ...] = ()
    resets: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    leads: Mapping[str, tuple[Lead, ...]] = field(default_factory=dict)
    acts: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    chatters: tuple[Chatter, ...] = ()
    symmetry: Mapping[str, str] | None = None
    stop_surface: str = ""
    kinks: tuple[str, ...] = ()
    angles: tuple[str, ...] = ()
    spread: tuple[str, ...] = ()
    ranges: tuple[Range, ...] = ()
    method: str = "explicit"
    tolerance: float = 1e-12
    max_step: float | None = None
    quantities: tuple[tuple[str, str], ...] = ()
    laws: tuple[ContactLaws, ...] = ()
    units: tuple[tuple[str, float], ...] = ()
    origins: tuple[tuple[str, str], ...] = ()
    phase: str = ""
    structure: Mapping[str, Any] = field(default_factory=dict)

    def data(self) -> dict[str, Any]:
        """Return the description in the schema of the YAML files, with nothing left out."""
        found: dict[str, Any] = {
            "name": self.name,
            "title": self.title,
            "references": list(self.references),
            "states": list(self.states),
            "parameters": {
                p.name: {"default": p.default, "meaning": p.meaning} for p in self.parameters
            },
            "constraints": dict(self.constraints),
            "define": dict(self.define),
            "observables": {o.name: o.formula for o in self.observables},
            "surfaces": {
                s.name: {"observable": s.observable, "level": s.level, "switching": s.switching}
                for s in self.surfaces
            },
            "modes": {m.name: self._mode(m) for m in self.modes},
            "domains": {
                d.name: {"mode": d.mode, "in": dict(d.sides), "label": d.label}
                for d in self.domains
            },
            "departures": [
                {"where": dict(d.where), "leaves": dict(d.leaves)} for d in self.departures
            ],
            "resets": {name: self._reset(name, texts) for name, texts in self.resets.items()},
            "spread": self._spread(),
            "integration": {"method": self.method, "tolerance": self.tolerance},
        }
        found.update({"period": self.period} if self.period else {"autonomous": True})
        if self.chatters:
            found["chatters"] = {
                c.surface: {k: v for k, v in asdict(c).items() if v and k != "surface"}
                for c in self.chatters
            }
        if self.symmetry is not None:
            found["symmetry"] = dict(self.symmetry)
        if self.max_step is not None:
            found["max_step"] = self.max_step
        if self.laws:
            found[LAWS] = written(self.laws)
        optional = {
            "kinks": list(self.kinks),
            "angles": list(self.angles),
            "stop_surface": self.stop_surface,
            "quantities": dict(self.quantities),
            "in_units": dict(self.units),
            "measured_from": dict(self.origins),
            "phase": self.phase,
            STRUCTURE: dict(self.structure),
        }
        return {**found, **{key: value for key, value in optional.items() if value}}

    def _spread(self) -> dict[str, Any]:
        widths: dict[str, Any] = dict(zip(self.states, self.spread, strict=True))
        ranges = zip(self.states, self.ranges, strict=False)
        return {**widths, **{state: list(ends) for state, ends in ranges if ends}}

    def _reset(self, name: str, texts: Mapping[str, str]) -> dict[str, Any]:
        found: dict[str, Any] = dict(texts)
        if name in self.leads:
            found["to"] = _leads_entry(self.leads[name])
        if name in self.acts:
            found["from"] = list(self.acts[name])
        return found

    def _mode(self, mode: ModeText) -> dict[str, Any]:
        found: dict[str, Any] = {
            "in": dict(mode.sides),
            "field": dict(zip(self.states, mode.field, strict=True)),
        }
        said = {"rank": mode.rank, "derived": mode.derived or None}
        return {**found, **{key: value for key, value in said.items() if value is not None}}

    @cached_property
    def text(self) -> str:
        """The description as one line of JSON, always the same for the same description."""
        return json.dumps(self.data(), ensure_ascii=False, allow_nan=False)

    @cached_property
    def motion(self) -> str:
        """The same of what motion depends on: what only names, explains or measures is left out."""
        parameters = tuple(replace(p, meaning="") for p in self.parameters)
        modes = tuple(replace(mode, derived=False) for mode in self.modes)
        kept = replace(
            self, name="model", title="", references=(), parameters=parameters, modes=modes
        )
        return replace(kept, max_step=None, quantities=(), laws=(), units=(), origins=()).text

    @cached_property
    def names(self) -> Names:
        """What each name of the expressions means."""
        return Names.of(
            self.states,
            tuple(p.name for p in self.parameters),
            dict(self.define),
            {o.name: o.formula for o in self.observables},
        )


def _leads_entry(leads: Sequence[Lead]) -> Any:
    """Return what a file says of all modes that a reset leads into: a list, where one is there twice."""
    found = {lead.mode: _lead_entry(lead) for lead in leads}
    return found if len(found) == len(leads) else [{x.mode: _lead_entry(x)} for x in leads]


def _lead_entry(lead: Lead) -> dict[str, Any]:
    """Return what a file says of a mode that a reset leads into."""
    return {**lead.where, **({"from": list(lead.after)} if lead.after else {})}
