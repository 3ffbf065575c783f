"""Symmetries that a model has and does not declare: changes of sign of states, with shifts.

A map ``y -> K y + k``, K diagonal with entries 1 and -1, and half a period later, is looked for that takes
the fields of all modes to those of others, surfaces to surfaces with their sides exchanged, and resets to
resets. The shift k follows from one pair of modes by least squares; everything else is a test of it.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.errors import ParameterError
from contfric.models.check.probe import Probe
from contfric.models.check.report import ModelReport, Topic
from contfric.models.definition import Model

#: States in each mode, and draws of states in which they are looked for: what holds at six random states
#: holds almost everywhere.
_STATES, _DRAWS = 6, 400
#: Rounding of values that should be the same, relative to 1 + their size.
_SAME = 1e-8
#: Steps of Gauss and Newton for the shift; fields that are linear in the states need one.
_STEPS = 6
#: Step of differences: the cube root of rounding.
_DIFFERENCE = 6e-6
#: Parameters near the given ones are drawn within these shares of them.
_NEARBY = 0.1
#: Sets of parameters that a symmetry of the model itself must hold at, besides the given ones.
_SETS = 4
#: Coefficients of an expression of the parameters are multiples of this.
_UNIT = 0.5
#: A model of more states than this is tested for the change of all signs only: patterns double with each.
_MOST_STATES = 8

Place = tuple[float, FloatArray]


@dataclass(frozen=True)
class SignChanges:
    """A map ``(t, y) -> (t + T/2, signs * y + shift)``, and the mode whose field gave the shift."""

    signs: tuple[float, ...]
    shift: FloatArray
    pair: tuple[str, str]

    def of(self, place: Place, period: float) -> Place:
        """Return the image of a time and state."""
        return place[0] + 0.5 * period, np.array(self.signs) * place[1] + self.shift


def check_hidden(report: ModelReport, probe: Probe) -> None:
    """Look for a symmetry that is not declared, and say what it is good for."""
    if probe.model.symmetry is not None:
        return
    found = hidden_symmetry(probe)
    report.count(Topic.UNDECLARED)
    if found is not None:
        report.note(Topic.UNDECLARED, _advice(probe, found))


def hidden_symmetry(probe: Probe) -> SignChanges | None:
    """Return a symmetry that a model has at some parameters, declared or not; None if none was found."""
    places = {
        mode.name: list(probe.places(mode.name, _DRAWS, _STATES)) for mode in probe.model.modes
    }
    if not all(len(own) == _STATES for own in places.values()):
        return None
    first = next((m.name for m in probe.model.modes if not m.sliding), probe.model.modes[0].name)
    for signs in _patterns(len(probe.model.states)):
        for mode in probe.model.modes:
            shift = _shift(probe, signs, (first, mode.name), places[first])
            if shift is None:
                continue
            found = SignChanges(signs, shift, (first, mode.name))
            if _holds(probe, found, places):
                return found
    return None


def _patterns(states: int) -> Iterator[tuple[float, ...]]:
    """Yield the changes of sign, that of all states first, without that of none."""
    if states > _MOST_STATES:
        yield (-1.0,) * states
        return
    yield from list(itertools.product((-1.0, 1.0), repeat=states))[:-1]


def _shift(
    probe: Probe, signs: tuple[float, ...], pair: tuple[str, str], places: list[Place]
) -> FloatArray | None:
    """Return the shift with which the field of one mode is the image of that of another; None if none."""
    k, free = np.zeros(len(signs)), [i for i, sign in enumerate(signs) if sign < 0.0]
    wanted = np.concatenate([np.array(signs) * probe.field(pair[0], *p) for p in places])

    def missing(shift: FloatArray) -> FloatArray:
        images = (SignChanges(signs, shift, pair).of(p, probe.period) for p in places)
        found = np.concatenate([probe.field(pair[1], *image) for image in images])
        return np.asarray(found - wanted)

    converged = False
    for _ in range(_STEPS):
        here = missing(k)
        if not np.all(np.isfinite(here)):
            return None
        if converged:  # by one step more than it takes
            return np.where(np.abs(k) < _SAME, 0.0, k)
        converged = bool(np.max(np.abs(here)) <= _SAME * (1.0 + np.max(np.abs(wanted))))
        slopes = np.empty((len(here), len(free)))
        for column, i in enumerate(free):
            step = np.zeros(len(k))
            step[i] = _DIFFERENCE
            slopes[:, column] = (missing(k + step) - missing(k - step)) / (2.0 * _DIFFERENCE)
        if not np.all(np.isfinite(slopes)):
            return None
        towards = np.linalg.lstsq(slopes, here, rcond=1e-9)[0]
        left = np.max(np.abs(here - slopes @ towards)) > 0.5 * np.max(np.abs(here))
        if left and not converged and np.max(np.abs(towards)) <= _SAME * (1.0 + np.max(np.abs(k))):
            return None  # the nearest that a shift comes
        k[free] -= towards
    return None


def _holds(probe: Probe, found: SignChanges, places: dict[str, list[Place]]) -> bool:
    """Tell whether a map takes every surface, mode and reset to another one."""
    every = [place for own in places.values() for place in own]
    surfaces = _surfaces(probe, found, every)
    if surfaces is None:
        return False
    modes = _modes(probe.model, surfaces)
    if modes is None:
        return False
    for mode, own in places.items():
        for place in own:
            here = np.array(found.signs) * probe.field(mode, *place)
            there = probe.field(modes[mode], *found.of(place, probe.period))
            if not np.allclose(here, there, rtol=_SAME, atol=_SAME):
                return False
    return all(_maps_reset(probe, found, s, surfaces[s]) for s in probe.model.reset_by_surface)


def _surfaces(probe: Probe, found: SignChanges, places: list[Place]) -> dict[str, str] | None:
    """Return the image of each surface, with the sides exchanged; None if one has none."""

    def image(name: str) -> str | None:
        for other in probe.model.surfaces:
            pairs = [
                (
                    probe.height(name, *found.of(place, probe.period)),
                    probe.height(other.name, *place),
                )
                for place in places
            ]
            if all(abs(a + b) <= _SAME * (1.0 + abs(a) + abs(b)) for a, b in pairs):
                return other.name
        return None

    images = {s.name: image(s.name) for s in probe.model.surfaces}
    return None if None in images.values() else {a: b for a, b in images.items() if b is not None}


def _modes(model: Model, surfaces: dict[str, str]) -> dict[str, str] | None:
    """Return the image of each mode by the sides of its domains; None if a domain has none."""
    found: dict[str, str] = {}
    for domain in model.domains:
        signs = {surfaces[s]: -side for s, side in domain.signs.items()}
        image = next((d for d in model.domains if d.signs == signs), None)
        if image is None or found.setdefault(domain.own_mode, image.own_mode) != image.own_mode:
            return None
    return found


def _maps_reset(probe: Probe, found: SignChanges, surface: str, image: str) -> bool:
    """Tell whether the image of a reset is the reset at the image of its surface."""
    if image not in probe.model.reset_by_surface:
        return False
    for place in itertools.islice(probe.on(surface, _DRAWS), _STATES):
        moved = found.of(place, probe.period)
        after = np.array(found.signs) * probe.reset(surface, *place) + found.shift
        if not np.allclose(after, probe.reset(image, *moved), rtol=_SAME, atol=_SAME):
            return False
    return True


# -------------------------------------------------------------------------------------- in words


def _advice(probe: Probe, found: SignChanges) -> str:
    """Return what the symmetry is, and what can be done with it."""
    elsewhere = list(_at_other_parameters(probe))
    texts, simple = _shifts(probe, found, elsewhere)
    always = all(_is_same(found, hidden_symmetry(other)) for other in elsewhere[:_SETS])
    shown = ", ".join(
        _image(*row) for row in zip(probe.model.states, found.signs, texts, strict=True)
    )
    shown += "" if probe.model.autonomous else ", t -> t + T/2"
    pairs = "orbits come in pairs of mirror images, and branch points where that symmetry is broken"
    if not always:
        return (
            f"at these parameters the model has a symmetry that is not declared: {shown}. Expect that "
            f"{pairs}. It does not hold at parameters near these, so that it cannot be declared"
        )
    if not simple:
        return (
            f"the model has a symmetry that is not declared: {shown}. Expect that {pairs}. Write its shift "
            "as an expression of the parameters, and it can be declared: mirror images then cost nothing"
        )
    return (
        f"the model has a symmetry that is not declared. Declare it, 'symmetry: {shown}', and mirror images "
        "cost nothing, symmetric orbits half"
    )


def _at_other_parameters(probe: Probe) -> Iterator[Probe]:
    """Yield probes at parameters near the given ones, more than there are parameters."""
    draw, values = random.Random(probe.seed), probe.model.mapping(probe.vector)
    count, wanted = 0, len(values) + 2 + _SETS
    for _ in range(50 * wanted):
        moved = {
            name: value + _NEARBY * (abs(value) or 1.0) * draw.uniform(-1.0, 1.0)
            for name, value in values.items()
        }
        try:
            params = probe.model.check_params(moved)
        except ParameterError:
            continue
        yield Probe(probe.model, params, probe.seed)
        count += 1
        if count == wanted:
            return


def _is_same(found: SignChanges, other: SignChanges | None) -> bool:
    return other is not None and other.signs == found.signs


def _shifts(probe: Probe, found: SignChanges, elsewhere: list[Probe]) -> tuple[list[str], bool]:
    """Return the shift of each state as an expression of the parameters, or as a number if one has none."""
    first, rows, values = found.pair[0], [], []
    for other in elsewhere:
        places = list(other.places(first, _DRAWS, _STATES))
        shift = _shift(other, found.signs, found.pair, places) if places else None
        if shift is not None:
            rows.append([1.0, *other.vector])
            values.append(shift)
    texts, simple = [], True
    for i, number in enumerate(found.shift):
        fitted = len(rows) > len(probe.vector) + 1
        column = np.array([shift[i] for shift in values])
        text = _expression(probe.model, np.array(rows), column) if fitted and number else ""
        simple = simple and bool(text or not number)
        texts.append(text or (f"{number:.12g}" if number else ""))
    return texts, simple


def _expression(model: Model, rows: FloatArray, values: FloatArray) -> str:
    """Return a linear expression of the parameters with simple coefficients, or an empty text."""
    fit = np.linalg.lstsq(rows, values, rcond=1e-12)[0]
    simple = np.round(fit / _UNIT) * _UNIT
    if not np.allclose(rows @ simple, values, rtol=_SAME, atol=_SAME):
        return ""
    terms = [
        (c, name) for c, name in zip(simple, ("", *model.parameter_names), strict=True) if c != 0.0
    ]
    text = ""
    for c, name in sorted(terms, key=lambda term: term[0] < 0.0):
        size = "" if abs(c) == 1.0 and name else f"{abs(c):g}" + ("*" if name else "")
        text += (" - " if c < 0.0 else " + " if text else "") + size + name
    return text.replace(" - ", "-", 1) if text.startswith(" - ") else text


def _image(state: str, sign: float, shift: str) -> str:
    own = f"{'-' if sign < 0.0 else ''}{state}"
    if not shift:
        return f"{state} -> {own}"
    return f"{state} -> {shift} {'-' if sign < 0.0 else '+'} {state}"
