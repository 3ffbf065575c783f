"""Surfaces that a solution meets together, to rounding: which mode follows, compiled."""

from __future__ import annotations

from contfric.compiled import helper
from contfric.models.parts import MOST_SURFACES

#: Distance, relative to 1 + its level, within which a surface is met together with another one: far above
#: what rounding leaves of the same solution, far below what tells two events apart.
_TOGETHER = 1e-12


@helper
def mode_together(functions, tables, mode, surface, code, t, y, p, workspace):  # type: ignore[no-untyped-def]
    """Return the mode that follows where motion meets other surfaces with this one; -1 if none does.

    Friction elements that turned together reach their limits together. On which side of those the state lies
    is rounding; each ends the mode that follows, at once.
    """
    none, empty, together = workspace.none, workspace.empty, 0
    for k in range(min(tables.observables.shape[0], MOST_SURFACES)):
        if k != surface and tables.bounds[mode, k] == 1:
            level = functions.level(k, p, none, empty)
            value = functions.observe(tables.observables[k], t, y, p, none, empty)
            if abs(value - level) <= _TOGETHER * (1.0 + abs(level)):
                together |= 1 << k
    place = mode * tables.observables.shape[0] + surface
    for k in range(tables.first[place], tables.first[place + 1]):
        if together and (code ^ tables.rules[k, 1]) & tables.rules[k, 0] & ~together == 0:
            return tables.rules[k, 2]
    return -1
