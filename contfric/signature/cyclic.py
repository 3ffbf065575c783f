"""Cyclic sequences: the least rotation and the shortest period, both in linear time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

T = TypeVar("T")


def rotated(items: tuple[T, ...], k: int) -> tuple[T, ...]:
    """Return the items starting at index k, cyclically; k may be any integer.

    Examples
    --------
    >>> rotated(("a", "b", "c"), -1)
    ('c', 'a', 'b')
    """
    if not items:
        return items
    k %= len(items)
    return items[k:] + items[:k]


def least_rotation(keys: Sequence[Any]) -> int:
    """Return the index at which the lexicographically least rotation starts.

    Two candidate starts race each other; the loser and all starts that it has already compared
    are skipped, hence O(n). Of equal rotations the first start is returned.

    Examples
    --------
    >>> least_rotation([2, 1, 3, 1])
    3
    """
    n = len(keys)
    i, j, matched = 0, 1, 0
    while i < n and j < n and matched < n:
        a, b = keys[(i + matched) % n], keys[(j + matched) % n]
        if a == b:
            matched += 1
            continue
        if a > b:
            i += matched + 1
        else:
            j += matched + 1
        if i == j:
            j += 1
        matched = 0
    return min(i, j)


def primitive_length(keys: Sequence[Any]) -> int:
    """Return the length of the shortest block whose repetition is the whole sequence.

    Examples
    --------
    >>> primitive_length("abab")
    2
    """
    n = len(keys)
    if n == 0:
        return 0
    # border[i]: the longest proper prefix of keys[: i + 1] that is its suffix, too
    border = [0] * n
    for i in range(1, n):
        k = border[i - 1]
        while k and keys[i] != keys[k]:
            k = border[k - 1]
        border[i] = k + (keys[i] == keys[k])
    block = n - border[-1]
    return block if n % block == 0 else n
