"""Itineraries of an orbit and of its half, and the domains that its segments pass."""

from __future__ import annotations

from collections import deque
from functools import cache

import numpy as np

from contfric.base.arrays import IntArray
from contfric.bvp.system import Itinerary
from contfric.models.definition import Model
from contfric.models.mode_domains import exit_domains
from contfric.signature.reduced import mirror_pair


@cache
def mirror_pairs(model: Model, itinerary: Itinerary) -> Itinerary:
    """Return the mirror image of an itinerary, segment by segment (not rotated)."""
    assert model.symmetry is not None
    return tuple(mirror_pair(pair, model) for pair in itinerary)


@cache
def half_of(model: Model, itinerary: Itinerary, periods: int) -> Itinerary | None:
    """Return the first half if the second one is its mirror image, else None.

    An orbit of an even number of periods has no such half: twice the symmetry is one period.
    """
    if model.symmetry is None or len(itinerary) % 2 or periods % 2 == 0:
        return None
    half = itinerary[: len(itinerary) // 2]
    return half if mirror_pairs(model, half) == itinerary[len(itinerary) // 2 :] else None


def whole_of(model: Model, itinerary: Itinerary, half: bool) -> Itinerary:
    """Return the itinerary of the whole orbit."""
    return itinerary + mirror_pairs(model, itinerary) if half else itinerary


def end_domain(model: Model, mode: str, exit_: str, after: str, signs: dict[str, int]) -> str:
    """Return the domain in which a segment ends: one whose exit leads on, by the signs there.

    Where a stop lies on a surface to rounding (at an event) the itinerary decides, not the sign.
    """

    def wrong(domain: str) -> int:
        own = model.domain_by_name[domain].signs
        return sum(own[s] * signs[s] < 0 for s in own if s != exit_)

    return min(exit_domains(model, mode, exit_, after), key=wrong)


def passed_domains(model: Model, start: str, end: str, crossed: list[str]) -> list[str]:
    """Return the domains of one segment in order, from the surfaces that it crosses.

    A crossing at a joint itself may be counted or not, by rounding: one that leads nowhere is left
    out, and the walk is cut or completed so that it ends where the itinerary says.
    """
    mode = model.domain_by_name[start].mode
    path = [start]
    for surface in crossed:
        target = model.transitions.get((path[-1], surface))
        if target is not None and model.domain_by_name[target].mode == mode:
            path.append(target)
    if path[-1] == end:
        return path
    if end in path[-2:]:
        return path[: len(path) - path[::-1].index(end)]
    return path[:-1] + _shortest_walk(model, path[-1], end)


def _shortest_walk(model: Model, start: str, end: str) -> list[str]:
    """Return the shortest walk between two domains of one mode; both ends without one."""
    mode = model.domain_by_name[start].mode
    waiting = deque([[start]])
    seen = {start}
    while waiting:
        walk = waiting.popleft()
        if walk[-1] == end:
            return walk
        for (source, _), target in model.transitions.items():
            inside = model.domain_by_name[target].mode == mode
            if source == walk[-1] and inside and target not in seen:
                seen.add(target)
                waiting.append([*walk, target])
    return [start, end]


def decode(code: int, surfaces: list[str]) -> list[str]:
    """Return the surfaces crossed, in order, from the digits of a label; none if they are too many."""
    base = len(surfaces) + 1
    crossed: list[str] = []
    while code > 0:
        code, digit = divmod(code, base)
        crossed.append(surfaces[digit - 1])
    return crossed[::-1]


def encode(crossed: list[str], surfaces: list[str]) -> int:
    """Return the label of the surfaces crossed, in order."""
    code = 0
    for surface in crossed:
        code = code * (len(surfaces) + 1) + surfaces.index(surface) + 1
    return code


def mirrored_labels(labels: IntArray, model: Model) -> IntArray:
    """Return the labels of the mirror image: the same crossings of the mirrored surfaces."""
    assert model.symmetry is not None
    codes, inverse = np.unique(labels, return_inverse=True)
    mirrored = [_mirrored_code(code, model) for code in codes.tolist()]
    return np.array(mirrored, dtype=np.int64)[inverse].reshape(labels.shape)


@cache
def _mirrored_code(code: int, model: Model) -> int:
    assert model.symmetry is not None
    if code < 0:  # more crossings than a label lists
        return code
    image, surfaces = model.symmetry.surfaces, [s.name for s in model.surfaces]
    return encode([image[s] for s in decode(code, surfaces)], surfaces)
