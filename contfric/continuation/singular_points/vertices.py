"""Vertices: where the branch of an asymmetric (a doubled) orbit meets the symmetric (the undoubled) one.

The parameter turns there as at a fold, and the equations of the branch that turns are singular. So the
meeting is recognised by the distance of the orbit to its mirror image (to its own second half), and
located on the simpler orbit, of which one multiplier of a turn is -1.
"""

from __future__ import annotations

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.attributes import altered
from contfric.bvp.linear import null_vectors
from contfric.bvp.system import System, build_system
from contfric.continuation.half_branch import first_point
from contfric.continuation.points import Point, Settings
from contfric.events.doubling_point import EVEN, NEARLY, solved_at_vertex
from contfric.orbit.canonical.section_crossings import crossings_near
from contfric.orbit.canonical.sections import in_halves, is_smooth
from contfric.orbit.clock import clocked
from contfric.orbit.itinerary.itineraries import half_of
from contfric.orbit.orbit import Orbit

#: Odd parts below this (nondimensional) are what a singular system leaves undetermined.
_ODD = 1e-5


def symmetric_part(orbit: Orbit, active: int) -> Orbit | None:
    """Return the symmetric orbit that an orbit has come to, solved on its half; None if far."""
    part = symmetrised(orbit)
    return None if part is None else solved_at_vertex(part, active)


def symmetrised(orbit: Orbit, farthest: float = NEARLY) -> Orbit | None:
    """Return the symmetric part of an orbit, not solved; None if it is far from its mirror image."""
    system = orbit.system
    half = None if system.half else half_of(orbit.model, system.itinerary, system.periods)
    if half is None or orbit.model.symmetry is None:
        return None
    n = len(half)
    image = orbit.joints[n:].copy()
    image[:, 0] -= 0.5 * orbit.period
    image[:, 1:] = image[:, 1:] @ orbit.model.symmetry.array()
    if np.abs(image - orbit.joints[:n]).max() > farthest:
        return None
    middle = 0.5 * (image + orbit.joints[:n])
    middle = clocked(orbit.model, middle, float(middle[0, 0]) + 0.5 * orbit.period)
    part = build_system(orbit.model, half, system.periods, half=True)
    return altered(orbit, system=part, joints=middle)


def undoubled_part(orbit: Orbit, active: int, farthest: float = NEARLY) -> Orbit | None:
    """Return the orbit of half the period that an orbit has come to; None if far.

    At a fold at which holds turn by themselves orbits of any number of turns meet: it is that of one turn.
    """
    part = undoubled(orbit, farthest)
    solved = None if part is None else solved_at_vertex(part, active)
    if solved is None or not solved.system.holds:
        return solved
    return undoubled_part(solved, active, _ODD) or solved


def undoubled(orbit: Orbit, farthest: float = NEARLY) -> Orbit | None:
    """Return the orbit of half the period that an orbit is near, not solved; None if far."""
    orbit = in_halves(orbit)
    system = orbit.system
    n, odd = divmod(len(system.itinerary), 2)
    if system.half or odd or system.periods % 2 or system.itinerary[:n] != system.itinerary[n:]:
        return None
    image: FloatArray = orbit.joints[n:].copy()
    image[:, 0] -= 0.5 * orbit.period
    if np.abs(image - orbit.joints[:n]).max() > farthest:
        return None
    part = build_system(orbit.model, system.itinerary[:n], system.periods // 2)
    middle = 0.5 * (image + orbit.joints[:n])
    middle = clocked(orbit.model, middle, float(middle[0, 0]) + 0.5 * orbit.period)
    return altered(orbit, system=part, joints=middle)


def simpler_fold(orbit: Orbit, settings: Settings) -> Orbit | None:
    """Return the symmetric (undoubled) orbit that a bridge has come to at a fold of both; None if far.

    Where holds turn by themselves, each is longer or shorter beyond the fold: the branch on which two of them
    change their lengths with each other passes the orbit at which they are the same. That may itself be a
    shorter one, run through twice: each passage of it has a null vector of its own.
    """
    if not orbit.system.holds:
        return None
    for part in (symmetrised(orbit), undoubled(orbit)):
        if part is None or np.abs(part.joints - orbit.joints[: len(part.joints)]).max() > _ODD:
            continue
        null = null_vectors(part.system, part.joints, part.vector)
        if len(null) > 1 and (shorter := simpler_fold(part, settings)) is not None:
            return shorter
        point = first_point(part, settings, null[0], 0.0) if len(null) == 1 else None
        if point is not None and np.abs(point.joints - part.joints).max() < _ODD:
            return point.orbit(part, part.model.index_of(settings.parameter))
    return None


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
    gone = (size[1:] < EVEN**2) & (np.maximum.accumulate(size[:-1]) > (100.0 * EVEN) ** 2)
    locations = first + np.flatnonzero((turned | fallen | gone)[first:])
    if not len(locations):
        return None
    k = int(locations[0])
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
    if not same or np.abs(joints - point.joints).max() > NEARLY:
        return point
    return altered(point, joints=joints, w=simple.vector[[active]])


def joints_like(simple: Orbit, joints: FloatArray) -> FloatArray:
    """Return the joints of a simpler orbit where an orbit near it, run through once, has its own."""
    whole = simple.as_whole()
    if whole.joints.shape != joints.shape:
        return simple.doubled().joints
    if not is_smooth(simple.model, whole.itinerary) or simple.model.autonomous:
        return whole.joints
    return crossings_near(whole, joints)  # one each way, however long the orbit is


def parabola_vertex(before: Point, after: Point, share: float) -> Point:
    """Return the point between two at which the parameter's slope, taken as linear, vanishes."""
    step = after.arc - before.arc
    return altered(
        before,
        joints=before.joints + share * (after.joints - before.joints),
        w=before.w + 0.5 * before.direction * share * step,
        direction=np.zeros(1),
        arc=before.arc + share * step,
    )
