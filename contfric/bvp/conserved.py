"""Quantities that are constant along an orbit, such as the position of a contact that never slips.

A linear function ``w . y`` whose rate vanishes in all modes of an itinerary keeps its value: the orbits form
a continuum, with a multiplier 1 (-1 of a half turn, if the symmetry turns it over) for each such w, which is
a left eigenvector of the linear map of a turn. The value is a given datum: Newton's method does not move it,
and the trivial multiplier is taken away exactly (:mod:`contfric.bvp.spectrum`). In the matrix of the
closure K that a correction is solved with, ``K + w w'`` stands for K wherever ``w . K = w``: the closure's
residual along w is zero, so that the correction is zero along w too, and the matrix is regular.

A velocity that is 0 as long as a contact sticks is no datum: the surface that all modes lie on gives it.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, lru_cache

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.models.definition import Model
from contfric.models.deriving.growing_model import ComposedModel
from contfric.models.described.evaluate import Sampler, defaults, floats

Itinerary = tuple[tuple[str, str], ...]
#: Parameters, time, state and rate.
Motion = tuple[FloatArray, float, FloatArray, FloatArray]
#: A rate this small, relative to the largest one, is zero: rounding of formulas of moderate size.
_ZERO = 1e-9
#: Rates below this, relative to 1 + the states, are zero: a state is put onto a surface to rounding.
_NOTHING = 1e-12
#: States at which rates are asked for, beyond the number of states: one more says that none is an accident.
_MORE = 3
#: States that are tried for them.
_TRIES = 200
#: Itineraries whose directions are kept: an event asks again for those of all that can follow it.
_ITINERARIES = 512
#: A second set of parameters: what vanishes at the defaults alone is no datum.
_MOVED = 1.07


def conserved(model: Model, itinerary: Itinerary) -> FloatArray:
    """Return the directions w of the linear functions that an itinerary conserves.

    Orthonormal rows, shape (k, n).
    """
    if not model.definition:  # of functions of its own: such a model says nothing of its fields
        return np.empty((0, len(model.states)))
    resets = (exit_ for mode, exit_ in itinerary if model.reset_at(mode, exit_) is not None)
    modes = (mode for mode, _ in itinerary)
    return _by_modes(model, tuple(dict.fromkeys(modes)), tuple(dict.fromkeys(resets)))


@lru_cache(maxsize=_ITINERARIES)
def _by_modes(model: Model, modes: tuple[str, ...], resets: tuple[str, ...]) -> FloatArray:
    """Return the directions that some modes and the resets at some surfaces conserve."""
    still = np.eye(len(model.states))
    for mode in modes:
        still = _kept(still, _along(model, mode)[0])
        if not len(still):
            return still
    for surface in resets:
        still = _kept(still, _jumps(model, surface))
    if not len(still):
        return still
    first, *others = (_along(model, mode)[1] for mode in modes)
    varied, fixed = _varied(still, first)
    if any(np.linalg.norm(fixed @ apart) > _ZERO for apart in others):  # few modes have others
        return _varied(still, np.hstack([first, *others]))[0]
    return varied


def _varied(still: FloatArray, apart: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return those of some directions, orthonormal rows, along which states differ, and the others."""
    own, sizes, _ = np.linalg.svd(still @ apart, full_matrices=apart.shape[1] < len(still))
    count = int(np.sum(sizes > _ZERO))
    return np.ascontiguousarray(own[:, :count].T @ still), own[:, count:].T @ still


def kept_by(closure: FloatArray, directions: FloatArray) -> FloatArray:
    """Return those of some directions, orthonormal rows, that a closure maps to themselves."""
    if not len(directions):
        return directions
    own = directions @ closure @ directions.T - np.eye(len(directions))
    left, sizes, _ = np.linalg.svd(own)
    return np.ascontiguousarray(left[:, sizes <= _ZERO].T @ directions)


def _kept(still: FloatArray, changes: FloatArray) -> FloatArray:
    """Return those of some directions, orthonormal rows, along which no change has a part."""
    parts = still @ changes
    if np.linalg.norm(parts) <= _ZERO:  # mostly: modes say what others have said
        return still
    # all directions, and of many changes not all of theirs
    left, sizes, _ = np.linalg.svd(parts, full_matrices=changes.shape[1] < len(still))
    return np.ascontiguousarray(left[:, int(np.sum(sizes > _ZERO)) :].T @ still)


