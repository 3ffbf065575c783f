"""First roots that cannot be missed: a march that is bounded by Taylor's remainder.

Let q be smooth with ``|q'''| <= M`` on ``[r, r + H]`` and ``w = s q > 0`` at r. On that interval::

    w(r + e) >= w + w' e + L e^2,      L = w''/2 - M H / 6,

so no root lies before the first positive zero ``e*`` of the right-hand side, and a step of
``min(e*, H)`` is safe. Near a transversal root H shrinks like the step itself, L tends to ``w''/2``,
and the steps converge to the root from one side like Halley's method. Near a grazing the steps stay
of the size ``sqrt(w / |L|)`` and carry the march past the minimum, or into the root, whichever there
is. No sampling grid is involved, and no bracket.

A march that starts on a root (a slide starts at ``v = 0``) first leaves it by the same bound divided
by e: ``w' + w'' e / 2 - M e^2 / 6 > 0``.
"""

from __future__ import annotations

import math

from contfric.compiled import helper

#: A step below this many units in the last place of the time ends the search: the root is reached.
_ULPS = 4.0 * 2.220446049250313e-16


@helper
def safe_step(w, w1, w2, m, window):  # type: ignore[no-untyped-def]
    """Return a step in (0, window] before which w has no root, from w > 0."""
    low = 0.5 * w2 - m * window / 6.0
    disc = w1 * w1 - 4.0 * low * w
    if low > 0.0 and (w1 >= 0.0 or disc < 0.0):
        return window
    if low == 0.0 and w1 >= 0.0:
        return window
    step = 2.0 * w / (-w1 + math.sqrt(disc))
    return min(step, window)


@helper
def leaving_step(w1, w2, m):  # type: ignore[no-untyped-def]
    """Return a step before which w has no second root, from w = 0; 0 if w does not become positive."""
    if w1 <= 0.0 and w2 <= 0.0:
        return 0.0
    if w1 < 0.0:
        return 0.0
    # positive root of w1 + w2 e/2 - m e^2/6, written without cancellation
    half = 0.25 * w2
    third = m / 6.0
    root = math.sqrt(half * half + third * w1)
    if half >= 0.0:
        return (half + root) / third
    return w1 / (root - half)


@helper
def window_of(w, w1, natural):  # type: ignore[no-untyped-def]
    """Return the window of the next bound: twice Newton's step, at most the natural scale."""
    if w1 < 0.0:
        return min(natural, -2.0 * w / w1 + 1e-300)
    return natural


@helper
def reached(step, tau):  # type: ignore[no-untyped-def]
    """Tell whether a step has become as small as the resolution of time."""
    return step <= _ULPS * (abs(tau) + step) or step < 1e-300
