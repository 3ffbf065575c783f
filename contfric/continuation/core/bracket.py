"""A bracket between two points of a branch or curve, compiled: each trial is a solved point.

A trial is predicted by the cubic through both ends of the step and their tangents, and corrected
normal to the tangent between them. Places are chosen by Chandrupatla's method (Adv. Eng. Software 28
(1997) 145-149): inverse quadratic interpolation where the values are monotone enough for it, bisection
elsewhere; the bracket shrinks to the resolution of the arithmetic, or of the flow where that is integrated.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from contfric.compiled import helper
from contfric.compiling.references import by_reference
from contfric.continuation.core.geometry import copy_to, copy_vector, distance, interpolate

#: Share of the value at the start of a step that may be left at a location where trials fail: it is found,
#: and they fail by rounding, as they do where joints are at times of many periods.
_LEFT = 1e-9
#: Two trials that are farther apart than this many times the way between their locations lie on two sheets: a
#: step is refused whose ends differ by a third of a radian in direction.
_APART = 100.0
#: Trials after which a bracket has the width of the arithmetic, whatever the function.
_MOST_TRIALS = 120


@helper
def next_trial(low, high, f_low, f_high, x_old, f_old, x, closest):  # type: ignore[no-untyped-def]
    """Return Chandrupatla's next abscissa: inverse quadratic where it is monotone, else the middle.

    It is not closer to either end of the bracket than ``closest``.
    """
    a, fa = x, (f_low if x == low else f_high)
    b, fb = (high, f_high) if x == low else (low, f_low)
    c, fc = x_old, f_old
    share = 0.5
    if fb != fa and fc != fb and fc != fa and b != c:
        xi = (a - b) / (c - b)
        phi = (fa - fb) / (fc - fb)
        if phi * phi < xi and (1 - phi) * (1 - phi) < 1 - xi:
            share = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (
                fc - fb
            )
    width = abs(b - a)
    least = min(0.5, closest / width if width > 0.0 else 0.5)
    share = min(1.0 - least, max(least, share))
    return a + share * (b - a)


@helper
def limited(value):  # type: ignore[no-untyped-def]
    """Return a value fit for interpolation: a margin without stationary points is infinite."""
    return -1.0 if math.isnan(value) else min(value, 1e3)


@helper
def copy_row(points, target, source):  # type: ignore[no-untyped-def]
    """Copy one row of points to another."""
    copy_to(points.joints[target], points.joints[source])
    copy_to(points.tangents[target], points.tangents[source])
    copy_vector(points.w[target], points.w[source])
    copy_vector(points.directions[target], points.directions[source])
    copy_vector(points.tests[target], points.tests[source])
    copy_vector(points.labels[target], points.labels[source])
    copy_vector(points.mu[target], points.mu[source])
    points.arc[target] = points.arc[source]


class Rules(NamedTuple):
    """How a bracket is narrowed down.

    Attributes
    ----------
    accuracy : of a trial
    two_sided : whether the value has the sign that it has before, or is positive there
    noise : value that is rounding
    narrowest : width of a bracket that is as narrow as can be
    given_up : width below which it is not narrowed down where trials fail, 0 where sheets are not told apart
    """

    accuracy: float
    two_sided: bool
    noise: float
    narrowest: float
    given_up: float


def bracketing(correct_at: Any, value_at: Any) -> Any:
    """Return the bracket of branches or curves, as a helper.

    Parameters
    ----------
    correct_at : that of :func:`contfric.continuation.core.march.marching`
    value_at : returns the value that is sought, ``(way, sought, points, row)``
    """

    @helper
    def trial(way: Any, sought: Any, points: Any, x: Any, accuracy: Any, sign: Any) -> Any:
        """Solve for the point at a share of the step, in row 2; whether it is solved, and its value."""
        interpolate(points, x)
        zs, ws, tzs, tws = points.joints, points.w, points.tangents, points.directions
        fine, _ = correct_at(way, zs[2], ws[2], tzs[2], tws[2], accuracy)
        return fine, limited(sign * value_at(way, sought, points, 2)) if fine else -1.0

    @helper
    def bracket(way, sought, points, ends, rules):  # type: ignore[no-untyped-def]
        """Find where a value changes sign between rows 0 and 1 of the points.

        Parameters
        ----------
        way, sought : what the two functions need
        points : four rows; the third one is for trials, the location is left in the fourth
        ends : (value at row 0, value at row 1)
        rules : :class:`Rules`

        Returns
        -------
        tuple
            (position in the step, value there, whether trials fail after it or go over to another sheet,
            whether any did not).
        """
        way, points = by_reference(way), by_reference(points)
        noise, narrowest, given_up = rules.noise, rules.narrowest, rules.given_up
        zs, ws, sign = points.joints, points.w, -1.0 if rules.two_sided and ends[0] < 0.0 else 1.0
        f_low, f_high = limited(sign * ends[0]), limited(sign * ends[1])
        low, high, x, best, best_f, left = 0.0, 1.0, 0.5, 0.0, f_low, _LEFT * f_low
        x_old, f_old, lost, solved = low, f_low, False, False
        reach = _APART * distance(zs[0], ws[0], zs[1], ws[1], way.scale)
        at_end = f_low > 0.0 and f_high > 0.0
        copy_row(points, 3, 1 if at_end else 0)
        if at_end or f_low <= 0.0:
            return (1.0, f_high, lost, solved) if at_end else (best, best_f, lost, solved)
        if f_high < 0.0:
            x = min(0.99, max(0.01, f_low / (f_low - f_high)))
        for _ in range(_MOST_TRIALS):
            fine, f = trial(way, sought, points, x, rules.accuracy, sign)
            solved = solved or fine
            if fine and f >= 0.0:
                best, best_f = x, f
                copy_row(points, 3, 2)
            if f > 0.0:
                x_old, f_old = low, f_low
                low, f_low = x, f
            else:
                x_old, f_old = high, f_high
                high, f_high = x, f
                lost = not fine
                if fine and given_up > 0.0:
                    lost = distance(zs[2], ws[2], zs[3], ws[3], way.scale) > reach * (x - low)
                    if lost:
                        break
            if f == 0.0 or high - low <= narrowest or (f_low <= noise and f_high >= -noise):
                break
            if lost and high - low < given_up:
                break
            x = next_trial(low, high, f_low, f_high, x_old, f_old, x, 0.25 * narrowest)
        return best, best_f, lost and best_f > left, solved

    return bracket
