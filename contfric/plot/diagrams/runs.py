"""A branch cut into stable and unstable runs, exactly at its bifurcations."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import compress, pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.quantities.extreme import integrated
from contfric.quantities.registry import NAMED, quantity_of

if TYPE_CHECKING:
    from contfric.continuation.branch import Branch
    from contfric.events.bifurcation import Bifurcation
    from contfric.orbit.orbit import Orbit
    from contfric.quantities.registry import QuantityLike

#: In units of the length of the branch: a point this near to an event is the event.
_SAME = 1e-9


@dataclass(frozen=True)
class StabilityRun:
    """Part of a branch with one stability: x has shape (m,), y (m, quantities)."""

    stable: bool | None
    x: FloatArray
    y: FloatArray

    @property
    def line(self) -> tuple[FloatArray, FloatArray]:
        """All quantities as one line with gaps, x and y of shape (quantities (m + 1),)."""
        count = self.y.shape[1]
        if count == 1:
            return self.x, self.y[:, 0]
        gap = np.full((1, count), np.nan)
        x = np.append(self.x, np.nan)
        return np.tile(x, count), np.concatenate([self.y, gap]).T.ravel()


class _Vertex(NamedTuple):  # there is one for each point: cheaper than a dataclass
    arc: float
    x: float
    y: FloatArray
    before: bool | None
    after: bool | None
    located: bool


def quantity(source: Branch | Orbit, row: QuantityLike) -> FloatArray:
    """Return a quantity of a branch, shape (k, numbers), or of an orbit, (numbers,).

    What is not finite, such as multipliers of orbits with holds, is nan: nothing is drawn.
    """
    attribute = NAMED[row].attribute if isinstance(row, str) and row in NAMED else ""
    found = getattr(source, attribute) if attribute else source.quantity(row)
    values = np.asarray(found, dtype=np.float64)
    values = np.where(np.isfinite(values), values, np.nan)
    if hasattr(source, "values"):
        return values.reshape(len(values), -1)
    return np.atleast_1d(values)


def stability_runs(branch: Branch, row: QuantityLike) -> list[StabilityRun]:
    """Cut a branch where its stability changes.

    Consecutive runs share the point of change, which is the located bifurcation. A branch whose
    stability was not computed is one run with ``stable`` None; a bridge, which is nowhere stable,
    is one run too.
    """
    vertices, turns = _vertices(branch, row), _is_phase(branch, row)
    runs: list[StabilityRun] = []
    start = 0
    states = [False] * (len(vertices) - 1) if branch.bridge else list(_between(vertices))
    for k in range(1, len(states) + 1):
        if k == len(states) or states[k] is not states[start]:
            part = vertices[start : k + 1]
            x, y = np.array([v.x for v in part]), np.array([v.y for v in part])
            runs.append(StabilityRun(states[start], *(_cut_at_turns(x, y) if turns else (x, y))))
            start = k
    return runs


def _is_phase(branch: Branch, row: QuantityLike) -> bool:
    if isinstance(row, str) and row in NAMED:
        return False
    functional = integrated(quantity_of(row, branch.model))
    return functional is not None and functional.kind == "phase"


def _cut_at_turns(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a line of angles with gaps where they pass from one end of the turn to the other."""
    gaps = np.flatnonzero(np.abs(np.diff(y[:, 0])) > np.pi) + 1
    return np.insert(x, gaps, np.nan), np.insert(y, gaps, np.nan, axis=0)


def _vertices(branch: Branch, row: QuantityLike) -> list[_Vertex]:
    """Return points and located events in the order of the branch."""
    columns = threaded(quantity(branch, row))
    tolerance = _SAME * max(float(np.ptp(branch.arc)), 1e-300)
    events = [_event_vertex(branch, b, columns, row) for b in branch.bifurcations]
    points = list(_points(branch, columns))
    gaps = np.subtract.outer([v.arc for v in points], [v.arc for v in events])
    free = ~np.any(np.abs(gaps) <= tolerance, axis=1)
    return sorted([*events, *compress(points, free)], key=lambda v: v.arc)


def _points(branch: Branch, columns: FloatArray) -> Iterator[_Vertex]:
    stable = branch.stable
    positions = np.array([_position(branch, b) for b in branch.bifurcations])
    arcs, values = branch.arc.tolist(), branch.values.tolist()
    states = [None] * len(arcs) if stable is None else stable.tolist()
    for k, (arc, x, state) in enumerate(zip(arcs, values, states, strict=True)):
        yield _Vertex(arc, x, columns[k], state, state, False)
        if stable is None or k + 1 == len(columns) or state == states[k + 1]:
            continue
        after = float(branch.arc[k + 1])
        if not np.any((positions >= arc) & (positions <= after)):
            yield _change(branch, columns, k)


def _change(branch: Branch, columns: FloatArray, k: int) -> _Vertex:
    """Return the change between two points that no event explains, by linear interpolation."""
    assert branch.stable is not None and branch.turn_multipliers is not None
    size = np.abs(branch.turn_multipliers[k : k + 2]).max(axis=1) - 1.0
    w = float(size[0] / (size[0] - size[1])) if size[0] != size[1] else 0.5
    mix = [(1.0 - w) * a[k] + w * a[k + 1] for a in (branch.arc, branch.values, columns)]
    before, after = bool(branch.stable[k]), bool(branch.stable[k + 1])
    return _Vertex(float(mix[0]), float(mix[1]), np.asarray(mix[2]), before, after, True)


