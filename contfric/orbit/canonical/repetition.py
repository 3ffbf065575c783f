"""Orbits that are shorter ones run through several times."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contfric.bvp.system import build_system
from contfric.orbit.canonical.sections import shortened
from contfric.orbit.clock import clocked
from contfric.orbit.orbit import Orbit

#: Joints that repeat themselves to this (relative to 1 + their size) are the same: rounding over a
#: multiplier's distance from 1 of 1e-7.
_SAME = 1e-8


def shortest(orbit: Orbit) -> Orbit:
    """Return the orbit of fewest periods that runs through the same solution; most often the same.

    Without an excitation its itinerary may repeat itself any number of times.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> shortest(orbit.doubled()).periods
    1
    """
    whole = orbit.as_whole()
    itinerary, joints = whole.system.itinerary, whole.joints
    most = len(itinerary) if whole.model.autonomous else whole.periods
    for turns in range(most, 1, -1):
        if most % turns:
            continue
        if (found := shortened(whole, turns)) is not None:
            return found
        part, rest = divmod(len(itinerary), turns)
        if rest or itinerary != itinerary[:part] * turns:
            continue
        step = joints[part:] - joints[:-part]
        step[:, 0] -= whole.period / turns
        if np.max(np.abs(step)) < _SAME * (1.0 + np.max(np.abs(joints))):
            system = build_system(whole.model, itinerary[:part], max(1, whole.periods // turns))
            first = clocked(whole.model, joints[:part], float(joints[part, 0]))
            return replace(whole, system=system, joints=first)
    return orbit
