"""The field at a joint: unchanged, changed along one direction as sliding begins, or with a jump.

Judged at random states on the surface between two modes, on which both slide as they do.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from functools import cache

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.models.definition import Model
from contfric.models.view import FlowView
from contfric.signature.holds import is_hold

#: Fields that differ by less than this share of each rate's size, at all states, are equal there: rounding.
_SAME = 1e-9
#: States at which fields are compared, and at how many sets of parameters. Whether changes are none, of one
#: direction or of more, two random states tell; the others are there as not all land on the surface.
_STATES, _SETS = 6, 2
#: What the second set is changed by: what vanishes at the defaults alone is an accident.
_MOVED = 1.07
#: Distance from a surface that counts as on it.
_ON = 1e-11


class Passage(Enum):
    """What the field does at a joint."""

    CONTINUOUS = "the same field on both sides"
    PROJECTED = "sliding begins, and the field changes along one direction"
    JUMP = "another field"


@cache
def passage_at(model: Model, mode: str, surface: str, following: str) -> Passage:
    """Return what the field does between a mode and the following one, on all of the surface between them.

    Judged at random states on the surface, on which both modes slide as they do.
    """
    if is_hold(surface) or model.reset_at(mode, surface) is not None:
        return Passage.JUMP
    if model.whole_mode(mode) == model.whole_mode(following):
        return Passage.CONTINUOUS
    if mode in model.chatter_by_mode:  # left where the force of the wall vanishes
        return Passage.CONTINUOUS
    slides = surface in lies_on(model, following)
    vector, worst = model.vector({}), Passage.CONTINUOUS
    for k in range(_SETS):
        found = list(fields_between(FlowView(model, vector * _MOVED**k), mode, surface, following))
        if len(found) < 2:
            return Passage.JUMP
        here, there, sizes_off = (np.array(fields) for fields in zip(*found, strict=True))
        size = np.max(np.abs(here), axis=0) + np.max(np.abs(there), axis=0)
        size += np.max(sizes_off, axis=0)
        changes = (there - here)[:, size > 0.0] / size[size > 0.0]
        if np.max(np.abs(changes), initial=0.0) <= _SAME:
            continue
        sizes = np.linalg.svd(changes, compute_uv=False)
        if not slides or np.any(sizes[1:] > _SAME * sizes[0]):
            return Passage.JUMP
        worst = Passage.PROJECTED
    return worst


@cache
def lies_on(model: Model, mode: str) -> set[str]:
    """Return the surfaces that a mode slides on."""
    whole = model.whole_mode(mode)
    own = [d.signs for d in model.domains_of(whole)]
    return {name for name in own[0] if all(signs[name] == 0 for signs in own)}


def fields_between(
    view: FlowView, mode: str, surface: str, following: str
) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
    """Yield the fields of two modes at random states on the surface between them, and sizes of their rates.

    A rate that is zero on the surface (of what rests there) is so to how well the state lies on it. So sizes
    are those off the surface.
    """
    model = view.model
    surfaces = sorted({surface} | lies_on(model, mode) | lies_on(model, following))
    draw = np.random.default_rng(1)
    wide = np.abs(model.spread(model.mapping(view.vector)))
    for _ in range(_STATES):
        t, y = float(draw.uniform(0.0, view.period or 10.0)), draw.uniform(-2.0, 2.0, len(wide))
        landed = view.landed(surfaces, t, wide * y, _ON)
        if landed is not None:
            off = [_field(view, which, t, wide * y) for which in (mode, following)]
            size = np.max(np.abs(np.nan_to_num(off, nan=0.0, posinf=0.0, neginf=0.0)), axis=0)
            yield _field(view, mode, t, landed), _field(view, following, t, landed), size


def _field(view: FlowView, mode: str, t: float, y: FloatArray) -> FloatArray:
    """Return the field of a mode: how the state at the end of a segment changes with its duration."""
    return view.jacobian(mode, t, y, 0.0)[:, 1 + len(y)]
