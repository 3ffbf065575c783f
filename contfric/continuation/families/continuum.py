"""Continua: where the orbits at one value of the parameter are a family, and not isolated.

At Omega = 1/2 and without damping a slide lasts a whole natural period whatever its amplitude, so that a
solution without sticks leaves its amplitude free. Such a family is met in two ways.

* The branch **is** the family: the parameter is constant along it, and its slope is rounding.
* The branch **passes through** one family after the other: a multiplier is 1 at every point, and the
  sign of chi(1) or chi(-1) is rounding. An orbit of such a family other than the symmetric one has no unique
  continuation: the equations with the parameter have two null vectors there, as they have at a branch
  point; but near it they have two again.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.linear import equations_at, null_space
from contfric.orbit.orbit import Orbit

if TYPE_CHECKING:
    from contfric.continuation.branch import Branch

#: Slope of the parameter, and chi(1) or chi(-1), below which they are rounding: an event is passed with a
#: slope of one over a step of 1e-8 or more, and what the elimination leaves of a zero is below 1e-12.
LEVEL = 1e-10
#: Parameter values of one continuum agree to this (relative to 1 + the value): they are solved for to 1e-13.
_ONE_VALUE = 1e-12
#: Arclength from which a branch at one value is a continuum, and not an orbit: far above rounding.
_LENGTH = 1e-6
#: A multiplier is 1 to this: the root of rounding, where two of them are.
ONE = 1e-7
#: Points in a row from which multipliers at 1 are no event: of one, its two neighbours would be farther away.
_RUN = 4
#: Share of 1 + its value by which the parameter changes over them: a multiplier that is 1 at a branch point
#: changes in proportion to the parameter, and a hundred times the number above is seen of it.
_CHANGES = 1e-5
#: Distance to the neighbour in a continuum (root mean square of joints): far from rounding, and near enough
#: for Newton's method.
_NEARBY = 1e-3
#: Steps of Gauss and Newton to it, and what is left of the equations then.
_STEPS, _SOLVED = 12, 1e-11
#: Null vectors of the equations with the parameter, in a continuum.
_PLANE = 2


def in_continuum(orbit: Orbit, active: int) -> bool:
    """Tell whether orbits form a family at a value of the parameter, and at the values near it.

    It is, if the equations have a plane of null vectors there and at a neighbour found along the one of
    them that leaves the parameter as it is.

    Examples
    --------
    >>> import contfric as cf
    >>> in_continuum(cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4}), 0)
    False
    """
    vectors, slopes = null_space(orbit.system, orbit.joints, orbit.vector, active)
    if len(vectors) != _PLANE:
        return False
    away = slopes[1] * vectors[0] - slopes[0] * vectors[1]
    if not np.any(away):
        away = vectors[0]
    joints = orbit.joints + _NEARBY * away * np.sqrt(len(away)) / np.linalg.norm(away)
    for _ in range(_STEPS):
        residual, by_joints, _ = equations_at(orbit.system, joints, orbit.vector)
        if not np.isfinite(by_joints).all():
            return False
        change = np.linalg.lstsq(by_joints, -residual, rcond=LEVEL)[0]
        joints = joints + change.reshape(joints.shape)
    residual, _, _ = equations_at(orbit.system, joints, orbit.vector)
    if not np.abs(residual).max() < _SOLVED:
        return False
    gap = np.linalg.norm(joints - orbit.joints) / np.sqrt(len(joints))
    there, _ = null_space(orbit.system, joints, orbit.vector, active)
    return bool(gap > 0.5 * _NEARBY and len(there) == _PLANE)


def is_continuum(branch: Branch) -> bool:
    """Tell whether a branch is a family of orbits at one value of its parameter.

    Its folds are asked, too: the points of a short bridge may all be near its ends, at one value.
    """
    return (
        branch.arc[-1] > _LENGTH
        and _at_one_value(branch, branch.values)
        and _at_one_value(branch, branch.nodes.values)
    )


def _at_one_value(branch: Branch, values: FloatArray) -> bool:
    """Tell whether values differ by what they are solved to."""
    low, high = float(values.min()), float(values.max())
    return high - low < _ONE_VALUE * _size(branch, max(-low, high))


def _size(branch: Branch, value: float) -> float:
    return branch.model.size_of(branch.model.index_of(branch.parameter), value)


def continua_of(branch: Branch) -> Iterator[str]:
    """Yield what is to be said of the continua on a branch, in words."""
    values, name = branch.values, branch.parameter
    if is_continuum(branch):
        middle = float(np.median(values))
        ends = [end.bifurcation for end in branch.ends]
        between = " and ".join("an end" if b is None else b.kind.value for b in ends)
        yield f"a continuum of orbits at {name} = {middle:.10g}, between {between}"
        return
    mu = branch.turn_multipliers
    if mu is None or mu.shape[1] == 0:  # one state without excitation has none
        return
    away = np.abs(mu - 1.0)
    if branch.system.half:  # a multiplier of the whole is the square of one of the half
        away = np.minimum(away, np.abs(mu + 1.0))
    at_one = np.min(away, axis=1) < ONE
    for first, last in _runs(at_one):
        low, high = sorted((values[first], values[last]))
        if high - low < _CHANGES * _size(branch, high):
            continue
        yield (
            f"a continuum of orbits at each {name} between {low:.10g} and {high:.10g}: "
            "a multiplier is 1 all along"
        )


def _runs(flags: np.ndarray) -> Iterator[tuple[int, int]]:
    """Yield first and last place of each run of true flags that is long enough."""
    if not flags.any():
        return
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    for first, behind in edges.reshape(-1, 2):
        if behind - first >= _RUN:
            yield int(first), int(behind) - 1
