"""From a description to a model: what can be derived is not asked for."""

from __future__ import annotations

import ast
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.yaml_lines import Address
from contfric.errors import ModelError
from contfric.models.definition import Domain, Model, Surface
from contfric.models.deriving.departing import (
    departing_side,
    leaves_at_rest,
    limit_departures,
    other_departures,
    turned_modes,
)
from contfric.models.deriving.landing import reset_of
from contfric.models.deriving.measuring import displacement_of, extrema_at_joints
from contfric.models.deriving.sections import clear_surfaces, join_domains, joined_modes
from contfric.models.described.description import Description, Range
from contfric.models.described.evaluate import Evaluator, Sampler, defaults, floats
from contfric.models.described.reading_back import from_text
from contfric.models.described.regions import domains_of, is_possible, ordered_surfaces
from contfric.models.entries import EntryError
from contfric.models.generated.build import GeneratedFlow
from contfric.models.language.grammar import FLOATS, PERIOD, TIME, Scope, parse
from contfric.models.language.linear import linear_form
from contfric.models.parts import Constraint, Departure, Mode, Symmetry

#: Rounding in an identity of expressions of moderate size, relative to 1 + the values.
_SAME = 1e-9
#: States on a surface at which its rates are asked for.
_PLACES = 24
#: Points at which two expressions must agree to be the same.
_POINTS = 8


@dataclass(frozen=True)
class Spread:
    """Half-widths of starts, and ranges of states, from the expressions of a description."""

    texts: tuple[str, ...]
    definition: str
    ends: tuple[Range, ...] = ()

    def __call__(self, params: Mapping[str, float]) -> FloatArray:
        """Return the half-width of each state, shape (n,)."""
        evaluator = _evaluator(self.definition)
        return np.array([evaluator.value(text, params) for text in self.texts])

    def ranges(self, params: Mapping[str, float]) -> FloatArray:
        """Return the lowest and highest value of each state, shape (n, 2); no number without a range."""
        evaluator, nothing = _evaluator(self.definition), [math.nan, math.nan]
        rows = [[evaluator.value(text, params) for text in ends] or nothing for ends in self.ends]
        return np.array(rows)


@lru_cache(maxsize=64)
def _evaluator(definition: str) -> Evaluator[float]:
    return floats(from_text(definition))


def model_from(description: Description) -> Model:
    """Build the model of a description.

    Raises
    ------
    EntryError
        If the description contradicts itself; with the address of the entry.
    """
    if description.structure:
        from contfric.models.deriving.growing_model import composed_from

        return composed_from(description)
    params = defaults(description)
    evaluator = floats(description)
    sampler = Sampler(evaluator, params)
    levels = {s.name: level_of(evaluator, s, params) for s in description.surfaces}
    surfaces = ordered_surfaces(description, levels)
    declared = domains_of(description, surfaces)
    departures = description.departures or _departures(sampler, surfaces, declared)
    resting = {own.mode for own in description.chatters}
    flights = tuple(d for d in declared if d.mode not in resting)
    ends = {lift for own in description.chatters for lift, _ in own.ways}
    asked = [s for s in surfaces if s.name not in ends]
    domains = join_domains(declared, joined_modes(description))
    surfaces = clear_surfaces(surfaces, domains)
    always, at_times = turned_modes(sampler, surfaces, declared)
    model = Model(
        **as_described(description, sampler, surfaces),
        modes=tuple(_mode(description, m.name) for m in description.modes),
        domains=domains,
        departures=departures,
        resets=tuple(reset_of(sampler, name, asked, flights) for name in description.resets),
        chatters=description.chatters,
        kinks=description.kinks,
        filippov=leaves_at_rest(sampler, description, flights),
        turned=always,
        turned_at_times=at_times,
        phase=description.phase,
    )
    for domain, surface, modes in model.undecided():
        if not _meets(sampler, domain, surface):
            continue
        raise _undecided(model, domain, surface, modes)
    return model


