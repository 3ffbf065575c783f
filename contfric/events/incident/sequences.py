"""Cyclic sequences of the forms of a unit: the orbits of one or several periods that an event can have.

A motion whose unit has k forms is an orbit of every cyclic sequence of them, each unit with its own form.
Two sequences are one orbit if one is a rotation of the other. Where the unit is half of a symmetric motion,
a rotation by one unit is the symmetry image; so rotations are orbits up to symmetry there, and a sequence
of odd length is the half of a symmetric orbit. A sequence that repeats itself is an orbit of fewer periods.

They are the aperiodic necklaces over k letters; their number is ``sum_{d | n} mu(d) k^(n / d) / n``
(P. A. MacMahon, 1892).
"""

from __future__ import annotations

from collections.abc import Iterator

#: Most sequences of one length: all of three forms over eight units. Beyond it Duval's algorithm is cheap,
#: but the local conditions of each sequence are not.
MOST_SEQUENCES = 1000


def lengths(periods: int, half: bool, most_periods: int) -> list[int]:
    """Return the numbers of units of which orbits of at most some periods consist.

    Parameters
    ----------
    periods : shortest period of the solution
    half : whether the unit is half of it

    Examples
    --------
    >>> lengths(1, False, 3), lengths(1, True, 3), lengths(2, False, 5)
    ([1, 2, 3], [1, 2, 3, 4, 6], [1, 2])
    """
    if not half:
        return list(range(1, max(1, most_periods // periods) + 1))
    longest = max(1, most_periods // periods)
    return sorted({1, *(n for n in range(1, longest + 1) if n % 2), *range(2, 2 * longest + 1, 2)})


def necklaces(letters: int, length: int) -> Iterator[tuple[int, ...]]:
    """Yield the aperiodic necklaces of a length, each in its least rotation (J.-P. Duval, 1988).

    Examples
    --------
    >>> list(necklaces(2, 3))
    [(0, 0, 1), (0, 1, 1)]
    >>> len(list(necklaces(2, 8)))
    30
    """
    itinerary = [-1]
    while itinerary:
        itinerary[-1] += 1
        if len(itinerary) == length:
            yield tuple(itinerary)
        known = len(itinerary)
        while len(itinerary) < length:
            itinerary.append(itinerary[-known])
        while itinerary and itinerary[-1] == letters - 1:
            itinerary.pop()


def count(letters: int, length: int) -> int:
    """Return how many aperiodic necklaces of a length there are.

    Examples
    --------
    >>> [count(2, n) for n in range(1, 9)]
    [2, 1, 2, 3, 6, 9, 18, 30]
    """
    total = int(letters**length)
    for part in range(1, length):
        if length % part == 0:
            total -= part * count(letters, part)
    return total // length
