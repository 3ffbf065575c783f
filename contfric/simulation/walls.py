"""Tests at a wall: whether a mass is pressed to it, in flight, or at rest on it."""

from __future__ import annotations

from contfric.compiled import helper

#: Events within this share of a period follow each other at once; more of them in a row than this do
#: not come to an end (a stop, a release and a reversal may fall together, twice).
NO_TIME, MOST_AT_ONCE = 1e-12, 16
#: The same where impacts chatter: a mass that bounces to less than rounding of its displacement (1e-16)
#: is in flight for the root of that, and never for less.
NO_FLIGHT = 1e-7
#: A mass nearer to its wall than this, and slower (relative to 1 + its state), rests there: far more than the
#: error of a contact that is integrated (1e-12), less than the speed of the shortest flight.
_RESTS = 1e-9


@helper
def is_pressed(functions, tables, mode, surface, following, t, before, y, p, unit, workspace):  # type: ignore[no-untyped-def]
    """Tell whether a state after an impact is driven back at once: its next flight is too short to resolve.

    It is if the mean rate of the gap over the shortest flight does not lead away from the wall. Impacts
    with a small restitution come to that before there are many, one without restitution at once; a first
    hit would be searched on the other side of the wall.
    """
    if tables.walls >> surface & 1 == 0:
        return False  # the reset leads elsewhere
    c, none, empty = tables.observables[surface], workspace.none, workspace.empty
    toward = functions.rate(mode, c, t, before, p, none, empty)
    h = NO_FLIGHT * unit
    away = functions.rate(following, c, t, y, p, none, empty)
    functions.flow(following, t, y, h, p, none, workspace.trial, workspace.nothing)
    later = functions.rate(following, c, t + h, workspace.trial, p, none, empty)
    return (away + later) * toward > 0.0


@helper
def is_crossed(functions, tables, mode, surface, t, y, p, unit, workspace):  # type: ignore[no-untyped-def]
    """Tell whether motion goes through a surface that no mode is behind, and does not only touch it.

    Where some mode is, for other sides of other surfaces, these may be rounding: motion goes on. Over the
    shortest flight the rate of a crossing hardly changes. A touch is found to the root of rounding: its rate
    is a tenth of that flight's change at most.
    """
    rules = mode * tables.observables.shape[0] + surface
    if tables.flights[mode] >= 0 or tables.first[rules + 1] > tables.first[rules]:
        return False
    c, none, empty = tables.observables[surface], workspace.none, workspace.empty
    here, h = functions.rate(mode, c, t, y, p, none, empty), NO_FLIGHT * unit
    functions.flow(mode, t, y, h, p, none, workspace.trial, workspace.nothing)
    later = functions.rate(mode, c, t + h, workspace.trial, p, none, empty)
    return abs(later - here) < 0.1 * abs(here)


@helper
def in_flight(functions, tables, mode, wall, t, y, p, workspace):  # type: ignore[no-untyped-def]
    """Tell whether a state in a mode of chatter is between impacts still, and not at rest on the wall."""
    c, none, empty, size = tables.observables[wall], workspace.none, workspace.empty, 1.0
    for j in range(y.shape[0]):
        size = max(size, abs(y[j]))
    gap = functions.observe(c, t, y, p, none, empty) - functions.level(wall, p, none, empty)
    speed = functions.rate(tables.flights[mode], c, t, y, p, none, empty)
    return max(abs(gap), abs(speed)) > _RESTS * size


@helper
def lying_on(functions, tables, t, y, p, workspace):  # type: ignore[no-untyped-def]
    """Return the surfaces that a state is on to rounding, as bits."""
    found = 0
    for k in range(tables.observables.shape[0]):
        value = functions.observe(tables.observables[k], t, y, p, workspace.none, workspace.empty)
        level = functions.level(k, p, workspace.none, workspace.empty)
        if abs(value - level) <= NO_TIME * (1.0 + abs(level)):
            found |= 1 << k
    return found


@helper
def walls_of(tables):  # type: ignore[no-untyped-def]
    """Return 1 if a model has resets, in any of its modes."""
    for mode in range(tables.bounds.shape[0]):
        for k in range(tables.bounds.shape[1]):
            if tables.bounds[mode, k] == 2:
                return 1
    return 0
