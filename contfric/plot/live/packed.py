"""Numbers as short text that a browser reads: base64 of little-endian arrays."""

from __future__ import annotations

import base64

import numpy as np
from numpy.typing import NDArray

from contfric.models.definition import FloatArray

#: Steps of a quantised number: the largest number of 16 bits.
_STEPS = 65535
#: What counts as small on a line: this quantile of its values, unless they span more decades than single
#: precision has.
_SMALL, _DECADES = 0.05, 1e-6


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


def local_sizes(values: FloatArray) -> FloatArray:
    """Return the size of a quantity at each of its values: what an error there is compared with.

    Near a resonance a branch grows by many decades, and one zooms in to where it is small.
    """
    sizes = np.abs(np.nan_to_num(values))
    if not np.any(sizes):
        return np.ones_like(sizes)
    found = sizes[np.isfinite(values)]
    small = max(float(np.quantile(found, _SMALL)), _DECADES * float(found.max()))
    return np.asarray(sizes + small)


def kept(columns: FloatArray, sizes: FloatArray, tolerance: float) -> NDArray[np.intp]:
    """Return the indices of the vertices that a polyline needs (Douglas and Peucker, 1973).

    Parameters
    ----------
    columns : ndarray, shape (k, quantities)
        The vertices as they are drawn; nan where a quantity is absent.
    sizes : ndarray, shape (k, quantities)
        What distances at each vertex are compared with.
    tolerance : float
        Largest distance of a vertex that is left out, relative to its sizes; 0 keeps all.
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
            here = slice(first, last + 1)
            far = (np.abs(filled[here] - chord) / sizes[here]).max(axis=1)
            far[[0, -1]] = 0.0  # the ends are kept already
            worst = int(np.argmax(far))
            if far[worst] > tolerance:
                needed[first + worst] = True
                pieces += [(first, first + worst), (first + worst, last)]
    return np.flatnonzero(needed)
