"""The orbits that starts converge to: given ones, those of a diagram, and those that are found."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.errors import (
    ConvergenceError,
    ParameterError,
    items_of,
    shown,
)
from contfric.models.definition import Model
from contfric.orbit.finding.find import find_orbit
from contfric.orbit.orbit import Orbit, Status
from contfric.orbit.solve import refine_with_symmetry
from contfric.response.targets import Targets, targets_of

if TYPE_CHECKING:
    from contfric.continuation.branch import Branch

#: Most orbits that are found: there are more only where every start has its own, on a continuum.
MOST = 64
#: Joints of two solved orbits that are nearer than this are the same: far above their errors.
_SAME_ORBIT = 1e-8
#: Parameters of a given orbit that differ by no more than rounding are the same.
_SAME = 1e-14


@dataclass(eq=False)
class Attractors:
    """The stable orbits that are known at some parameters."""

    model: Model
    vector: FloatArray
    orbits: list[Orbit] = field(default_factory=list)

    @property
    def targets(self) -> Targets:
        """Their joints."""
        return targets_of(self.model, self.orbits)

    def add(self, orbit: Orbit) -> bool:
        """Add an orbit and its mirror image, if they are not known; whether that is so.

        Its model may have chatter where the given one has not: then the others are told by it, too.
        """
        if orbit.model.chatters and not self.model.chatters:
            self.model = orbit.model
        images = [orbit]
        if self.model.symmetry is not None and not orbit.symmetric:
            images.append(orbit.mirror())
        new = [image for image in images if not self._knows(image)]
        self.orbits += new
        return bool(new)

    def rest_at_walls(self) -> bool:
        """Take the model with chatter at its walls, as `find_orbit` does; whether there is one."""
        from contfric.models.shorthand.chatter import with_chatter  # which takes sympy

        resting = with_chatter(self.model)
        if resting is not None:
            self.model = resting
        return resting is not None

    def _knows(self, orbit: Orbit) -> bool:
        mine, theirs = targets_of(self.model, [orbit]), self.targets
        period = 0.0 if self.model.autonomous else orbit.period / orbit.periods
        apart = np.abs(theirs.z[theirs.key == mine.key[0]] - mine.z[0])
        if period > 0.0:
            apart[:, 0] = np.minimum(apart[:, 0], period - apart[:, 0])
        return bool(len(apart)) and bool(np.any(np.max(apart, axis=1) <= _SAME_ORBIT))

    def search(self, state: FloatArray, time: float) -> bool:
        """Find the orbit that a start converges to and add it; whether there is a new one."""
        if len(self.orbits) >= MOST:
            return False
        try:
            orbit = find_orbit(self.model, self.model.mapping(self.vector), state=state, time=time)
        except ConvergenceError:  # aperiodic, unbounded, at rest, or no solution at all
            return False
        return self.add(orbit)


def given_orbits(model: Model, vector: FloatArray, orbits: object) -> list[Orbit]:
    """Return the stable orbits of a diagram, or of a list, at some parameters.

    Raises
    ------
    ParameterError
        If they are no orbits of the model at these parameters.
    """
    branches = getattr(orbits, "branches", None)
    if branches is not None:
        return [o for branch in branches for o in _on_branch(model, vector, branch) if o.stable]
    found = items_of(orbits)
    if not all(isinstance(orbit, Orbit) for orbit in found) or not found:
        raise ParameterError(f"orbits is a diagram or a list of orbits, got {shown(orbits)}")
    for orbit in found:
        if orbit.model.name != model.name or not np.allclose(
            orbit.vector, vector, rtol=_SAME, atol=_SAME
        ):
            raise ParameterError(f"{orbit!r} is an orbit of another model, or of other parameters")
        if not orbit.converged:
            raise ParameterError(f"{orbit!r} is not solved: {orbit.status.value}")
    return [orbit for orbit in found if orbit.stable]


def _on_branch(model: Model, vector: FloatArray, branch: Branch) -> Iterator[Orbit]:
    """Yield the orbits of a branch at the parameters, solved."""
    k = model.index_of(branch.parameter)
    others = np.delete(branch.vector - vector, k)
    if branch.model.name != model.name or np.any(np.abs(others) > _SAME):
        raise ParameterError(
            f"the diagram is of '{branch.model.name}' along '{branch.parameter}', with other parameters "
            "than the basins"
        )
    if branch.bridge:  # its orbits repel
        return
    value = vector[k]
    before, after = branch.values[:-1], branch.values[1:]
    for i in np.flatnonzero((before - value) * (after - value) <= 0.0):
        width = after[i] - before[i]
        share = (value - before[i]) / width if width != 0.0 else 0.0
        joints = (1.0 - share) * branch.joints[i] + share * branch.joints[i + 1]
        orbit = refine_with_symmetry(
            Orbit(branch.system, joints, vector.copy(), np.inf, Status.NOT_CONVERGED)
        )
        if orbit.converged and orbit.admissible:
            yield orbit


def named(orbits: Sequence[Orbit]) -> list[str]:
    """Return a name for each orbit: its own, with a number where several have the same."""
    names = [orbit.name for orbit in orbits]
    return [
        name if names.count(name) == 1 else f"{name} ({names[: k + 1].count(name)})"
        for k, name in enumerate(names)
    ]
