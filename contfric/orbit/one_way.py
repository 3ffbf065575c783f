"""Words in which something only ever grows, such as the offset of a slider that slips to one side only.

A linear function ``w . y`` whose rate is, along some modes, the height of a surface on whose positive side
all of these lie, and zero along all others, grows whenever a motion is in one of them. It is the same after
a period, so that they last for no time: what solves the equations of such an itinerary are the orbits of the
itinerary without these modes that just touch their limit, for every value of the parameter.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np

from contfric.models.definition import FloatArray, Model
from contfric.orbit.conserved import conserved, sampled_states
from contfric.orbit.system import Itinerary

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
    for surface, modes in _one_sided(model, itinerary):
        others = tuple(pair for pair in itinerary if pair[0] not in modes)
        mapped = [model.reset_at(*joint) for joint in itinerary if joint[0] in modes]
        if not others or any(mapped):
            continue
        still = conserved(model, others)
        if len(still) > len(conserved(model, itinerary)) and _explained(
            model, still, surface, modes
        ):
            return modes
    return ()


def _one_sided(model: Model, itinerary: Itinerary) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield surfaces on which segments of an itinerary end, and its modes, where these lie on one side."""
    named = dict.fromkeys(mode for mode, _ in itinerary)
    for surface in dict.fromkeys(exit_ for _, exit_ in itinerary if exit_ in model.surface_by_name):
        sides = {m: {d.signs.get(surface, 0) for d in model.domains_of(m)} for m in named}
        on_one = {mode: min(own) for mode, own in sides.items() if len(own) == 1 and own != {0}}
        if len(set(on_one.values())) == 1:
            yield surface, tuple(on_one)


def _explained(model: Model, still: FloatArray, surface: str, modes: tuple[str, ...]) -> bool:
    """Tell whether the rate of a combination of some functions is the height of a surface in some modes."""
    changes, heights = [], []
    for mode in modes:
        for vector, t, y, rate in sampled_states(model, mode):
            changes.append(still @ rate)
            heights.append(model.view(vector).height(surface, t, y))
    if not changes:
        return False
    weights = np.linalg.lstsq(np.array(changes), np.array(heights), rcond=None)[0]
    off = np.array(changes) @ weights - heights
    return bool(np.max(np.abs(off)) < _ZERO * np.max(np.abs(heights)))
