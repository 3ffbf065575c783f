"""What vanishes at the joints by construction, and not by rounding.

Each joint lies on the exit surface of the segment before it; along a mode in which the rate of an
observable is identically zero (a stick keeps v) what vanished before still does. So a few rows vanish on
the extended state at the start of a segment, and every linear combination of them does. An observable
whose row is such a combination vanishes there, and so does its rate if ``g M`` is one: with S0 = S, a
stick is left with acceleration zero. The combination is sought by elimination in exact arithmetic: what
is not exactly zero counts as different.
"""

from __future__ import annotations

from collections.abc import Callable

from flint import arb, arb_mat

from contfric.certify.equations.chain import Segments
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector, identity, numbers

#: Most derivatives of an observable that vanish at a start: rest left at the largest load has three.
MOST_ORDER = 4


#: Returns the row at the first joint that a row at the last one is, by the closure.
Closing = Callable[[Vector], Vector]


def zeros_at_joints(
    segments: Segments,
    model: BallModel,
    closing: Closing,
    more: dict[int, list[Vector]] | None = None,
    still: int = -1,
) -> list[list[Vector]]:
    """Return the rows that vanish at joints 0 .. N - 1 (before a reset).

    Parameters
    ----------
    more : further rows that vanish at the ends of segments
    still : a segment without duration, if there is one: what vanishes at its start vanishes at its end
    """
    count = segments.count
    found: list[list[Vector]] = [[] for _ in range(count)]
    for i in [*range(count), *range(count)]:  # what the last segment keeps is known after one round
        rows = _at_end(segments, model, (i - 1) % count, found)
        rows += (more or {}).get((i - 1) % count, [])
        rows += found[still] if still >= 0 and (i - 1) % count == still else []
        if i == 0:
            rows = [closed(row, closing, segments, model) for row in rows]
        pin = segments.pins[i]
        if isinstance(pin, str):
            rows.append(model.rows[pin])
        elif pin is not None:  # a touch: the rate along the mode before vanishes
            rows.append(model.rate(pin[1], pin[0]))
        found[i] = rows
    return found


def closed(row: Vector, closing: Closing, segments: Segments, model: BallModel) -> Vector:
    """Return the row at the first joint, up to its sign: a list of the model's where that is known.

    It is the same one where the closure changes its sign at most; that of a surface is its image's.
    """
    for name, image in segments.images:
        if row is model.rows[name]:
            return model.rows[image]
    pairs = []
    for k in (k for k, x in enumerate(row) if not x.is_zero()):
        unit = [arb(int(j == k)) for j in range(len(row))]
        pairs += list(zip(closing(unit), unit, strict=True))
    same = any(all(a == sign * b for a, b in pairs) for sign in (1, -1))
    return row if same else closing(row)


def at_start(segments: Segments, model: BallModel, i: int, rows: list[Vector]) -> list[Vector]:
    """Return the rows that vanish where segment i starts: after its reset, if there is one."""
    if not segments.resets[i]:
        return rows
    return _after_reset(rows, model, segments.resets[i], segments.modes[i])


def _at_end(
    segments: Segments, model: BallModel, i: int, found: list[list[Vector]]
) -> list[Vector]:
    """Return the rows that vanish at the end of a segment: its exit, and what it keeps at zero."""
    known = at_start(segments, model, i, found[i])
    kept = [row for row in known if model.keeps(row, segments.modes[i])]
    if not segments.exits[i]:
        return kept
    exit_row = model.rows[segments.exits[i]]
    return [exit_row, *(row for row in kept if not in_span(row, [exit_row]))]


def _after_reset(rows: list[Vector], model: BallModel, reset: str, mode: str) -> list[Vector]:
    """Return the surfaces on which the image of a reset lies, and the one of the reset if it is touched.

    An impact without speed leaves without speed: the rate along the mode after it vanishes, too.
    """
    matrix = model.resets[reset]
    found = [*model.rows.values(), model.rate(reset, mode)]
    return [row for row in found if vanishes_after(row, matrix, rows)]


def vanishes_after(row: Vector, reset: arb_mat, rows: list[Vector]) -> bool:
    """Tell whether a row vanishes after a reset, if others do before it.

    A row that a reset leaves as it is may have balls, as those of the level of a wall that is moved.
    """
    if in_span(numbers(arb_mat([row]) * reset), rows):
        return True
    size = reset.nrows()
    one = identity(size)
    return in_span(row, rows) and in_span(numbers(arb_mat([row]) * (reset - one)), rows)


def _is_zero(row: Vector) -> bool:
    return all(x.is_zero() for x in row)


def in_span(row: Vector, rows: list[Vector]) -> bool:
    """Tell whether a row is exactly a linear combination of others.

    Examples
    --------
    >>> from flint import arb
    >>> in_span([arb(2), arb(4)], [[arb(1), arb(2)]]), in_span([arb(2), arb(5)], [[arb(1), arb(2)]])
    (True, False)
    """
    if any(row is other for other in rows):  # of balls that are not exact, too
        return True
    # balls that are not exact leave nothing exactly zero: rows of them come last; and rows of few entries
    # first, as those of surfaces such as x = 0, since quotients of others are rounded
    basis = sorted(
        rows, key=lambda own: (all(x.is_exact() for x in own), sum(map(arb.is_zero, own)))
    )
    left = row
    while basis and not _is_zero(left):
        pivot = basis.pop()
        at = next((k for k, x in enumerate(pivot) if x.is_exact() and not x.is_zero()), None)
        if at is None:
            continue
        left = _without(left, pivot, at)
        basis = [_without(other, pivot, at) for other in basis]
    return _is_zero(left)


def _without(row: Vector, pivot: Vector, at: int) -> Vector:
    if row[at].is_zero():
        return row
    factor = row[at] / pivot[at]
    return [
        arb(0) if k == at else x - factor * p
        for k, (x, p) in enumerate(zip(row, pivot, strict=True))
    ]


def order_at_start(
    model: BallModel,
    row: Vector,
    mode: str,
    known: list[Vector],
    surface: str = "",
    least: int = 0,
) -> int:
    """Return how many of an observable and its derivatives along a mode vanish at a start by construction.

    Parameters
    ----------
    row : the observable
    surface : that it is the distance to, if it is one: its derivatives are then known as such
    least : how many are known to vanish
    """
    for order in range(MOST_ORDER):
        row = model.rate(surface, mode, order) if surface else row
        named = model.alike(surface, mode) if surface and order == 1 and model.alike else None
        vanishes = in_span(row, known) or (named and in_span(model.rows[named], known))
        if order >= least and not vanishes:
            return order
        row = numbers(arb_mat([row]) * model.fields[mode])
    return MOST_ORDER
