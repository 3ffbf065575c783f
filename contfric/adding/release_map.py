"""The return map of a release, as a map of an interval with one jump, sampled.

A rest of an oscillator with one displacement ends at a surface: its release has one number, the time t. Let
the last segment of two orbits be the same such rest, and let the slide from its release end at the stop that
tells them apart: on one side of the surface a turn follows a, on the other b. Let c be the release from which
that stop is on the surface. With s = t - c the next release is

    s' = F_a(s) on the side A of s = 0,      s' = F_b(s) on the other side B.

Both are sampled over an interval D that they map into itself, and over a range of the parameter. All this is
tested: the release has one number, the stop's distance from the surface is monotone in s over D, and
both branches are defined on their sides and stay in D. (Orbits that are nowhere near the two are not in D.)
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray, with_entries
from contfric.bvp.prescribed_outcomes import follow_itinerary
from contfric.continuation.branch import Branch
from contfric.orbit.orbit import Orbit
from contfric.simulation.tables import surfaces_under

#: Samples of each branch over its side of D; the first is next to the jump (in widths of the side), where
#: perhaps only one branch is defined.
_NODES, _NEARBY = 65, 1e-6
#: Rounds in which D grows until it is mapped into itself, by so much more than the images ask for; samples of
#: a side and parameters meanwhile. The side that it begins with, in periods.
_MOST_ROUNDS, _MORE, _FEW, _FIRST = 40, 1.1, 9, 1e-9
#: Newton steps to a release and to the jump, and where they end.
_STEPS, _NEAR = 12, 1e-13
#: Difference by which the stop's distance from the surface is differentiated, in periods.
_STEP = 1e-5


class Samples(NamedTuple):
    """A branch of the map over its side of D.

    Attributes
    ----------
    end : the other end of the side, s = 0 is the first
    images : s' at equal distances in s, at each parameter, shape (parameters, samples)
    """

    end: float
    images: FloatArray


def sampled(
    letters: dict[str, Orbit], bridge: Branch, grid: FloatArray
) -> dict[str, Samples] | None:
    """Return the branches over D by their letters; None if this is no map of an interval with one jump.

    Parameters
    ----------
    letters : the two orbits, each from the release on
    grid : increasing parameters
    """
    release = _Release(letters, bridge)
    if release.surfaces is None:
        return None
    jumps = release.jumps(grid)
    if not np.isfinite(jumps).all():
        return None
    sides = _sides(release, grid, jumps)
    if sides is None:
        return None
    ends = _interval(release, grid, jumps, sides)
    if ends is None:
        return None
    found = {}
    for letter, end in ends.items():
        images, heights = release.over(letter, end, _NODES, grid, jumps)
        above = heights[:, 1:] * release.sign(letter)
        one_jump = np.all(np.diff(above, axis=1) > 0.0) and np.all(above > 0.0)
        if not one_jump or not np.isfinite(images).all():
            return None
        if images.min() < min(ends.values()) or images.max() > max(ends.values()):
            return None
        found[letter] = Samples(end, images)
    return found


def _sides(release: _Release, grid: FloatArray, jumps: FloatArray) -> dict[str, float] | None:
    """Return on which side of s = 0 each letter follows; None if both follow on the same one."""
    step = _STEP * release.period
    heights = [release.after("a", grid[0], jumps[0] + s)[1] for s in (-step, step)]
    rising = np.sign(heights[1] - heights[0])
    sides = {letter: float(rising * release.sign(letter)) for letter in release.letters}
    return sides if sides["a"] * sides["b"] < 0.0 else None


def _interval(
    release: _Release, grid: FloatArray, jumps: FloatArray, sides: dict[str, float]
) -> dict[str, float] | None:
    """Return the ends of an interval that is mapped into itself; None if it does not close."""
    ends = {letter: side * _FIRST * release.period for letter, side in sides.items()}
    few = np.linspace(0, len(grid) - 1, 3).astype(int)
    for _ in range(_MOST_ROUNDS):
        images = np.concatenate(
            [
                release.over(k, end, _FEW, grid[few], jumps[few])[0].ravel()
                for k, end in ends.items()
            ]
        )
        if not np.isfinite(images).all():
            return None
        wanted = {k: side * float(np.max(side * images)) for k, side in sides.items()}
        if all(abs(ends[k]) >= sides[k] * wanted[k] for k in ends):
            return {k: _MORE * end for k, end in ends.items()}
        ends = {k: sides[k] * max(abs(ends[k]), _MORE * sides[k] * wanted[k]) for k in ends}
    return None


@dataclass(frozen=True)
class _Release:
    """The solution from a release to the next, with the outcomes of either orbit."""

    letters: dict[str, Orbit]
    bridge: Branch

    @cached_property
    def surfaces(self) -> tuple[str, str] | None:
        """The surfaces of a release: that of the rest, and its exit; None if it has more than one number."""
        a, b = (orbit.system.itinerary for orbit in self.letters.values())
        model = self.bridge.model
        mode, exit_ = a[-1]
        if a[0] != b[0] or a[-1] != b[-1] or len(model.states) != 2:
            return None
        under = surfaces_under(model, mode)
        on = [s.name for k, s in enumerate(model.surfaces) if under >> k & 1]
        if len(on) != 1 or not model.mode_by_name[mode].sliding:
            return None
        orbit, found = self.letters["a"], (on[0], exit_)
        slopes = self._slopes(found, orbit, float(orbit.joints[0, 0]), orbit.joints[0, 1:])
        return found if np.linalg.matrix_rank(slopes) == 2 else None  # else its time is given

    @property
    def pin(self) -> str:
        """The surface of the stop."""
        return str(self.bridge.system.holds[0].pin)

    @property
    def period(self) -> float:
        """Period of the excitation."""
        orbit = self.letters["a"]
        return orbit.period / orbit.periods

    def sign(self, letter: str) -> float:
        """Return on which side of its surface the stop is where a letter follows."""
        rows = self.letters[letter].system.layout.joint
        pin = self.bridge.model.surface_index[self.pin]
        return float(next(row[2] for row in rows if row[0] == 0 and row[1] == pin and row[3] == 0))

    def jumps(self, grid: FloatArray) -> FloatArray:
        """Return the release to a stop on the surface at each parameter, or nan."""
        found, time = np.empty(len(grid)), float(self.letters["a"].joints[0, 0])
        step = _STEP * self.period
        for k, value in enumerate(grid):
            for _ in range(_STEPS):
                height, beyond = (self.after("a", value, t)[1] for t in (time, time + step))
                if not abs(height) >= _NEAR or beyond == height:
                    break
                time -= height * step / (beyond - height)
            found[k] = time if abs(height) < _NEAR else np.nan
        return found

    def over(
        self, letter: str, end: float, count: int, grid: FloatArray, jumps: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return images and heights of the stop over a side of D, each of shape (parameters, count)."""
        s = np.linspace(0.0, end, count)
        s[0] = _NEARBY * end
        found = np.array(
            [[self.after(letter, x, c + d) for d in s] for x, c in zip(grid, jumps, strict=True)]
        )
        return found[:, :, 0] - jumps[:, None], found[:, :, 1]

    def after(self, letter: str, value: float, time: float) -> tuple[float, float]:
        """Return the next release and the height of the stop above its surface; nan where none is met."""
        start = self._start(letter, value, time)
        joints, end, system = start.joints, np.empty(3), start.system
        joints[1] = np.nan  # written as soon as the stop is met
        found = follow_itinerary(system.functions(), system.layout, joints, start.vector, 1, end)
        view = start.model.view(start.vector)
        height = view.height(self.pin, float(joints[1, 0]), joints[1, 1:])
        return (float(end[0]) if found else np.nan), height

    def _start(self, letter: str, value: float, time: float) -> Orbit:
        """Return a letter with its first joint the release at a time."""
        orbit = self.letters[letter]
        model, joints = orbit.model, orbit.joints.copy()
        vector = with_entries(orbit.vector, model.index_of(self.bridge.parameter), value)
        view, state, on = model.view(vector), joints[0, 1:], self.surfaces
        assert on is not None
        joints[0, 0] = time
        for _ in range(_STEPS):
            heights = [view.height(s, time, state) for s in on]
            if max(map(abs, heights)) < _NEAR:
                break
            slopes = self._slopes(on, replace(orbit, vector=vector), time, state)
            state -= np.linalg.solve(slopes, heights)
        return replace(orbit, joints=joints, vector=vector)

    def _slopes(
        self, on: tuple[str, str], orbit: Orbit, time: float, state: FloatArray
    ) -> FloatArray:
        """Return the derivatives by the state of the observables of two surfaces, shape (2, 2)."""
        view, known = orbit.model.view(orbit.vector), orbit.model.surface_by_name
        return np.array([view.gradient(known[s].observable, time, state)[1:] for s in on])