def _event_vertex(
    branch: Branch, event: Bifurcation, columns: FloatArray, row: QuantityLike
) -> _Vertex:
    # at the end of a branch the map from there on is another one, and multipliers jump: its own are drawn
    arc = _position(branch, event)
    near = np.array([np.interp(arc, branch.arc, column) for column in columns.T])
    known = np.isfinite(near) | (len(near) == 1)
    y = near.copy()
    if not (row == "multiplier" and any(end.bifurcation is event for end in branch.ends)):
        y[known] = aligned(counted(branch, event, quantity(event.orbit, row), near), near[known])
    x = event.params[branch.parameter]
    sides = event.stable_before, event.stable_after
    if event.kind.value != "SN" and _falls(branch, arc):  # told upward, but drawn along the branch
        sides = sides[1], sides[0]
    return _Vertex(arc, x, y, *sides, True)


def _falls(branch: Branch, arc: float) -> bool:
    """Tell whether the parameter falls along a branch at an arclength."""
    k = int(np.clip(np.searchsorted(branch.arc, arc), 1, len(branch.arc) - 1))
    return bool(branch.values[k] < branch.values[k - 1])


def _position(branch: Branch, event: Bifurcation) -> float:
    """Return the arclength of an event; one that ends the branch may come from another branch."""
    for side, end in enumerate(branch.ends):
        if end.bifurcation is event:
            return float(branch.arc[-side])
    return event.position


def counted(branch: Branch, event: Bifurcation, values: FloatArray, near: FloatArray) -> FloatArray:
    """Return a quantity of an event's orbit as a branch counts it, which has its value there near by.

    An orbit that doubles its period is the event's orbit, passed twice: an integral over it, or its period,
    is twice that of the event's orbit, and a mean is the same.
    """
    cycles = branch.system.periods / event.orbit.periods
    if len(values) != 1 or len(near) != 1 or not np.isfinite(near[0]) or not cycles > 1.0:
        return values
    several = cycles * values
    return several if abs(several[0] - near[0]) < abs(values[0] - near[0]) else values


def threaded(rows: FloatArray) -> FloatArray:
    """Return lists of numbers, one in each row, with a column for each number that goes on from row to row.

    Lists are cyclic, as stops in the order of an orbit, and end with nan. Where a list is longer by two than
    the one before, or shorter, two neighbours appear or vanish; any other change begins with new columns.

    Examples
    --------
    >>> threaded(np.array([[1.0, 5.0, np.nan, np.nan], [5.1, 2.0, 2.1, 1.1]]))
    array([[1. , 5. , nan, nan],
           [1.1, 5.1, 2. , 2.1]])
    """
    if rows.shape[1] == 1:
        return rows
    if np.all(np.isfinite(rows)):
        turned = [np.roll(rows[:-1], k, axis=1) for k in range(rows.shape[1])]
        apart = np.array([np.sum((rows[1:] - other) ** 2, axis=1) for other in turned])
        if np.all(apart[0] <= apart.min(axis=0)):
            return rows  # most of them
    lists = [row[np.isfinite(row)] for row in rows]
    columns: list[list[int]] = []
    count, last, own = 0, np.empty(0), list[int]()
    for values in lists:
        kept, new = _followed(last, values)
        own = [own[k] if k >= 0 else count + new.index(i) for i, k in enumerate(kept)]
        count += len(new)
        columns.append(own)
        last = values
    found = np.full((len(rows), max(count, 1)), np.nan)
    for k, (values, own) in enumerate(zip(lists, columns, strict=True)):
        found[k, own] = values
    return found


def _followed(last: FloatArray, values: FloatArray) -> tuple[list[int], list[int]]:
    """Return which of the last list each number of a cyclic one goes on from; -1 if none, and those."""
    n, m = len(last), len(values)
    every = list(range(m))
    if abs(n - m) not in (0, 2) or not n or not m:
        return [-1] * m, every
    more, fewer = (last, values) if n > m else (values, last)
    longer, shorter = len(more), len(fewer)
    # The longer list from each of its numbers, without its first two; the shorter one from each, or as it is.
    own = (np.arange(longer)[:, None] + np.arange(longer)[abs(n - m) :]) % longer
    turns = np.arange(shorter if n != m else 1)
    other = (turns[:, None] + np.arange(shorter)) % shorter
    apart = np.sum((more[own][:, None] - fewer[other]) ** 2, axis=2)
    turn, k = np.unravel_index(np.argmin(apart), apart.shape)
    pairs = (other[k], own[turn]) if n > m else (own[turn], other[k])
    came = dict(zip(*(side.tolist() for side in pairs), strict=True))
    kept = [came.get(i, -1) for i in every]
    return kept, [i for i in every if kept[i] < 0]


def aligned(values: FloatArray, reference: FloatArray) -> FloatArray:
    """Return the rotation of a cyclic list that is nearest to a reference.

    The reference itself is returned if the numbers of values differ.

    Examples
    --------
    >>> aligned(np.array([2.0, 1.0]), np.array([1.1, 2.1]))
    array([1., 2.])
    """
    if values.shape != reference.shape:
        return reference
    rotations = [np.roll(values, k) for k in range(len(values))]
    return min(rotations, key=lambda r: float(np.sum((r - reference) ** 2)))


def _between(vertices: list[_Vertex]) -> Iterator[bool | None]:
    """Yield the stability of each piece between consecutive vertices; solved points decide."""
    last: bool | None = None
    for left, right in pairwise(vertices):
        if not left.located:
            last = left.after
        elif not right.located:
            last = right.before
        else:  # two events: what they say, unless they contradict each other
            said = {left.after, right.before} - {None}
            last = said.pop() if len(said) == 1 else last
        yield last
