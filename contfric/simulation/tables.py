"""A model's transitions as the compiled simulation takes them: bounds of modes, and which mode follows.

What follows where a motion meets a surface depends on the sides of the other surfaces. It is a list of rules
for each (mode, surface), ``sides & mask == value -> mode``, as short as merging makes it: a table of all
combinations of sides doubles with each surface.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import cache
from itertools import product
from typing import NamedTuple

import numpy as np

from contfric.base.arrays import IntArray
from contfric.errors import ModelError, ParameterError
from contfric.models.definition import Domain, Model, Surface
from contfric.models.deriving.growing_model import ComposedModel
from contfric.models.mode_domains import cut_bounds
from contfric.models.parts import MOST_SURFACES, Mode

#: What a surface is in ``Tables.bounds`` to a mode in which it has a reset.
MAPPED = 2
#: In a rule, the number that stands for a mode which is solved for, from the state at the joint; numbers
#: below are those of modes that were not visited yet (:mod:`contfric.simulation.growing_tables`).
SOLVED = -2
#: A rule for the sides of surfaces as bits: (mask, value, mode that follows).
Rule = tuple[int, int, int]


class Tables(NamedTuple):
    """The model's transitions in the form that the compiled simulation takes.

    Attributes
    ----------
    observables : observable of each surface
    bounds : whether a surface bounds a mode, shape (modes, surfaces); 2 if it has a reset in that mode
    inside : the side of a surface that a mode which it bounds lies on; 0 if it lies on it, or on both
    first : first rule of each (mode, surface), and the number of rules, shape (modes * surfaces + 1,)
    rules : rows (mask, value, mode that follows): the first that the sides of all surfaces fit, as bits
    sliding : whether a mode slides on a surface; 2 if it may do so for more than a period
    lies_on : surfaces that a mode moves on, as bits
    kept : surfaces that the state stays on where a surface is met in a mode, as bits: a reset takes it off
        others; shape (modes, surfaces)
    chatters : mode that infinitely many impacts lead to, by (mode after an impact, surface); -1 if none,
        shape (modes, surfaces)
    flights : mode that a mode of chatter is left for, -1 of others; behind these, where impacts pass their
        surface, that which it is left for below it
    landed : surfaces that the state is on where motion goes on, as bits: the one met, but for a reset;
        shape (modes, surfaces)
    walls : surfaces at which a reset sends motion back, as bits
    """

    observables: IntArray
    bounds: IntArray
    inside: IntArray
    first: IntArray
    rules: IntArray
    sliding: IntArray
    lies_on: IntArray
    kept: IntArray
    landed: IntArray
    walls: int
    chatters: IntArray
    flights: IntArray


def declared_surfaces(model: Model) -> Sequence[Surface]:
    """Return the surfaces that are there before a solution visits any mode."""
    if not isinstance(model, ComposedModel):
        return model.surfaces
    return model.surfaces[: len(model.composition.declared)]


def check_surfaces(model: Model) -> None:
    """Refuse a model that a simulation cannot take.

    Raises
    ------
    ModelError
        If it has more surfaces than can be told apart.
    """
    if len(declared_surfaces(model)) > MOST_SURFACES:
        raise ModelError(
            f"model '{model.name}' has {len(model.surfaces)} surfaces, a simulation takes {MOST_SURFACES}: "
            "leave out those at which nothing changes"
        )


@cache
def tables(model: Model) -> Tables:
    """Return the transition tables of a model, in modes as they were declared: sections are events, too.

    Those of a model whose modes are made when they are visited grow
    (:mod:`contfric.simulation.growing_tables`).

    Raises
    ------
    ModelError
        If it has more surfaces than can be told apart.
    """
    if model.composed:
        raise ParameterError(
            f"this is not offered for '{model.name}', whose modes are made when solutions visit them (it has "
            "many contacts, or friction contacts that share their load): sweeps, return maps, basins and "
            "Lyapunov exponents need all of them before. Simulations, orbits, branches and diagrams are "
            "offered; in place of a sweep, call find_orbit at each value with the state before it (state=)"
        )
    check_surfaces(model)
    bounds = np.zeros((len(model.modes), len(model.surfaces)), dtype=np.int64)
    inside = np.zeros_like(bounds)
    for k, mode in enumerate(model.modes):
        for name in cut_bounds(model)[mode.name]:
            bounds[k, model.surface_index[name]] = (
                1 if model.reset_at(mode.name, name) is None else MAPPED
            )
            inside[k, model.surface_index[name]] = side_of(model, mode.name, name)
    first, rules = _rules(model)
    return Tables(
        np.array([model.observable_index[s.observable] for s in model.surfaces], dtype=np.int64),
        bounds,
        inside,
        first,
        rules,
        np.array(
            [int(m.sliding) * (1 + int(moves_on(model, m))) for m in model.modes], dtype=np.int64
        ),
        np.array([surfaces_under(model, m.name) for m in model.modes], dtype=np.int64),
        _by_mode(model, _surfaces_kept),
        _by_mode(model, lambda *met: bits_of(model, _landed(*met))),
        bits_of(model, (r.surface for r in model.resets if r.lands.get(r.surface) == 1)),
        chatter_table(model, len(model.modes)),
        flight_table(model, len(model.modes)),
    )


def chatter_table(model: Model, modes: int) -> IntArray:
    """Return the mode of chatter that impacts in a mode at a surface may lead to, or -1."""
    found = np.full((modes, len(model.surfaces)), -1, dtype=np.int64)
    for own in model.chatters:
        for k, mode in enumerate(model.modes[:modes]):
            if any(model.whole_mode(mode.name) == flight for _, flight in own.ways):
                found[k, model.surface_index[own.surface]] = model.mode_index[own.mode]
    return found


def flight_table(model: Model, modes: int) -> IntArray:
    """Return the mode that each mode of chatter is left for, -1 of others; then those below a surface."""
    found = np.full((2, modes), -1, dtype=np.int64)
    for own in model.chatters:
        for row, (_, flight) in zip(found, own.ways, strict=False):
            row[model.mode_index[own.mode]] = model.mode_index[flight]
    return found.ravel()


def _rules(model: Model) -> tuple[IntArray, IntArray]:
    """Return the rules of all (mode, surface), one after the other, and where each begins."""
    found: dict[tuple[int, int], tuple[dict[tuple[int, int], int], ...]] = {}

    def add(
        source: str, surface: str, signs: Mapping[str, int], skipped: Collection[str], to: str
    ) -> None:
        pair = model.mode_index[model.domain_by_name[source].own_mode], model.surface_index[surface]
        # a side 0 is not asked for: a mode on a surface that the state need not be on is the last resort
        by_chance = any(sign == 0 and s not in skipped for s, sign in signs.items())
        where = found.setdefault(pair, ({}, {}))[by_chance]
        where[sides_of(model, signs, skipped)] = model.mode_index[model.domain_by_name[to].own_mode]

    for (name, surface), target in model.transitions.items():
        add(name, surface, model.domain_by_name[name].signs, {surface}, target)
    for (name, surface), targets in model.targets.items():
        source = model.domain_by_name[name].own_mode
        reset = model.reset_at(source, surface)
        if reset is not None:
            for after in targets:  # after a reset the signs of the mapped state tell the domain
                if model.domain_by_name[after].own_mode in model.chatter_by_mode:
                    continue  # found by following the impacts
                signs = model.domain_by_name[after].signs
                slid = model.slid_before(model.domain_by_name[name], surface)
                add(name, surface, signs, {*_landed(model, source, surface), *slid}, after)
    for own in model.chatters:
        for domain, (lift, _) in product(model.domains_of(own.mode), own.ways):
            found.pop((model.mode_index[own.mode], model.surface_index[lift]), None)
            for after in model.targets[domain.name, lift]:
                signs = model.domain_by_name[after].signs
                add(domain.name, lift, signs, {own.surface}, after)
    first, rules = [0], []
    for mode in range(len(model.modes)):
        for k in range(len(model.surfaces)):
            rules += [rule for cases in found.get((mode, k), ()) for rule in _merged(cases)]
            first.append(len(rules))
    return np.array(first, dtype=np.int64), np.array(rules, dtype=np.int64).reshape(-1, 3)


def _merged(cases: Mapping[tuple[int, int], int]) -> list[Rule]:
    """Return rules for the same cases: two that differ in one side, and lead to one mode, are one.

    The cases are distinct, so that their order does not matter.
    """
    rules = dict(cases)
    bits = 0
    for mask, _ in rules:
        bits |= mask
    for k in range(bits.bit_length()):
        bit = 1 << k
        for (mask, value), to in list(rules.items()):
            other = mask, value ^ bit
            if mask & bit and not value & bit and rules.get(other) == to:
                rules.pop((mask, value)), rules.pop(other)
                rules[mask & ~bit, value] = to
    return [(mask, value, to) for (mask, value), to in rules.items()]


def sides_of(model: Model, signs: Mapping[str, int], skipped: Collection[str]) -> tuple[int, int]:
    """Return the sides of a domain as (mask, value); those that a solution lies on are not asked for."""
    asked = [
        s
        for s, sign in signs.items()
        if sign != 0 and s not in skipped and s not in model.fixed_sides
    ]
    return bits_of(model, asked), bits_of(model, (s for s in asked if signs[s] > 0))


def surfaces_under(model: Model, mode: str) -> int:
    """Return the surfaces that a mode moves on, as bits."""
    if model.composed:
        sides = model.domain_by_name[mode].signs
        return bits_of(model, (s for s, side in sides.items() if side == 0))
    return bits_of(model, _lies_on(model).get(mode, ()))


def side_of(model: Model, mode: str, surface: str) -> int:
    """Return the side of a surface that a mode lies on; 0 if it lies on it, or on both sides."""
    own = (model.domain_by_name[mode],) if model.composed else _own_domains(model)[mode]
    signs = {domain.signs.get(surface, 0) for domain in own}
    return signs.pop() if len(signs) == 1 else 0


@cache
def _own_domains(model: Model) -> dict[str, list[Domain]]:
    found: dict[str, list[Domain]] = {mode.name: [] for mode in model.modes}
    for domain in model.domains:
        found[domain.own_mode].append(domain)
    return found


@cache
def _lies_on(model: Model) -> dict[str, set[str]]:
    """Return the surfaces that each mode moves on."""
    found: dict[str, set[str]] = {}
    for domain in model.domains:
        found.setdefault(domain.own_mode, set()).update(
            s for s, v in domain.signs.items() if v == 0
        )
    return found


def _by_mode(model: Model, bits: Callable[[Model, str, str], int]) -> IntArray:
    """Return surfaces, as bits, for each mode and surface that is met in it."""
    rows = [[bits(model, mode.name, s.name) for s in model.surfaces] for mode in model.modes]
    return np.array(rows, dtype=np.int64)


def _surfaces_kept(model: Model, mode: str, met: str) -> int:
    """Return the surfaces that the state stays on where one is met in a mode, as bits."""
    reset = model.reset_at(mode, met)
    kept = [s.name for s in model.surfaces if reset is None or not model.changed_by(reset, s.name)]
    return bits_of(model, kept)


def _landed(model: Model, mode: str, met: str) -> Collection[str]:
    """Return the surfaces that the state is on after one that is met in a mode."""
    reset = model.reset_at(mode, met)
    return {met} if reset is None else reset.lands


def bits_of(model: Model, surfaces: Iterable[str]) -> int:
    """Return surfaces as bits of a number."""
    places = (model.surface_index[name] for name in surfaces)
    return sum(1 << k for k in places if k < MOST_SURFACES)


def moves_on(model: Model, mode: Mode) -> bool:
    """Tell whether a load may grow for more than a period: without excitation, or as other masses move.

    Where as many states are free as are held, these are the places of what rests. Impacts before rest may
    take any time.
    """
    free = model.autonomous or 2 * mode.rank > len(model.states)
    return free or mode.name in model.chatter_by_mode
