"""A flow with modes of chatter: what the engine asks of it (:mod:`contfric.flow.interface`), compiled.

In such a mode motion begins with infinitely many impacts (:mod:`contfric.flow.chatter`), and rests on the
wall from their limit on. All other modes are those of the flow that it is made from.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from contfric.compiled import (
    Kernel,
    allocating_helper,
    flow_signature,
    hit_signature,
    second_signature,
    stationary_signature,
)
from contfric.flow.chatter import (
    CHATTERING,
    LAYOUT,
    MOST_IMPACTS,
    TABLES,
    flight_at,
    fly,
    is_left,
    lift_side,
    limit_of,
)
from contfric.flow.layouts import FLOW
from contfric.handle import Block, Bound, with_handle

if TYPE_CHECKING:
    from contfric.flow.interface import CompiledFlow

#: Flights that are looked into for stationary points: those that follow are lower in proportion.
_LOOKED = 64
#: Share of the time to the limit in which nothing is looked for: no two events are told apart by less.
_REST_OF_TIME = 1e-10


@allocating_helper
def bouncing(motion, mode, t0, y0, dt, p, y1):  # type: ignore[no-untyped-def]
    """Write the state a time after an impact, which is before the limit: in one of the flights."""
    none, nothing, empty = np.empty(0, dtype=np.int64), np.empty((0, 0)), np.empty(0)
    t, y, before = t0, y0.copy(), y0.copy()
    for _ in range(MOST_IMPACTS):
        from_t, before[:] = t, y
        flight, _side = flight_at(motion, mode, t, y, p, none, empty)
        tau = fly(motion, mode, t, y, p, none, nothing)
        if not tau > 0.0:
            return
        if t + tau >= t0 + dt:
            motion.flow(flight, from_t, before, t0 + dt - from_t, p, none, y1, nothing)
            return
        t += tau
        y1[:] = y


def flow(motion, mode, t0, y0, dt, p, which, y1, jac):  # type: ignore[no-untyped-def]
    """Advance a state by ``dt`` (``flow_signature``); no number where the impacts have no limit.

    Without derivatives the state before the limit is that in flight: for those who look at the motion.
    """
    if motion.flights[mode] < 0:
        motion.flow(mode, t0, y0, dt, p, which, y1, jac)
        return
    n, rows, k = y0.shape[0], jac.shape[0], which.shape[0]
    limit, by = np.empty(1 + n), np.empty((1 + n if rows > 0 else 0, 1 + n + k))
    if limit_of(motion, mode, t0, y0, p, which, limit, by) < 0.0:
        y1[:] = np.nan
        for i in range(rows):
            jac[i, :] = np.nan
        return
    left = dt - (limit[0] - t0)
    if rows == 0 and left < 0.0 <= dt:
        limit_state = limit[1:]
        y1[:] = limit_state
        bouncing(motion, mode, t0, y0, dt, p, y1)
        return
    own = np.empty((rows, 2 + n + k if rows > 0 else 0))
    motion.flow(mode, limit[0], limit[1:], left, p, which, y1, own)
    for i in range(rows):
        jac[i, 1 + n] = own[i, 1 + n]
        for j in range(1 + n + k):
            total = (own[i, 0] - own[i, 1 + n]) * by[0, j]
            if j == 0:
                total += own[i, 1 + n]
            if j > n:
                total += own[i, 1 + j]
            for a in range(n):
                total += own[i, 1 + a] * by[1 + a, j]
            jac[i, j if j <= n else 1 + j] = total


@allocating_helper
def hit_in_flights(motion, mode, c, target, t0, y0, within, p, y1):  # type: ignore[no-untyped-def]
    """Return the first time within which an observable takes a value between impacts; -1 if it does not."""
    none, nothing, empty = np.empty(0, dtype=np.int64), np.empty((0, 0)), np.empty(0)
    t, y, before = t0, y0.copy(), y0.copy()
    for _ in range(MOST_IMPACTS):
        flight, _side = flight_at(motion, mode, t, y, p, none, empty)
        if t >= t0 + within * (1.0 - _REST_OF_TIME):
            break
        before[:] = y
        tau = fly(motion, mode, t, y, p, none, nothing)
        if not tau > 0.0:
            break
        longest = min(tau, t0 + within - t)
        at = motion.hit(flight, c, target, False, t, before, longest, p, y1)
        if at >= 0.0:
            return t - t0 + at
        t += tau
    return -1.0


def hit(motion, mode, c, target, on, t0, y0, dt_max, p, y1):  # type: ignore[no-untyped-def]
    """Return the first time at which an observable takes a value (``hit_signature``).

    What lets the mass go counts only when it has come to rest; the wall is met all the time.
    """
    if motion.flights[mode] < 0:
        return motion.hit(mode, c, target, on, t0, y0, dt_max, p, y1)
    none = np.empty(0, dtype=np.int64)
    if c == motion.gaps[mode] and target == motion.level(motion.walls[mode], p, none, np.empty(0)):
        return -1.0  # another level of the same observable is another wall
    limit, nothing = np.empty(1 + y0.shape[0]), np.empty((0, 0))
    if limit_of(motion, mode, t0, y0, p, none, limit, nothing) < 0.0:
        return -1.0
    rests = limit[0] - t0
    if lift_side(motion, mode, c) != 0:
        if is_left(motion, mode, limit[0], limit[1:], p, none, np.empty(0)):
            return -1.0  # it does not stay
    else:
        at = hit_in_flights(motion, mode, c, target, t0, y0, min(rests, dt_max), p, y1)
        if at >= 0.0:
            return at
    if dt_max <= rests:
        return -1.0
    at = motion.hit(mode, c, target, False, limit[0], limit[1:], dt_max - rests, p, y1)
    return rests + at if at >= 0.0 else -1.0


@allocating_helper
def turning_in_flights(motion, mode, c, t0, y0, within, p, times, values):  # type: ignore[no-untyped-def]
    """Write the stationary points of an observable in the flights, and its values at the impacts.

    Of the gap those of flights that are higher than all before, and of those that come near the wall between
    two impacts: how high the others are, lower and lower, is no distance from another motion.
    """
    none, empty, nothing = np.empty(0, dtype=np.int64), np.empty(0), np.empty((0, 0))
    t, y, before = t0, y0.copy(), y0.copy()
    found, most, gap = 0, times.shape[0], c == motion.gaps[mode]
    highest = np.full(2, -np.inf)  # by sides
    for _ in range(_LOOKED):
        before[:] = y
        flight, side = flight_at(motion, mode, t, y, p, none, empty)
        tau = fly(motion, mode, t, y, p, none, nothing)
        if not tau > 0.0 or t + tau >= t0 + within:
            break
        own = motion.stationary(flight, c, t, before, tau, p, times[found:], values[found:])
        if own < 0 or found + own + 1 > most:
            return -1
        if gap and own == 1:
            if side * values[found] > highest[(1 + side) // 2]:
                highest[(1 + side) // 2] = side * values[found]
            else:
                own = 0
        for i in range(found, found + own):
            times[i] += t - t0
        found += own
        t += tau
        if not gap:
            times[found], values[found] = t - t0, motion.observe(c, t, y, p, none, empty)
            found += 1
    return found


def stationary(motion, mode, c, t0, y0, dt, p, times, values):  # type: ignore[no-untyped-def]
    """Write the stationary points of an observable and return their number (``stationary_signature``).

    Those of what lets the mass go are those at rest, with its value where rest begins.
    """
    if motion.flights[mode] < 0:
        return motion.stationary(mode, c, t0, y0, dt, p, times, values)
    n, found = y0.shape[0], 0
    limit, nothing = np.empty(1 + n), np.empty((0, 0))
    none, empty = np.empty(0, dtype=np.int64), np.empty(0)
    if limit_of(motion, mode, t0, y0, p, none, limit, nothing) < 0.0 or times.shape[0] < 1:
        return -1
    rests = limit[0] - t0
    if lift_side(motion, mode, c) != 0:
        times[0], values[0] = rests, motion.observe(c, limit[0], limit[1:], p, none, empty)
        found = 1
    else:
        found = turning_in_flights(motion, mode, c, t0, y0, min(rests, dt), p, times, values)
    if found < 0 or c == motion.gaps[mode] or dt <= rests:
        return found
    own = motion.stationary(
        mode, c, limit[0], limit[1:], dt - rests, p, times[found:], values[found:]
    )
    if own < 0:
        return -1
    for i in range(found, found + own):
        times[i] += rests
    return found + own


def second(motion, mode, c, t0, y0, d, p, which, along, jac, workspace):  # type: ignore[no-untyped-def]
    """Write second derivatives (``second_signature``); none of chatter."""
    if motion.flights[mode] >= 0 and c < 0:
        return 0
    return motion.second(mode, c, t0, y0, d, p, which, along, jac, workspace)


KERNELS = {
    "flow": Kernel(flow, with_handle(flow_signature, CHATTERING)),
    "hit": Kernel(hit, with_handle(hit_signature, CHATTERING)),
    "stationary": Kernel(stationary, with_handle(stationary_signature, CHATTERING)),
    "second": Kernel(second, with_handle(second_signature, CHATTERING)),
}


@dataclass(frozen=True)
class ChatterMode:
    """A mode of chatter in the numbers of a flow.

    Attributes
    ----------
    mode, flight : the mode, and that between the impacts
    gap, wall : observable of the gap, and its surface
    side : side of the wall on which flights are
    lift : observable whose sign changes where the wall's force vanishes
    other, other_lift : the same on the other side where impacts pass the surface, else -1
    """

    mode: int
    flight: int
    gap: int
    wall: int
    side: int
    lift: int
    other: int = -1
    other_lift: int = -1


def with_chatter(flow: CompiledFlow, modes: int, chatters: Sequence[ChatterMode]) -> CompiledFlow:
    """Return a flow whose modes of chatter begin with infinitely many impacts.

    Parameters
    ----------
    flow : in which these modes are contact alone
    modes : how many there are
    """
    from contfric.flow.without import no_second

    tables = {name: np.full(modes, -1) for name in TABLES}
    for own in chatters:
        row = (own.flight, own.gap, own.wall, own.side, own.lift, own.other, own.other_lift)
        for name, value in zip(TABLES, row, strict=True):
            tables[name][own.mode] = value
    values: dict[str, Any] = {name: getattr(flow, name) for name in FLOW} | dict(tables)
    followed = {name: value for name, value in values.items() if name != "stationary"}
    blocks: Mapping[str, Block] = {
        "flow": (moving := Block(LAYOUT, followed)),
        "hit": moving,
        "stationary": Block(LAYOUT, values),
        "second": Block(LAYOUT, {**tables, "second": flow.second or no_second}),
    }
    changed: dict[str, Any] = {name: Bound(KERNELS[name], block) for name, block in blocks.items()}
    return replace(flow, **changed, made_of=None)
