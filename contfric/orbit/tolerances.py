"""Tolerances of inequalities: at an event they vanish, and their sign is rounding."""

from __future__ import annotations

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.system import Margin, System

#: A stick of length zero (at an event) has a duration of rounding over the rate of its release. Where that
#: rate vanishes as well (a slide that appears) it is the root of rounding.
_NO_TIME = 1e-10
#: A margin that vanishes is rounding of the motion (relative to the size of the orbit's times and states)
#: times the number of terms that it is made of, about this many.
_ROUNDING = 10.0
#: A joint that touches a surface, and a hold at its limits: located to the root of rounding where two
#: conditions meet.
_LOCATED = 1e-9


def margin_rounding(system: System, joints: FloatArray) -> float:
    """Return the rounding of a margin."""
    return _ROUNDING * system.model.rounding * (1.0 + float(np.abs(joints).max()))


def margin_slack(system: System, joints: FloatArray) -> FloatArray:
    """Return what each margin must be above, in the order of ``system.tests``.

    Before an exit with the rate -r its surface is passed by r^2 / 2: r is known to the root of rounding where
    the exit is tangential.
    """
    held = {hold.segment for hold in system.holds}
    located = [
        t.margin in (Margin.JOINT, Margin.LASTING) or t.segment in held for t in system.tests
    ]
    rounding = margin_rounding(system, joints)
    root = np.array([t.margin is Margin.EXIT for t in system.tests])
    return np.where(root, -np.sqrt(rounding), np.where(np.array(located), -_LOCATED, -rounding))


def no_time(system: System, joints: FloatArray, margins: FloatArray) -> FloatArray:
    """Return how much less than nothing each segment of the whole orbit may last: as exits are known."""
    first = system.layout.interior.shape[0]
    exits = np.abs(margins[first : first + system.segments])
    rounding = margin_rounding(system, joints)
    least = np.maximum(_NO_TIME, rounding / np.maximum(exits, np.sqrt(rounding)))
    return np.resize(least, system.segments * (2 if system.half else 1))
