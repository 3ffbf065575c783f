"""Corners: events at which two branches of one itinerary meet, and a march goes on from one to the other.

At the end of a continuum (Omega = 1/2, no damping) a margin falls to zero along one branch, and grows again
along another one of the same itinerary: the equations left over begin with a quadratic form, of which each is
one line (:mod:`contfric.atlas.families`). No test changes its sign there. Newton's method sees a hyperbola
that is as wide as rounding makes it, and steps that are short enough turn with it. What is smooth turns in
proportion to the step.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contfric.continuation.events import Bifurcation, End, EndReason
from contfric.continuation.points import Settings
from contfric.continuation.report import ROUGH
from contfric.continuation.side import Side
from contfric.continuation.sliding import nearly_reached
from contfric.orbit.orbit import Orbit

#: A turn (rad) over a step (arclength) that no smooth branch makes: steps are chosen to turn by 0.12, and
#: those that do within hundreds of roots of rounding have a radius of less than 1e-4.
_TURN, _STEP = 0.12, 1e-5
#: Distance from the start of a side below which the step control has not found its step yet.
_START = 10.0 * _STEP
#: Share of what a margin was along the side that is left of it where it vanishes; and the most that is left,
#: at the tip of a hyperbola as wide as rounding makes it: some hundreds of units of rounding come together in
#: a margin. Where margins stay above, steps are short for another reason.
_FALLEN, _LEFT = 1e-2, 1e3 * float(np.finfo(float).eps)


def ends_at_corner(orbit: Orbit, side: Side, settings: Settings, fresh: int) -> bool:
    """End a side at the first corner among its last points, if there is one at which a margin vanishes.

    Parameters
    ----------
    fresh : number of points that are new
    """
    rows, last = side.rows, side.last
    first = max(0, last - fresh)
    steps = rows.arc[first + 1 : last + 1] - rows.arc[first:last]
    short = (steps < _STEP) & (rows.arc[first:last] - side.first.arc > _START)
    if not short.any():
        return False
    z, w = rows.tangents[first : last + 1], rows.directions[first : last + 1, 0]
    along = np.sum(z[1:] * z[:-1], axis=(1, 2)) / z.shape[1] + w[1:] * w[:-1] * settings.scale
    for k in first + np.flatnonzero(short & (along < np.cos(_TURN))):
        tip = rows.point(int(k))
        found = nearly_reached(orbit, tip, settings)
        if found is None or not _has_fallen(side, orbit, int(k), found):
            continue
        # it lies within the step over which the branch turns
        known = max(ROUGH, 2.0 * float(steps[k - first]) / settings.width)
        side.rewind(int(k))
        side.end = End(EndReason[found.kind.name], bifurcation=replace(found, bound=known))
        return True
    return False


def _has_fallen(side: Side, orbit: Orbit, k: int, found: Bifurcation) -> bool:
    """Tell whether a margin has come to zero along a side, and is not zero all along."""
    before = side.rows.tests[: k + 1, orbit.system.tests.index(found.tests[0])]
    return bool(before[-1] < min(_LEFT, _FALLEN * np.max(before)))
