"""Lists of numbers that grow, and are arrays at any time: for tables that compiled code reads."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

#: Places of a new column; one that is full doubles, so that a number is copied twice on average.
_FIRST = 64


class Column:
    """Numbers one after the other.

    Parameters
    ----------
    values : the first ones
    whole : whether they are whole numbers

    Examples
    --------
    >>> column = Column([1, 2])
    >>> column.append(3)
    >>> len(column), column[2], column.array[:3].tolist()
    (3, 3, [1, 2, 3])
    """

    def __init__(self, values: Iterable[float] = (), whole: bool = True) -> None:
        self._array = np.zeros(_FIRST, dtype=np.int64 if whole else np.float64)
        self._count = 0
        self.extend(values)

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, k: int) -> Any:
        return self._array[k if k >= 0 else self._count + k].item()

    def append(self, value: float) -> None:
        """Put a number after the others."""
        if self._count == len(self._array):
            self._array = np.concatenate([self._array, np.zeros_like(self._array)])
        self._array[self._count] = value
        self._count += 1

    def extend(self, values: Iterable[float]) -> None:
        """Put numbers after the others."""
        for value in values:
            self.append(value)

    def __iadd__(self, values: Iterable[float]) -> Column:
        self.extend(values)
        return self

    @property
    def array(self) -> np.ndarray:
        """The numbers as an array; there are zeros after them."""
        return self._array
