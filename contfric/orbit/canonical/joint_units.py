"""Units in which the joints of an orbit are measured when null directions are computed."""

from __future__ import annotations

import math

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.orbit.measured.samples import state_within
from contfric.orbit.orbit import Orbit

#: Where in a segment states are looked at: velocities are zero at its ends.
_INSIDE = 0.381966
#: States that are smaller than this share of the largest are rounding.
_NONE = 1e-12


def joint_units(orbit: Orbit) -> FloatArray:
    """Return what joints are measured in, shape (1 + n,): a phase of 1, and the size of each state.

    With these units a model in seconds has the same singular values as one in milliseconds.

    Examples
    --------
    >>> import contfric as cf
    >>> joint_units(cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})).round(1)
    array([2. , 1.4, 0.6])
    """
    inside = (state_within(orbit, i, _INSIDE * d) for i, d in enumerate(orbit.durations.tolist()))
    sizes = np.abs(np.concatenate([orbit.ends[:, 1:], list(inside)])).max(axis=0)
    sizes[sizes < _NONE * sizes.max()] = sizes.max() or 1.0  # what is always zero has no size
    return np.concatenate([[orbit.period / (math.tau * orbit.periods)], sizes])
