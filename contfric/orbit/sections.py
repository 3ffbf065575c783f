"""Orbits without joints where nothing happens.

A simulation stops at every section (a surface between two parts of one mode). An orbit that meets other surfaces has
its joints there, and passes sections inside of its segments. An orbit that meets none is found and fixed by
sections: by one crossing each way for every period of the excitation, that at which the surface is crossed
fastest. Whether it crosses them more often is a label.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contfric.models.definition import FloatArray, Model
from contfric.orbit.clock import clocked
from contfric.orbit.orbit import Orbit
from contfric.orbit.system import Word, build_system

#: Crossings that belong to consecutive periods are apart by one period to this share of it.
_SHARE = 0.25
#: A crossing that is the symmetry image of another one is so to this (nondimensional).
_IMAGE = 1e-6


def has_sections(model: Model, word: Word) -> bool:
    """Tell whether a word has joints on sections beside others."""
    return bool(model.sections) and any(pair in model.sections for pair in word)


def is_smooth(model: Model, word: Word) -> bool:
    """Tell whether a cycle meets nothing but sections."""
    return bool(model.sections) and all(pair in model.sections for pair in word)


def without_sections(
    model: Model, word: Word, joints: FloatArray, end: float, vector: FloatArray, periods: int
) -> tuple[Word, FloatArray, float]:
    """Return a whole cycle without its joints on sections: word, joints and the time at which it ends.

    Parameters
    ----------
    word, joints : all segments of a cycle and the time and state where each begins, behind no reset
    end : time at which the cycle ends
    vector : parameters, which tell how fast a section is crossed
    periods : of the excitation
    """
    if not model.joined:
        return word, joints, end
    kept = [i for i, pair in enumerate(word) if pair not in model.sections]
    if not kept:
        kept = _crossings(model, word, joints, end, vector, periods)
    first = kept[-1] + 1 - len(word)  # the first segment may begin in the cycle before
    starts = [first, *(i + 1 for i in kept[:-1])]
    found = joints[[i % len(word) for i in starts]].copy()
    period = end - joints[0, 0]
    if first < 0:
        found[0, 0] -= period
    pairs = tuple(
        model.section_pair(*word[i]) if word[i] in model.sections else (model.whole_mode(word[i][0]), word[i][1])
        for i in kept
    )
    return pairs, found, float(found[0, 0]) + period


def _crossings(
    model: Model, word: Word, joints: FloatArray, end: float, vector: FloatArray, periods: int
) -> list[int]:
    """Return the segments at whose ends a smooth cycle keeps a joint."""
    surface = next(s for s in model.surface_by_name if any(pair[1] == s for pair in word))
    at = [i for i, pair in enumerate(word) if pair[1] == surface]
    if model.autonomous:
        return at
    ends = np.roll(joints, -1, axis=0)
    ends[-1, 0] = end
    sides = [[i for i in at if model.section_sides[word[i]] == side] for side in (1, -1)]
    rates = {i: _rate(model, word[i], ends[i], vector) for i in at}
    period = end - joints[0, 0]
    chosen: list[int] = []
    for side in sides:
        if not side:
            continue
        best = _image_of(model, chosen, side, ends, period) if chosen else None
        chosen.append(max(side, key=rates.__getitem__) if best is None else best)
    more = [_later(i, side, ends, period, periods) for i, side in zip(chosen, filter(None, sides), strict=True)]
    if all(more):
        chosen = [i for run in more for i in run]
    return sorted(chosen)


def _rate(model: Model, pair: tuple[str, str], at: FloatArray, vector: FloatArray) -> float:
    c = [o.name for o in model.observables].index(model.surface_by_name[pair[1]].observable)
    mode = [m.name for m in model.modes].index(pair[0])
    none, empty = np.empty(0, dtype=np.int64), np.empty(0)
    return abs(float(model.flow.rate(mode, c, float(at[0]), at[1:].copy(), vector, none, empty)))


def _image_of(
    model: Model, chosen: list[int], side: list[int], ends: FloatArray, period: float
) -> int | None:
    """Return the crossing that is the symmetry image of the one chosen, if there is one."""
    if model.symmetry is None:
        return None
    image = model.symmetry.array() @ ends[chosen[0], 1:]
    time = ends[chosen[0], 0] + 0.5 * period
    for i in side:
        late = abs((ends[i, 0] - time + 0.5 * period) % period - 0.5 * period)
        if max(late, float(np.max(np.abs(ends[i, 1:] - image)))) < _IMAGE:
            return i
    return None


def _later(first: int, side: list[int], ends: FloatArray, period: float, periods: int) -> list[int]:
    """Return a crossing in every period of the excitation; none if one has none."""
    step, found = period / periods, []
    for k in range(periods):
        late = (ends[side, 0] - ends[first, 0] - k * step + 0.5 * period) % period - 0.5 * period
        best = int(np.argmin(np.abs(late)))
        if abs(late[best]) > _SHARE * step:
            return []
        found.append(side[best])
    return found if len(set(found)) == periods else []


def canonical(orbit: Orbit) -> Orbit:
    """Return the same orbit without joints on sections that it can do without; most often as it is."""
    model, word = orbit.model, orbit.system.word
    if not model.joined or orbit.system.domains or orbit.system.half:
        return orbit
    found, joints, end = without_sections(
        model, word, orbit.joints, float(orbit.joints[0, 0]) + orbit.period, orbit.vector, orbit.periods
    )
    if found == word:
        return orbit
    system = build_system(model, found, orbit.periods)
    return replace(orbit, system=system, joints=clocked(model, joints, end))
