"""Crossings of its section by a smooth cycle: all of them, and those at which it keeps its joints.

A smooth cycle meets nothing but sections. It is fixed by one crossing each way, that at which its section is
crossed fastest; without excitation by as many as it has large loops.
"""

from __future__ import annotations

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.system import Itinerary
from contfric.models.definition import Model
from contfric.orbit.orbit import Orbit

#: A crossing this slow compared with the fastest one is that of a small loop.
_SMALL = 0.2
#: Most crossings of one segment that are looked for, and how near to its end one is the end itself.
_MOST, _AT_JOINT = 1000, 1e-8


def loops(
    model: Model, itinerary: Itinerary, joints: FloatArray, end: float, vector: FloatArray
) -> int:
    """Return how often a smooth cycle crosses its section each way; small loops are left out."""
    crossings = SectionCrossings(model, itinerary, joints, end, vector)
    rates = [crossings.rates[i] for i in crossings.down]
    return max(1, sum(rate > _SMALL * max(rates) for rate in rates))


def crossings_near(whole: Orbit, joints: FloatArray) -> FloatArray:
    """Return the crossings of a smooth orbit that are nearest to some joints, in any of its periods.

    An orbit of many periods has joints at one crossing each way, which may not be those of a shorter one.
    """
    _, every = every_crossing(whole)
    found = []
    for joint in joints:
        there = every.copy()
        there[:, 0] += whole.period * np.round((joint[0] - there[:, 0]) / whole.period)
        found.append(there[int(np.argmin(np.max(np.abs(there - joint), axis=1)))])
    return np.array(found)


def every_crossing(whole: Orbit) -> tuple[Itinerary, FloatArray]:
    """Return all crossings of its section as the itinerary and the joints of a smooth orbit, in order."""
    model, flow = whole.model, whole.flow
    mode, surface = whole.itinerary[0]
    observable, level = model.surface_by_name[surface].observable, flow.level(surface)
    pairs = model.section_pairs(mode, surface)
    found: list[FloatArray] = []
    for joint, end in zip(whole.cycle, whole.ends, strict=True):
        found.append(joint)
        for _ in range(_MOST):
            time, state = float(found[-1][0]), found[-1][1:]
            left = float(end[0]) - time
            hit = flow.first(mode, observable, level, time, state, left, on=True)
            if hit is None or left - hit[0] < _AT_JOINT:
                break
            found.append(np.array([time + hit[0], *hit[1]]))
    joints = np.array(found)
    rates = [flow.rate(mode, observable, float(z[0]), z[1:]) for z in joints]
    # the segment that begins at a joint ends at the next one, on the side that this one leads to
    itinerary = tuple(pairs[1 if rate > 0.0 else -1] for rate in rates)
    return itinerary, joints


class SectionCrossings:
    """The crossings of the first section that a smooth cycle has, each as the segment that ends there."""

    def __init__(
        self, model: Model, itinerary: Itinerary, joints: FloatArray, end: float, vector: FloatArray
    ) -> None:
        self.model = model
        surface = next(s for s in model.surface_by_name if any(pair[1] == s for pair in itinerary))
        self.at = [i for i, pair in enumerate(itinerary) if pair[1] == surface]
        self.ends = np.concatenate((joints[1:], joints[:1]))
        self.ends[-1, 0] = end
        self.period = end - float(joints[0, 0])
        self.rates = {i: _rate(model, itinerary[i], self.ends[i], vector) for i in self.at}
        self.down = [i for i in self.at if model.section_sides[itinerary[i]] > 0]

    def chosen(self, pairs: int) -> list[int]:
        """Return crossings in both directions by turns, as many each way as there are to be."""
        chosen = sorted(self.later(pairs) or sorted(self.down, key=self.rates.__getitem__)[-pairs:])
        found = []
        for i, following in zip(chosen, [*chosen[1:], chosen[0]], strict=True):
            ups = [j for j in self._behind(i, following) if j not in self.down]
            if not ups:
                return sorted(chosen)  # of a surface that is crossed one way only
            image = self._image_of(i, ups)
            found += [i, max(ups, key=self.rates.__getitem__) if image is None else image]
        return sorted(found)

    def _behind(self, i: int, following: int) -> list[int]:
        """Return the crossings between two of them; all others if they are one."""
        own = [j for j in self.at if j not in (i, following)]
        if i < following:
            return [j for j in own if i < j < following]
        return [j for j in own if j > i or j < following]

    def _image_of(self, i: int, others: list[int]) -> int | None:
        """Return the crossing that is nearest to the symmetry image of another one."""
        if self.model.symmetry is None:
            return None
        image = self.model.symmetry.array() @ self.ends[i, 1:]

        def apart(j: int) -> float:
            late = self._apart(self.ends[j, 0] - self.ends[i, 0] - 0.5 * self.period)
            return max(late, float(np.max(np.abs(self.ends[j, 1:] - image))))

        return min(others, key=apart)

    def later(self, periods: int) -> list[int]:
        """Return crossings that are nearest to one another, a period of the excitation apart; or none."""
        first, found = max(self.down, key=self.rates.__getitem__), []
        step = self.period / periods
        for k in range(periods):

            def apart(i: int, time: float = self.ends[first, 0] + k * step) -> float:
                gap = float(np.max(np.abs(self.ends[i, 1:] - self.ends[first, 1:])))
                return max(self._apart(self.ends[i, 0] - time), gap)

            found.append(min(self.down, key=apart))
        return found if len(set(found)) == periods else []

    def _apart(self, time: float) -> float:
        return float(abs((time + 0.5 * self.period) % self.period - 0.5 * self.period))


def fastest_crossings(
    model: Model,
    itinerary: Itinerary,
    joints: FloatArray,
    end: float,
    vector: FloatArray,
    periods: int,
) -> list[int]:
    """Return the segments at whose ends a smooth cycle keeps a joint."""
    crossings = SectionCrossings(model, itinerary, joints, end, vector)
    if not crossings.down:
        return crossings.at[:1]
    return crossings.chosen(min(periods, len(crossings.down)) if model.autonomous else 1)


def _rate(model: Model, pair: tuple[str, str], at: FloatArray, vector: FloatArray) -> float:
    observable = model.surface_by_name[pair[1]].observable
    return abs(model.view(vector).rate(pair[0], observable, float(at[0]), at[1:]))
