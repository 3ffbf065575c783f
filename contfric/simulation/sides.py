"""On which side of every surface a state is, and which mode follows by that; compiled."""

from __future__ import annotations

from contfric.compiled import helper
from contfric.models.parts import MOST_SURFACES


@helper
def sign_code(functions, observables, landed, t, y, p, none, empty):  # type: ignore[no-untyped-def]
    """Return the sides of all surfaces but those that the state is on, as bits."""
    code, observed, value = 0, -1, 0.0
    for k in range(min(observables.shape[0], MOST_SURFACES)):
        if landed >> k & 1:
            continue
        if observables[k] != observed:  # surfaces of one observable stand together
            observed = observables[k]
            value = functions.observe(observed, t, y, p, none, empty)
        if value > functions.level(k, p, none, empty):
            code |= 1 << k
    return code


@helper
def mode_after(tables, mode, surface, code):  # type: ignore[no-untyped-def]
    """Return the mode that follows where motion meets a surface, by the sides of all; -1 if none does.

    A number below that stands for a mode that was not visited yet
    (:mod:`contfric.simulation.growing_tables`).
    """
    place = mode * tables.observables.shape[0] + surface
    for k in range(tables.first[place], tables.first[place + 1]):
        if code & tables.rules[k, 0] == tables.rules[k, 1]:
            return tables.rules[k, 2]
    return -1


@helper
def surfaces_after(tables, mode, surface):  # type: ignore[no-untyped-def]
    """Return the surfaces that the state is on when motion in a mode has met one, as bits."""
    return tables.landed[mode, surface] | (tables.lies_on[mode] & tables.kept[mode, surface])


@helper
def flight_of(functions, tables, mode, wall, t, y, p, workspace):  # type: ignore[no-untyped-def]
    """Return the mode of a state between the impacts of a chatter: the part of the flight that it is in."""
    none, empty = workspace.none, workspace.empty
    code = sign_code(functions, tables.observables, 0, t, y, p, none, empty)
    flight, below = tables.flights[mode], tables.flights[tables.flights.shape[0] // 2 + mode]
    if below >= 0 and code >> wall & 1 == 0:
        flight = below
    for k in range(tables.observables.shape[0]):
        if tables.bounds[mode, k] == 1 and leads_to(tables, mode, k, flight):
            # left by it, a mode of chatter is followed by one of these parts
            following = mode_after(tables, mode, k, code)
            if following >= 0 and tables.flights[following] < 0:
                return following
    return flight


@helper
def leads_to(tables, mode, surface, target):  # type: ignore[no-untyped-def]
    """Tell whether a mode may be left for another one where it meets a surface."""
    place = mode * tables.observables.shape[0] + surface
    for k in range(tables.first[place], tables.first[place + 1]):
        if tables.rules[k, 2] == target:
            return True
    return False
