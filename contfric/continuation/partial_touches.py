"""Orbits of several periods that cross a surface in some of them only, where an orbit of one touches it.

A mass between a free flight and a preloaded stop is smooth on the one side of a grazing, so that it may have
no joint there: the two forms of a period cannot be put one after the other. But over m periods the form that
crosses has m passages of no length, and any of them may be left out, if not all.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from contfric.continuation.candidates import Candidate, along_motion
from contfric.continuation.events import Bifurcation
from contfric.continuation.incident import Form, Incident, edited_whole, incident_forms
from contfric.continuation.outcomes import Outcome
from contfric.continuation.sequences import MOST_SEQUENCES, count, necklaces
from contfric.continuation.touching import crossed_at, speeds_of_crossing
from contfric.errors import NotationError
from contfric.orbit.orbit import Orbit
from contfric.orbit.slides import SHORT, time_unit
from contfric.orbit.system import EventFunction, Margin
from contfric.signature.edits import Edit


def is_crossed(bifurcation: Bifurcation) -> bool:
    """Tell whether an event is the touch of a surface that is crossed beyond it."""
    whole = bifurcation.orbit.as_whole()
    return any(crossed_at(whole, test) for test in bifurcation.tests)


def partial_touches(
    bifurcation: Bifurcation, most_periods: int, copies: int
) -> Iterator[Candidate]:
    """Yield orbits of several periods in which a surface that an orbit touches is crossed in some of them.

    Parameters
    ----------
    most_periods, copies : longest orbits, in periods, and in copies of the one at the event
    """
    incident = incident_forms(bifurcation)
    if len(incident.forms) != 1 or incident.unit.half:
        return
    (form,) = incident.forms
    for length in range(2, min(copies, most_periods // incident.unit.periods) + 1):
        if count(2, length) > MOST_SEQUENCES:
            return
        for kept in necklaces(2, length):
            if 0 < sum(kept) < length:
                reason = f"crossed in {sum(kept)} of {length} periods"
                yield from _candidate(incident, form, kept, reason)


def _candidate(
    incident: Incident, form: Form, kept: tuple[int, ...], reason: str
) -> Iterator[Candidate]:
    orbit, _ = incident.unit.orbit((form,) * len(kept))
    whole = orbit.as_whole()
    passages = _passages(whole)
    if len(passages) != len(kept):
        return
    n, away, dropped = len(whole.itinerary), np.zeros(len(whole.itinerary)), set()
    for k, stays in zip(passages, kept, strict=True):
        if stays:
            away[k], away[(k + 1) % n] = speeds_of_crossing(whole, k)
        else:
            dropped |= {k, (k + 1) % n}
    try:
        edited, moves = edited_whole(whole, [Outcome(Edit(frozenset(dropped)), {}, reason)], away)
    except NotationError as error:
        yield Candidate(reason, None, str(error))
        return
    yield Candidate(
        reason, edited, away=along_motion(edited, moves), itineraries=frozenset({edited.itinerary})
    )


def _passages(whole: Orbit) -> list[int]:
    """Return the segments of no length beyond a surface that is crossed there and back."""
    lasts, n = whole.ends[:, 0] - whole.begins[:, 0], len(whole.itinerary)
    model, found = whole.model, []
    for k, (_, surface) in enumerate(whole.itinerary):
        before, behind = whole.itinerary[k - 1], whole.itinerary[(k + 1) % n]
        same = model.whole_mode(before[0]) == model.whole_mode(behind[0])
        touch = EventFunction(Margin.EXIT, k, surface)
        short = lasts[k] < SHORT * time_unit(whole)
        if same and short and before[1] == surface and crossed_at(whole, touch):
            found.append(k)
    return found
