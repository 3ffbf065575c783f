"""A segment that begins with infinitely many impacts, as the smooth pieces that quantities are measured on.

Flights, until they are too low to count, and then the contact, drawn back to the end of the last of them.
Left out are flights of speeds below ``_SLOWEST`` times the first: its square in heights and integrals.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from contfric.errors import ContfricError

if TYPE_CHECKING:
    from contfric.base.arrays import FloatArray
    from contfric.models.parts import Chatter
    from contfric.quantities.motion import MeasuredSegment

#: Flights of lower speeds, as a share of the first, are left out: they change integrals by 1e-15.
_SLOWEST = 1e-5
#: Periods (or units of time) that a flight is looked for in.
_LONGEST = 64.0
_EMPTY, _NOTHING = np.empty(0), np.empty((0, 0))


def pieces(segment: MeasuredSegment, own: Chatter) -> Iterator[MeasuredSegment]:
    """Yield the flights of a segment of chatter, then its contact."""
    model, vector = segment.model, segment.vector
    view = model.view(vector)
    gap = model.surface_by_name[own.surface].observable
    level, longest = view.level(own.surface), _LONGEST * (view.period or 1.0)
    first, part = 0.0, segment
    side = model.domains_of(own.flight)[0].signs[own.surface]
    while True:
        speed = view.rate(own.flight, gap, part.start, part.state)
        flight = own.flight if not own.other or speed * side > 0.0 else own.other
        speed = abs(speed)
        first = max(first, speed)
        if speed <= _SLOWEST * first:
            break
        hit = view.first(flight, gap, level, part.start, part.state, longest, on=True)
        if hit is None:
            raise ContfricError(f"the impacts at '{own.surface}' do not come to rest")
        flown, part = _flight(part, flight, own.surface, hit[0])
        yield flown
    yield _contact(part, segment)


def _flight(
    part: MeasuredSegment, mode: str, wall: str, lasts: float
) -> tuple[MeasuredSegment, MeasuredSegment]:
    """Return one flight, and what follows the impact that ends it."""
    model, vector, n = part.model, part.vector, len(part.state)
    k, end = model.surface_index[wall], part.start + lasts
    gap = model.surface_by_name[wall].observable
    if not part.exact:
        state = model.view(vector).state(mode, part.start, part.state, lasts)
        after = model.view(vector).reset(wall, end, state)
        return replace(part, mode=mode, lasts=lasts), replace(part, start=end, state=after)
    before, moved, by_time = _moved(part, mode, lasts)
    every = np.arange(len(vector))
    grad, slope = np.empty(1 + n + len(every)), np.empty(len(every))
    model.flow.observe(model.observable_index[gap], end, before, vector, every, grad)
    model.flow.level(k, vector, every, slope)
    rate = grad[0] + grad[1 : 1 + n] @ by_time
    height = (
        grad[0] * part.d_start + grad[1 : 1 + n] @ moved + (grad[1 + n :] - slope) @ part.d_vector
    )
    d_lasts = -height / rate
    joint = np.vstack([part.d_start + d_lasts, moved + np.outer(by_time, d_lasts)])
    after, jac = np.empty(n), np.empty((n, 1 + n + len(every)))
    model.flow.reset(k, end, before, vector, every, after, jac)
    d_after = jac[:, : 1 + n] @ joint + jac[:, 1 + n :] @ part.d_vector
    flight = replace(part, mode=mode, lasts=lasts, d_lasts=d_lasts)
    following = replace(part, start=end, state=after, d_start=joint[0], d_state=d_after)
    return flight, following


def _moved(
    part: MeasuredSegment, mode: str, lasts: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the state after a duration that is fixed, how it moves, and its derivative by the duration."""
    n, every = len(part.state), np.arange(len(part.vector))
    out, jac = np.empty(n), np.empty((n, 2 + n + len(every)))
    m = part.model.mode_index[mode]
    part.model.flow.flow(m, part.start, part.state, lasts, part.vector, every, out, jac)
    begin = np.vstack([part.d_start, part.d_state])
    return out, jac[:, : 1 + n] @ begin + jac[:, 2 + n :] @ part.d_vector, jac[:, 1 + n].copy()


def _contact(part: MeasuredSegment, whole: MeasuredSegment) -> MeasuredSegment:
    """Return the contact, drawn back to where ``part`` starts: with derivatives the flow does that."""
    own = whole if whole.exact else _still(whole)
    state, moved, by_time = _moved(own, whole.mode, part.start - whole.start)
    lasts = whole.start + whole.lasts - part.start
    if not whole.exact:
        return replace(part, state=state, lasts=lasts)
    d_state = moved + np.outer(by_time, part.d_start - whole.d_start)
    d_lasts = whole.d_start + whole.d_lasts - part.d_start
    return replace(part, state=state, d_state=d_state, lasts=lasts, d_lasts=d_lasts)


def _still(part: MeasuredSegment) -> MeasuredSegment:
    """Return a piece in one direction in which nothing moves."""
    return replace(
        part,
        d_start=np.zeros(1),
        d_state=np.zeros((len(part.state), 1)),
        d_vector=np.zeros((len(part.vector), 1)),
    )
