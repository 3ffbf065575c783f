"""Which branches end at a branch point, and in which direction they leave it."""

from __future__ import annotations

import numpy as np

from contfric.continuation.branch import Branch
from contfric.continuation.crossing import Crossing, Direction
from contfric.models.definition import FloatArray
from contfric.orbit.clock import clocked
from contfric.orbit.orbit import Orbit

#: Cosine above which two directions are the same.
_ALONG = 0.9
#: Joints that agree to this are those of the same motion: ends of branches at a branch point are located.
_SAME = 1e-6


def starts_along(branch: Branch, crossing: Crossing, direction: Direction, scale: float) -> bool:
    """Tell whether a branch has an end at a branch point and leaves it in a direction."""
    orbit = crossing.orbit
    if len(branch) < 2 or branch.system.half != orbit.system.half:
        return False
    for tip, inner in ((0, 1), (-1, -2)):
        end = _aligned(branch, tip, tip, orbit)
        near = _aligned(branch, inner, tip, orbit)
        if end is None or near is None or np.abs(end - orbit.joints).max() > _SAME:
            continue
        slope = float(branch.values[inner] - branch.values[tip])
        if direction.cosine(near - end, slope, scale) > _ALONG:
            return True
    return False


def _aligned(branch: Branch, k: int, reference: int, orbit: Orbit) -> FloatArray | None:
    """Return the joints of a point, turned so that those of another one are next to an orbit's.

    A branch may begin with another segment of the same solution, and in another period.
    """
    itinerary, wanted = branch.system.itinerary, orbit.system.itinerary
    if len(itinerary) != len(wanted) or branch.system.half:
        return branch.joints[k] if itinerary == wanted else None
    best: tuple[float, FloatArray] | None = None
    for first in range(len(itinerary)):
        if itinerary[first:] + itinerary[:first] != wanted:
            continue
        turned = [_turned(branch[i], first) for i in (reference, k)]
        shift = 0.0
        if not orbit.model.autonomous:
            unit = orbit.period / orbit.periods
            shift = unit * round(float(turned[0][0, 0] - orbit.joints[0, 0]) / unit)
        for joints in turned:
            joints[:, 0] -= shift
        gap = float(np.abs(turned[0] - orbit.joints).max())
        if best is None or gap < best[0]:
            best = gap, turned[1]
    return None if best is None else best[1]


def _turned(orbit: Orbit, first: int) -> FloatArray:
    """Return the joints of an orbit from another segment on."""
    joints = np.roll(orbit.joints, -first, axis=0)
    joints[len(joints) - first :, 0] += orbit.period
    return clocked(orbit.model, joints, float(joints[0, 0]) + orbit.period)
