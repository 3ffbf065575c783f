r"""The stable set of an unstable orbit in the plane of two states: where basins of attraction meet.

The section map f takes the state at a phase of the excitation to that one period of the orbit later. An
unstable orbit is a saddle :math:`p_0` of f. With the left unstable eigenvector l,
:math:`u = l^T (f^n(q) - p_0)` grows by the unstable multiplier with each return near the saddle. The stable
set is where it vanishes; so it separates starts that leave the saddle along one direction from those that
leave along the other.

It is followed without the inverse of f, as a stick has none (J. P. England, B. Krauskopf, H. M. Osinga, SIAM
J. Appl. Dyn. Syst. 3 (2004) 161-190). The next point lies on an arc around the last one, where u changes its
sign. Where no start on the arc comes to the saddle f is discontinuous, and the set has a break. It is looked
for on the other side, and ends where it is not found within a fiftieth of the ranges.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from contfric.base.tabled import Columns, Tabled
from contfric.chaos.running import Progress
from contfric.errors import ParameterError, function_of, real_number, shown, whole_number
from contfric.models.definition import FloatArray, Model
from contfric.orbit.orbit import Orbit
from contfric.orbit.system import IntArray
from contfric.remember.folder import kept_in
from contfric.remember.journal import remembered
from contfric.response.section_map import NEAR, SectionMap

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: First distance from the saddle, in sizes of the orbit: its set is straight there to its square.
_FIRST = 1e-3
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
    INTERRUPTED = "interrupted"


@dataclass(frozen=True, eq=False)
class StableSet(Tabled):
    """The stable set of an unstable orbit; the result of :func:`contfric.stable_set`.

    Attributes
    ----------
    orbit : Orbit
    phase : float
        The phase of the section, as a share of the period of the excitation.
    states : tuple of ndarray, shape (k, 2) each
        Both halves, each from the orbit on.
    breaks : tuple of ndarray of int
        Of both halves, the points that a break leads to: the set has a gap before them.
    ends : (StableEnd, StableEnd)

    Examples
    --------
    >>> import contfric as cf
    >>> saddle = cf.solve_orbit("coulomb", "2s", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> found = cf.stable_set(saddle, {"x": (-2, 2), "v": (-1, 1)}, max_step=0.1)
    >>> found.points.shape[1]
    2
    """

    orbit: Orbit
    phase: float
    states: tuple[FloatArray, FloatArray]
    breaks: tuple[IntArray, IntArray]
    ends: tuple[StableEnd, StableEnd]

    @property
    def model(self) -> Model:
        """The model that moves."""
        return self.orbit.model

    @property
    def complete(self) -> bool:
        """Whether it was followed to its ends; False after an interrupt."""
        return StableEnd.INTERRUPTED not in self.ends

    @property
    def points(self) -> FloatArray:
        """All points in their order along the set, shape (k, 2)."""
        one, other = self.states
        return np.concatenate([one[:0:-1], other])

    def columns(self) -> Columns:
        """Return one row for each point: both states, and the half."""
        names = self.orbit.model.states
        half = np.repeat([0, 1], [len(self.states[0]) - 1, len(self.states[1])])
        return {**dict(zip(names, self.points.T, strict=True)), "half": half}

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the set in the plane of the two states, as over basins, with the orbit on it."""
        from contfric.plot.basins import plot_stable_set

        return plot_stable_set(self, ax=ax)

    def __repr__(self) -> str:
        ends = " and ".join(end.name for end in self.ends)
        return f"<StableSet of {self.orbit.name}: {len(self.points)} points, ends {ends}>"


def stable_set(
    orbit: Orbit,
    ranges: Mapping[str, tuple[float, float]],
    *,
    phase: float = 0.0,
    max_step: float | None = None,
    max_points: int = 2000,
    folder: str | Path | None = None,
    progress: Progress | None = None,
) -> StableSet:
    """Follow the stable set of an unstable orbit in the plane of the two states.

    Parameters
    ----------
    orbit : Orbit
        An unstable orbit with one multiplier outside of the unit circle, of a model of two states with
        excitation.
    ranges : mapping
        Where each of the two states may go.
    phase : float
        Phase of the section, as a share of the period of the excitation; that of the starts of basins.
    max_step : float, optional
        Longest step along the set; by default a hundredth of the ranges.
    max_points : int
        Most points of each half.
    folder : path, optional
        Where finished stretches are kept; the same call goes on from them.
    progress : callable, optional
        Called with one line of text now and then.

    Raises
    ------
    ParameterError
        If the orbit is no saddle of that kind, or an argument is not valid.
    ResultFileError
        If the folder cannot be written, or another version of contfric has written to it.

    Examples
    --------
    >>> import contfric as cf
    >>> saddle = cf.solve_orbit("coulomb", "2s", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> found = cf.stable_set(saddle, {"x": (-2, 2), "v": (-1, 1)}, max_step=0.1)
    >>> len(found.points) > 20
    True
    """
    if not isinstance(orbit, Orbit):
        raise ParameterError(f"a stable set is one of an Orbit, got {shown(orbit)}")
    low, high = check_ranges(orbit.model, ranges)
    section = SectionMap(_checked(orbit), real_number("phase", phase))
    function_of("progress", progress)
    longest = (
        0.01 * float(np.hypot(*(high - low)))
        if max_step is None
        else real_number("max_step", max_step, least=1e-9)
    )
    whole_number("max_points", max_points, least=2)
    halves, ends, breaks = [], [], []
    with kept_in(folder):
        for sign in (1.0, -1.0):
            half = _Half(section, [section.saddle], sign * section.stable, low, high)
            first = min(_FIRST * section.size, longest)
            stopped = StableEnd.INTERRUPTED in ends
            ends.append(
                StableEnd.INTERRUPTED
                if stopped
                else half.trace(first, longest, max_points, progress)
            )
            halves.append(np.array(half.points))
            breaks.append(np.array(half.breaks, dtype=np.int64))
    return StableSet(
        orbit, section.phase, (halves[0], halves[1]), (breaks[0], breaks[1]), (ends[0], ends[1])
    )


def _checked(orbit: Orbit) -> Orbit:
    outside = [m for m in orbit.multipliers if abs(m) > 1.0]
    if orbit.system.holds or len(outside) != 1:
        raise ParameterError(
            f"{orbit!r} has no stable set that separates: one multiplier has to be outside of the "
            f"unit circle, and there are {len(outside)}"
        )
    return orbit


def check_ranges(model: Model, ranges: object) -> tuple[FloatArray, FloatArray]:
    """Return the corners of the ranges that a user gave.

    Raises
    ------
    ParameterError
        If the model has no stable sets that are curves, or they are no ranges of its states.
    """
    if model.autonomous or len(model.states) != 2:
        raise ParameterError(
            "a stable set is a curve in the section of a model with excitation and two states; "
            f"'{model.name}' has {len(model.states)} states and {'no' if model.autonomous else 'an'} "
            "excitation"
        )
    wanted = (
        f"ranges are {{'{model.states[0]}': (lower, upper), '{model.states[1]}': (lower, upper)}}"
    )
    if not isinstance(ranges, Mapping) or set(ranges) != set(model.states):
        raise ParameterError(f"{wanted}, got {shown(ranges)}")
    try:
        found = np.array([ranges[name] for name in model.states], dtype=np.float64)
    except (TypeError, ValueError):
        found = np.empty(0)
    if (
        found.shape != (2, 2)
        or not np.all(np.isfinite(found))
        or not np.all(found[:, 0] < found[:, 1])
    ):
        raise ParameterError(f"{wanted}, got {shown(ranges)}")
    return found[:, 0], found[:, 1]


@dataclass(frozen=True, eq=False)
class _Stretch:
    """A stretch of a half: its points, those of them that a break leads to, and from where it goes on.

    Attributes
    ----------
    end : why the half ends there, None if it goes on
    """

    points: FloatArray
    breaks: list[int]
    direction: FloatArray
    step: float
    end: StableEnd | None


@remembered(without=("section",), finished=lambda s: s.end is not StableEnd.INTERRUPTED)
def _stretch(
    orbit: Orbit,
    phase: float,
    corners: tuple[FloatArray, FloatArray],
    last: FloatArray,
    direction: FloatArray,
    steps: tuple[float, float],
    most: int,
    section: SectionMap,
) -> _Stretch:
    """Follow a half by so many points.

    Parameters
    ----------
    steps : the next step, and the longest
    section : the section map of the orbit at the phase
    """
    half = _Half(section, [last], direction, *corners)
    step, end = half.grow(*steps, most)
    return _Stretch(np.array(half.points[1:]), half.breaks, half.direction, step, end)


@dataclass
class _Half:
    """One half of a stable set while it grows."""

    section: SectionMap
    points: list[FloatArray]
    direction: FloatArray
    low: FloatArray
    high: FloatArray
    breaks: list[int] = field(default_factory=list)

    def trace(self, step: float, longest: float, most: int, progress: Progress | None) -> StableEnd:
        """Follow it to its end, stretch by stretch."""
        try:
            while len(self.points) < most:
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
        self, step: float, longest: float, most: int
    ) -> tuple[float, StableEnd | None]:
        """Return the next step, and why it ends if it does."""
        count, corners = len(self.points), (self.low, self.high)
        found = _stretch(
            *(self.section.orbit, self.section.phase, corners, self.points[-1], self.direction),
            *((step, longest), min(_STRETCH, most - count), self.section),
        )
        self.breaks += [count - 1 + k for k in found.breaks]
        self.points += list(found.points)
        self.direction = found.direction
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
        from scipy.optimize import brentq

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
