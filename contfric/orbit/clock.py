"""The origin of time of an orbit: with an excitation any, without one the end of a cycle.

Every shift of an autonomous orbit in time is one too. Its joints are kept with the end of the turn at
time 0, so that the first of them is minus the duration of the turn (:mod:`contfric.bvp.equations`).
"""

from __future__ import annotations

from contfric.base.arrays import FloatArray
from contfric.models.definition import Model


def clocked(model: Model, joints: FloatArray, end: float) -> FloatArray:
    """Return the joints of one turn, shape (N, 1 + n), in the clock of their model.

    Parameters
    ----------
    end : float
        Time at which the turn ends, in the clock that the joints are given in.
    """
    if not model.autonomous:
        return joints
    moved = joints.copy()
    moved[:, 0] -= end
    return moved
