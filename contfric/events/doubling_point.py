"""Orbits whose turn has the multiplier -1: a disturbance opens there that changes sign after each turn.

Near it orbits are solved normal to the tangent of their curve, also where that turns. A fold of the simpler
orbits may lie so near to a vertex that there is no orbit at parameters near it, or that Newton's method at
fixed parameters goes to the other side of the fold. With the unit tangent (t, r) of the curve at (z*, p*)
the orbit at the distance s solves

    F(z, p) = 0,    t . (z - z*) + r (p - p*) = s,

which is regular at a fold (H. B. Keller, 1977). For single orbits, with the assembled Jacobian.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from contfric.base.arrays import FloatArray, with_entries
from contfric.base.attributes import altered
from contfric.bvp.linear import equations_at, pencil_of_turn, tangent_of
from contfric.orbit.orbit import Orbit, Status
from contfric.orbit.solve import refine

#: Distance of a fold to its mirror image (or to its own second half) below which it may be the vertex
#: of a pitchfork (of a period doubling). There the system is singular and the state is good to about
#: 1e-5 only, while the parameter, stationary along the branch, is good to the square of that.
NEARLY = 1e-2
#: At such a vertex the symmetric (the undoubled) orbit has a multiplier -1 of its turn; what vanishes
#: there is zero to the accuracy of the parameter, far below this.
_OPENS = 1e-4
#: The same where the vertex is located: rounding, and where a multiplier touches -1 the root of it.
_LOCATED = 1e-7
#: Farthest in the parameter (relative to 1 + its value) from which a vertex is located: orbits this far from
#: it are within :data:`NEARLY` of each other.
_FAR = 1e-2
#: Most steps of the secant: two or three where a multiplier passes -1, many where it touches it.
_SECANTS = 40
#: Distance in the parameter at which a multiplier that passes -1 is told from one that touches it; and a
#: shorter one, where a fold is so near that there is no orbit on one side.
_NEARBY = (1e-6, 1e-8, 1e-10)
#: What vanishes at an opening is the difference of matrices of order 1: its rounding, with some reserve.
_ROUNDING = 1e-13
#: Odd parts below this are rounding: away from a vertex the orbit is symmetric (undoubled). Orbits with
#: a small odd part may be truly asymmetric, where a vertex lies near a fold.
EVEN = 1e-9
#: Most corrections: from near the curve it takes three to five.
_MOST_CORRECTIONS = 12
#: A correction (relative to 1 + the size of the orbit) that is rounding of the equations, and one below which
#: the next would be.
_ROUNDING, _LAST = 1e-14, 1e-9


def solved_at_vertex(orbit: Orbit, active: int) -> Orbit | None:
    """Return the orbit solved if its turn has a multiplier -1, else None."""
    solved = refine(orbit, damped=False)
    if not solved.converged:  # the simpler orbits turn there, too
        return _refined_along(orbit, active)
    opens = opening(solved)
    if not abs(opens) < _OPENS:
        return None
    refined, least = _refined(solved, active, opens)
    if _is_near(refined, solved) and least < _LOCATED:
        return refined
    return _refined_along(orbit, active)


def _is_near(orbit: Orbit, other: Orbit) -> bool:
    return float(np.abs(orbit.joints - other.joints).max()) < NEARLY


def opening(orbit: Orbit) -> float:
    """Return what vanishes where a disturbance that changes sign after one turn solves the equations.

    The pencil of one turn, ``P z_0 + Q z_N = 0``, with ``z_N = -K z_0``: the least singular value of
    P - Q K against the largest, with the sign of the determinant. Other than the multiplier -1 that it
    stands for, it is defined also on a bridge. Nan for an orbit that Newton has lost.
    """
    if not (orbit.converged and np.isfinite(orbit.joints).all()):
        return float(np.nan)
    p, q = pencil_of_turn(orbit.system, orbit.joints, orbit.vector)
    left = p - q @ orbit.system.closing
    if not np.isfinite(left).all():  # an orbit that Newton has lost
        return np.nan
    values = np.linalg.svd(left, compute_uv=False)
    return float(np.copysign(values[-1] / values[0], np.linalg.det(left)))


def opens_through(orbit: Orbit, active: int) -> bool:
    """Tell whether a multiplier of the turn passes -1 at a vertex, and does not only touch it.

    At a continuum (Omega = 1/2) it touches: the location is good to the root of rounding. Next to an exit
    that becomes tangential it passes -1 and then infinity: a shorter way tells that it passes. Where a fold
    is so near that there is no orbit on one side of the parameter the curve of orbits is asked.
    """
    value, decided = float(orbit.vector[active]), False
    size = orbit.model.size_of(active, value)
    for share in _NEARBY:
        offset = share * size
        sides = [opening(moved(orbit, active, value + s * offset)) for s in (-1.0, 1.0)]
        if np.isfinite(sides).all() and min(np.abs(sides)) > _ROUNDING:
            decided = True
            if sides[0] * sides[1] < 0.0:
                return True
    if decided:
        return False
    line = Line.through(orbit, active)
    along = [] if line is None else [line.at(s * _NEARBY[0]) for s in (-1.0, 1.0)]
    sides = [opening(there) for there in along if there is not None]
    return len(sides) == 2 and sides[0] * sides[1] < 0.0


def location_error(orbit: Orbit, active: int) -> float:
    """Return how well the parameter of a located opening is known: by rounding of what vanishes there.

    What vanishes has a slope along the curve of orbits, and so has the parameter; where that turns, its
    second order counts. Infinite where there is no curve.
    """
    line = Line.through(orbit, active)
    sides = [] if line is None else [line.at(s * _NEARBY[0]) for s in (-1.0, 1.0)]
    if len(sides) != 2 or None in sides:
        return np.inf
    (low, high) = (side for side in sides if side is not None)
    slope = abs(opening(high) - opening(low)) / (2.0 * _NEARBY[0])
    if not slope > 0.0:
        return np.inf
    off = (abs(opening(orbit)) + _ROUNDING) / slope
    values = [float(o.vector[active]) for o in (low, orbit, high)]
    rise = abs(values[2] - values[0]) / (2.0 * _NEARBY[0])
    bend = abs(values[2] - 2.0 * values[1] + values[0]) / _NEARBY[0] ** 2
    return rise * off + bend * off * off


def refined_opening(orbit: Orbit, active: int) -> Orbit | None:
    """Return the orbit nearby at which a disturbance opens that changes sign after a turn; or None."""
    found, least = _refined(orbit, active, opening(orbit))
    if found.converged and least < EVEN:
        return found
    along = _refined_along(orbit, active)
    return along if along is not None and abs(opening(along)) < EVEN else None


def _refined(orbit: Orbit, active: int, opens: float) -> tuple[Orbit, float]:
    """Return the orbit whose turn has the multiplier -1 exactly, by secants in the parameter.

    The best one that was met, and how far it misses: whether that is the multiplier is for the caller to say.
    """
    value = float(orbit.vector[active])
    size = orbit.model.size_of(active, value)
    return _by_secants(orbit, opens, lambda shift, near: moved(near, active, value + shift), size)


def _refined_along(orbit: Orbit, active: int) -> Orbit | None:
    """Do the same along the curve of orbits, where that turns near the vertex; None if it fails."""
    line = Line.through(orbit, active)
    start = None if line is None else line.at(0.0)
    if line is None or start is None:
        return None
    opens = opening(start)
    if not abs(opens) < _OPENS:
        return None
    lost = altered(start, status=Status.NOT_CONVERGED)
    found, least = _by_secants(start, opens, lambda shift, _: line.at(shift) or lost, 1.0)
    return found if _is_near(found, orbit) and least < _LOCATED else None


def _by_secants(
    orbit: Orbit, opens: float, orbit_at: Callable[[float, Orbit], Orbit], size: float
) -> tuple[Orbit, float]:
    """Return the orbit at which a disturbance opens, or the nearest of those met, and how far it misses.

    Once what vanishes has had both signs no step leaves the bracket: the secant of two values that are
    rounding leads anywhere.

    Parameters
    ----------
    opens : what vanishes at an opening, at the first orbit (:func:`opening`)
    orbit_at : the orbit at a shift from the first one, from another one nearby
    size : scale of the shifts
    """
    before, here = 0.0, 1e-7 * size  # far above rounding, far below the curve's curvature
    near = orbit_at(here, orbit)
    open_before, open_here = opens, opening(near)
    best, least = orbit, abs(open_before)
    ends = [np.nan, np.nan]  # the last places at which it was negative, and positive
    ends[int(open_before > 0.0)], ends[int(open_here > 0.0)] = before, here
    for _ in range(_SECANTS):
        if not np.isfinite(open_here) or open_before == open_here:
            break
        there = here - open_here * (here - before) / (open_here - open_before)
        if np.isfinite(ends).all() and not min(ends) < there < max(ends):
            there = 0.5 * (ends[0] + ends[1])
        if not abs(there) < _FAR * size:
            break
        before, open_before, last = here, open_here, here
        near = orbit_at(there, near)
        here, open_here = there, opening(near)
        ends[int(open_here > 0.0)] = here
        if abs(open_here) <= least:
            best, least = near, abs(open_here)
        if abs(here - last) < 1e-15 * size:
            break
    return best, least


def moved(orbit: Orbit, active: int, value: float) -> Orbit:
    """Return an orbit solved at another value of a parameter; its status says whether it is."""
    return refine(altered(orbit, vector=with_entries(orbit.vector, active, value)), damped=False)


@dataclass(frozen=True, eq=False)
class Line:
    """A curve of orbits near one of them: an orbit on or near the curve, and its unit tangent there.

    Attributes
    ----------
    orbit : where it begins
    active : index of the parameter
    tangent, slope : the tangent, of the joints and of the parameter
    """

    orbit: Orbit
    active: int
    tangent: FloatArray
    slope: float

    @classmethod
    def through(cls, orbit: Orbit, active: int) -> Line | None:
        """Return the curve through an orbit; None if it has no unique direction there."""
        try:
            tangent, slope = tangent_of(orbit.system, orbit.joints, orbit.vector, active)
        except np.linalg.LinAlgError:
            return None
        size = float(np.sqrt(np.sum(tangent**2) + slope**2))
        if not (np.isfinite(size) and size > 0.0):
            return None
        return cls(orbit, active, tangent / size, slope / size)

    def at(self, distance: float) -> Orbit | None:
        """Return the orbit at a distance along the tangent; None where Newton's method fails."""
        size = self.orbit.joints.size
        along = np.append(self.tangent.ravel(), self.slope)
        start = np.append(self.orbit.joints.ravel(), self.orbit.vector[self.active])
        x, full = start + distance * along, np.empty((size + 1, size + 1))
        full[size] = along
        before = np.inf
        for _ in range(_MOST_CORRECTIONS):
            joints, vector = self._split(x)
            at = self.orbit.system, joints, vector
            residual, full[:size, :size], full[:size, size:] = equations_at(*at, (self.active,))
            right = np.append(-residual, distance - along @ (x - start))
            try:
                step = np.linalg.solve(full, right)
            except np.linalg.LinAlgError:
                return None
            if not np.isfinite(step).all():
                return None
            x = x + step
            now = float(np.abs(step).max()) / (1.0 + float(np.abs(x).max()))
            if now < _ROUNDING or (now < _LAST and now >= 0.5 * before):
                joints, vector = self._split(x)
                done = Status.CONVERGED
                return replace(self.orbit, joints=joints, vector=vector, status=done)
            before = now
        return None

    def _split(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        joints = x[:-1].reshape(self.orbit.joints.shape)
        return joints, with_entries(self.orbit.vector, self.active, x[-1])
