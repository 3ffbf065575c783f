"""A solution in which a contact slips to one side only, a little less in each period, until it sticks.

Such a motion is not periodic, however near its returns are: its creep ``c`` a period falls with the distance
``e`` that is left. A massless slider slips by the excess of its stretch, ``c = k e``. A mass that sticks lets
go where the excess of its load, at most like e, lasts for a time like the root of e: it gets a velocity like
``e**(3/2)``, and ``c = k e**2``. For any ``c = k e**p`` with a small c/e the ratio r of two creeps is
``1 - p c/e``, so that ``q = c/(1 - r) = e/p``; and q falls by c/p from one creep to the next, which gives p
(for p = 1 both hold for any r). What the motion comes to is an orbit of the itinerary without these slides,
at a position by e farther on: one of a continuum (:mod:`contfric.orbit.conserved`).
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from contfric.models.definition import FloatArray
from contfric.orbit.conserved import conserved
from contfric.orbit.one_way import only_grows
from contfric.orbit.simulation import Trajectory

#: Powers of the law of a creep, and how well two estimates of it agree where it holds.
_LEAST, _MOST, _AGREE = 0.9, 2.1, 0.1
#: Farther by this, so that the contact sticks although the distance is an estimate.
_BEYOND = 1.01


def creeps(trajectory: Trajectory, lag: int) -> bool:
    """Tell whether the last events are those of an itinerary in which something only grows."""
    return bool(only_grows(trajectory.model, trajectory.itinerary_from(-lag)))


def beyond_creep(trajectory: Trajectory, lag: int) -> tuple[float, FloatArray] | None:
    """Return time and state after the end of a creep; None while it does not follow its law.

    Parameters
    ----------
    lag : events after which the solution nearly returns
    """
    model, itinerary = trajectory.model, trajectory.itinerary_from(-lag)
    modes = only_grows(model, itinerary)
    if len(trajectory) < 4 * lag + 1 or not modes:
        return None
    joint = next(k for k in range(1, lag + 1) if itinerary[-k][0] not in modes) + 1
    still = conserved(model, tuple(pair for pair in itinerary if pair[0] not in modes))
    at = [trajectory.states[-1 - k * lag] for k in range(5)]
    steps = [still.T @ (still @ (at[k] - at[k + 1])) for k in range(4)]
    left = _left([float(np.linalg.norm(step)) for step in steps])
    if left is None or any(steps[0] @ step <= 0.0 for step in steps):
        return None
    state = trajectory.states[-joint] + _BEYOND * left * steps[0] / np.linalg.norm(steps[0])
    return float(trajectory.times[-joint]), np.asarray(state)


def _left(creep: list[float]) -> float | None:
    """Return how far a motion still creeps by its last four creeps, the last one first; None without a law.

    Examples
    --------
    >>> round(_left([1.0, 2.0, 4.0, 8.0]), 12)  # 1/2 + 1/4 + ...
    1.0
    """
    if not all(now < before for now, before in pairwise(creep)):
        return None
    q = [now / (1.0 - now / before) for now, before in pairwise(creep)]
    powers = [creep[k + 1] / (q[k + 1] - q[k]) if q[k + 1] > q[k] else np.inf for k in range(2)]
    p = powers[0]
    if not (_LEAST < p < _MOST and abs(powers[1] - p) < _AGREE * p):
        return None
    return p * q[0] - creep[0]
