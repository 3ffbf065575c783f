"""Numbers as short text that a browser reads: base64 of little-endian arrays."""

from __future__ import annotations

import base64

import numpy as np
from numpy.typing import NDArray

from contfric.models.definition import FloatArray

#: Steps of a quantised number: the largest number of 16 bits.
_STEPS = 65535


def floats(values: FloatArray) -> str:
    """Return numbers in single precision, which a screen cannot tell from double.

    Examples
    --------
    >>> floats(np.array([1.0]))
    'AACAPw=='
    """
    return base64.b64encode(np.asarray(values, dtype="<f4").tobytes()).decode("ascii")


def quantised(values: FloatArray) -> tuple[float, float, str]:
    """Return the least value, the step, and the numbers of steps in 16 bits each.

    Examples
    --------
    >>> quantised(np.array([1.0, 2.0]))
    (1.0, 1.5259021896696422e-05, 'AAD//w==')
    """
    low, high = float(np.min(values)), float(np.max(values))
    step = (high - low) / _STEPS or 1.0
    counts = np.rint((values - low) / step).astype("<u2")
    return low, step, base64.b64encode(counts.tobytes()).decode("ascii")


def kept(columns: FloatArray, tolerance: float) -> NDArray[np.intp]:
    """Return the indices of the vertices that a polyline needs (Douglas and Peucker, 1973).

    Parameters
    ----------
    columns : ndarray, shape (k, quantities)
        The vertices, each quantity as a share of what is drawn; nan where it is absent.
    tolerance : float
        Largest distance of a vertex that is left out; 0 keeps all.
    """
    count = len(columns)
    needed = np.ones(count, dtype=bool)
    if tolerance > 0.0 and count > 2:
        needed[1:-1] = False
        filled = np.nan_to_num(columns)
        pieces = [(0, count - 1)]
        while pieces:
            first, last = pieces.pop()
            if last - first < 2:
                continue
            share = np.linspace(0.0, 1.0, last - first + 1)[:, None]
            chord = (1.0 - share) * filled[first] + share * filled[last]
            far = np.abs(filled[first : last + 1] - chord).max(axis=1)
            worst = int(np.argmax(far))
            if far[worst] > tolerance:
                needed[first + worst] = True
                pieces += [(first, first + worst), (first + worst, last)]
    return np.flatnonzero(needed)