def _undecided(model: Model, domain: Domain, surface: str, modes: Sequence[str]) -> EntryError:
    """Return how to say in which of several modes motion goes on."""
    where = (
        f"a solution that meets '{surface}' in '{domain.name}' could go on in {' or '.join(modes)}"
    )
    if model.maps_at(domain, surface):
        each = ", ".join(
            f"{mode}: {{...: {side}}}" for mode, side in zip(modes, "+-", strict=False)
        )
        advice = (
            f"tell by the sides of other surfaces which one: 'to: {{{each}}}' in the reset there"
        )
        return EntryError(("resets", surface), f"{where}: {advice}")
    advice = f"them a side of a surface that divides them, or write a reset at '{surface}' with"
    return EntryError(("modes", modes[-1], "in"), f"{where}: give {advice} 'to: {modes[0]}'")


def as_described(
    description: Description, sampler: Sampler, surfaces: list[Surface]
) -> dict[str, Any]:
    """Return the parts of a model, by their names, that no mode of it is needed for."""
    return {
        "name": description.name,
        "title": description.title or description.name,
        "states": description.states,
        "parameters": description.parameters,
        "constraints": tuple(
            constraint_of(("constraints", i), text, why, sampler.params)
            for i, (text, why) in enumerate(description.constraints)
        ),
        "observables": description.observables,
        "surfaces": tuple(surfaces),
        "symmetry": symmetry_of(sampler, surfaces),
        "stop_surface": description.stop_surface or stop_surface_of(sampler),
        "displacement": ""
        if extrema_at_joints(sampler, surfaces)
        else displacement_of(description),
        "flow_factory": GeneratedFlow(description.motion),
        "spread": (spread := Spread(description.spread, description.text, description.ranges)),
        "ranges": spread.ranges if description.ranges else None,
        "references": description.references,
        "autonomous": not description.period,
        "max_step": description.max_step,
        "quantities": description.quantities,
        "units": description.units,
        "origins": description.origins,
        "definition": description.text,
    }


def _meets(sampler: Sampler, domain: Domain, surface: str) -> bool:
    """Tell whether some motion in a domain comes to a surface; so it is, too, where no state was sampled."""
    mode, side = domain.own_mode, domain.signs[surface]
    others = {name: sign for name, sign in domain.signs.items() if name != surface}
    places = list(sampler.on(surface, others, _PLACES))
    rates = [side * sampler.rate(mode, surface, side, t, y) for t, y in places]
    return not rates or min(rates) < 0.0


def level_of(evaluator: Evaluator[float], surface: Surface, params: dict[str, float]) -> float:
    """Return the level of a surface at the defaults."""
    address = ("surfaces", surface.name, "level")
    level = evaluator.value(surface.level, params)
    if not math.isfinite(level):
        raise EntryError(address, f"the level '{surface.level}' has no value at the defaults")
    return level


def _mode(description: Description, name: str) -> Mode:
    """Return a mode; one that slides forgets a direction for each surface that it lies on."""
    text = next(m for m in description.modes if m.name == name)
    held = sum(side == 0 for side in text.sides.values())
    rank = len(description.states) - held if text.rank is None else text.rank
    return Mode(name, rank, held > 0, text.derived)


# ------------------------------------------------------------------------------ constraints


def constraint_of(address: Address, text: str, why: str, params: Mapping[str, float]) -> Constraint:
    """Read ``S0 >= S``: the difference of both sides, linear in the parameters."""
    tree = _comparison(address, text)
    above = isinstance(tree.ops[0], (ast.Gt, ast.GtE))
    sides = (tree.left, tree.comparators[0]) if above else (tree.comparators[0], tree.left)
    try:
        found = linear_form(ast.BinOp(sides[0], ast.Sub(), sides[1]), sorted(params))
    except ModelError as error:
        raise EntryError(address, f"'{text}': {error}") from None
    if found is None:
        raise EntryError(
            address, f"'{text}' must be linear in the parameters, such as S0 >= S or Omega > 0"
        )
    constant, slopes = found
    coefficients = {name: slope for name, slope in slopes.items() if slope != 0.0}
    strict = isinstance(tree.ops[0], (ast.Gt, ast.Lt))
    return Constraint(text, coefficients, strict, why, constant)


