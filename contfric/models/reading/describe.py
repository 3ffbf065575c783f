"""From a mapping in the schema of the YAML files to a description; every mistake in its place."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from contfric.models.definition import Surface
from contfric.models.deriving.measuring import measured
from contfric.models.described.description import Description, DomainText, ModeText
from contfric.models.described.evaluate import check_period
from contfric.models.described.quantity_entries import check_quantities
from contfric.models.described.ranges import check_ranges, ranges_of, spread_of
from contfric.models.described.reset_modes import FROM, TO, acts_of, leads_of
from contfric.models.entries import EntryError, known_keys, known_sides, one_of
from contfric.models.language.names import Names
from contfric.models.parts import Chatter, Departure, Observable, Parameter
from contfric.models.shorthand.clocks import TICK
from contfric.models.shorthand.structure_units import structure_in_units
from contfric.models.shorthand.written_out import expanded
from contfric.models.structures.contact_laws import ContactLaws, check_laws
from contfric.models.structures.contact_modes import with_contacts
from contfric.models.structures.names import COORDINATES


def describe(data: Mapping[str, Any]) -> Description:
    """Read and check a model in the schema of the YAML files (:mod:`contfric.models.reading.schema`).

    Raises
    ------
    EntryError
        For the first mistake, with the address of its entry.
    """
    # pydantic is loaded where a model is read, and not where one that was read before is used
    from contfric.models.reading.schema import checked

    given = checked(data)
    if COORDINATES in given:
        given = checked(with_contacts(structure_in_units(given, read_plain)))
    return expanded(given, read_plain)


def read_plain(plain: Mapping[str, Any]) -> Description:
    """Return the description of data in which nothing is said in short, checked against the schema."""
    from contfric.models.reading.schema import checked

    return _described(checked(plain))


def _described(data: dict[str, Any]) -> Description:
    """Return the description of data in which nothing is said in short."""
    states = tuple(data["states"])
    parameters = tuple(
        Parameter(name, entry["default"], entry["meaning"])
        for name, entry in data["parameters"].items()
    )
    period = _period(data)
    observables, surfaces = _surfaces(data, states)
    names = Names.of(
        states,
        tuple(p.name for p in parameters),
        data["define"],
        {o.name: o.formula for o in observables},
    )
    known = [s.name for s in surfaces]
    modes = _modes(data, states, known)
    known_keys(data["in_units"], (*states, "t"), ("in_units",))
    found = Description(
        name=data["name"],
        title=data["title"],
        references=tuple(data["references"]),
        states=states,
        parameters=parameters,
        constraints=tuple(data["constraints"].items()),
        period=period,
        define=tuple(data["define"].items()),
        observables=observables,
        surfaces=surfaces,
        modes=modes,
        domains=_domains(data, modes, known),
        departures=_departures(data, known),
        **_resets(data, states, known, modes),
        chatters=tuple(Chatter(surface, **own) for surface, own in data["chatters"].items()),
        symmetry=_symmetry(data, states),
        stop_surface=_stop_surface(data, known),
        kinks=tuple(data["kinks"]),
        angles=tuple(data["angles"]),
        spread=spread_of(data["spread"], states),
        ranges=ranges_of(data["spread"], states),
        **data["integration"],
        max_step=data.get("max_step"),
        quantities=tuple(data["quantities"].items()),
        laws=tuple(ContactLaws(name, **own) for name, own in data["forces"].items()),
        units=tuple(data["in_units"].items()),
        origins=tuple(data["measured_from"].items()),
        phase=data["phase"],
        structure=data.get("structure", {}),
    )
    _check_expressions(found, names)
    return measured(found)


def _period(data: Mapping[str, Any]) -> str:
    period: str = data.get("period", "")
    if bool(period) == bool(data.get("autonomous")):
        raise EntryError(
            ("period",) if period else (),
            "a model has one of 'period: 2*pi/Omega' (that of its excitation) and "
            "'autonomous: true', got " + ("both" if period else "none"),
        )
    return period


def _surfaces(
    data: Mapping[str, Any], states: tuple[str, ...]
) -> tuple[tuple[Observable, ...], tuple[Surface, ...]]:
    formulas, surfaces = dict(data["observables"]), []
    for name, entry in data["surfaces"].items():
        valid = (*formulas, *(s for s in states if s not in formulas))
        address = ("surfaces", name, "observable")
        observable = one_of(entry["observable"], valid, "observable or state", address)
        formulas.setdefault(observable, observable)
        switching = bool(entry.get("switching"))
        surfaces.append(Surface(name, observable, entry["level"], switching))
    if not surfaces and "period" not in data:
        raise EntryError(
            ("surfaces",),
            "a model without excitation has at least one surface: it fixes orbits",
        )
    for name in data["kinks"]:
        if name not in (*formulas, *states):
            raise EntryError(
                ("kinks",),
                f"a kink is where an observable or a state is 0, and '{name}' is neither",
            )
        formulas.setdefault(name, name)
    return tuple(Observable(name, text) for name, text in formulas.items()), tuple(surfaces)


def _modes(
    data: Mapping[str, Any], states: tuple[str, ...], known: list[str]
) -> tuple[ModeText, ...]:
    found = []
    for name, entry in data["modes"].items():
        address = ("modes", name)
        sides = known_sides(entry["in"], known, (*address, "in"))
        sliding, rank = entry.get("sliding"), entry.get("rank")
        if sliding is not None and sliding != (0 in sides.values()):
            raise EntryError(
                (*address, "sliding"),
                "a mode slides if and only if 'in' has a surface on its 0 side",
            )
        field = entry.get("field", data.get("field"))
        if field is None:
            raise EntryError(
                address, "key 'field' is missing; it must be a mapping of states to rates"
            )
        place = (*address, "field") if "field" in entry else ("field",)
        known_keys(field, states, place)
        for state in states:
            if state not in field:
                raise EntryError(
                    place, f"the rate of '{state}' is missing: write {state}: expression"
                )
        if rank is not None and rank > len(states):
            raise EntryError(
                (*address, "rank"),
                f"'rank' is a whole number from 0 to {len(states)}, got {rank}",
            )
        rates = tuple(field[state] for state in states)
        found.append(ModeText(name, rates, sides, rank, bool(entry.get("derived"))))
    if not found:
        raise EntryError(("modes",), _no_modes(data, known))
    return tuple(found)


def _no_modes(data: Mapping[str, Any], known: list[str]) -> str:
    """Return what to write where a model has no modes: with a reset those in which it acts."""
    met = next((name for name in known if name in data["resets"]), "")
    if not met or "field" not in data:
        example = ", ".join(f"{name}: -" for name in known)
        return f"a model has at least one mode, such as modes: {{free: {{in: {{{example}}}}}}}"
    return (
        f"a reset acts in modes. Where '{met}' is met from one side (a wall, a threshold) write "
        f"modes: {{free: {{in: {{{met}: -}}}}}}, or +; where from both, modes: {{free: {{}}}} and "
        f"'from: [free]' in the reset at '{met}'"
    )


def _domains(
    data: Mapping[str, Any], modes: tuple[ModeText, ...], known: list[str]
) -> tuple[DomainText, ...]:
    names = [m.name for m in modes]
    return tuple(
        DomainText(
            name,
            one_of(entry["mode"], names, "mode", ("domains", name, "mode")),
            known_sides(entry["in"], known, ("domains", name, "in")),
            entry["label"],
        )
        for name, entry in data["domains"].items()
    )


def _departures(data: Mapping[str, Any], known: list[str]) -> tuple[Departure, ...]:
    found = []
    for index, entry in enumerate(data["departures"]):
        where, leaves = (
            known_sides(entry[key], known, ("departures", index, key))
            for key in ("where", "leaves")
        )
        if not leaves or 0 in leaves.values():
            raise EntryError(
                ("departures", index, "leaves"),
                "'leaves' names a surface and the side, + or -, it is left to",
            )
        found.append(Departure(where, leaves))
    return tuple(found)


def _resets(
    data: Mapping[str, Any],
    states: tuple[str, ...],
    surfaces: list[str],
    modes: tuple[ModeText, ...],
) -> dict[str, Any]:
    """Return the maps of the states, the modes after them that are named, and those that they act in."""
    known_keys(data["resets"], surfaces, ("resets",))
    known = [m.name for m in modes]
    maps, leads, acts = {}, {}, {}
    for name, entry in data["resets"].items():
        address = ("resets", name)
        known_keys(entry, (*states, TO, FROM), address)
        if FROM in entry:
            acts[name] = acts_of(entry, known, address)
        if TO in entry:
            leads[name] = leads_of(entry, known, surfaces, address)
        maps[name] = {state: text for state, text in entry.items() if state not in (TO, FROM)}
    return {"resets": maps, "leads": leads, "acts": acts}


def _symmetry(data: Mapping[str, Any], states: tuple[str, ...]) -> dict[str, str] | None:
    images = data.get("symmetry")
    if images is None:
        return None
    known_keys(images, (*states, "t"), ("symmetry",))
    return {name: images.get(name, name) for name in (*states, "t")}


def _stop_surface(data: Mapping[str, Any], known: list[str]) -> str:
    kinks, name = data["kinks"], data.get("stop_surface", "")
    what = "surface or kink" if kinks else "surface"
    return name and one_of(name, [*known, *kinks], what, ("stop_surface",))


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
