"""The joints of orbits, as the kernel of :mod:`contfric.response.capture` takes them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray, IntArray
from contfric.models.definition import Model
from contfric.orbit.orbit import Orbit

#: A joint is at most so far from one of a stable orbit that it has converged to it (nondimensional, small
#: against orbits of size 1): the linear map of the orbit holds there.
NEAR = 1e-3
#: The same as a share of 1 - |mu| with the largest multiplier mu: where the orbit meets an unstable one in a
#: fold, that one is as far as 1 - |mu| divided by a curvature of order 1.
_OF_MULTIPLIER = 1e-2
#: The same as a share of the distance to another orbit, and of the margins of the orbit's inequalities:
#: where one is violated the segments are others, and what they lead to as well.
_SHARE = 0.1
#: A margin below this is zero, and bounds nothing: a joint that lies at an event by its definition.
_ZERO = 1e-9
#: No radius is less: a solution does not come nearer to an orbit than rounding, amplified along it.
_LEAST = 1e-9


class Targets(NamedTuple):
    """Joints of orbits.

    Attributes
    ----------
    key : mode and surface, shape (k,)
    z : phase and state, after a reset, shape (k, 1 + n)
    owner : number of the orbit, shape (k,)
    radius : distance that counts as convergence, shape (k,)
    """

    key: IntArray
    z: FloatArray
    owner: IntArray
    radius: FloatArray


def targets_of(model: Model, orbits: Sequence[Orbit]) -> Targets:
    """Return the joints of orbits of the same parameters, with their radii.

    A simulation tells both sides of a section within one smooth field apart, and an orbit has one segment
    across it: each joint has a row for every mode with the field of its segment.
    """
    n, surfaces = len(model.states), [s.name for s in model.surfaces]
    keys: list[int] = []
    owners: list[int] = []
    rows = [np.empty((0, 1 + n))]
    for number, orbit in enumerate(orbits):
        itinerary, begins = orbit.itinerary, orbit.begins.copy()
        period = orbit.period / orbit.periods
        begins[:, 0] = 0.0 if model.autonomous else np.mod(begins[:, 0], period)
        for i, (mode, _) in enumerate(itinerary):
            on, whole = surfaces.index(itinerary[i - 1][1]), model.whole_mode(mode)
            alike = [k for k, m in enumerate(model.modes) if model.whole_mode(m.name) == whole]
            keys += [k * len(surfaces) + on for k in alike]
            owners += [number] * len(alike)
            rows.append(np.tile(begins[i], (len(alike), 1)))
    z, key = np.concatenate(rows), np.array(keys, dtype=np.int64)
    owner = np.array(owners, dtype=np.int64)
    least = np.array([_reach(orbit) for orbit in orbits])
    turn = orbits[0].period / orbits[0].periods if orbits and not model.autonomous else 0.0
    return Targets(key, z, owner, _radii(key, z, owner, turn, least))


def _reach(orbit: Orbit) -> float:
    """Return how near a joint has to be, for what the orbit itself says."""
    margins = np.abs(orbit.margins)
    slack = 1.0 - float(np.max(np.abs(orbit.multipliers), initial=0.0))
    bounds = [NEAR, _OF_MULTIPLIER * slack, *(_SHARE * margins[margins > _ZERO])]
    return max(_LEAST, float(min(bounds)))


def _radii(
    key: IntArray, z: FloatArray, owner: IntArray, turn: float, least: FloatArray
) -> FloatArray:
    """Return the radius of each joint: that of its orbit, smaller where a joint of another one is near."""
    radius = np.empty(len(key))
    for i in range(len(key)):
        radius[i] = least[owner[i]]
        apart = np.abs(z[(key == key[i]) & (owner != owner[i])] - z[i])
        if turn > 0.0:
            apart[:, 0] = np.minimum(apart[:, 0], turn - apart[:, 0])
        if len(apart):
            radius[i] = min(radius[i], _SHARE * float(np.min(np.max(apart, axis=1))))
    return radius