def _comparison(address: Address, text: str) -> ast.Compare:
    wanted = f"a constraint is such as 'S0 >= S' or 'Omega > 0', got '{text}'"
    try:
        parse(f"where({text}, 1, 0)")
        tree = ast.parse(text.strip(), mode="eval").body
    except (ModelError, SyntaxError) as error:
        raise EntryError(address, f"{wanted}: {error}") from None
    if not isinstance(tree, ast.Compare) or len(tree.ops) != 1:
        raise EntryError(address, wanted)
    return tree


# ------------------------------------------------------------------------------- departures


def _departures(
    sampler: Sampler, surfaces: list[Surface], domains: tuple[Domain, ...]
) -> tuple[Departure, ...]:
    """Find where motion on a surface goes when it leaves: the side that its field points to."""
    found: dict[tuple[str, str, int], Departure] = {}
    order = [s.name for s in surfaces]
    nearby: dict[tuple[int, ...], str] = {}  # the last mode of each combination of sides
    for domain in domains:
        nearby[tuple(domain.signs[name] for name in order)] = domain.mode
    for domain in domains:
        on = [name for name, side in domain.signs.items() if side == 0]
        if len(on) != 1:
            continue
        for surface in order:
            key = on[0], surface, -domain.signs[surface]
            signs = {**domain.signs, surface: key[2]}
            if key in found or surface == on[0] or not is_possible(surfaces, signs):
                continue  # the first one that holds decides where motion goes
            if tuple(signs[name] for name in order) in nearby:
                continue
            departure = _departure(sampler, on[0], surface, signs, nearby)
            if departure is not None:
                found[key] = departure
    others = tuple(found.values())
    others = (*other_departures(sampler, domains, nearby, others), *others)
    return (*limit_departures(sampler, surfaces, domains, others), *others)


def _departure(
    sampler: Sampler,
    on: str,
    through: str,
    signs: dict[str, int],
    modes: Mapping[tuple[int, ...], str],
) -> Departure | None:
    nearby = {}
    for side in (1, -1):
        mode = modes.get(tuple(side if name == on else sign for name, sign in signs.items()))
        if mode is not None:
            nearby[side] = mode
    side = departing_side(sampler, nearby, on, signs)
    if side == 0:
        return None
    return Departure({on: 0, through: signs[through]}, {on: side})


# --------------------------------------------------------------------------- stops, symmetry


def stop_surface_of(sampler: Sampler) -> str:
    """Find the surface on which the first state is stationary in every mode that moves it; or none."""
    evaluator, description = sampler.evaluator, sampler.evaluator.description
    moving = [m for m in description.modes if 0 not in m.sides.values()] or description.modes
    points = list(sampler.states(_POINTS))
    for surface in description.surfaces:
        ratios = set()
        for t, y in points:
            above = evaluator.height(surface.name, sampler.params, t, y)
            for mode in moving:
                rate = evaluator.value(mode.field[0], sampler.params, t, y)
                ratios.add(_ratio(rate, above))
        if len(ratios) == 1 and ratios & {1, -1}:
            return surface.name
    return ""


def _ratio(a: float, b: float) -> int:
    scale = _SAME * (1.0 + abs(a) + abs(b))
    return 1 if abs(a - b) <= scale else -1 if abs(a + b) <= scale else 0


