"""Orbits that leave an event at which several locations are singular at once, by leading orders.

Where a slide of no length comes in, its ends may move together, and no equation changes to first order. Such
a freedom v is a null vector of the Jacobian F_z of all equations. What it does is of order p, two at a touch
of rest and three where the acceleration falls through zero. With freedoms at k locations, and the distance
lambda in the parameter, the left null vectors L of F_z leave

    L F_lambda lambda + sum_j L d_j eps_j^p_j = 0,

k equations for the k numbers ``eps_j^p_j``. Their roots are how far each location opens: by the root of
lambda where the order is two, by the third root where it is three. So where orders differ the proportion
depends on the distance. One location alone may open as it likes: its direction is v. A start that opens
several of them in another proportion is no guess for Newton's method, whose matrix is nearly singular in all
of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.bvp.linear import equations_at
from contfric.orbit.canonical.slides import SHORT, time_unit
from contfric.orbit.orbit import Orbit

#: Singular values below this share of the largest belong to freedoms, as in :mod:`contfric.bvp.linear`.
_NULL = 1e-7
#: Components of a freedom below this share of the largest are rounding of a singular direction: its root.
_OWN = 1e-3
#: Length of the finite step along a freedom: locations of an arriving orbit may be open by 1e-4 (the third
#: root of rounding times its condition), and the next order is this much smaller.
_STEP = 1e-3


@dataclass(frozen=True, eq=False)
class Opening:
    """How the joints of an orbit move away from an event at which several locations of it open at once.

    Attributes
    ----------
    freedoms : ndarray, shape (k, N, m)
        Of the locations, each with the largest component 1.
    sizes : ndarray, shape (k,)
        How far each location opens at a unit of the parameter.
    orders : ndarray, shape (k,)
        The power of each freedom that the parameter is.
    """

    freedoms: FloatArray
    sizes: FloatArray
    orders: FloatArray

    def at(self, distance: float) -> FloatArray:
        """Return how the joints move where the location that opens farthest does so by a distance."""
        opens = self.sizes != 0.0
        shift = np.min((distance / np.abs(self.sizes[opens])) ** self.orders[opens])
        moved: FloatArray = np.tensordot(
            self.sizes * shift ** (1.0 / self.orders), self.freedoms, axes=1
        )
        return moved


def opening_together(orbit: Orbit, active: int) -> Iterator[Opening]:
    """Yield how the joints of an orbit at an event move where several locations of it open at once.

    For either side of the event; nothing where fewer than two locations are singular, or where their freedoms
    cannot be told apart.
    """
    start, jacobian, column = equations_at(orbit.system, orbit.joints, orbit.vector, (active,))
    left, size, right = np.linalg.svd(jacobian)
    rank = int(np.sum(size > _NULL * size[0]))
    if len(size) - rank < 2:
        return
    freedoms = _of_locations(right[rank:].reshape(-1, *orbit.joints.shape))
    if freedoms is None:
        return
    left = left[:, rank:].T
    effects, orders = _effects(orbit, freedoms, left, start)
    try:
        powers = np.asarray(np.linalg.solve(effects, -(left @ column[:, 0])), dtype=np.float64)
    except np.linalg.LinAlgError:
        return
    for side in (powers, -powers):
        sizes = _sizes(orbit, freedoms, orders, side)
        if sizes is not None and np.any(sizes):
            yield Opening(freedoms, sizes, orders)


def _of_locations(null: FloatArray) -> FloatArray | None:
    """Return null vectors that move the joints of one location each, shape (k, N, m); None if mixed.

    The projector on all of them falls into blocks, one a location.
    """
    k, count, m = null.shape
    flat = null.reshape(k, -1)
    projector = flat.T @ flat
    share = np.abs(projector).reshape(count, m, count, m).max(axis=(1, 3))
    alike = share > _OWN * share.max()
    found = []
    for joints in _connected(alike):
        kept = np.zeros((count, m), dtype=bool)
        kept[joints] = True
        size, vectors = np.linalg.eigh(projector * np.outer(kept.ravel(), kept.ravel()))
        if np.sum(size > 0.5) != 1:  # eigenvalues of a projector are 0 and 1
            return None
        vector = vectors[:, -1].reshape(count, m)
        found.append(vector / np.abs(vector).max())
    return np.array(found) if len(found) == k else None


def _connected(alike: NDArray[np.bool_]) -> list[list[int]]:
    """Return the groups of indices that a symmetric relation connects; others are left out."""
    waiting = {int(i) for i in np.flatnonzero(np.any(alike, axis=1))}
    groups = []
    while waiting:
        group = [waiting.pop()]
        for i in group:  # grows
            near = [j for j in map(int, np.flatnonzero(alike[i])) if j in waiting]
            waiting.difference_update(near)
            group += near
        groups.append(sorted(group))
    return groups


def _effects(
    orbit: Orbit, freedoms: FloatArray, left: FloatArray, start: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return what each freedom does to the remaining equations, shape (k, k), and its order, two or three.

    An even order is what steps forth and back have in common, an odd one what they differ by.
    """
    effects, orders = [], []
    for freedom in freedoms:
        ahead, back = (
            left
            @ (equations_at(orbit.system, orbit.joints + step * freedom, orbit.vector)[0] - start)
            for step in (_STEP, -_STEP)
        )
        even, odd = 0.5 * (ahead + back), 0.5 * (ahead - back)
        second = bool(np.linalg.norm(even) > np.linalg.norm(odd))
        orders.append(2.0 if second else 3.0)
        effects.append(even / _STEP**2 if second else odd / _STEP**3)
    return np.array(effects).T, np.array(orders)


def _sizes(
    orbit: Orbit, freedoms: FloatArray, orders: FloatArray, powers: FloatArray
) -> FloatArray | None:
    """Return how far each location opens at a unit of the parameter; None where a square would be negative.

    A square has two roots: that which a solution has (:func:`_longer`).
    """
    roots = np.sign(powers) * np.abs(powers) ** (1.0 / orders)
    for k in np.flatnonzero(orders == 2.0):
        if roots[k] < 0.0:
            return None
        roots[k] *= _longer(orbit, freedoms[k])
    return roots


def _longer(orbit: Orbit, freedom: FloatArray) -> float:
    """Return the sign with which a freedom makes the segments of no length last.

    A segment that is as long as before ends at the first zero, which a tangency has before it.
    """
    lasts = orbit.durations
    grows = np.roll(freedom[:, 0], -1) - freedom[:, 0]
    short = lasts[: len(grows)] < SHORT * time_unit(orbit)
    change = float(np.sum(grows[short])) or -float(np.sum(freedom[:, 0]))
    return -1.0 if change < 0.0 else 1.0
