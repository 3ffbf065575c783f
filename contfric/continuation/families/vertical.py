"""Families of orbits at one value of the parameter, whose equations are singular all along.

Without damping, at Omega = 1/2, slides last whole natural periods whatever their amplitude: orbits without
sticks are a family at this one value (:mod:`contfric.continuation.families.continuum`). Let z be the joints,
F = 0 the equations, a the location along the family and b the distance of the parameter from its value. By
the method of Lyapunov and Schmidt one equation is left, and it begins with the square,

    ``g(a, b) = c(a) b^2 + ...``,

so that the equations with the parameter have a plane of null vectors at every orbit of the family. A march in
this parameter knows it to the root of rounding only, takes the sign of its slope for folds, and its steps get
lost. Two things are regular, though.

* **The value.** With w the left null vector of F_z, ``w F_b = 2 c b`` passes zero at the family's value,
  which is located to rounding by secants. All of F but its part along w vanishes at each trial: with v the
  right null vector, Newton's corrections dz solve ``F_z dz + s w = -F``, ``v dz = 0``, which is regular.
* **Another parameter q**, with ``w F_q`` not zero (the damping). In (z, q) the family is a curve with a
  unique tangent and q constant: it is traced along q by the ordinary march, with all events that end it.

Where g vanishes identically, orbits are a family at each value of the parameter: that is not treated here.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contfric.base.arrays import FloatArray, with_entries
from contfric.bvp.linear import equations_at, null_space
from contfric.continuation.accuracy.rounding import LEAST
from contfric.continuation.branch import Branch
from contfric.continuation.families.continuum import continua_of
from contfric.continuation.located_event import ROUGH
from contfric.continuation.points import Settings
from contfric.events.bifurcation import TERMINAL, Bifurcation, End
from contfric.orbit.orbit import Orbit

#: Smallest singular value of the equations (joints alone), relative to the largest, next to a family.
_NEARLY = 1e-2
#: Distances along the family (root mean square of joints) at which an orbit inside of it is looked for.
_INSIDE = (1e-2, -1e-2, 1e-3, -1e-3, 1e-4, -1e-4, 1e-5, -1e-5)
#: Steps of Newton's method at one value, and trials of the value.
_STEPS, _TRIALS = 8, 12
#: A correction of Newton's method that is larger than the one before, and than this, says that it does not
#: converge: next to a solution each is the square of the one before, down to rounding times the condition.
_STALLS = 1e-6
#: How far, in second smallest singular values, the reduced equations are solved for: Newton's method
#: converges to a distance of that value over the second derivative (Kantorovich), of order one or less.
_REACH = 10.0
#: Second trial of the value, and how far from the first it may be found (relative to 1 + its size).
_TRIAL, _FAR = 1e-6, 1e-2
#: What is left of the equations at an orbit of the family, and of w F there. (A damping q that is nearly
#: nothing leaves w F_q q, in proportion to the distance from the symmetric orbit: no family.)
_SOLVED, _MISSED = 1e-11, 1e-13
#: The same at the first trial of the value.
_NEAR = 1e-10
#: Rounding of w F_b relative to F_b; and of q along a family.
_ROUNDED, _CONSTANT = 1e-12, 1e-11
#: Slope of w F_b, and w F_q relative to F_b, below which they are rounding.
_FLAT, _OPENS = 1e-6, 1e-4
#: Null vectors of the equations with the parameter.
_PLANE = 2


#: The left and the right null vector of the equations, w and v.
Border = tuple[FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class VerticalFamily:
    """An orbit inside of a family, at its value.

    Attributes
    ----------
    orbit : the orbit, on its whole period
    along : the direction of the family, shape (N, m)
    active, other : the parameter that is constant, and the one along which the equations are regular
    missed : what is left of w F, which is not made small: rounding in a family
    """

    orbit: Orbit
    along: FloatArray
    active: int
    other: int
    missed: float

    def settings(self, settings: Settings) -> Settings:
        """Return the settings with which the family is traced along the other parameter."""
        value = float(self.orbit.vector[self.other])
        name = self.orbit.model.parameters[self.other].name
        inside = replace(settings, parameter=name, low=value - 1.0, high=value + 1.0)
        return replace(inside, low_reason="", high_reason="", grows=False, stop_at=())

    def at_its_value(self, branch: Branch) -> Branch | None:
        """Return the traced family as a branch at one value of the parameter that was asked for.

        None if the other parameter is not that of the family.
        """
        if abs(float(np.median(branch.values)) - self.orbit.vector[self.other]) > _CONSTANT:
            return None
        vector, name = self.orbit.vector, self.orbit.model.parameters[self.active].name
        moved = {id(b): _at(b, vector) for b in branch.bifurcations}
        ends = tuple(_end_at(end, moved, vector) for end in branch.ends)
        found = replace(
            branch,
            parameter=name,
            vector=vector,
            values=np.full(len(branch), vector[self.active]),
            bifurcations=tuple(moved.values()),
            ends=(ends[0], ends[1]),
            notes=(),
        )
        return replace(found, notes=tuple(continua_of(found)))


def _at(event: Bifurcation, vector: FloatArray) -> Bifurcation:
    orbit = replace(event.orbit, vector=vector)
    # what other branches have of a sliding event there is known to the root of rounding
    known = ROUGH if event.kind in TERMINAL else LEAST
    return replace(event, params=orbit.params, orbit=orbit, bound=known)


def _end_at(end: End, moved: dict[int, Bifurcation], vector: FloatArray) -> End:
    if end.bifurcation is None:
        return end
    known = moved.get(id(end.bifurcation))
    return replace(end, bifurcation=known or _at(end.bifurcation, vector))


def family_near(orbit: Orbit, active: int, within: float = 1e-6) -> VerticalFamily | None:
    """Return the family at one value of a parameter that an orbit belongs to, or is next to; None if none is.

    ``within`` is how far from the orbit's parameter its value may be.

    Examples
    --------
    >>> import contfric as cf
    >>> family_near(cf.find_orbit("coulomb", {"Omega": 0.51, "S": 0.32, "S0": 0.4}), 0) is None
    True
    """
    if orbit.model.autonomous or orbit.system.holds:
        return None
    try:
        return _next_to(orbit.as_whole(), active, within)
    except np.linalg.LinAlgError:  # with its border singular: more than one null vector
        return None


def _next_to(whole: Orbit, active: int, within: float) -> VerticalFamily | None:
    """Return the family next to an orbit on its whole period."""
    by_joints = equations_at(whole.system, whole.joints, whole.vector)[1]
    left, size, right = np.linalg.svd(by_joints)
    if size[-1] > _NEARLY * size[0]:
        return None
    distances = [d for d in _INSIDE if abs(d) < _REACH * size[-2]]
    if not distances:  # several nearly vanish, as where a slide is about to: no family is told
        return None
    border = left[:, -1], right[-1]
    along = right[-1].reshape(whole.joints.shape)
    along = along * np.sqrt(len(along)) / np.linalg.norm(along)
    first = replace(whole, joints=whole.joints + distances[0] * along)
    joints = _reduced(first, whole.vector, border)
    if joints is None:
        return None
    residual, _, _ = equations_at(whole.system, joints, whole.vector)
    if not np.abs(residual).max() < _NEAR + within**2:  # it is c b^2 near an orbit of a family
        return None
    for distance in distances:
        moved = replace(whole, joints=whole.joints + distance * along)
        found = _at_value(moved, active, border)
        if found is not None and found.orbit.admissible and not found.orbit.symmetric:
            return found if found.missed < _MISSED else None
    return None


def _at_value(orbit: Orbit, active: int, border: Border) -> VerticalFamily | None:
    """Return the orbit of a family next to a guess, at the value at which w F_b vanishes."""
    start = float(orbit.vector[active])
    trials: list[tuple[float, float]] = []
    value = start
    for _ in range(_TRIALS):
        vector = with_entries(orbit.vector, active, value)
        joints = _reduced(orbit, vector, border)
        if joints is None:
            return None
        residual, by_joints, by_parameters = equations_at(
            orbit.system, joints, vector, range(len(vector))
        )
        w, along = _null_vectors(by_joints, border)
        rates = w @ by_parameters
        scale = float(np.linalg.norm(by_parameters[:, active]))
        trials.append((value, float(rates[active])))
        if abs(rates[active]) < _ROUNDED * scale and len(trials) > 1:
            break
        value = _secant(trials, _TRIAL * orbit.model.size_of(active, start))
        if not abs(value - start) <= _FAR * orbit.model.size_of(active, start):
            return None
    else:
        return None
    there = replace(orbit, joints=joints, vector=vector, residual=float(np.abs(residual).max()))
    rates[active] = 0.0
    other = int(np.argmax(np.abs(rates)))
    vectors, _ = null_space(there.system, joints, vector, active)
    regular = len(vectors) == _PLANE and abs(rates[other]) > _OPENS * scale
    if not regular or there.residual > _SOLVED or _is_flat(trials, scale):
        return None
    missed = abs(float(w @ residual))
    return VerticalFamily(there, along.reshape(joints.shape), active, other, missed)


def _secant(trials: list[tuple[float, float]], first: float) -> float:
    """Return the next trial of the value; infinite where w F_b does not change."""
    if len(trials) == 1:
        return trials[0][0] + first
    (x0, g0), (x1, g1) = trials[-2:]
    return np.inf if g1 == g0 else x1 - g1 * (x1 - x0) / (g1 - g0)


def _is_flat(trials: list[tuple[float, float]], scale: float) -> bool:
    """Tell whether w F_b vanishes at other values as well: then orbits are a family at each of them."""
    (x0, g0), (x1, g1) = trials[:2]
    return abs(g1 - g0) < _FLAT * scale * abs(x1 - x0)


def _bordered(by_joints: FloatArray, border: Border) -> FloatArray:
    """Return the matrix [[F_z, w], [v, 0]]."""
    size = len(by_joints)
    full = np.empty((size + 1, size + 1))
    full[:size, :size], full[size, size] = by_joints, 0.0
    full[:size, size], full[size, :size] = border
    return full


def _null_vectors(by_joints: FloatArray, border: Border) -> Border:
    """Return the left and the right null vector, from those of a matrix nearby."""
    full = _bordered(by_joints, border)
    last = np.append(np.zeros(len(by_joints)), 1.0)
    left, right = (np.linalg.solve(matrix, last)[:-1] for matrix in (full.T, full))
    return left / np.linalg.norm(left), right / np.linalg.norm(right)


def _reduced(orbit: Orbit, vector: FloatArray, border: Border) -> FloatArray | None:
    """Return the joints at which all equations hold but one, the part of F along w (Lyapunov, Schmidt).

    None where Newton's method goes away: along no family, as at an event known so roughly that any orbit may
    seem to be next to one. (Its iterates may have segments of a thousand periods, which cost as much.)
    """
    joints, before = orbit.joints, np.inf
    for _ in range(_STEPS):
        residual, by_joints, _ = equations_at(orbit.system, joints, vector)
        full = _bordered(by_joints, border)
        if not (np.isfinite(full).all() and np.isfinite(residual).all()):
            return None
        change = np.linalg.solve(full, np.append(-residual, 0.0))[:-1]
        size = float(np.abs(change).max())
        if size > max(before, _STALLS):
            return None
        joints, before = joints + change.reshape(joints.shape), size
        if size < np.finfo(float).eps:
            break
    return joints