def symmetry_of(sampler: Sampler, surfaces: list[Surface]) -> Symmetry | None:
    """Read the linear map and find the image of every surface."""
    description = sampler.evaluator.description
    if description.symmetry is None:
        return None
    try:
        matrix, fraction = _linear_map(description)
        evaluator, params = sampler.evaluator, sampler.params
        points, period = list(sampler.states(_POINTS)), evaluator.period(params) or 0.0
        moved = [evaluator.image(params, t, y, period) for t, y in points]
        heights, beyond = (
            {s.name: [evaluator.height(s.name, params, t, y) for t, y in at] for s in surfaces}
            for at in (points, moved)
        )
        found = {s.name: _image(s, heights, beyond) for s in surfaces}
        images = {name: image for name, (image, _) in found.items()}
        kept = frozenset(name for name, (_, sense) in found.items() if sense > 0)
        modes = _modes_alike(sampler, matrix, points, moved)
        lifts = {own.surface: own.lift for own in description.chatters if not own.other}
        for wall, lift in lifts.items():  # of two walls they may be levels of one observable
            images[lift] = lifts.get(images[wall], images[lift])
    except ModelError as error:
        raise EntryError(("symmetry",), str(error)) from None
    if not description.period:
        fraction = 0.5
    return Symmetry(matrix, fraction, images, kept, modes)


def _modes_alike(
    sampler: Sampler,
    matrix: tuple[tuple[float, ...], ...],
    points: list[tuple[float, list[float]]],
    moved: list[tuple[float, list[float]]],
) -> dict[str, frozenset[str]]:
    """Return for each mode those whose field, at the images of some states, is the image of its own."""
    names = [mode.name for mode in sampler.evaluator.description.modes]
    here, there = (
        np.array(
            [[sampler.evaluator.field(name, sampler.params, t, y) for t, y in at] for name in names]
        )
        for at in (points, moved)
    )
    images = here @ np.array(matrix).T
    found = {}
    for name, image in zip(names, images, strict=True):
        alike = np.isclose(there, image, _SAME, _SAME, equal_nan=True).all(axis=(1, 2))
        found[name] = frozenset(itertools.compress(names, alike))
    return found


def _linear_map(description: Description) -> tuple[tuple[tuple[float, ...], ...], float]:
    images, states = description.symmetry or {}, description.states
    zero = dict.fromkeys(states, 0.0)

    def value(name: str, state: Mapping[str, float], t: float, period: float) -> float:
        scope = Scope(FLOATS, {PERIOD: period, **state, TIME: t})
        return scope.evaluate(parse(images[name]))

    rows = []
    mixed = {name: 0.3 + 0.7 * i for i, name in enumerate(states)}
    for name in states:
        row = tuple(value(name, {**zero, s: 1.0}, 0.0, 0.0) for s in states)
        linear = sum(c * mixed[s] for c, s in zip(row, states, strict=True))
        if not abs(value(name, mixed, 0.7, 0.9) - linear) <= _SAME:
            raise ModelError(f"the image of {name} must be linear in the states, such as -{name}")
        rows.append(row)
    fraction = value(TIME, zero, 0.0, 1.0)
    if not abs(value(TIME, mixed, 0.7, 0.9) - 0.7 - 0.9 * fraction) <= _SAME:
        raise ModelError("the image of t must be t plus a share of the period, such as t + T/2")
    return tuple(rows), fraction


def _image(
    surface: Surface, heights: Mapping[str, list[float]], images: Mapping[str, list[float]]
) -> tuple[str, int]:
    """Return the surface that a surface comes to, and whether its sides are kept (1) or exchanged (-1)."""
    for sense in (-1, 1):
        for other, values in heights.items():
            pairs = zip(images[surface.name], values, strict=True)
            if all(abs(a - sense * b) <= _SAME * (1.0 + abs(a) + abs(b)) for a, b in pairs):
                return other, sense
    raise ModelError(
        f"the image of surface '{surface.name}' ({surface.observable} = {surface.level}) is not one of "
        "the surfaces: there is no such symmetry, or a surface is missing"
    )
