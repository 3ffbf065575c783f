"""Vertices: where the branch of an asymmetric (a doubled) orbit meets the symmetric (the undoubled) one.

The parameter turns there as at a fold, and the equations of the branch that turns are singular. So the
meeting is recognised by the distance of the orbit to its mirror image (to its own second half), and
located on the simpler orbit, of which one multiplier of a turn is -1.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contfric.continuation.points import Point
from contfric.models.definition import FloatArray
from contfric.orbit.clock import clocked
from contfric.orbit.linear import pencil_of_turn
from contfric.orbit.orbit import Orbit, Status
from contfric.orbit.sections import crossings_near, in_halves, is_smooth
from contfric.orbit.solve import polish
from contfric.orbit.system import System, build_system
from contfric.orbit.words import half_of

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
    half = None if system.half else half_of(orbit.model, system.word, system.periods)
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
    n, odd = divmod(len(system.word), 2)
    if system.half or odd or system.periods % 2 or system.word[:n] != system.word[n:]:
        return None
    image: FloatArray = orbit.joints[n:].copy()
    image[:, 0] -= 0.5 * orbit.period
    if np.max(np.abs(image - orbit.joints[:n])) > _NEARLY:
        return None
    part = build_system(orbit.model, system.word[:n], system.periods // 2)
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
    n = len(system.word) // 2
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
    """Return the state matrix that takes the second half of a word to the first; None if none does."""
    n, odd = divmod(len(system.word), 2)
    if system.half or odd:
        return None
    symmetry = system.model.symmetry
    if symmetry is not None and half_of(system.model, system.word, system.periods) is not None:
        return symmetry.array()
    doubled = system.periods % 2 == 0 and system.word[:n] == system.word[n:]
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
    if not is_smooth(simple.model, whole.word) or simple.model.autonomous:
        return whole.joints
    return crossings_near(whole, joints)  # one each way, however long the orbit is


def _vertex(orbit: Orbit, active: int) -> Orbit | None:
    """Return the orbit solved if its turn has a multiplier -1, else None."""
    solved = polish(orbit, damped=False)
    if not solved.converged and orbit.system.holds:  # the symmetric bridge turns there, too
        solved = replace(orbit, status=Status.CONVERGED)
        return solved if abs(opening(solved)) < _OPENS else None
    if not solved.converged or not abs(opening(solved)) < _OPENS:
        return None
    refined = _refined(solved, active)
    same = float(np.max(np.abs(refined.joints - solved.joints))) < _NEARLY
    return refined if same and abs(opening(refined)) < _LOCATED else None


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

    At a continuum (Omega = 1/2) it touches: the place is good to the root of rounding.
    """
    value = float(orbit.vector[active])
    for beside in _BESIDE:
        offset = beside * (1.0 + abs(value))
        sides = [opening(moved(orbit, active, value + s * offset)) for s in (-1.0, 1.0)]
        if np.all(np.isfinite(sides)):
            return sides[0] * sides[1] < 0.0
    return False


def refined_opening(orbit: Orbit, active: int) -> Orbit | None:
    """Return the orbit nearby at which a disturbance opens that changes sign after a turn; or None."""
    found = _refined(orbit, active)
    return found if found.converged and abs(opening(found)) < _EVEN else None


def _refined(orbit: Orbit, active: int) -> Orbit:
    """Return the orbit whose turn has the multiplier -1 exactly, by secants in the parameter.

    The best one that was met: whether it has the multiplier is for the caller to ask. Once what vanishes has
    had both signs no step leaves the bracket: the secant of two values that are rounding leads anywhere.
    """
    value = float(orbit.vector[active])
    offset = 1e-7 * (1.0 + abs(value))  # far above rounding, far below the branch's curvature
    a, b = orbit, moved(orbit, active, value + offset)
    open_a, open_b = opening(a), opening(b)
    best, least = orbit, abs(open_a)
    ends = [np.nan, np.nan]  # the last places at which it was negative, and positive
    ends[int(open_a > 0.0)], ends[int(open_b > 0.0)] = value, float(b.vector[active])
    for _ in range(_SECANTS):
        if not np.isfinite(open_b) or open_a == open_b:
            break
        here = float(b.vector[active])
        there = here - open_b * (here - float(a.vector[active])) / (open_b - open_a)
        if np.all(np.isfinite(ends)) and not min(ends) < there < max(ends):
            there = 0.5 * (ends[0] + ends[1])
        if not abs(there - value) < _FAR * (1.0 + abs(value)):
            break
        a, open_a = b, open_b
        b = moved(b, active, there)
        open_b = opening(b)
        ends[int(open_b > 0.0)] = there
        if abs(open_b) <= least:
            best, least = b, abs(open_b)
        if abs(there - here) < 1e-15 * (1.0 + abs(value)):
            break
    return best


def moved(orbit: Orbit, active: int, value: float) -> Orbit:
    """Return an orbit solved at another value of a parameter; its status says whether it is."""
    vector = orbit.vector.copy()
    vector[active] = value
    return polish(replace(orbit, vector=vector), damped=False)


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
