"""From a mapping in the schema of the YAML files to a description; every mistake in its place."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from contfric.errors import ModelError
from contfric.models.clocks import TICK
from contfric.models.contact_laws import KEY as LAWS
from contfric.models.contact_laws import check_laws, read_laws
from contfric.models.definition import Departure, Observable, Parameter, Surface
from contfric.models.description import STRUCTURE, Description, DomainText, ModeText
from contfric.models.entries import Part, is_number, mapping_in
from contfric.models.evaluate import check_period
from contfric.models.measuring import measured
from contfric.models.names import Names
from contfric.models.parts import Chatter
from contfric.models.quantity_entries import check_quantities, read_quantities
from contfric.models.ranges import check_ranges, ranges_of, spread_of
from contfric.models.reset_modes import FROM, TO, acts_of, leads_of
from contfric.models.shorthand import expanded
from contfric.models.units import APPLIED, KEY, read_units

KEYS = (
    *("name", "title", "references", "states", "parameters", "constraints", "period"),
    *("autonomous", "define", "observables", "surfaces", "field", "modes", "domains"),
    *("angles", "departures", "resets", "symmetry", "stop_surface", "kinks", "spread"),
    "integration",
    "max_step",
    "quantities",
    KEY,
    APPLIED,
    LAWS,
    STRUCTURE,
    "chatters",
    "phase",
)
_PARAMETER = ("default", "meaning")
_SURFACE = ("observable", "level", "switching")
_MODE = ("in", "field", "sliding", "rank")
_DOMAIN = ("mode", "in", "label")
_METHODS = ("explicit", "implicit", "automatic")
#: Tolerances between rounding and what Newton's method on a chain of segments still takes for smooth.
_TOLERANCES = (1e-14, 1e-6)
#: Shares of a range that are steps: below it a branch is millions of points long.
_STEPS = (1e-8, 1.0)


@lru_cache(maxsize=16)
def from_text(text: str) -> Description:
    """Read a description that :attr:`Description.text` wrote.

    Raises
    ------
    ModelError
        If it is no description.
    """
    try:
        data = json.loads(text)
    except ValueError as error:
        raise ModelError(f"the definition of the model is damaged: {error}") from None
    if not isinstance(data, dict):
        raise ModelError("the definition of the model is damaged: it is no mapping")
    return describe(data)


def describe(data: Mapping[str, Any]) -> Description:
    """Read and check a model in the schema of the YAML files.

    Raises
    ------
    EntryError
        For the first mistake, with the address of its entry.
    """
    return expanded({str(key): value for key, value in data.items()}, _described)


def _described(data: dict[str, Any]) -> Description:
    top = Part(data)
    top.only(KEYS)
    states = _states(top)
    parameters = _parameters(top)
    define = _expressions(top.part("define", "a mapping of names to expressions"))
    observables, surfaces = _surfaces(top, states)
    names = Names.of(
        states,
        tuple(p.name for p in parameters),
        define,
        {o.name: o.formula for o in observables},
    )
    modes = _modes(top, states, surfaces)
    method, tolerance = _integration(top)
    found = Description(
        name=top.text("name"),
        title=top.text("title", ""),
        references=top.texts("references"),
        states=states,
        parameters=parameters,
        constraints=_constraints(top),
        period=_period(top),
        define=tuple(define.items()),
        observables=observables,
        surfaces=surfaces,
        modes=modes,
        domains=_domains(top, modes, surfaces),
        departures=_departures(top, surfaces),
        **_resets(top, states, surfaces, modes),
        chatters=tuple(
            Chatter(surface, **own) for surface, own in mapping_in(data, "chatters").items()
        ),
        symmetry=_symmetry(top, states),
        stop_surface=_stop_surface(top, surfaces),
        kinks=top.texts("kinks"),
        angles=top.texts("angles"),
        spread=spread_of(top, states),
        ranges=ranges_of(top, states),
        method=method,
        tolerance=tolerance,
        max_step=_max_step(top),
        quantities=read_quantities(top),
        laws=read_laws(top),
        units=tuple(read_units(top, APPLIED, states).items()),
        phase=top.text("phase", ""),
        structure=mapping_in(data, STRUCTURE),
    )
    _check_expressions(found, names)
    return measured(found)


def _states(top: Part) -> tuple[str, ...]:
    wanted = "a list of names, such as [x, v]"
    value = top.needs("states", wanted)
    if not isinstance(value, (list, tuple)) or not value:
        top.fail("states", f"'states' must be {wanted}, got {value!r}")
    return tuple(str(name) for name in value)


def _parameters(top: Part) -> tuple[Parameter, ...]:
    wanted = "a mapping of names to numbers, or to {default: number, meaning: text}"
    part = top.part("parameters", wanted, required=True)
    found = []
    for name, value in part.data.items():
        if isinstance(value, Mapping):
            entry = part.part(name, wanted)
            entry.only(_PARAMETER)
            number = _number(entry, "default", entry.needs("default", "a number"), name)
            found.append(Parameter(name, number, entry.text("meaning", "")))
        else:
            found.append(Parameter(name, _number(part, name, value, name), ""))
    return tuple(found)


def _number(part: Part, key: str, value: object, name: str) -> float:
    if isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e300:
        return float(value)
    hint = "; a number has no quotes" if isinstance(value, str) else ""
    part.fail(key, f"the default of '{name}' must be a finite number, got {value!r}{hint}")


def _constraints(top: Part) -> tuple[tuple[str, str], ...]:
    value = top.data.get("constraints")
    if isinstance(value, Mapping):
        part = top.part("constraints", "")
        return tuple((text, " ".join(str(why or "").split())) for text, why in part.data.items())
    return tuple((text, "") for text in top.texts("constraints"))


def _period(top: Part) -> str:
    autonomous = top.flag("autonomous")
    given = top.data.get("period") is not None
    if given == bool(autonomous):
        top.fail(
            "period" if given else None,
            "a model has one of 'period: 2*pi/Omega' (that of its excitation) and "
            "'autonomous: true', got " + ("both" if given else "none"),
        )
    return top.expression("period") if given else ""


def _expressions(part: Part) -> dict[str, str]:
    return {name: part.expression(name) for name in part.data}


def _surfaces(
    top: Part, states: tuple[str, ...]
) -> tuple[tuple[Observable, ...], tuple[Surface, ...]]:
    formulas = _expressions(top.part("observables", "a mapping of names to expressions"))
    wanted = "a mapping of names to {observable: name, level: expression}"
    part = top.part("surfaces", wanted, required="period" not in top.data)
    surfaces = []
    for name in part.data:
        entry = part.part(name, "{observable: name, level: expression}")
        entry.only(_SURFACE)
        valid = (*formulas, *(s for s in states if s not in formulas))
        observable = entry.one_of("observable", valid, "observable or state")
        formulas.setdefault(observable, observable)
        level = entry.expression("level") if "level" in entry.data else "0"
        surfaces.append(Surface(name, observable, level, bool(entry.flag("switching"))))
    if not surfaces and "period" not in top.data:
        top.fail("surfaces", "a model without excitation has at least one surface: it fixes orbits")
    for name in top.texts("kinks"):
        if name not in (*formulas, *states):
            top.fail(
                "kinks", f"a kink is where an observable or a state is 0, and '{name}' is neither"
            )
        formulas.setdefault(name, name)
    return tuple(Observable(name, text) for name, text in formulas.items()), tuple(surfaces)


def _modes(
    top: Part, states: tuple[str, ...], surfaces: tuple[Surface, ...]
) -> tuple[ModeText, ...]:
    wanted = "a mapping of names to {in: sides of surfaces, field: {state: rate}}"
    part = top.part("modes", wanted, required=True)
    known = [s.name for s in surfaces]
    found = []
    for name in part.data:
        entry = part.part(name, "a mapping with 'in' and 'field'")
        entry.only(_MODE)
        sides = entry.sides("in", known)
        sliding = entry.flag("sliding")
        if sliding is not None and sliding != (0 in sides.values()):
            entry.fail("sliding", "a mode slides if and only if 'in' has a surface on its 0 side")
        own = "field" in entry.data
        field_part = (entry if own else top).part("field", "a mapping of states to rates")
        rates = _rates(field_part, states, name if own or "field" in top.data else None, entry)
        rank = entry.data.get("rank")
        if rank is not None and (type(rank) is not int or not 0 <= rank <= len(states)):
            entry.fail("rank", f"'rank' is a whole number from 0 to {len(states)}, got {rank!r}")
        found.append(ModeText(name, rates, sides, rank))
    if not found:
        example = ", ".join(f"{name}: -" for name in known)
        top.fail(
            "modes",
            f"a model has at least one mode, such as modes: {{free: {{in: {{{example}}}}}}}",
        )
    return tuple(found)


def _rates(part: Part, states: tuple[str, ...], mode: str | None, entry: Part) -> tuple[str, ...]:
    if mode is None:
        entry.fail(None, "key 'field' is missing; it must be a mapping of states to rates")
    part.only(states)
    for state in states:
        if state not in part.data:
            part.fail(None, f"the rate of '{state}' is missing: write {state}: expression")
    return tuple(part.expression(state) for state in states)


def _domains(
    top: Part, modes: tuple[ModeText, ...], surfaces: tuple[Surface, ...]
) -> tuple[DomainText, ...]:
    part = top.part("domains", "a mapping of names to {mode: name, in: sides of surfaces}")
    known, found = [s.name for s in surfaces], []
    for name in part.data:
        entry = part.part(name, "{mode: name, in: sides of surfaces}")
        entry.only(_DOMAIN)
        mode = entry.one_of("mode", [m.name for m in modes], "mode")
        label = str(entry.data.get("label") or "")
        found.append(DomainText(name, mode, entry.sides("in", known), label))
    return tuple(found)


def _departures(top: Part, surfaces: tuple[Surface, ...]) -> tuple[Departure, ...]:
    wanted = "a list of {where: sides, leaves: sides}"
    value = top.data.get("departures") or []
    if not isinstance(value, (list, tuple)):
        top.fail("departures", f"'departures' must be {wanted}, got {value!r}")
    known, found = [s.name for s in surfaces], []
    for index, item in enumerate(value):
        if not isinstance(item, Mapping):
            Part({}, ("departures", index)).fail(None, f"a departure is {wanted[10:]}")
        entry = Part({str(k): v for k, v in item.items()}, ("departures", index))
        entry.only(("where", "leaves"))
        leaves = entry.sides("leaves", known)
        if not leaves or 0 in leaves.values():
            entry.fail("leaves", "'leaves' names a surface and the side, + or -, it is left to")
        found.append(Departure(entry.sides("where", known), leaves))
    return tuple(found)


def _resets(
    top: Part,
    states: tuple[str, ...],
    surfaces: tuple[Surface, ...],
    modes: tuple[ModeText, ...],
) -> dict[str, Any]:
    """Return the maps of the states, the modes after them that are named, and those that they act in."""
    part = top.part("resets", "a mapping of surfaces to {state: new value, to: mode, from: modes}")
    part.only([s.name for s in surfaces])
    maps, leads, acts = {}, {}, {}
    for name in part.data:
        entry = part.part(name, "{state: new value, to: mode, from: modes}")
        entry.only((*states, TO, FROM))
        known = [m.name for m in modes]
        if FROM in entry.data:
            acts[name] = acts_of(entry, known)
        if TO in entry.data:
            leads[name] = leads_of(entry, known, [s.name for s in surfaces])
        maps[name] = _expressions(
            Part({k: v for k, v in entry.data.items() if k not in (TO, FROM)}, entry.address)
        )
    return {"resets": maps, "leads": leads, "acts": acts}


def _symmetry(top: Part, states: tuple[str, ...]) -> dict[str, str] | None:
    value = top.data.get("symmetry")
    if value is None:
        return None
    if isinstance(value, str):
        pairs = [piece.partition("->") for piece in value.split(",")]
        if not all(arrow for _, arrow, _ in pairs):
            top.fail("symmetry", "a symmetry is such as 'x -> -x, v -> -v, t -> t + T/2'")
        value = {name.strip(): image.strip() for name, _, image in pairs}
    part = Part({"symmetry": value}, top.address).part("symmetry", "a mapping of states to images")
    part.only((*states, "t"))
    images = _expressions(part)
    return {name: images.get(name, name) for name in (*states, "t")}


def _stop_surface(top: Part, surfaces: tuple[Surface, ...]) -> str:
    if top.data.get("stop_surface") is None:
        return ""
    valid = [*(s.name for s in surfaces), *top.texts("kinks")]
    return top.one_of("stop_surface", valid, "surface or kink" if top.texts("kinks") else "surface")


def _integration(top: Part) -> tuple[str, float]:
    part = top.part("integration", "{method: explicit, tolerance: 1.0e-12}")
    part.only(("method", "tolerance"))
    method = part.one_of("method", _METHODS, "method of integration", "explicit")
    tolerance = part.data.get("tolerance", 1e-12)
    low, high = _TOLERANCES
    if not is_number(tolerance) or not low <= tolerance <= high:
        part.fail(
            "tolerance",
            f"'tolerance' is a number from {low:g} to {high:g}, got {tolerance!r}",
        )
    return method, float(tolerance)


def _max_step(top: Part) -> float | None:
    step, (low, high) = top.data.get("max_step"), _STEPS
    if step is None:
        return None
    if not is_number(step) or not low <= step <= high:
        top.fail(
            "max_step",
            f"'max_step' is the largest step of a continuation as a share of the range, from {low:g} to "
            f"{high:g}, got {step!r}",
        )
    return float(step)


def _check_expressions(found: Description, names: Names) -> None:
    """Read every expression and look every name up, in its place."""
    ticks = (surface.level for surface in found.surfaces if surface.name == TICK)
    names.check_names(found.period or next(ticks, ""))
    timed = not found.period
    for name, text in found.define:
        names.check(("define", name), text, timed)
    for o in found.observables:
        names.check(("observables", o.name), o.formula, timed)
    for s in found.surfaces:
        names.check(("surfaces", s.name, "level"), s.level, only_parameters=True)
    for m in found.modes:
        for state, rate in zip(found.states, m.field, strict=True):
            names.check(("modes", m.name, "field", state), rate, timed)
    for surface, texts in found.resets.items():
        for state, value in texts.items():
            names.check(("resets", surface, state), value, timed)
    for state, width in zip(found.states, found.spread, strict=True):
        names.check(("spread", state), width, only_parameters=True)
    check_ranges(found, names)
    if found.period:
        names.check(("period",), found.period, only_parameters=True)
        check_period(found)
    check_laws(found.laws, names, timed)
    check_quantities(found.quantities, names, timed, [law.name for law in found.laws])
