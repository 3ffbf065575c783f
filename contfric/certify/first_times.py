r"""When an observable may vanish for the first time, over a whole set of solutions at once.

Along a segment q is positive at first. Pieces of time are shown to be positive for all solutions of the set, or
negative for all, or neither. What is neither is joined to clusters. The first zero of each solution lies in one
of the clusters up to the first piece that is negative; where no piece is, a solution may have none.
At a grazing contact (q touches 0 for some of the solutions) there is a cluster, and positive pieces follow it.
"""

from __future__ import annotations

from dataclasses import dataclass

from flint import arb, arb_mat

from contfric.certify.sign import Path, higher, range_over
from contfric.certify.stretch import UndecidedError

#: Pieces are halved to this share of the segment where they have no sign, the ends of clusters further.
_COARSE, _FINE = 8, 26
#: Most pieces that are looked at.
_MOST = 3000


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
        If too many pieces are needed.
    """
    signs = _Signs(path, row, start_order)
    waiting, found = [(0, 0)], list[list[tuple[int, int]]]()
    all_end, follows = False, False
    while waiting:
        level, index = waiting.pop()
        sign = signs.of(level, index)
        if sign == 0 and level < _COARSE:
            waiting += [(level + 1, 2 * index + 1), (level + 1, 2 * index)]
            continue
        if sign == 0 or (sign < 0 and not follows):
            if follows:
                found[-1].append((level, index))
            else:
                found.append([(level, index)])
        follows = sign == 0
        if sign < 0:
            all_end = True
            break
    clusters = (signs.narrowed(cluster) for cluster in found)
    return FirstTimes(tuple((low, high) for low, high in clusters if low < high), all_end)


class _Signs:
    """Signs of an observable over pieces of time."""

    def __init__(self, path: Path, row: arb_mat, start_order: int) -> None:
        self.path, self.rows, self.count = path, path.derivatives(row), 0
        start = higher(path, row, start_order)
        self.first = path.derivatives(start) if start_order else None

    def of(self, level: int, index: int) -> int:
        """Return 1 or -1 if all solutions have that sign over a piece (but for its start), else 0."""
        self.count += 1
        if self.count > _MOST:
            raise UndecidedError("a segment needs too many pieces")
        if (self.path.norm * self.path.duration).upper() > 2 ** (level + 2):
            return 0  # Taylor's polynomial is not worth its price
        value = range_over(self.path, self.rows, level, index)
        if value > 0:
            return 1
        if value < 0:
            return -1
        if index == 0 and self.first is not None:
            return int(range_over(self.path, self.first, level, index) > 0)
        return 0

    def narrowed(self, cluster: list[tuple[int, int]]) -> tuple[arb, arb]:
        """Return the ends of a cluster of pieces, the outermost halved further."""
        low, high = cluster[0], cluster[-1]
        for _ in range(_FINE - _COARSE):
            half = (low[0] + 1, 2 * low[1])
            low = (half[0], half[1] + 1) if self.of(*half) > 0 else half
        for _ in range(_FINE - _COARSE):
            half = (high[0] + 1, 2 * high[1] + 1)
            high = (half[0], half[1] - 1) if self.of(*half) else half
        duration = self.path.duration
        return duration * low[1] / 2 ** low[0], duration * (high[1] + 1) / 2 ** high[0]