@cache
def _samplers(model: Model) -> tuple[Sampler, Sampler]:

    description = model.description
    params = defaults(description)
    moved = {name: value * _MOVED for name, value in params.items()}
    evaluator = floats(description)
    return Sampler(evaluator, params), Sampler(evaluator, moved)


@cache
def _along(model: Model, mode: str) -> tuple[FloatArray, FloatArray]:
    """Return rates along a mode at some states that it has, and how far these are from the first.

    Columns of size 1, shapes (n, states).
    """
    found = sampled_states(model, mode)
    found = [(p, t, y, _without_rounding(rate, y)) for p, t, y, rate in found]
    apart = [y - found[0][2] for _, _, y, _ in found[1:]]
    changes = _columns([rate for *_, rate in found], len(model.states))
    if model.composed:  # many itineraries have this mode: directions that say the same
        left, sizes, _ = np.linalg.svd(changes, full_matrices=False)
        changes = left[:, : int(np.sum(sizes > _ZERO))]
    return changes, _columns(apart, len(model.states))


@cache
def sampled_states(model: Model, mode: str) -> list[Motion]:
    """Return some states of a mode: parameters, time, state and its rate."""
    return _at_random(model, mode) if isinstance(model, ComposedModel) else _at_samples(model, mode)


def _at_random(model: ComposedModel, mode: str) -> list[Motion]:
    """Return random states of a mode, by its compiled field."""
    k, n, draw = model.mode_index[mode], len(model.states), np.random.default_rng(1)
    found = []
    for factor in (1.0, _MOVED):
        vector = model.vector({}) * factor
        wide, period = 2.0 * np.abs(model.spread(model.mapping(vector))), model.view(vector).period
        for _ in range(n + _MORE):
            t, y = float(draw.uniform(0.0, period or 10.0)), wide * draw.uniform(-1.0, 1.0, n)
            found.append((vector, t, *model.state_and_rate(k, t, y, vector)))
    return found


def _at_samples(model: Model, mode: str) -> list[Motion]:
    """Return sampled states of a mode, by its formulas."""
    found: list[Motion] = []
    description = _samplers(model)[0].evaluator.description
    parts = [
        name for name in model.mode_by_name if model.whole_mode(name) == model.whole_mode(mode)
    ]
    text = next(m for m in description.modes if m.name in parts)
    held = [surface for surface, side in text.sides.items() if side == 0]
    for sampler in _samplers(model):
        vector = np.array([sampler.params[name] for name in model.parameter_names])
        wanted = len(found) + len(model.states) + _MORE
        for t, y in sampler.states(_TRIES):
            place: tuple[float, list[float]] | None = (t, y)
            for surface in (*held, *held):  # twice: one may move a state off the other
                place = place and sampler.landed(surface, *place)
            if place is not None:
                at, state = place
                rate = sampler.evaluator.field(text.name, sampler.params, at, state)
                if np.all(np.isfinite(rate)):  # a root of a negative level has no value
                    found.append((vector, at, np.array(state), np.array(rate)))
            if len(found) == wanted:
                break
    return found


@cache
def _jumps(model: Model, surface: str) -> FloatArray:
    """Return by how much a reset changes some states."""
    found = []
    texts = _samplers(model)[0].evaluator.description.resets[surface]
    for sampler in _samplers(model):
        for t, y in sampler.states(len(model.states) + _MORE):
            place = sampler.landed(surface, t, y)
            if place is not None:
                at, state = place
                value = sampler.evaluator.value
                after = [value(texts.get(s, s), sampler.params, at, state) for s in model.states]
                found.append([b - a for a, b in zip(state, after, strict=True)])
    return _columns(found, len(model.states))


def _without_rounding(rate: FloatArray, y: FloatArray) -> FloatArray:
    """Return a rate without what is rounding of a state that stands still: the speed of what rests."""
    return np.where(np.abs(rate) < _NOTHING * (1.0 + np.max(np.abs(y))), 0.0, rate)


def _columns(rows: Sequence[FloatArray | list[float]], n: int) -> FloatArray:
    """Return rows as columns, each of size 1: a stiff mode must not drown a slow one."""
    columns = np.array([row for row in rows if np.all(np.isfinite(row))]).reshape(-1, n).T
    sizes: FloatArray = np.linalg.norm(columns, axis=0)
    found: FloatArray = columns[:, sizes > 0.0] / sizes[sizes > 0.0]
    return found
