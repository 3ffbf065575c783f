"""Both arms of a fold of passages: orbits of which each hold is longer or shorter, independently.

A pin may fix the whole state at which its hold starts: at a touch inside a stick ``u' = 0`` gives the phase
and ``u = S0`` the position; a stop is fixed where the stick before the slide to it has such an end. Then the
motion from one pin to the next, a **passage**, is an equation of its own for the length of its hold, and the
orbits are the cyclic sequences of passages. Near a fold ``lambda = c s^2`` a passage has two lengths, its
arms ``s = +-(lambda / c)^(1/2)``. An orbit with n such passages is one of 2^n orbits beyond the fold,
and each of their curves passes the fold, where all signs change.

Let J be the Jacobian of an orbit at fixed parameters. A passage folds by itself if J has a null vector that
moves only the joints between its two pins. This is tested; nothing is assumed about the pins.

A unit may also fold as a whole. The position x of the stick before its pin is free, and ``G(x, lambda) = 0``
says that the pin is met. At the fold ``dG/dx = 0``: beyond it x has two values, and the hold of the unit
before leads to either. All joints move then, but over two units J has two null vectors, one for each x.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.linear import assembled, null_vectors
from contfric.bvp.system import System
from contfric.continuation.half_branch import first_point
from contfric.continuation.points import Settings
from contfric.errors import NotationError
from contfric.events.incident.unit import Form, Unit, form_of, pieces, unit_of
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine

#: A singular value this small (relative to the largest) is zero at a fold: the length of a hold is known
#: there to the root of rounding.
_NULL = 1e-6
#: An arm is the other side of the fold if its holds have moved by this share of the distance at least.
_OTHER_SIDE = 0.5


def passages(system: System) -> list[list[int]]:
    """Return the joints that follow from each hold: from its end to the start of the next one."""
    count, holds = len(system.itinerary), system.ends_of_holds
    starts = [first.segment for first, _ in holds]
    ahead = [*starts[1:], starts[0] + count] if starts else []
    return [
        [j % count for j in range(last.segment + 1, after + 1)]
        for (_, last), after in zip(holds, ahead, strict=True)
    ]


def turning_passages(orbit: Orbit) -> dict[int, FloatArray]:
    """Return the holds whose passages turn by themselves, each with its null vector, shape (N, 1 + n).

    The vectors are scaled to the length of the hold.
    """
    full = assembled(orbit.system, orbit.joints, orbit.vector)
    m = orbit.joints.shape[1]
    largest, found = float(np.linalg.norm(full, 2)), {}
    for hold, joints in enumerate(passages(orbit.system)):
        inner = np.array(joints[:-1])  # without the next pin
        columns = (inner[:, None] * m + np.arange(m)).ravel()
        _, size, right = np.linalg.svd(full[:, columns], full_matrices=False)
        if not size[-1] < _NULL * largest or abs(right[-1][0]) < _NULL:
            continue
        vector = np.zeros_like(orbit.joints)
        vector[inner] = (right[-1] / right[-1][0]).reshape(len(inner), m)
        found[hold] = vector
    return found


@dataclass(frozen=True, eq=False)
class Arms:
    """The solution at a fold, and its two arms at one value of the parameter near it.

    Attributes
    ----------
    unit : the shortest part that the solution consists of
    fold : the orbit of one unit at the fold
    turning : the holds of the unit whose passages turn
    as_one : the unit turns as a whole, all of its passages together
    longer, shorter : the orbits of one unit with all of them on the same arm; None at the fold itself
    """

    unit: Unit
    fold: Orbit
    turning: dict[int, FloatArray]
    as_one: bool = False
    longer: Orbit | None = None
    shorter: Orbit | None = None

    @cached_property
    def letters(self) -> int:
        """How many orbits of one unit there are: each turning hold is on either arm, or all on the same."""
        return int(2 ** len(self.turning))

    def solved_near(self, distance: float, settings: Settings) -> Arms | None:
        """Return the same with both arms solved near the fold, this far in the lengths of holds."""
        fold = self.fold
        direction = np.sum(list(self.turning.values()), axis=0)
        point = first_point(
            replace(fold, joints=fold.joints + distance * direction), settings, direction, 0.0
        )
        if point is None:
            return None
        active = fold.model.index_of(settings.parameter)
        longer = point.orbit(fold, active)
        guess = replace(longer, joints=2.0 * fold.joints - longer.joints)
        shorter = refine(replace(guess, residual=np.inf), damped=False)
        if not (longer.converged and shorter.converged):
            return None
        ends = [passages(fold.system)[hold][0] for hold in self.turning]
        moved = np.array([(o.joints - fold.joints)[ends, 0] for o in (longer, shorter)])
        least = _OTHER_SIDE * distance
        if not (np.all(moved[0] > least) and np.all(moved[1] < -least)):
            return None
        return replace(self, longer=longer, shorter=shorter)

    def at_fold(self, count: int) -> Orbit:
        """Return the solution at the fold as an orbit of several units."""
        return self._repeated(self.fold, count)

    def orbit(self, sequence: tuple[int, ...]) -> Orbit:
        """Return the orbit of a sequence, solved; a letter's bits tell which holds of a unit are shorter."""
        assert self.longer is not None
        assert self.shorter is not None
        orbit = self._repeated(self.longer, len(sequence))
        other = self._repeated(self.shorter, len(sequence)).joints
        joints, own = orbit.joints.copy(), len(self.fold.system.ends_of_holds)
        short = list(self.turning)
        for number, locations in enumerate(passages(orbit.system)):
            unit, hold = divmod(number, own)
            bit = 0 if self.as_one else short.index(hold) if hold in self.turning else self.letters
            if sequence[unit] >> bit & 1:
                joints[locations] = other[locations]
        return refine(replace(orbit, joints=joints, residual=np.inf), damped=False)

    def _repeated(self, orbit: Orbit, count: int) -> Orbit:
        unit = replace(self.unit, vector=orbit.vector, duration=orbit.turn)
        form = Form(orbit.system.itinerary, orbit.joints, np.zeros(len(orbit.joints)), "", unit)
        return unit.orbit((form,) * count)[0]


def arms_at(orbit: Orbit) -> Arms | None:
    """Return what turns by itself at a fold; None if nothing does.

    Nor is there an answer where the units of the motion differ in their holds: where a hold is as long as
    the stick of another unit, the fold is not one of the unit's orbits.
    """
    if orbit.model.autonomous or not orbit.system.holds:
        return None
    whole = orbit.as_whole()
    unit = unit_of(whole)
    parts = pieces(whole, unit)
    try:
        form = form_of(whole, np.zeros(len(whole.itinerary)), unit, parts[0], "")
        fold = form.orbit
    except (NotationError, ValueError):
        return None
    if len(fold.system.ends_of_holds) * len(parts) != len(whole.system.ends_of_holds):
        return None
    if turning := turning_passages(fold):
        return Arms(unit, fold, turning)
    null = null_vectors(fold.system, fold.joints, fold.vector)
    end = passages(fold.system)[0][0]
    if len(null) != 1 or abs(null[0, end, 0]) < _NULL:
        return None
    one = Arms(unit, fold, {0: null[0] / null[0, end, 0]}, as_one=True)
    two = one.at_fold(2)
    null = null_vectors(two.system, two.joints, two.vector)
    return one if len(null) == 2 else None
