"""Itineraries over two orbits that can have a window, by a necessary condition from their release map.

Let ``w_1 ... w_k`` be the last turns of an orbit in D (:mod:`contfric.adding.release_map`). Its
release is then in

    I(w_1 ... w_k) = F_{w_k}(I(w_1 ... w_{k-1}) on the side of w_k),      I() = D.

If this set is empty, no orbit in D takes these turns one after the other: no itinerary has them in it. An
itinerary that comes to nothing when it is run through again and again has no window.

Nothing is assumed of the shape of F. If both branches increase and leave a gap between the images of the
jump, F is a circle map with a gap. Then all orbits at a parameter have one rotation number p / q, and the
itineraries that are left are the balanced ones, in the order of the Farey tree. If a branch decreases, F need
not be one-to-one, and windows of itineraries ``a^n b`` may overlap (period incrementing). Below the bridge of
Fig. 5 F_b has a maximum near the jump, and both kinds are met.

Between the samples F is interpolated linearly, with an error below ``(d_ss + d_pp) / 8``, d the second
differences over s and over the parameter. The intervals are widened by twice that. For a range of the
parameter the image is that of the lesser, and of the greater, of the two interpolations at its ends.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np

from contfric.adding.release_map import Samples, sampled
from contfric.base.arrays import FloatArray, IntArray
from contfric.continuation.branch import Branch
from contfric.orbit.orbit import Orbit
from contfric.signature.cyclic import least_rotation, primitive_length

#: Parts of a range between two sampled parameters, each with its own intervals.
_PARTS = 8
#: Turns for which an itinerary that does not come to nothing is run through.
_TURNS = 36
#: Widening of the intervals, in second differences.
_WIDENING = 0.25


def itineraries_with_ranges(
    letters: dict[str, Orbit], bridge: Branch, grid: FloatArray, longest: int
) -> Iterator[tuple[str, FloatArray]]:
    """Yield the itineraries that can have a window, each with the parameters of the grid around it.

    Itineraries have both letters; each comes once up to rotation, and none repeats itself. All of them come,
    with the whole grid, if the release is no map of an interval.

    Parameters
    ----------
    letters : the two orbits by their letters a and b, each from the slide to the stop that tells them apart
    grid : increasing parameters
    longest : most turns of an itinerary
    """
    samples = sampled(letters, bridge, grid)
    if samples is None:
        yield from ((turns, grid) for turns in _all_itineraries(longest))
        return
    branches = {letter: _Images(found) for letter, found in samples.items()}
    for turns, parts in _possible(branches, longest):
        first, last = parts[0] // _PARTS, parts[-1] // _PARTS + 1
        yield turns, grid[max(first - 1, 0) : last + 2]


def _all_itineraries(longest: int) -> Iterator[str]:
    for length in range(2, longest + 1):
        for letters in product("ab", repeat=length):
            if _is_itinerary("".join(letters)):
                yield "".join(letters)


def _is_itinerary(turns: str) -> bool:
    """Tell whether turns are an itinerary: both letters, the least of its rotations, and no repetition."""
    both = len(set(turns)) == 2
    return both and least_rotation(turns) == 0 and primitive_length(turns) == len(turns)


def _may_be_least(turns: str) -> bool:
    """Tell whether turns begin an itinerary that is the least of its rotations."""
    return all(turns[k:] >= turns[: len(turns) - k] for k in range(1, len(turns)))


def _possible(branches: dict[str, _Images], longest: int) -> Iterator[tuple[str, IntArray]]:
    """Yield itineraries that do not come to nothing, with the parts of the range in which they do not."""
    low = min(images.end for images in branches.values())
    high = max(images.end for images in branches.values())
    parts = np.arange(next(iter(branches.values())).parts)
    waiting = [("", (parts, np.full(len(parts), low), np.full(len(parts), high)))]
    while waiting:
        turns, left = waiting.pop()
        if _is_itinerary(turns):
            again = left
            for letter in turns * (_TURNS // len(turns)):
                again = branches[letter].of(*again)
            if len(again[0]):
                yield turns, again[0]
        if len(turns) == longest:
            continue
        for letter, images in branches.items():
            longer = turns + letter
            if _may_be_least(longer):
                following = images.of(*left)
                if len(following[0]):
                    waiting.append((longer, following))


class _Images:
    """Images of intervals by one branch of the map, over parts of the parameter's range.

    Parameters
    ----------
    samples : of the branch

    Attributes
    ----------
    end : the side of the branch is from 0 to here
    parts : number of parts of the range
    """

    def __init__(self, samples: Samples) -> None:
        images, self.end = samples.images, samples.end
        at = np.linspace(0.0, len(images) - 1.0, (len(images) - 1) * _PARTS + 1)
        k = np.minimum(at.astype(int), len(images) - 2)[:, None]
        share = at[:, None] - k
        every = np.arange(images.shape[1])
        rows = images[k, every] * (1.0 - share) + images[k + 1, every] * share
        error = _WIDENING * sum(float(np.abs(np.diff(images, 2, axis)).max()) for axis in (0, 1))
        self._low = np.minimum(rows[:-1], rows[1:]) - error
        self._high = np.maximum(rows[:-1], rows[1:]) + error
        self._error, self.parts = error, len(rows) - 1

    def of(
        self, parts: IntArray, low: FloatArray, high: FloatArray
    ) -> tuple[IntArray, FloatArray, FloatArray]:
        """Return the parts in which intervals reach to the side of the branch, and their images there."""
        a, b = (low, high) if self.end > 0.0 else (-high, -low)
        kept = b >= -self._error
        parts, last = parts[kept], self._low.shape[1] - 1
        step = abs(self.end) / last
        first, end = (np.clip(x[kept] / step, 0.0, float(last)) for x in (a, b))
        inside = np.arange(last + 1)
        inside = (inside >= first[:, None]) & (inside <= end[:, None])
        lows, highs = self._low[parts], self._high[parts]
        least = np.where(inside, lows, np.inf).min(axis=1)
        most = np.where(inside, highs, -np.inf).max(axis=1)
        for x in (first, end):
            least = np.minimum(least, _between(lows, x))
            most = np.maximum(most, _between(highs, x))
        return parts, least, most


def _between(rows: FloatArray, x: FloatArray) -> FloatArray:
    """Return each row at a location between its samples, by linear interpolation."""
    k = np.minimum(x.astype(int), rows.shape[1] - 2)
    every, share = np.arange(len(rows)), x - k
    found: FloatArray = rows[every, k] * (1.0 - share) + rows[every, k + 1] * share
    return found
