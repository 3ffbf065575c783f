"""Itineraries in which something only ever grows, such as the offset of a slider that slips to one side only.

A linear function ``w . y`` whose rate is, along some modes, a positive multiple of the height of a surface on
whose one side all of these lie, and zero along all others, grows whenever a motion is in one of them. It is
the same after a period, so that they last for no time: what solves the equations of such an itinerary are the
orbits of the itinerary without these modes that just touch their limit, for every value of the parameter.

What all of an itinerary conserves grows nowhere along it: where that is all that the other modes conserve,
as it is of contacts that never slip, no height is asked.

Other modes on that side may conserve it: where several sliders are in parallel all stop at once, at one
surface, and only the strongest of them slips to one side only.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.interrupts import whole
from contfric.bvp.conserved import conserved, sampled_states
from contfric.bvp.system import Itinerary
from contfric.models.definition import Model

#: How well rates are explained by heights, relative to the largest of these: rounding.
_ZERO = 1e-9


@cache
def only_grows(model: Model, itinerary: Itinerary) -> tuple[str, ...]:
    """Return modes of an itinerary that periodic motion enters for no time, as a quantity only grows there.

    Examples
    --------
    >>> import contfric as cf
    >>> slider = {"kind": "jenkins", "displacement": "q1", "stiffness": "1", "limit": "S"}
    >>> model = cf.Mechanism([[1.0]], [[0.1]], [[1.0]], contacts={"d": slider}, force={"q1": "cos(w*t)"},
    ...                      parameters={"w": 0.7, "S": 0.2}, period="2*pi/w")
    >>> only_grows(model, (("s", "d-"), ("n", "d")))
    ('n',)
    >>> only_grows(model, (("s", "d-"), ("n", "d"), ("s", "d+"), ("p", "d")))
    ()
    """
    if not model.definition:
        return ()
    throughout = conserved(model, itinerary)
    for surface, modes in _one_sided(model, itinerary):
        others = tuple(pair for pair in itinerary if pair[0] not in modes)
        mapped = [model.reset_at(*joint) for joint in itinerary if joint[0] in modes]
        if not others or any(mapped):
            continue
        still = conserved(model, others)
        if np.all(np.abs(still - still @ throughout.T @ throughout) < _ZERO):
            continue
        growing = _growing(model, still, surface, modes)
        if growing:
            return growing
    return ()


def _one_sided(model: Model, itinerary: Itinerary) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield surfaces on which segments of an itinerary end, with the modes of it on one side of them."""
    named = dict.fromkeys(mode for mode, _ in itinerary)
    for surface in dict.fromkeys(exit_ for _, exit_ in itinerary if exit_ in model.surface_by_name):
        sides = {m: {d.signs.get(surface, 0) for d in model.domains_of(m)} for m in named}
        for side in (1, -1):
            modes = tuple(mode for mode, own in sides.items() if own == {side})
            if modes:
                yield surface, modes


def _growing(
    model: Model, still: FloatArray, surface: str, modes: tuple[str, ...]
) -> tuple[str, ...]:
    """Return the modes in which a combination of some functions grows and falls in none; empty if none does.

    Parameters
    ----------
    still : the functions, which all other modes conserve
    modes : on one side of the surface; in each the rate must be a multiple of its height
    """
    if not len(still):
        return ()
    slopes, off, largest = [], [], 0.0
    for mode in modes:
        rates, heights = _rates_and_heights(model, mode, surface)
        if not len(heights):
            return ()
        changes = rates @ still.T
        slope = heights @ changes / (heights @ heights)
        slopes.append(slope)
        off.append(changes - np.outer(heights, slope))
        largest = max(largest, float(np.max(np.abs(heights))))
    left_over = np.vstack(off)
    _, sizes, right = np.linalg.svd(left_over, full_matrices=len(left_over) < len(still))
    explained = right[int(np.sum(sizes > _ZERO * largest)) :].T
    weights = _of_one_sign(np.array(slopes) @ explained)
    return tuple(mode for mode, weight in zip(modes, weights, strict=True) if weight > _ZERO)


@cache
def _rates_and_heights(model: Model, mode: str, surface: str) -> tuple[FloatArray, FloatArray]:
    """Return the rates at sampled states of a mode, and their heights over a surface."""
    found = sampled_states(model, mode)
    heights = [model.view(vector).height(surface, t, y) for vector, t, y, _ in found]
    return np.array([rate for *_, rate in found]), np.array(heights)


def _of_one_sign(columns: FloatArray) -> FloatArray:
    """Return a combination of columns without negative elements, whose sum is 1; zeros without one.

    Examples
    --------
    >>> _of_one_sign(np.array([[0.0], [-2.0]]))
    array([0., 1.])
    >>> _of_one_sign(np.array([[1.0], [-2.0]]))
    array([0., 0.])
    """
    none = np.zeros(len(columns))
    if not columns.size or np.max(np.abs(columns)) <= _ZERO:
        return none
    left, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    columns = left[:, sizes > _ZERO * sizes[0]]  # what is combined has as many directions
    if columns.shape[1] == 1:
        column = columns[:, 0] if np.max(columns) >= -np.min(columns) else -columns[:, 0]
        one_sign = np.min(column) >= -_ZERO * np.max(column)
        return np.maximum(column, 0.0) / np.sum(np.maximum(column, 0.0)) if one_sign else none
    linprog = whole("scipy.optimize").linprog

    found = linprog(
        np.zeros(columns.shape[1]),
        A_ub=-columns,
        b_ub=none,
        A_eq=columns.sum(axis=0)[None],
        b_eq=[1.0],
        bounds=(None, None),
    )
    return np.asarray(columns @ found.x) if found.status == 0 else none
