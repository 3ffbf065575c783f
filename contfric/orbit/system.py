"""From a signature to the boundary-value problem: which equations and inequalities an orbit obeys.

A segment starts at a joint ``z_i = (t_i, y_i)`` and ends at the next one, on its exit surface. The
equations are the flow of the segment and its exit surface; the inequalities (margins, positive where
admissible) are

* interior: between its joints a segment does not cross a surface that bounds its mode,
* exit: it meets its exit surface from inside, with a rate that does not vanish,
* joint: where it exits, the other observables are in the domain that the signature names.

Crossings of transparent surfaces inside a segment do not matter to the motion; they label it.

Everything here derives from the model's definition; nothing knows what moves.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from contfric.models.definition import FloatArray, Model

IntArray = NDArray[np.int64]


class Layout(NamedTuple):
    """A boundary-value problem as arrays, as the compiled engine takes it.

    Attributes
    ----------
    modes, exits : mode and exit surface of each segment, shape (N,)
    observables : observable of each surface, shape (surfaces,)
    exit_signs : sign of the rate at which each exit is met, shape (N,)
    interior : rows (segment, surface, sign) of the interior margins
    joint : rows (segment, surface, sign) of the joint margins, at the segment's end
    labels : rows (segment, observable, surface that the segment starts on or -1)
    closure : state matrix of the closure, shape (n, n)
    turn : duration of one turn in periods of the excitation
    rank : number of independent directions that survive one turn
    """

    modes: IntArray
    exits: IntArray
    observables: IntArray
    exit_signs: FloatArray
    interior: IntArray
    joint: IntArray
    labels: IntArray
    closure: FloatArray
    turn: float
    rank: int


class Margin(str, Enum):
    """The kinds of inequality that an orbit obeys."""

    INTERIOR = "interior"
    EXIT = "exit"
    JOINT = "joint"


@dataclass(frozen=True)
class Test:
    """What one margin of a system means: its kind, segment and surface."""

    __test__ = False  # not a test case of pytest
    margin: Margin
    segment: int
    surface: str


Word = tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class System:
    """A boundary-value problem: a reduced word with its closure, over one turn.

    ``half`` says that the turn is half of the orbit and closes by the model's symmetry; ``domains``
    are those of the segments if the problem is in full form, empty if it is reduced.
    """

    model: Model
    word: Word
    periods: int
    half: bool
    layout: Layout
    tests: tuple[Test, ...]
    domains: tuple[str, ...] = ()

    @property
    def segments(self) -> int:
        """Number of segments of one turn."""
        return len(self.word)

    def functions(self) -> tuple[Any, ...]:
        """Return the model's compiled functions in the order in which kernels take them."""
        return self.model.flow.functions()


@cache
def mode_bounds(model: Model) -> dict[str, tuple[str, ...]]:
    """Surfaces that bound each mode: those through which a transition changes the mode."""
    bounds: dict[str, set[str]] = {mode.name: set() for mode in model.modes}
    for (name, surface), target in model.transitions.items():
        mode = model.domain_by_name[name].mode
        if model.domain_by_name[target].mode != mode:
            bounds[mode].add(surface)
    return {
        mode: tuple(s.name for s in model.surfaces if s.name in found)
        for mode, found in bounds.items()
    }


def mode_domains(model: Model, mode: str) -> list[str]:
    """Return the domains of one mode."""
    return [d.name for d in model.domains if d.mode == mode]


def inside_sign(model: Model, mode: str, surface: str) -> int:
    """Return the sign of (observable - level) inside a mode, 0 if the mode lies on both sides."""
    signs = {model.domain_by_name[d].signs[surface] for d in mode_domains(model, mode)}
    return signs.pop() if len(signs) == 1 else 0


def exit_domains(model: Model, mode: str, surface: str, following: str) -> list[str]:
    """Return the domains of a mode from which a surface leads into the following mode."""
    return [
        name
        for name in mode_domains(model, mode)
        if (target := model.transitions.get((name, surface)))
        and model.domain_by_name[target].mode == following
    ]


