r"""The sign of an observable over the whole of a segment.

Along a segment ``w(tau) = exp(M tau) w_0``, and an observable less its level is ``q(tau) = g w(tau)``; its
derivatives are ``g M^k w``. On a piece of half-width r around c, Taylor's theorem gives

    |q(c + s) - sum_{k<K} g M^k w(c) s^k / k!|  <=  |g M^K|_* exp(|M| r) |w(c)| r^K / K!

with the norm ``|w| = max |w_i| / d_i``, for any weights d: ``|w(c + s)| <= exp(|M| r) |w(c)|``, and
``|g|_* = sum |g_i| d_i``. Velocities are of the size of frequencies times displacements: with such weights
|M| is a frequency, and with equal ones the square of the largest one. Pieces that do not show the sign are
halved.

At an end where q vanishes by construction (a slide starts and stops with v = 0) no piece can show its
sign. There the first derivative that does not vanish does: if ``q = q' = .. = 0`` up to the order k - 1
at the start and the k-th derivative is positive on [0, b], q is positive on (0, b]. At an exit q vanishes
and q' < 0. Which derivatives vanish is not a question of rounding: it is read off the rows
(:mod:`contfric.certify.equations.zeros`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from flint import arb, arb_mat

from contfric.certify.verdict import Finding, Verdict

#: Terms of Taylor's polynomial: with |M| r <= 1/2 the remainder is 1e-6 of the state.
_TERMS = 8
#: Steps towards weights of states: after many, those of forces and constants, which nothing drives, are tiny.
_BALANCING = 4
#: Most pieces of one observable along one segment: a stiff mode (|M| d above this) is undecided.
_MOST = 4000
#: Narrowest piece, as a power of 1/2 of the segment: a touch within 1e-24 of it is undecided.
_NARROW = 80
#: Halvings of a segment in which a touch is looked for.
_WINDOW = 10


class Derivatives(NamedTuple):
    """An observable and its derivatives, a row each, and the norm of the row that follows them."""

    rows: arb_mat
    last: arb


@dataclass(frozen=True, eq=False)
class Path:
    """One segment of the solutions in some balls.

    Attributes
    ----------
    field : its field
    start : the extended state at its start
    duration : the longest one
    shortest : the shortest one, up to which a violation is one of all of them; the longest one if it is None
    """

    field: arb_mat
    start: arb_mat
    duration: arb
    shortest: arb | None = None
    # what was computed, by level and index of a piece, or by level
    _states: dict[tuple[int, int], arb_mat] = field(default_factory=dict)
    _sizes: dict[tuple[int, int], arb] = field(default_factory=dict)
    _flows: dict[tuple[int, int], arb_mat] = field(default_factory=dict)
    _growths: dict[int, arb] = field(default_factory=dict)
    _shifts: dict[int, arb_mat] = field(default_factory=dict)

    def lasts(self, level: int, index: int) -> bool:
        """Tell whether all of the solutions last up to the middle of piece ``index`` of 2^level."""
        if self.shortest is None:
            return True
        return bool(self.duration * (2 * index + 1) / 2 ** (level + 1) < self.shortest)

    @cached_property
    def weights(self) -> list[arb]:
        """Weights of the norm of states."""
        size = self.field.nrows()
        moduli = [float(entry.abs_upper()) for entry in self.field.entries()]
        return [arb(c) for c in balanced(np.reshape(moduli, (size, size))).tolist()]

    @cached_property
    def norm(self) -> arb:
        """Upper bound of the norm of the field."""
        size, weights = self.field.nrows(), self.weights
        sums = [
            sum((self.field[i, j].abs_upper() * weights[j] for j in range(size)), arb(0))
            / weights[i]
            for i in range(size)
        ]
        return max((total.upper() for total in sums), key=float)

    def middle(self, level: int, index: int) -> arb_mat:
        """Return the extended state at the middle of piece ``index`` of 2^level."""
        key = (level, index)
        if key not in self._states:
            shift = self._shift(level + 1)
            flow = self._flow(level, index) * shift if index else shift
            self._states[key] = flow * self.start
        return self._states[key]

    def _flow(self, level: int, index: int) -> arb_mat:
        """Return the flow up to a piece: a product of those over halves, quarters, ... of the segment.

        Products are forty times cheaper than exponentials. Going from piece to piece, or back and forth,
        their radii would be larger.
        """
        while index % 2 == 0:
            level, index = level - 1, index // 2
        if (level, index) not in self._flows:
            shift = self._shift(level)
            self._flows[level, index] = self._flow(level, index - 1) * shift if index > 1 else shift
        return self._flows[level, index]

    def _shift(self, power: int) -> arb_mat:
        """Return the flow over 2^-power of the segment."""
        if power not in self._shifts:
            self._shifts[power] = (self.field * (self.duration / 2**power)).exp()
        return self._shifts[power]

    def size(self, level: int, index: int) -> arb:
        """Return a bound of the norm of the state at the middle of a piece."""
        if (level, index) not in self._sizes:
            entries = zip(self.middle(level, index).entries(), self.weights, strict=True)
            self._sizes[level, index] = max(((x / d).abs_upper() for x, d in entries), key=float)
        return self._sizes[level, index]

    def derivatives(self, row: arb_mat) -> Derivatives:
        """Return an observable and its derivatives, each over its factorial, and the norm of the last one."""
        found = [row]
        for k in range(1, _TERMS + 1):
            found.append(found[-1] * self.field / k)
        last = zip(found[_TERMS].entries(), self.weights, strict=True)
        total = sum((x.abs_upper() * d for x, d in last), arb(0))
        return Derivatives(arb_mat([r.entries() for r in found[:_TERMS]]), total)

    def growth(self, level: int) -> arb:
        """Return a bound of how much a state grows in half a piece, times the last power of that time."""
        if level not in self._growths:
            half = (self.duration / 2 ** (level + 1)).upper()
            self._growths[level] = (self.norm * half).exp() * half**_TERMS
        return self._growths[level]


def balanced(moduli: np.ndarray) -> np.ndarray:
    """Return weights d with about the same sums of moduli ``M_ij d_j / d_i`` over rows and columns.

    Any weights make a norm: these are a good guess, in a few steps (E. E. Osborne, J. ACM 7 (1960) 338-345).
    A pair ``x' = v``, ``v' = -w^2 x`` has 1 and w.
    """
    d = np.ones(len(moduli))
    for _ in range(_BALANCING):
        rows, columns = moduli @ d / d, moduli.T @ (1 / d) * d
        least = 0.01 * (rows + columns) + 1e-300  # the row of a constant is zero
        d = d * ((rows + least) / (columns + least)) ** 0.25
    return d


def range_over(path: Path, derivatives: Derivatives, level: int, index: int) -> arb:
    """Return an enclosure of an observable over piece ``index`` of 2^level, from its derivatives."""
    half = (path.duration / 2 ** (level + 1)).upper()
    value, *others = (derivatives.rows * path.middle(level, index)).entries()
    spread = arb(0)
    for other in reversed(others):
        spread = (spread + other.abs_upper()) * half
    spread += derivatives.last * path.growth(level) * path.size(level, index)
    return value + arb(0, spread.upper())


def positive(
    path: Path,
    row: arb_mat,
    start_order: int,
    end_order: int,
    bends: bool = False,
    rises: bool = False,
) -> Finding:
    """Find whether an observable is positive inside of a segment.

    Parameters
    ----------
    row : the observable less its level, times the sign that is wanted
    start_order : how many of q, q', q'' vanish at the start by construction; 0 if q does not
    end_order : the same at the end
    bends : whether q falls at the end, too, if only a little: so it does before where q'' is positive
    rises : whether the first derivative that may differ from 0 at the start is not negative: so q is positive
        where the next one is
    """
    shown = _shown(path, row, start_order, end_order, bends, rises)
    level = 0
    while (path.norm * path.duration).upper() > 2**level and 2**level < _MOST:
        level += 1
    waiting = [(level, index) for index in range(2**level)]
    for _ in range(_MOST):
        if not waiting:
            return Finding(Verdict.PROVED)
        level, index = waiting.pop()
        found = shown(level, index)
        if found is False:
            return Finding(Verdict.REFUTED, f"violated at {_share(level, index)} of its duration")
        if found:
            continue
        if level >= _NARROW:
            return Finding(
                Verdict.UNDECIDED, f"not decided at {_share(level, index)} of its duration"
            )
        waiting += [(level + 1, 2 * index + 1), (level + 1, 2 * index)]
    return Finding(Verdict.UNDECIDED, "the segment needs too many pieces")


def _shown(
    path: Path,
    row: arb_mat,
    start_order: int,
    end_order: int,
    bends: bool = False,
    rises: bool = False,
) -> Callable[[int, int], bool | None]:
    """Return what tells whether an observable is positive on a piece; None if that is not decided."""
    rows = path.derivatives(row)
    first = path.derivatives(higher(path, row, start_order)) if start_order else rows
    sign = (-1) ** end_order  # of the derivatives by the time that is left
    last = path.derivatives(higher(path, row, end_order) * sign) if end_order else rows
    bend = path.derivatives(higher(path, row, 2)) if bends else rows
    rise = path.derivatives(higher(path, row, start_order + 1)) if rises else rows

    def shown(level: int, index: int) -> bool | None:
        value = range_over(path, rows, level, index)
        if (row * path.middle(level, index))[0, 0] < 0 and path.lasts(level, index):
            return False
        at_start = index == 0 and (start_order > 0 or rises)
        at_end = index == 2**level - 1 and end_order > 0
        if value > 0:
            return True
        if at_start and range_over(path, first, level, index) > 0:
            return True
        if at_start and rises and range_over(path, rise, level, index) > 0:
            return True
        if at_end and range_over(path, last, level, index) > 0:
            return True
        bent = at_end and bends and range_over(path, bend, level, index) > 0
        return True if bent else None

    return shown


def undecided(path: Path, row: arb_mat, start_order: int, end_order: int) -> arb | None:
    """Return a ball of times outside of which an observable is positive inside of a segment.

    None if it may not be positive next to an end of the segment.
    """
    shown, waiting, level = _shown(path, row, start_order, end_order), [0], 0
    for level in range(_WINDOW + 1):
        found = [k for k in waiting if not shown(level, k)]
        waiting = [half for k in found for half in (2 * k, 2 * k + 1)]
    if not found or found[0] == 0 or found[-1] == 2**level - 1:
        return None
    piece = path.duration / 2**level
    return (piece * found[0]).union(piece * (found[-1] + 1))


def touched(path: Path, row: arb_mat, start_order: int, after: arb | None) -> Finding:
    """Find whether an observable is positive inside of a segment but for a touch of zero, at a known time.

    There it vanishes with its rate, and its second derivative is positive.

    Parameters
    ----------
    after : time of the touch after the start; None for the end of the segment
    """
    at = path.duration if after is None else after
    state = (path.field * at).exp() * path.start
    shortest = None if path.shortest is None else arb(0)  # it begins where the longest one ends
    back = Path(-path.field, state, at.upper(), shortest)
    found = positive(back, row, 2, start_order)
    if after is None or not found.proved:
        return found
    return positive(Path(path.field, state, (path.duration - at).upper()), row, 2, 1)


def higher(path: Path, row: arb_mat, order: int) -> arb_mat:
    """Return the row of a derivative of an observable."""
    for _ in range(order):
        row = row * path.field
    return row


def _share(level: int, index: int) -> str:
    return f"{(2 * index + 1) / 2 ** (level + 1):.3g}"
