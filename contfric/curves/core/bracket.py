"""Location of a change between two points of a curve, compiled.

The bracket is that of :mod:`contfric.continuation.core.bracket`; every trial is watched as any point.
"""

from __future__ import annotations

import numpy as np
from numba import types

from contfric.compiled import blocks, f8, helper, i8, indices, kernel
from contfric.continuation.core.bracket import Rules, bracketing
from contfric.continuation.core.geometry import PointsType
from contfric.continuation.core.locate import BY_LABEL, BY_TEST, SoughtType
from contfric.continuation.core.steps import AT_EVENT, EXTRA
from contfric.curves.core.correct import CurveProblemType, along_curve, correct_curve, observe_curve

#: Share of a step to which a location is bracketed.
_RESOLUTION = 4e-16
#: Values below this are rounding: a narrower bracket would follow noise.
_NOISE = 2e-15
#: What is left at a location that counts as found.
_FOUND = 1e-6
#: A margin without stationary points is infinite: this is as good, and fit for interpolation.
_LARGE = 1e3


@helper
def value_of(sought, points, row):  # type: ignore[no-untyped-def]
    """Return the value that is sought, at one row of the points."""
    ws, tests, labels = points.w, points.tests, points.labels
    if sought.kind == BY_TEST:
        return min(tests[row, sought.number], _LARGE)
    if sought.kind == BY_LABEL:
        margins = tests.shape[1] - labels.shape[1] - EXTRA
        size = max(tests[row, margins + sought.number], 1e-300)
        return size if labels[row, sought.number] == labels[0, sought.number] else -size
    least, planes = np.inf, sought.planes
    for k in range(planes.shape[0]):
        value = planes[k, 0] * ws[row, 0] + planes[k, 1] * ws[row, 1] + planes[k, 2]
        least = min(least, value)
    return least


@helper
def observed_value(way, sought, points, row):  # type: ignore[no-untyped-def]
    """Watch a corrected point, and return the value that is sought."""
    z, w, tw = points.joints[row], points.w[row], points.directions[row]
    observe_curve(way, z, w, tw, points.tests[row], points.labels[row], points.mu[row])
    return value_of(sought, points, row)


_bracket = bracketing(correct_curve, observed_value)


@kernel(types.Tuple((i8, f8))(CurveProblemType, blocks, SoughtType, PointsType, indices))
def locate_on_curve(problem, border, sought, points, counts):  # type: ignore[no-untyped-def]
    """Find where a value changes sign between rows 0 and 1 of the points; the location is left in row 3.

    Parameters
    ----------
    border : the vectors b and c, shape (2, N, m)
    points : four rows; the third one is for trials
    counts : what is counted

    Returns
    -------
    tuple
        (1 if it is bracketed to its last digits, 0 if not, -1 if no trial was solved; the value there).
    """
    nothing = min(sought.number, 0) - 1  # -1, but no literal
    way = along_curve(
        problem, border, points.joints.shape[1], points.joints.shape[2], nothing, counts
    )
    ends = value_of(sought, points, 0), value_of(sought, points, 1)
    rules = Rules(AT_EVENT, True, _NOISE, _RESOLUTION, 0.0)
    _, value, lost, solved = _bracket(way, sought, points, ends, rules)
    if not solved:
        return -1, value
    return (1 if not lost and value < _FOUND else 0), value