@cache
def build_system(
    model: Model, word: Word, periods: int, half: bool = False, domains: tuple[str, ...] = ()
) -> System:
    """Assemble the boundary-value problem of a word.

    Parameters
    ----------
    word : tuple of (mode, exit surface)
        One turn: the whole cycle, or its first half if ``half``.
    periods : int
        Excitation periods of the whole orbit.
    domains : tuple of str
        Domains of the segments if the word is in full seven-domain form; by default the word is
        reduced and each segment spans its whole mode.
    """
    following = [mode for mode, _ in word[1:]] + [_mode_after(model, word, half)]
    names = [mode.name for mode in model.modes]
    surfaces = [s.name for s in model.surfaces]
    inside = [
        _segment_domains(model, mode, exit_, after, domains[i : i + 1])
        for i, ((mode, exit_), after) in enumerate(zip(word, following, strict=True))
    ]
    interior, joint, tests = _margins(model, word, inside, bool(domains))
    symmetry = model.symmetry
    n = len(model.states)
    layout = Layout(
        modes=np.array([names.index(mode) for mode, _ in word], dtype=np.int64),
        exits=np.array([surfaces.index(exit_) for _, exit_ in word], dtype=np.int64),
        observables=_surface_observables(model),
        exit_signs=np.array(
            [_exit_sign(model, i, e) for i, (_, e) in zip(inside, word, strict=True)]
        ),
        interior=interior,
        joint=joint,
        labels=_label_rows(model, word, half, bool(domains)),
        closure=symmetry.array() if half and symmetry else np.eye(n),
        turn=float(periods * symmetry.fraction) if half and symmetry else float(periods),
        rank=min(model.mode_by_name[mode].rank for mode, _ in word),
    )
    return System(model, word, periods, half, layout, tests, domains)


def _mode_after(model: Model, word: Word, half: bool) -> str:
    if not half:
        return word[0][0]
    return mirror_mode(model)[word[0][0]]


@cache
def mirror_mode(model: Model) -> dict[str, str]:
    """Image of each mode under the symmetry."""
    return {d.mode: model.domain_by_name[model.mirror_domain[d.name]].mode for d in model.domains}


def _segment_domains(
    model: Model, mode: str, surface: str, after: str, given: tuple[str, ...]
) -> list[str]:
    """Domains in which the segment may end."""
    if given:
        return list(given)
    found = exit_domains(model, mode, surface, after)
    if not found:
        raise ValueError(f"no domain of {mode} leads through {surface} into {after}")
    return found


def _exit_sign(model: Model, inside: list[str], surface: str) -> float:
    """Sign of the rate of the observable where the exit surface is met from inside."""
    sign = model.domain_by_name[inside[0]].signs[surface]
    return float(-sign)


def _surface_observables(model: Model) -> IntArray:
    names = [o.name for o in model.observables]
    return np.array([names.index(s.observable) for s in model.surfaces], dtype=np.int64)


def _margins(
    model: Model, word: Word, inside: list[list[str]], full: bool
) -> tuple[IntArray, IntArray, tuple[Test, ...]]:
    names = [s.name for s in model.surfaces]
    interior: list[tuple[int, int, int]] = []
    joint: list[tuple[int, int, int]] = []
    for i, (mode, exit_) in enumerate(word):
        for surface in names if full else mode_bounds(model)[mode]:
            sign = (
                model.domain_by_name[inside[i][0]].signs[surface]
                if full
                else inside_sign(model, mode, surface)
            )
            if sign != 0:
                interior.append((i, names.index(surface), sign))
        for surface in names:
            signs = {model.domain_by_name[d].signs[surface] for d in inside[i]}
            if surface != exit_ and len(signs) == 1 and (sign := signs.pop()) != 0:
                joint.append((i, names.index(surface), sign))
    tests = (
        *(Test(Margin.INTERIOR, i, names[k]) for i, k, _ in interior),
        *(Test(Margin.EXIT, i, exit_) for i, (_, exit_) in enumerate(word)),
        *(Test(Margin.JOINT, i, names[k]) for i, k, _ in joint),
    )
    return _rows(interior), _rows(joint), tests


def _rows(rows: list[tuple[int, int, int]]) -> IntArray:
    return np.array(rows, dtype=np.int64).reshape(len(rows), 3)


def _label_rows(model: Model, word: Word, half: bool, full: bool) -> IntArray:
    """Segments and observables whose surfaces are transparent there, and where they start."""
    if full:
        return _rows([])
    surfaces = [s.name for s in model.surfaces]
    first_entry = word[-1][1]
    if half and model.symmetry:
        inverse = {image: name for name, image in model.symmetry.surfaces.items()}
        first_entry = inverse[first_entry]
    rows: list[tuple[int, int, int]] = []
    for i, (mode, _) in enumerate(word):
        entry = word[i - 1][1] if i else first_entry
        for c, observable in enumerate(model.observables):
            clear = [
                s.name
                for s in model.surfaces
                if s.observable == observable.name and inside_sign(model, mode, s.name) == 0
            ]
            if clear and not model.mode_by_name[mode].sliding:
                start = surfaces.index(entry) if _observable(model, entry) == c else -1
                rows.append((i, c, start))
    return _rows(rows)


def _observable(model: Model, surface: str) -> int:
    names = [o.name for o in model.observables]
    return names.index(model.surface_by_name[surface].observable)
