"""Types of arrays, and an array with other values in some places."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def with_entries(values: FloatArray, where: Any, new: Any) -> FloatArray:
    """Return a copy of an array with other values in one place or several.

    Examples
    --------
    >>> with_entries(np.zeros(3), 1, 0.5).tolist()
    [0.0, 0.5, 0.0]
    """
    found = values.copy()
    found[where] = new
    return found
