"""Surfaces that a solution meets together, to rounding: which mode follows, compiled."""

from __future__ import annotations

from contfric.compiled import helper
from contfric.models.parts import MOST_SURFACES

#: Distance, relative to 1 + its level, within which a surface is met together with another one: far above
#: what rounding leaves of the same solution, far below what tells two events apart.
_TOGETHER = 1e-12


@helper
def _rule_but(tables, mode, surface, code, together):  # type: ignore[no-untyped-def]
    """Return the mode by the sides of all surfaces but some; -1 if none follows, or there are none."""
    place = mode * tables.observables.shape[0] + surface
    for k in range(tables.first[place], tables.first[place + 1]):
        if together and (code ^ tables.rules[k, 1]) & tables.rules[k, 0] & ~together == 0:
            return tables.rules[k, 2]
    return -1


@helper
def mode_together(functions, tables, mode, surface, code, t, y, p, workspace):  # type: ignore[no-untyped-def]
    """Return the mode that follows where motion meets other surfaces with this one; -1 if none does.

    Friction elements that turned together reach their limits together. On which side of those the state lies
    is rounding; each ends the mode that follows, at once. Surfaces that do not bound the mode come second: an
    element that has stopped at its limit stands there, to rounding, until something else moves.
    """
    none, empty, together, others = workspace.none, workspace.empty, 0, 0
    for k in range(min(tables.observables.shape[0], MOST_SURFACES)):
        if k != surface:
            level = functions.level(k, p, none, empty)
            value = functions.observe(tables.observables[k], t, y, p, none, empty)
            if abs(value - level) <= _TOGETHER * (1.0 + abs(level)):
                if tables.bounds[mode, k] == 1:
                    together |= 1 << k
                else:
                    others |= 1 << k
    found = _rule_but(tables, mode, surface, code, together)
    return found if found != -1 else _rule_but(tables, mode, surface, code, together | others)
