"""A step of a branch: two points, between which events are located."""

from __future__ import annotations

from dataclasses import dataclass

from contfric.continuation.points import Point, Settings
from contfric.orbit.orbit import Orbit


@dataclass(frozen=True, eq=False)
class Step:
    """A step of a branch, in which events are located.

    Attributes
    ----------
    orbit : an orbit of the branch, whose equations its points solve
    before, after : the ends of the step
    beyond : the sliding event within it, after which the branch does not go on; else ``after``
    settings : of the branch
    """

    orbit: Orbit
    before: Point
    after: Point
    beyond: Point
    settings: Settings

    @property
    def active(self) -> int:
        """Index of the parameter that varies."""
        return self.orbit.model.index_of(self.settings.parameter)

    @property
    def length(self) -> float:
        """Arclength from end to end."""
        return self.after.arc - self.before.arc

    def orbit_at(self, point: Point) -> Orbit:
        """Return a point of the branch as an orbit."""
        return point.orbit(self.orbit, self.active)
