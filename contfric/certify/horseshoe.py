r"""Chaos as a theorem: a horseshoe of the release map, by covering relations.

If f^n is continuous on disjoint intervals K_1 .. K_m within an interval W of phases, and the image of each
covers W, then every sequence of numbers 1 .. m is that of a solution, and the topological entropy of f is at
least ``log(m) / n`` (L. S. Block and W. A. Coppel, Dynamics in One Dimension, 1992, chapter II). Where such
intervals are is a question of sampling; that they are such ones is proved: the images of their ends lie on
both sides of W, and f^n is continuous on each of them (:mod:`contfric.certify.releases.returns`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from flint import arb

from contfric.base.arrays import FloatArray, IntArray
from contfric.certify.releases.returns import Release, ReturnMap
from contfric.certify.releases.stretch import LineInS, UndecidedError
from contfric.models.balls.numbers import working
from contfric.models.definition import Model

_BITS = 100
#: Ends of W that are tried, and how far images must lie beyond them, in shares of the period.
_ENDS, _BEYOND = 40, 1e-4
#: Candidates that are tried, the best first.
_CANDIDATES = 6
#: Pieces of an interval are at least this share of it.
_SHORTEST = 2.0**-14


@dataclass(frozen=True)
class Horseshoe:
    """What was proved of a release map.

    Attributes
    ----------
    params : the parameters, exact binary numbers
    returns : n, the number of returns
    window : W, an interval of phases
    intervals : K_1 .. K_m, disjoint intervals within W whose images under f^n cover W
    pieces : on so many pieces of them f^n was proved to be continuous
    why : what is not proved; empty if all is
    """

    params: dict[str, float]
    returns: int
    window: tuple[float, float]
    intervals: tuple[tuple[float, float], ...]
    pieces: int
    why: str = ""

    @property
    def proved(self) -> bool:
        """Whether the topological entropy is proved to be positive."""
        return not self.why

    @property
    def entropy(self) -> float:
        """Lower bound of the topological entropy of the release map; 0 if none is proved."""
        return math.log(len(self.intervals)) / self.returns * (1 - 1e-15) if self.proved else 0.0

    def __str__(self) -> str:
        """Say it in one line."""
        if not self.proved:
            return f"undecided: {self.why}"
        m, n = len(self.intervals), self.returns
        text = f"positive topological entropy >= log({m})/{n} = {self.entropy:.4f} proved"
        return f"{text}: {m} intervals in [{self.window[0]:.6g}, {self.window[1]:.6g}]"


@dataclass(frozen=True, eq=False)
class Sampled:
    """A sampled release map: phases, images, numbers of branches, a long orbit, the period."""

    phases: FloatArray
    images: FloatArray
    branch: IntArray
    orbit: FloatArray
    period: float


def find_horseshoe(
    model: Model, vector: FloatArray, release: Release, sampled: Sampled, most: int
) -> Horseshoe:
    """Return the largest entropy that could be proved from what was sampled, with at most so many returns."""
    params, why = model.mapping(vector), "no horseshoe was seen"
    found = sorted(_candidates(sampled, most), key=lambda c: -math.log(len(c[2])) / c[0])
    with working(_BITS):
        returns = ReturnMap(model, vector, release)
        for n, window, intervals in found[:_CANDIDATES]:
            try:
                pieces = sum(_covering(returns, n, window, interval) for interval in intervals)
            except UndecidedError as error:
                why = str(error)
                continue
            return Horseshoe(params, n, window, tuple(intervals), pieces)
    return Horseshoe(params, most, (0.0, 0.0), (), 0, why)


# ------------------------------------------------------------------ sampling

_Candidate = tuple[int, tuple[float, float], list[tuple[float, float]]]


def _candidates(sampled: Sampled, most: int) -> list[_Candidate]:
    """Return for each number of returns the window that most pieces of the map cross."""
    ends = np.unique(np.quantile(sampled.orbit, np.linspace(0.02, 0.98, _ENDS)))
    x = sampled.phases
    value, key = x.copy(), np.zeros(len(x), dtype=np.int64)
    found: list[_Candidate] = []
    for n in range(1, most + 1):
        value, key = _iterated(sampled, value, key)
        pairs = [(float(p), float(q)) for k, p in enumerate(ends) for q in ends[k + 1 :]]
        crossings = [(w, _crossings(sampled, x, value, key, w)) for w in pairs]
        window, best = max(crossings, key=lambda pair: len(pair[1]), default=((0.0, 0.0), []))
        if len(best) > 1:
            found.append((n, window, best))
    return found


def _iterated(sampled: Sampled, value: FloatArray, key: IntArray) -> tuple[FloatArray, IntArray]:
    """Return the images of phases, and a number that differs where they have gone other branches."""
    images, after = np.full(len(value), np.nan), np.full(len(value), -1, dtype=np.int64)
    for number in np.unique(sampled.branch[sampled.branch >= 0]).tolist():
        on = sampled.branch == number
        a, b = sampled.phases[on], sampled.images[on]
        inside = (value >= a[0]) & (value <= a[-1]) & (key >= 0)
        images[inside] = np.interp(value[inside], a, b)
        after[inside] = (key[inside] * 61 + number + 1) % (2**55)
    return images, after


def _crossings(
    sampled: Sampled, x: FloatArray, value: FloatArray, key: IntArray, window: tuple[float, float]
) -> list[tuple[float, float]]:
    """Return the intervals within a window whose images go from before it to after it, or back."""
    margin = _BEYOND * sampled.period
    inside = (x > window[0]) & (x < window[1]) & (key >= 0)
    side = np.where(value < window[0] - margin, -1, np.where(value > window[1] + margin, 1, 0))
    runs = np.cumsum(np.diff(np.where(inside, key, -1), prepend=-2) != 0)
    at = np.flatnonzero(inside & (side != 0))
    if len(at) < 2:
        return []
    first, last = at[:-1], at[1:]
    crossed = (runs[first] == runs[last]) & (side[first] != side[last]) & (last - first > 2)
    found: list[tuple[float, float]] = []
    for a, b in zip(x[first[crossed]].tolist(), x[last[crossed]].tolist(), strict=True):
        if not found or a > found[-1][1]:
            found.append((a, b))
    return found


# ------------------------------------------------------------------ proof


def _image(returns: ReturnMap, n: int, a: float, b: float) -> tuple[arb, object]:
    """Return f^n of the phases between two (an elapsed time), and the segments on the way."""
    middle, half = (arb(a) + arb(b)) / 2, (arb(b) - arb(a)) / 2
    line, itineraries = LineInS(middle, half, arb(0)), []
    for _ in range(n):
        line, itinerary = returns.follow(line)
        itineraries.append(itinerary)
    return line.whole, tuple(itineraries)


def _covering(
    returns: ReturnMap, n: int, window: tuple[float, float], interval: tuple[float, float]
) -> int:
    """Prove that f^n is continuous on an interval and that its image covers a window; return the pieces.

    Raises
    ------
    UndecidedError
        If it is not proved.
    """
    (a, b), period = interval, returns.balls.period
    (first, itineraries), (last, others) = (_image(returns, n, t, t) for t in interval)
    turns = round(float(((first + last) / 2 - arb(sum(window)) / 2).mid() / float(period.mid())))
    low, high = (arb(c) + turns * period for c in window)
    covers = (first < low and last > high) or (last < low and first > high)
    if not covers or itineraries != others:
        raise UndecidedError("the images of the ends of an interval do not enclose the window")
    waiting, pieces = [(a, b)], 0
    while waiting:
        left, right = waiting.pop()
        try:
            _, itinerary = _image(returns, n, left, right)
        except UndecidedError as error:
            if right - left < _SHORTEST * (b - a):
                raise UndecidedError(f"between {left:.9g} and {right:.9g}: {error}") from None
            middle = (left + right) / 2
            waiting += [(middle, right), (left, middle)]
            continue
        if itinerary != itineraries:
            raise UndecidedError("the map may have a jump within an interval")
        pieces += 1
    return pieces
