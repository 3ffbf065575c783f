r"""When an observable may vanish for the first time, over a whole set of solutions at once.

Along a segment q is positive at first. Pieces of time are shown to be positive for all solutions of the set,
or negative for all, or neither. Pieces that are neither are halved until the spread of q over them is that of
the set and not that of the piece; then neighbours are joined to clusters. The first zero of each solution
lies in one of the clusters up to the first piece that is negative; where no piece is, a solution may have
none. At a grazing contact, where q touches 0 for some of the solutions, there is a cluster, and positive
pieces follow it.
"""

from __future__ import annotations

from dataclasses import dataclass

from flint import arb, arb_mat

from contfric.certify.inequalities.sign import Path, higher, range_over
from contfric.certify.releases.stretch import UndecidedError

#: A piece is halved while the spread of q over it is so many times that in its middle; at most so often.
_SPREAD, _FINE = 4, 48
#: Longest cluster as a share of the segment, and most pieces that are looked at.
_LONGEST, _MOST = 0.125, 1500


@dataclass(frozen=True)
class FirstTimes:
    """Intervals of times after the start that hold all first zeros, and whether each solution has one."""

    clusters: tuple[tuple[arb, arb], ...]
    all_end: bool


def first_times(path: Path, row: arb_mat, start_order: int) -> FirstTimes:
    """Return when an observable may vanish for the first time, up to the end of a path.

    Parameters
    ----------
    row : the observable less its level, with the sign that makes it positive at first
    start_order : how many of q, q', .. vanish at the start by construction; 0 if q does not

    Raises
    ------
    UndecidedError
        If a cluster is long, or too many pieces are needed.
    """
    signs = _Signs(path, row, start_order)
    waiting, found = [(0, 0)], list[tuple[arb, arb]]()
    all_end, follows = False, False
    for _ in range(_MOST):
        if not waiting or all_end:
            return FirstTimes(tuple(found), all_end)
        level, index = waiting.pop()
        sign, halved = signs.of(level, index)
        if halved:
            waiting += [(level + 1, 2 * index + 1), (level + 1, 2 * index)]
            continue
        if sign == 0 or (sign < 0 and not follows):
            low, high = (path.duration * (index + k) / 2**level for k in (0, 1))
            low = found.pop()[0] if follows else low
            found.append((low, high))
            if high - low > _LONGEST * path.duration and level > 3:
                break
        follows, all_end = sign == 0, sign < 0
    raise UndecidedError("the first zeros are spread over a long time")


class _Signs:
    """Signs of an observable over pieces of time."""

    def __init__(self, path: Path, row: arb_mat, start_order: int) -> None:
        self.path, self.rows = path, path.derivatives(row)
        start = higher(path, row, start_order)
        self.first = path.derivatives(start) if start_order else None
        self.pieces = (
            path.norm * path.duration / 4
        ).upper()  # Taylor's polynomial is worth its price

    def of(self, level: int, index: int) -> tuple[int, bool]:
        """Return the sign of all solutions over a piece (but for its start), or 0; and whether to halve."""
        if self.pieces > 2**level:
            return 0, True
        value = range_over(self.path, self.rows, level, index)
        if value > 0:
            return 1, False
        if value < 0:
            return -1, False
        first = self.first if index == 0 else None
        if first is not None and range_over(self.path, first, level, index) > 0:
            return 1, False
        own = (self.rows[0] * self.path.middle(level, index))[0, 0].rad()
        return 0, level < _FINE and value.rad() > _SPREAD * own
