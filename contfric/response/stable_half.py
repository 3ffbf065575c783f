"""One half of a stable set, followed on arcs, stretch by stretch."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum
from itertools import pairwise

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.interrupts import whole
from contfric.chaos.running import Progress
from contfric.orbit.orbit import Orbit
from contfric.remember.journal import remembered
from contfric.response.section_map import NEAR, SectionMap, SpentError

#: Halves of the arc on which the next point is looked for (rad), and the turn that is accepted. Starts at the
#: ends of a narrow arc come to the saddle from farther away.
_ARCS, _TURN = (0.04, 0.12, 0.4), 0.3
#: Shortest step, as a share of the longest: what is lost on it is a break.
_SHORTEST = 1e-3
#: Beyond a break the set is looked for at so many distances, up to this share of the ranges, and at these
#: angles (rad). A gap is as wide as the map makes it, whatever the step is.
_GAPS, _REACH, _FAN = 9, 0.02, np.linspace(-1.0, 1.0, 21)
#: Points of a stretch: of it progress is told, and it is kept.
_STRETCH = 50


class StableEnd(str, Enum):
    """Why a stable set ends."""

    RANGE = "end of the range asked for"
    BREAK = (
        "the section map jumps: solutions on one side stop, or touch a surface, where others do not"
    )
    POINTS = "the largest number of points was reached"
    RETURNS = "the largest number of returns of the section map was reached"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True, eq=False)
class HalfStretch:
    """A stretch of a half: its points, those of them that a break leads to, and from where it goes on.

    Attributes
    ----------
    end : why the half ends there, None if it goes on
    returns : how often the section map was taken
    """

    points: FloatArray
    breaks: list[int]
    direction: FloatArray
    step: float
    end: StableEnd | None
    returns: int


@remembered(without=("section",), finished=lambda s: s.end is not StableEnd.INTERRUPTED)
def _stretch(
    orbit: Orbit,
    phase: float,
    corners: tuple[FloatArray, FloatArray],
    last: FloatArray,
    direction: FloatArray,
    steps: tuple[float, float],
    most: tuple[int, int],
    section: SectionMap,
) -> HalfStretch:
    """Follow a half by so many points.

    Parameters
    ----------
    steps : the next step, and the longest
    most : points, and returns of the section map
    section : the section map of the orbit at the phase
    """
    half = Half(section, [last], direction, *corners)
    before = section.returns
    section.most = before + most[1]
    try:
        step, end = half.grow(*steps, most[0])
    finally:
        section.most = math.inf
    points = np.array(half.points[1:]).reshape(-1, len(last))
    taken = section.returns - before
    return HalfStretch(points, half.breaks, half.direction, step, end, taken)


@dataclass
class Half:
    """One half of a stable set while it grows."""

    section: SectionMap
    points: list[FloatArray]
    direction: FloatArray
    low: FloatArray
    high: FloatArray
    breaks: list[int] = field(default_factory=list)
    returns: int = 0

    def trace(
        self,
        step: float,
        longest: float,
        most: tuple[int, int],
        progress: Progress | None,
    ) -> StableEnd:
        """Follow it to its end, stretch by stretch: so many points, and returns of the section map."""
        try:
            while len(self.points) < most[0]:
                step, end = self._add_stretch(step, longest, most)
                if progress is not None:
                    where = ", ".join(f"{value:.6g}" for value in self.points[-1])
                    progress(f"{len(self.points)} points of a half, at ({where})")
                if end is not None:
                    return end
        except KeyboardInterrupt:
            return StableEnd.INTERRUPTED
        return StableEnd.POINTS

    def _add_stretch(
        self, step: float, longest: float, most: tuple[int, int]
    ) -> tuple[float, StableEnd | None]:
        """Return the next step, and why it ends if it does."""
        left = min(_STRETCH, most[0] - len(self.points)), most[1] - self.returns
        count, corners = len(self.points), (self.low, self.high)
        found = _stretch(
            *(self.section.orbit, self.section.phase, corners, self.points[-1], self.direction),
            *((step, longest), left, self.section),
        )
        self.breaks += [count - 1 + k for k in found.breaks]
        self.points += list(found.points)
        self.direction = found.direction
        self.returns += found.returns
        return found.step, found.end

    def grow(self, step: float, longest: float, most: int) -> tuple[float, StableEnd | None]:
        """Add so many points; return the next step, and why it ends if it does."""
        try:
            while len(self.points) <= most:
                found = self._next(step)
                if found is None:
                    if step > _SHORTEST * longest:
                        step *= 0.5
                        continue
                    found = self._beyond_break(longest)
                    if found is None:
                        return step, StableEnd.BREAK
                    self._go_on_beyond(found, step)
                    continue
                turn = self._turn(found)
                self.direction = (found - self.points[-1]) / np.hypot(*(found - self.points[-1]))
                self.points.append(found)
                if np.any(found < self.low) or np.any(found > self.high):
                    return step, StableEnd.RANGE
                step = min(longest, step * (2.0 if turn < 0.5 * _TURN else 1.0))
        except KeyboardInterrupt:
            return step, StableEnd.INTERRUPTED
        except SpentError:
            return step, StableEnd.RETURNS
        return step, None

    def _turn(self, found: FloatArray) -> float:
        chord = found - self.points[-1]
        cosine = float(chord @ self.direction) / (np.hypot(*chord) * np.hypot(*self.direction))
        return float(np.arccos(np.clip(cosine, -1.0, 1.0)))

    def _next(self, step: float) -> FloatArray | None:
        """Return the point of the set on an arc; None without one, or where it turns too much."""
        for arc in _ARCS:
            angle = self._angle(step, -arc, arc)
            if angle is not None:
                return self._point(step, angle) if abs(angle) < _TURN else None
        return None

    def _beyond_break(self, longest: float) -> FloatArray | None:
        """Return the nearest point of the set across a break; None without one within reach."""
        reach = max(longest, _REACH * float(np.hypot(*(self.high - self.low))))
        for step in np.geomspace(_SHORTEST * longest, reach, _GAPS):
            for one, other in pairwise(_FAN):
                angle = self._angle(float(step), float(one), float(other))
                if angle is not None:
                    return self._point(float(step), angle)
        return None

    def _go_on_beyond(self, found: FloatArray, step: float) -> None:
        """Take a point beyond a break, and the direction of the set there: the one that leads away."""
        self.direction = found - self.points[-1]
        self.breaks.append(len(self.points))
        self.points.append(found)
        for one, other in sorted(pairwise(2.0 * _FAN), key=lambda pair: abs(sum(pair))):
            angle = self._angle(step, one, other)
            if angle is not None:
                self.direction = self._point(step, angle) - found
                return

    def _point(self, step: float, angle: float) -> FloatArray:
        ahead = np.arctan2(self.direction[1], self.direction[0]) + angle
        return np.asarray(self.points[-1] + step * np.array([np.cos(ahead), np.sin(ahead)]))

    def _angle(self, step: float, low: float, high: float) -> float | None:
        """Return the angle between two at which u vanishes on an arc; None if it does not, or jumps."""
        brentq = whole("scipy.optimize").brentq

        def departure_at(angle: float) -> float:
            found = self.section.departure(self._point(step, angle))
            if found is None:
                raise ArithmeticError
            return found

        try:
            if not departure_at(low) * departure_at(high) < 0.0:
                return None
            angle = float(brentq(departure_at, low, high, xtol=1e-12, rtol=1e-12))
            jump = abs(departure_at(angle)) > 1e-3 * NEAR * self.section.size
        except ArithmeticError:
            return None
        return None if jump else angle
