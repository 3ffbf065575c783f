"""Decides ahead whether the next impacts come to rest (chatter), where that is possible.

A mode of chatter begins with the first of infinitely many impacts, so after an impact the later ones are
looked at, over many periods. Impacts that do not come to rest are thrown off, go on for ever, or meet another
wall. Whichever it is, the look ahead has seen it: it says after how many impacts the question is open again,
and none of those between asks. So all looks ahead together follow each flight about once more.
"""

from __future__ import annotations

from contfric.compiled import helper
from contfric.flow.chatter import FASTER, LONGEST, MOST_IMPACTS, SHARE
from contfric.simulation.tables import MAPPED

#: Impacts with this share of the largest speed before are not followed one by one any more: their limit is
#: asked for. It is less than what that takes (eight speeds, each at most half of the one before), so this
#: decides how long a look ahead takes, and not what it finds.
_SLOW = 1e-3
#: Impacts in a row whose fastest is compared with that of as many before: a cycle without excitation is seen
#: after 500, where 10,000 took seconds.
_ROW = 250
#: What remains of it at least where impacts are slow within ``MOST_IMPACTS``, a constant restitution given.
_SHARE_OF_ROW = _SLOW ** (_ROW / MOST_IMPACTS)


@helper
def impacts_ahead(functions, tables, chatter, surface, t, y, p, unit, workspace):  # type: ignore[no-untyped-def]
    """Return (number of impacts looked at, whether they became slow).

    Impacts that have not become slow are thrown off, or meet another wall, where the count ends; or they go
    on for longer than any chatter. ``workspace.after`` is written over.
    """
    none, empty, nothing = workspace.none, workspace.empty, workspace.nothing
    state, struck_at, c = workspace.after, workspace.trial, tables.observables[surface]
    above, below = tables.flights[chatter], tables.flights[tables.flights.shape[0] // 2 + chatter]
    level = functions.level(surface, p, none, empty)
    excited = functions.period(p, none, empty) > 0.0
    for j in range(y.shape[0]):
        state[j] = y[j]
    side = 1.0 if functions.rate(above, c, t, y, p, none, empty) > 0.0 else -1.0
    highest, before, elapsed = 0.0, -1.0, 0.0
    fastest, fastest_before = 0.0, 0.0
    for count in range(MOST_IMPACTS):
        rate = functions.rate(above, c, t + elapsed, state, p, none, empty)
        speed = side * rate if below < 0 else abs(rate)
        if 0.0 <= before < SHARE * highest and speed > FASTER * before:
            return count, False
        if excited and elapsed > LONGEST * unit:
            return count, False
        if count % _ROW == 0:
            if count > _ROW and fastest > _SHARE_OF_ROW * fastest_before:
                return count, False
            fastest, fastest_before = 0.0, fastest
        highest, before, fastest = max(highest, speed), speed, max(fastest, speed)
        if not speed > _SLOW * highest:
            return 1 + count, True
        flight = above if below < 0 or rate >= 0.0 else below
        within, now = LONGEST * unit, t + elapsed
        tau = functions.hit(flight, c, level, True, now, state, within, p, struck_at)
        if not tau > 0.0 or meets_another(
            functions, tables, flight, surface, now, state, tau, p, workspace
        ):
            return 1 + count, False
        elapsed += tau
        functions.reset(surface, t + elapsed, struck_at, p, none, state, nothing)
    return MOST_IMPACTS, False


@helper
def meets_another(functions, tables, mode, surface, t, y, tau, p, workspace):  # type: ignore[no-untyped-def]
    """Tell whether a flight between two impacts meets another wall; else ``workspace.trial`` is its end."""
    none, looked = workspace.none, False
    for k in range(tables.observables.shape[0]):
        if k == surface or tables.bounds[mode, k] != MAPPED:
            continue
        looked, level = True, functions.level(k, p, none, workspace.empty)
        c = tables.observables[k]
        if functions.hit(mode, c, level, False, t, y, tau, p, workspace.trial) >= 0.0:
            return True
    if looked:
        functions.flow(mode, t, y, tau, p, none, workspace.trial, workspace.nothing)
    return False


@helper
def is_left(tables, chatter, met):  # type: ignore[no-untyped-def]
    """Tell whether contact ends at a surface (-1: none): the wall lets go, or another one throws it off."""
    if met < 0:
        return False
    rules = chatter * tables.observables.shape[0] + met
    thrown = tables.bounds[chatter, met] == MAPPED and tables.first[rules + 1] > tables.first[rules]
    return tables.bounds[chatter, met] == 1 or thrown


@helper
def still_bounced(tables, mode, target, bounced):  # type: ignore[no-untyped-def]
    """Return 1 + the wall that was met last where impacts at it go on alike after another event, else 0.

    They do where it leads into the same flight: a section of the phase, or one within a smooth field.
    """
    if bounced <= 0 or target < 0:
        return 0
    chatter = tables.chatters[mode, bounced - 1]
    return bounced if chatter >= 0 and tables.chatters[target, bounced - 1] == chatter else 0
