"""Pseudo-arclength continuation of conditions in q free parameters, compiled.

The march is that of :mod:`contfric.continuation.core.march`. The unknowns are the joints and the free
parameters; the border rows after the first are the q - 1 conditions: a bifurcation in two parameters, or
what is asked of a quantity.
"""

from __future__ import annotations

import numpy as np
from numba import types

from contfric.bvp.stationary_values import count_followed
from contfric.compiled import blocks, f8, i8, kernel
from contfric.continuation.core.geometry import CourseType
from contfric.continuation.core.march import marching
from contfric.curves.core.correct import (
    CurveProblemType,
    accept_curve,
    along_curve,
    correct_curve,
    observe_curve,
)

_march_points = marching(correct_curve, observe_curve, accept_curve)


@kernel(types.Tuple((i8, i8, f8))(CurveProblemType, blocks, CourseType))
def march_curve(problem, border, course):  # type: ignore[no-untyped-def]
    """Continue from a point of a curve until something happens.

    Parameters
    ----------
    border : the vectors b and c, shape (2, N, m); they follow the null vectors
    course : as that of :func:`contfric.continuation.core.march.march`

    Returns
    -------
    tuple
        (why it stopped, index of the last row written, next step).
    """
    zs, rows = course.points.joints, count_followed(problem.layout)
    way = along_curve(problem, border, zs.shape[1], zs.shape[2], rows, course.counts)
    guess_z, guess_w = np.empty((zs.shape[1], zs.shape[2])), np.empty(problem.which.shape[0])
    return _march_points(way, course, guess_z, guess_w)
