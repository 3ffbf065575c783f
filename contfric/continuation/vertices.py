"""Vertices: where the branch of an asymmetric (a doubled) orbit meets the symmetric (the undoubled) one.

The parameter turns there as at a fold, and the equations of the branch that turns are singular. So the
meeting is recognised by the distance of the orbit to its mirror image (to its own second half), and
located on the simpler orbit, of which one multiplier of a turn is -1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from contfric.continuation.along_curve import Line
from contfric.continuation.points import Point
from contfric.models.definition import FloatArray
from contfric.orbit.clock import clocked
from contfric.orbit.itineraries import half_of
from contfric.orbit.linear import pencil_of_turn
from contfric.orbit.orbit import Orbit, Status
from contfric.orbit.sections import crossings_near, in_halves, is_smooth
from contfric.orbit.solve import refine
from contfric.orbit.system import System, build_system

#: Distance of a fold to its mirror image (or to its own second half) below which it may be the vertex
#: of a pitchfork (of a period doubling). There the system is singular and the state is good to about
#: 1e-5 only, while the parameter, stationary along the branch, is good to the square of that.
_NEARLY = 1e-2
#: At such a vertex the symmetric (the undoubled) orbit has a multiplier -1 of its turn; what vanishes
#: there is zero to the accuracy of the parameter, far below this.
_OPENS = 1e-4
#: The same where the vertex is located: rounding, and where a multiplier touches -1 the root of it.
_LOCATED = 1e-7
#: Farthest in the parameter (relative to 1 + its value) from which a vertex is located: orbits this far from
#: it are within :data:`_NEARLY` of each other.
_FAR = 1e-2
#: Most steps of the secant: two or three where a multiplier passes -1, many where it touches it.
_SECANTS = 40
#: Distance in the parameter at which a multiplier that passes -1 is told from one that touches it; and a
#: shorter one, where a fold is so near that there is no orbit on one side.
_BESIDE = (1e-6, 1e-8)
#: What vanishes at an opening is the difference of matrices of order 1: its rounding, with some reserve.
_ROUNDING = 1e-13
#: Odd parts below this (nondimensional) are what a singular system leaves undetermined.
_ODD = 1e-5
#: Odd parts below this are rounding: away from a vertex the orbit is symmetric (undoubled). Orbits with
#: a small odd part may be truly asymmetric, where a vertex lies near a fold.
_EVEN = 1e-9


def symmetric_part(orbit: Orbit, active: int) -> Orbit | None:
    """Return the symmetric orbit that an orbit has come to, solved on its half; None if far."""
    part = symmetrised(orbit)
    return None if part is None else _vertex(part, active)


def symmetrised(orbit: Orbit, farthest: float = _NEARLY) -> Orbit | None:
    """Return the symmetric part of an orbit, not solved; None if it is far from its mirror image."""
    system = orbit.system
    half = None if system.half else half_of(orbit.model, system.itinerary, system.periods)
    if half is None or orbit.model.symmetry is None:
        return None
    n = len(half)
    image = orbit.joints[n:].copy()
    image[:, 0] -= 0.5 * orbit.period
    image[:, 1:] = image[:, 1:] @ orbit.model.symmetry.array()
    if np.max(np.abs(image - orbit.joints[:n])) > farthest:
        return None
    middle = 0.5 * (image + orbit.joints[:n])
    middle = clocked(orbit.model, middle, float(middle[0, 0]) + 0.5 * orbit.period)
    part = build_system(orbit.model, half, system.periods, half=True)
    return replace(orbit, system=part, joints=middle)


def undoubled_part(orbit: Orbit, active: int) -> Orbit | None:
    """Return the orbit of half the period that an orbit has come to; None if far."""
    part = undoubled(orbit)
    return None if part is None else _vertex(part, active)


def undoubled(orbit: Orbit) -> Orbit | None:
    """Return the orbit of half the period that an orbit is near, not solved; None if far."""
    orbit = in_halves(orbit)
    system = orbit.system
    n, odd = divmod(len(system.itinerary), 2)
    if system.half or odd or system.periods % 2 or system.itinerary[:n] != system.itinerary[n:]:
        return None
    image: FloatArray = orbit.joints[n:].copy()
    image[:, 0] -= 0.5 * orbit.period
    if np.max(np.abs(image - orbit.joints[:n])) > _NEARLY:
        return None
    part = build_system(orbit.model, system.itinerary[:n], system.periods // 2)
    middle = 0.5 * (image + orbit.joints[:n])
    middle = clocked(orbit.model, middle, float(middle[0, 0]) + 0.5 * orbit.period)
    return replace(orbit, system=part, joints=middle)


def passed_vertex(system: System, joints: FloatArray, first: int = 0) -> tuple[int, float] | None:
    """Return the step over which orbits become their own mirror images, or their own second halves.

    What is odd about them (the states of one half less their image in the other) changes sign there. A
    step that overshoots a vertex goes on along the mirror branch, and no fold is seen. Short steps may have
    points between whose odd part is not known: its sign is held against the last one that is.

    Parameters
    ----------
    joints : ndarray, shape (k, N, 1 + n)
        Consecutive points of a branch.
    first : int
        Steps from this point on are asked for; those before it serve the comparison.

    Returns
    -------
    (int, float) or None
        Index of the point before it, and the share of the step at which it is; infinite if the step has
        gone over to the simpler orbits, and tells nothing of it (minus infinity: from near ones).
    """
    image = _image_of_second_half(system)
    if image is None or len(joints) < 2:
        return None
    n = len(system.itinerary) // 2
    odd = (joints[:, n:, 1:] @ image - joints[:, :n, 1:]).reshape(len(joints), -1)
    size = np.sum(odd * odd, axis=1)
    known = np.maximum.accumulate(np.where(size > _ODD**2, np.arange(len(size)), -1))[:-1]
    ahead = np.sum(odd[1:] * odd[known], axis=1)
    turned = (known >= 0) & (size[1:] > _ODD**2) & (ahead < 0.0)
    fallen = (size[1:] < _ODD**2) & (size[:-1] > (10.0 * _ODD) ** 2)
    # in short steps the odd part is gone little by little
    gone = (size[1:] < _EVEN**2) & (np.maximum.accumulate(size[:-1]) > (100.0 * _EVEN) ** 2)
    places = first + np.flatnonzero((turned | fallen | gone)[first:])
    if not len(places):
        return None
    k = int(places[0])
    if not turned[k]:
        return k, float(np.inf if fallen[k] else -np.inf)
    if known[k] == k:
        return k, float(size[k] / (size[k] - ahead[k]))
    return int(known[k]), 1.0


def _image_of_second_half(system: System) -> FloatArray | None:
    """Return the state matrix that takes the second half of an itinerary to the first; None if none does."""
    n, odd = divmod(len(system.itinerary), 2)
    if system.half or odd:
        return None
    symmetry = system.model.symmetry
    if symmetry is not None and half_of(system.model, system.itinerary, system.periods) is not None:
        return symmetry.array()
    doubled = system.periods % 2 == 0 and system.itinerary[:n] == system.itinerary[n:]
    return np.eye(len(system.model.states)) if doubled else None


def at_vertex(point: Point, simple: Orbit, active: int) -> Point:
    """Return the end point of a branch at a vertex, from the simpler orbit that is located there."""
    joints = joints_like(simple, point.joints)
    same = joints.shape == point.joints.shape
    if not same or np.max(np.abs(joints - point.joints)) > _NEARLY:
        return point
    return replace(point, joints=joints, w=simple.vector[[active]])


def joints_like(simple: Orbit, joints: FloatArray) -> FloatArray:
    """Return the joints of a simpler orbit where an orbit near it, run through once, has its own."""
    whole = simple.as_whole()
    if whole.joints.shape != joints.shape:
        return simple.doubled().joints
    if not is_smooth(simple.model, whole.itinerary) or simple.model.autonomous:
        return whole.joints
    return crossings_near(whole, joints)  # one each way, however long the orbit is


def _vertex(orbit: Orbit, active: int) -> Orbit | None:
    """Return the orbit solved if its turn has a multiplier -1, else None."""
    solved = refine(orbit, damped=False)
    if not solved.converged:  # the simpler orbits turn there, too
        return _refined_along(orbit, active)
    if not abs(opening(solved)) < _OPENS:
        return None
    refined = _refined(solved, active)
    if _is_near(refined, solved) and abs(opening(refined)) < _LOCATED:
        return refined
    return _refined_along(orbit, active)


def _is_near(orbit: Orbit, other: Orbit) -> bool:
    return float(np.max(np.abs(orbit.joints - other.joints))) < _NEARLY


def opening(orbit: Orbit) -> float:
    """Return what vanishes where a disturbance that changes sign after one turn solves the equations.

    The pencil of one turn, ``P z_0 + Q z_N = 0``, with ``z_N = -K z_0``: the least singular value of
    P - Q K against the largest, with the sign of the determinant. Other than the multiplier -1 that it
    stands for, it is defined also on a bridge. Nan for an orbit that Newton has lost.
    """
    if not (orbit.converged and np.all(np.isfinite(orbit.joints))):
        return float(np.nan)
    p, q = pencil_of_turn(orbit.system, orbit.joints, orbit.vector)
    close = np.eye(len(p))
    close[0, 0] = 0.0 if orbit.model.autonomous else 1.0  # a turn may take another time
    close[1:, 1:] = orbit.system.layout.closing
    left = p - q @ close
    if not np.all(np.isfinite(left)):  # an orbit that Newton has lost
        return np.nan
    values = np.linalg.svd(left, compute_uv=False)
    return float(np.copysign(values[-1] / values[0], np.linalg.det(left)))


def opens_through(orbit: Orbit, active: int) -> bool:
    """Tell whether a multiplier of the turn passes -1 at a vertex, and does not only touch it.

    At a continuum (Omega = 1/2) it touches: the place is good to the root of rounding. Where a fold is so
    near that there is no orbit on one side of the parameter the curve of orbits is asked.
    """
    value = float(orbit.vector[active])
    for beside in _BESIDE:
        offset = beside * (1.0 + abs(value))
        sides = [opening(moved(orbit, active, value + s * offset)) for s in (-1.0, 1.0)]
        if np.all(np.isfinite(sides)):
            return sides[0] * sides[1] < 0.0
    line = Line.through(orbit, active)
    along = [] if line is None else [line.at(s * _BESIDE[0]) for s in (-1.0, 1.0)]
    sides = [opening(there) for there in along if there is not None]
    return len(sides) == 2 and sides[0] * sides[1] < 0.0


def place_error(orbit: Orbit, active: int) -> float:
    """Return how well the parameter of a located opening is known: by rounding of what vanishes there.

    What vanishes has a slope along the curve of orbits, and so has the parameter; where that turns, its
    second order counts. Infinite where there is no curve.
    """
    line = Line.through(orbit, active)
    sides = [] if line is None else [line.at(s * _BESIDE[0]) for s in (-1.0, 1.0)]
    if len(sides) != 2 or None in sides:
        return np.inf
    (low, high) = (side for side in sides if side is not None)
    slope = abs(opening(high) - opening(low)) / (2.0 * _BESIDE[0])
    if not slope > 0.0:
        return np.inf
    off = (abs(opening(orbit)) + _ROUNDING) / slope
    values = [float(o.vector[active]) for o in (low, orbit, high)]
    rise = abs(values[2] - values[0]) / (2.0 * _BESIDE[0])
    bend = abs(values[2] - 2.0 * values[1] + values[0]) / _BESIDE[0] ** 2
    return rise * off + bend * off * off


def refined_opening(orbit: Orbit, active: int) -> Orbit | None:
    """Return the orbit nearby at which a disturbance opens that changes sign after a turn; or None."""
    found = _refined(orbit, active)
    if found.converged and abs(opening(found)) < _EVEN:
        return found
    along = _refined_along(orbit, active)
    return along if along is not None and abs(opening(along)) < _EVEN else None


def _refined(orbit: Orbit, active: int) -> Orbit:
    """Return the orbit whose turn has the multiplier -1 exactly, by secants in the parameter.

    The best one that was met: whether it has the multiplier is for the caller to ask.
    """
    value = float(orbit.vector[active])
    size = 1.0 + abs(value)
    return _by_secants(orbit, lambda shift, near: moved(near, active, value + shift), size)


def _refined_along(orbit: Orbit, active: int) -> Orbit | None:
    """Do the same along the curve of orbits, where that turns beside the vertex; None if it fails."""
    line = Line.through(orbit, active)
    start = None if line is None else line.at(0.0)
    if line is None or start is None or not abs(opening(start)) < _OPENS:
        return None
    lost = replace(start, status=Status.NOT_CONVERGED)
    found = _by_secants(start, lambda shift, _: line.at(shift) or lost, 1.0)
    return found if _is_near(found, orbit) and abs(opening(found)) < _LOCATED else None


def _by_secants(orbit: Orbit, orbit_at: Callable[[float, Orbit], Orbit], size: float) -> Orbit:
    """Return the orbit at which a disturbance opens, or the one that is nearest to it of those met.

    Once what vanishes has had both signs no step leaves the bracket: the secant of two values that are
    rounding leads anywhere.

    Parameters
    ----------
    orbit_at : the orbit at a shift from the first one, from another one nearby
    size : scale of the shifts
    """
    before, here = 0.0, 1e-7 * size  # far above rounding, far below the curve's curvature
    near = orbit_at(here, orbit)
    open_before, open_here = opening(orbit), opening(near)
    best, least = orbit, abs(open_before)
    ends = [np.nan, np.nan]  # the last places at which it was negative, and positive
    ends[int(open_before > 0.0)], ends[int(open_here > 0.0)] = before, here
    for _ in range(_SECANTS):
        if not np.isfinite(open_here) or open_before == open_here:
            break
        there = here - open_here * (here - before) / (open_here - open_before)
        if np.all(np.isfinite(ends)) and not min(ends) < there < max(ends):
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
    return best


def moved(orbit: Orbit, active: int, value: float) -> Orbit:
    """Return an orbit solved at another value of a parameter; its status says whether it is."""
    vector = orbit.vector.copy()
    vector[active] = value
    return refine(replace(orbit, vector=vector), damped=False)


def parabola_vertex(before: Point, after: Point, share: float) -> Point:
    """Return the point between two at which the parameter's slope, taken as linear, vanishes."""
    step = after.arc - before.arc
    return replace(
        before,
        joints=before.joints + share * (after.joints - before.joints),
        w=before.w + 0.5 * before.direction * share * step,
        direction=np.zeros(1),
        arc=before.arc + share * step,
    )
