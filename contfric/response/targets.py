"""The joints of orbits, as the kernel of :mod:`contfric.response.capture` takes them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from contfric.models.definition import FloatArray, Model
from contfric.orbit.orbit import Orbit
from contfric.orbit.system import IntArray

#: A joint within this distance of one of a stable orbit has converged to it: where an orbit attracts, its
#: neighbourhood of this size does, unless a fold, or a jump of the flow, is as near as that.
NEAR = 1e-6
#: Share of the distance between two orbits that the radius is at most, so that neither takes what is of the
#: other.
_SHARE = 0.1


class Targets(NamedTuple):
    """Joints of orbits.

    Attributes
    ----------
    key : mode and surface, shape (k,)
    z : phase and state, behind a reset, shape (k, 1 + n)
    owner : number of the orbit, shape (k,)
    radius : distance that counts as convergence, shape (k,)
    """

    key: IntArray
    z: FloatArray
    owner: IntArray
    radius: FloatArray


def targets_of(model: Model, orbits: Sequence[Orbit]) -> Targets:
    """Return the joints of orbits of the same parameters, with their radii."""
    n, surfaces = len(model.states), [s.name for s in model.surfaces]
    modes = [m.name for m in model.modes]
    keys: list[int] = []
    owners: list[int] = []
    rows = [np.empty((0, 1 + n))]
    for number, orbit in enumerate(orbits):
        word, begins = orbit.word, orbit.begins.copy()
        period = orbit.period / orbit.periods
        begins[:, 0] = 0.0 if model.autonomous else np.mod(begins[:, 0], period)
        for i, (mode, _) in enumerate(word):
            keys.append(modes.index(mode) * len(surfaces) + surfaces.index(word[i - 1][1]))
            owners.append(number)
        rows.append(begins)
    z, key = np.concatenate(rows), np.array(keys, dtype=np.int64)
    owner = np.array(owners, dtype=np.int64)
    turn = orbits[0].period / orbits[0].periods if orbits and not model.autonomous else 0.0
    return Targets(key, z, owner, _radii(key, z, owner, turn))


def _radii(key: IntArray, z: FloatArray, owner: IntArray, turn: float) -> FloatArray:
    """Return the radius of each joint: small, and smaller where a joint of another orbit is near."""
    radius = np.full(len(key), NEAR)
    for i in range(len(key)):
        other = (key == key[i]) & (owner != owner[i])
        apart = np.abs(z[other] - z[i])
        if turn > 0.0:
            apart[:, 0] = np.minimum(apart[:, 0], turn - apart[:, 0])
        if len(apart):
            radius[i] = min(NEAR, _SHARE * float(np.min(np.max(apart, axis=1))))
    return radius
