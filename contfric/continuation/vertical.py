"""Families of orbits at one value of the parameter, whose equations are singular all along.

Without damping, at Omega = 1/2, slides last whole natural periods whatever their amplitude: orbits without
sticks are a family at this one value (:mod:`contfric.continuation.continuum`). Let z be the joints, F = 0 the
equations, a the place along the family and b the distance of the parameter from its value. By the method of
Lyapunov and Schmidt one equation is left, and it begins with the square,

    ``g(a, b) = c(a) b^2 + ...``,

so that the equations with the parameter have a plane of null vectors at every orbit of the family. A march in
this parameter knows it to the root of rounding only, takes the sign of its slope for folds, and its steps get
lost. Two things are regular, though.

* **The value.** With w the left null vector of F_z, ``w F_b = 2 c b`` passes zero at the family's value,
  which is located to rounding by secants. F is made as small as it can be at each trial (Gauss and Newton).
* **Another parameter q**, with ``w F_q`` not zero (the damping). In (z, q) the family is a curve with a
  unique tangent and q constant: it is traced along q by the ordinary march, with all events that end it.

Where g vanishes identically, orbits are a family at each value of the parameter: that is not treated here.

Where a symmetric branch passes the family a multiplier of its half touches -1, with the square of the
distance: no test changes its sign there. It is looked for where a multiplier comes near -1 and leaves again,
and may touch it: its distance from -1 is convex on either side of a touch, so that the line through two
points on one side is at zero before the touch is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from contfric.continuation.accuracy import LEAST
from contfric.continuation.branch import Branch
from contfric.continuation.continuum import continua_of
from contfric.continuation.events import TERMINAL, Bifurcation, End, Kind
from contfric.continuation.moved_by_errors import UNITS
from contfric.continuation.openings import in_order
from contfric.continuation.points import Settings
from contfric.continuation.report import ROUGH
from contfric.models.definition import FloatArray
from contfric.orbit.linear import equations_at, null_space
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine
from contfric.orbit.system import Margin

#: Smallest singular value of the equations (joints alone), relative to the largest, next to a family.
_NEARLY = 1e-2
#: Distances along the family (root mean square of joints) at which an orbit inside of it is looked for.
_INSIDE = (1e-2, -1e-2, 1e-3, -1e-3, 1e-4, -1e-4, 1e-5, -1e-5)
#: Steps of Gauss and Newton at one value, and trials of the value.
_STEPS, _TRIALS = 8, 12
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
#: A multiplier of a symmetric branch that comes this near to -1 and leaves again is asked for a family.
_TOUCHES = 1e-2
#: Reserve of the line through two points, by which it may miss the touch: far off the distance is not convex.
_RESERVE = 2.0


@dataclass(frozen=True, eq=False)
class Family:
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


def family_near(orbit: Orbit, active: int, within: float = 1e-6) -> Family | None:
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
    whole = orbit.as_whole()
    _, size, right = np.linalg.svd(equations_at(whole.system, whole.joints, whole.vector)[1])
    if size[-1] > _NEARLY * size[0]:
        return None
    along = right[-1].reshape(whole.joints.shape)
    along = along * np.sqrt(len(along)) / np.linalg.norm(along)
    first = replace(whole, joints=whole.joints + _INSIDE[0] * along)
    joints = _least(first, whole.vector)
    if joints is None:
        return None
    residual, _, _ = equations_at(whole.system, joints, whole.vector)
    if not np.max(np.abs(residual)) < _NEAR + within**2:  # it is c b^2 near an orbit of a family
        return None
    for distance in _INSIDE:
        moved = replace(whole, joints=whole.joints + distance * along)
        found = _at_value(moved, active)
        if found is not None and found.orbit.admissible and not found.orbit.symmetric:
            return found if found.missed < _MISSED else None
    return None


def _at_value(orbit: Orbit, active: int) -> Family | None:
    """Return the orbit of a family next to a guess, at the value at which w F_b vanishes."""
    start = float(orbit.vector[active])
    trials: list[tuple[float, float]] = []
    value, normal = start, None
    for _ in range(_TRIALS):
        vector = orbit.vector.copy()
        vector[active] = value
        joints = _least(orbit, vector)
        if joints is None:
            return None
        residual, by_joints, by_parameters = equations_at(orbit.system, joints, vector)
        left, _, right = np.linalg.svd(by_joints)
        w = left[:, -1] if normal is None or left[:, -1] @ normal > 0.0 else -left[:, -1]
        normal = w
        rates = w @ by_parameters
        scale = float(np.linalg.norm(by_parameters[:, active]))
        trials.append((value, float(rates[active])))
        if abs(rates[active]) < _ROUNDED * scale and len(trials) > 1:
            break
        value = _secant(trials, start)
        if not abs(value - start) <= _FAR * (1.0 + abs(start)):
            return None
    else:
        return None
    there = replace(orbit, joints=joints, vector=vector, residual=float(np.max(np.abs(residual))))
    rates[active] = 0.0
    other = int(np.argmax(np.abs(rates)))
    vectors, _ = null_space(there.system, joints, vector, active)
    regular = len(vectors) == _PLANE and abs(rates[other]) > _OPENS * scale
    if not regular or there.residual > _SOLVED or _is_flat(trials, scale):
        return None
    missed = abs(float(w @ residual))
    return Family(there, right[-1].reshape(joints.shape), active, other, missed)


def _secant(trials: list[tuple[float, float]], start: float) -> float:
    """Return the next trial of the value; infinite where w F_b does not change."""
    if len(trials) == 1:
        return start + _TRIAL * (1.0 + abs(start))
    (x0, g0), (x1, g1) = trials[-2:]
    return np.inf if g1 == g0 else x1 - g1 * (x1 - x0) / (g1 - g0)


def _is_flat(trials: list[tuple[float, float]], scale: float) -> bool:
    """Tell whether w F_b vanishes at other values as well: then orbits are a family at each of them."""
    (x0, g0), (x1, g1) = trials[:2]
    return abs(g1 - g0) < _FLAT * scale * abs(x1 - x0)


def _least(orbit: Orbit, vector: FloatArray) -> FloatArray | None:
    """Return the joints nearest to a guess at which the equations are as small as they can be."""
    joints = orbit.joints
    for _ in range(_STEPS):
        residual, by_joints, _ = equations_at(orbit.system, joints, vector)
        if not (np.all(np.isfinite(by_joints)) and np.all(np.isfinite(residual))):
            return None
        left, size, right = np.linalg.svd(by_joints)
        change = right[:-1].T @ (left[:, :-1].T @ -residual / size[:-1])
        joints = joints + change.reshape(joints.shape)
    return joints


# ------------------------------------------------------------------- a symmetric branch passes a family


def with_families(branch: Branch, settings: Settings) -> Branch:
    """Return a symmetric branch with the branch points at which it passes families of asymmetric orbits."""
    mu = branch.turn_multipliers
    if mu is None or not branch.system.half or branch.bridge or len(branch) < 3:
        return branch
    away = np.min(np.abs(mu + 1.0), axis=1)
    near = (away[1:-1] < _TOUCHES) & (away[1:-1] <= away[:-2]) & (away[1:-1] < away[2:])
    sides = np.min((mu + 1.0).real, axis=1)
    touches = near & (sides[:-2] * sides[2:] > 0.0) & _may_touch(away, branch.arc)
    events = [_passed(branch, mu, int(k)) for k in 1 + np.flatnonzero(touches)]
    found = [b for b in events if b is not None and not _is_listed(branch, b, settings)]
    return replace(branch, bifurcations=in_order(branch, found)) if found else branch


def _may_touch(away: FloatArray, arc: FloatArray) -> NDArray[np.bool_]:
    """Tell for each inner point of a branch whether a multiplier may be at -1 between its neighbours.

    Examples
    --------
    >>> import numpy as np
    >>> s = np.array([-1.0, 0.2, 1.0])
    >>> _may_touch(s**2, s).tolist(), _may_touch(4.0 + s**2, s).tolist()
    ([True], [False])
    """
    before, here, after = away[:-2], away[1:-1], away[2:]
    behind, ahead = np.diff(arc)[:-1], np.diff(arc)[1:]
    from_left = here * behind <= _RESERVE * (before - here) * ahead
    from_right = here * ahead <= _RESERVE * (after - here) * behind
    return from_left | from_right


def _is_rounding(orbit: Orbit, away: FloatArray) -> bool:
    """Tell whether distances of a multiplier from -1 are rounding, which a tangential exit magnifies.

    Multipliers have the rates at which segments end as divisors, and these rates are margins.
    """
    exits = [test.margin is Margin.EXIT for test in orbit.system.tests]
    slowest = float(orbit.margins[exits].min(initial=1.0))
    return bool(np.min(away) * slowest <= UNITS * np.finfo(float).eps)


def _is_listed(branch: Branch, event: Bifurcation, settings: Settings) -> bool:
    value = event.params[branch.parameter]
    return any(
        b.kind is event.kind
        and abs(b.params[branch.parameter] - value) <= max(LEAST, b.accuracy) * settings.width
        for b in branch.bifurcations
    )


def _passed(branch: Branch, mu: NDArray[np.complex128], k: int) -> Bifurcation | None:
    """Return the branch point next to a point of a symmetric branch, if it passes a family there."""
    active = branch.model.index_of(branch.parameter)
    before, after = branch.values[k - 1], branch.values[k + 1]
    if _is_rounding(branch[k], np.min(np.abs(mu[[k - 1, k + 1]] + 1.0), axis=1)):
        return None
    family = family_near(branch[k], active, abs(float(after - before)))
    if family is None:
        return None
    value = float(family.orbit.vector[active])
    if not min(before, after) <= value <= max(before, after):
        return None
    j = k if (branch.values[k] - value) * (after - value) <= 0.0 else k - 1
    share = (value - branch.values[j]) / (branch.values[j + 1] - branch.values[j])
    position = float(branch.arc[j] + share * (branch.arc[j + 1] - branch.arc[j]))
    there = refine(replace(branch.between(position), vector=family.orbit.vector), damped=False)
    if not there.converged:
        return None
    low, high = (k - 1, k + 1) if before < after else (k + 1, k - 1)
    below, above = (bool(np.all(np.abs(mu[i]) < 1.0)) for i in (low, high))
    return Bifurcation(Kind.BP, there.params, there, (), position, below, above, bound=LEAST)
