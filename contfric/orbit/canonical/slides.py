"""The slides of a solution: what it is, whatever itinerary it is solved with.

A motion at an event solves several itineraries. They differ by segments of no length, and by touches of rest
inside of a slide. The slides of some length, joined over such touches, are the same for all of them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.attributes import cached_property
from contfric.models.definition import Model
from contfric.orbit.canonical.sections import only_touches
from contfric.orbit.measured.samples import state_within
from contfric.orbit.orbit import Orbit

#: Parts of a cycle that agree to this (nondimensional) are the same solution: the root of rounding.
SAME_SOLUTION = 1e-5
#: Segments shorter than this have no length: a slide that vanishes is located to the third root of rounding
#: (times its conditioning), a hold at a touch of rest to the second.
SHORT = 1e-3
#: Where a segment is asked for a third state, as a share of it: no whole number of it are a whole segment.
_INSIDE = 0.381966


def resting_modes(orbit: Orbit) -> set[str]:
    """Return the modes of an orbit in which nothing moves.

    One in which a contact rests is not enough: of several contacts, or masses, one nearly always does. And
    it does not depend on the itinerary, so that all itineraries of one solution have the same slides.
    """
    return {mode for mode, _ in orbit.itinerary if orbit.model.is_at_rest(mode)}


def time_unit(orbit: Orbit) -> float:
    """Return the time that short times are a share of: 1, or the period of a solution that is faster.

    In seconds a converter switches within microseconds: times of 1e-3 are long there.
    """
    return min(1.0, orbit.period)


def slides_of(orbit: Orbit) -> list[int]:
    """Return the segments with which slides of some length begin, joined over a touch of rest.

    Segments of rest are left out, those of no length, and those that stand still; a segment that goes on in
    the mode and from the state in which the one before it ended is a part of that. Where there are joints on
    sections slides begin there.
    """
    sliding = resting_modes(orbit)
    lasts = orbit.durations
    some = [i for i in range(len(orbit.itinerary)) if lasts[i] > SHORT * time_unit(orbit)]
    cut = [i for i in some if orbit.itinerary[i - 1] in orbit.model.sections]
    if cut:  # the only joints that are in every itinerary; of touches any may be an impact or not
        return some if len(cut) < len(some) and only_touches(orbit) else cut
    goes_on = [_goes_on(orbit, some[k - 1], i) for k, i in enumerate(some)]
    found = set()
    for k, i in enumerate(some if not all(goes_on) else ()):
        if orbit.itinerary[i][0] in sliding or stands_still(orbit, i):
            continue
        first = k  # what it goes on from may stand still: in other itineraries that is a part of it
        while goes_on[first]:
            first -= 1
        found.add(some[first])
    return sorted(found) or [i for i in some if orbit.itinerary[i][0] not in sliding] or [0]


def _goes_on(orbit: Orbit, before: int, i: int) -> bool:
    """Tell whether a segment goes on in the mode and from the state in which another one ended.

    In the short time between them what rests stays where it is, and what else moves goes on as in the mode.
    """
    mode, end, begin = orbit.itinerary[i][0], orbit.ends[before, 1:], orbit.begins[i, 1:]
    if i == before or orbit.itinerary[before][0] != mode:
        return False
    apart = np.abs(begin - end)
    between = range(before + 1, i if i > before else i + len(orbit.itinerary))
    if between and apart.max() >= SAME_SOLUTION:
        later = float(orbit.durations[[k % len(orbit.itinerary) for k in between]].sum())
        moved = orbit.flow.state(mode, float(orbit.ends[before, 0]), end, later)
        apart = np.minimum(apart, np.abs(begin - moved))
    return bool(apart.max() < SAME_SOLUTION)


def stands_still(orbit: Orbit, i: int) -> bool:
    """Tell whether a segment stays where it begins: a slide that stands in its equilibrium.

    The solution is the same as at rest. What moves and comes back to where it began is elsewhere in between.
    """
    begin, end = orbit.begins[i], orbit.ends[i]
    if orbit.model.autonomous or np.abs(end[1:] - begin[1:]).max() >= SAME_SOLUTION:
        return False
    inside = state_within(orbit, i, _INSIDE * float(end[0] - begin[0]))
    return bool(np.abs(inside - begin[1:]).max() < SAME_SOLUTION)


def repeats(orbit: Orbit, slides: list[int], turns: int, mirrored: bool = False) -> bool:
    """Tell whether the slides repeat themselves (or as symmetry images) after a part of the period."""
    if turns == 1:
        return True
    count, rest = divmod(len(slides), turns)
    symmetry = orbit.model.symmetry
    if rest or (mirrored and symmetry is None):
        return False
    starts = orbit.begins[slides]
    ahead = np.roll(starts, -count, axis=0)
    ahead[len(starts) - count :, 0] += orbit.period
    ahead[:, 0] -= orbit.period / turns
    if mirrored:
        assert symmetry is not None
        ahead[:, 1:] = ahead[:, 1:] @ symmetry.array().T
    return bool(np.abs(ahead - starts).max() < SAME_SOLUTION)


def repetitions(orbit: Orbit, slides: list[int]) -> int:
    """Return how often the solution of a whole orbit repeats itself in its period.

    Without an excitation that may be any part of its slides.
    """
    whole = len(slides) if orbit.model.autonomous else orbit.periods
    found = (k for k in range(whole, 0, -1) if whole % k == 0 and repeats(orbit, slides, k))
    return next(found)


@dataclass(frozen=True, eq=False)
class Outline:
    """The starts of the slides of a solution, over its shortest period.

    Attributes
    ----------
    periods : shortest period, in periods of the excitation; without one it is of no importance
    cycle : period of the excitation; infinite without one
    starts : ndarray, shape (k, 1 + n)
        Time and state at the start of each slide, after an impact (a slide of no length may lie between);
        times are those of the excitation, zero without one.
    images : ndarray, shape (k, 1 + n)
        The same for the symmetry image; ``starts`` if the model has no symmetry.
    angles : columns of angles, the same a turn later
    ordered : whether the starts are a cyclic sequence; where they are states at a phase they are a set
    """

    periods: int
    cycle: float
    starts: FloatArray
    images: FloatArray
    angles: tuple[int, ...] = ()
    ordered: bool = True

    def apart(self, other: Outline) -> float:
        """Return how far two solutions are apart, up to symmetry; infinite if they are of another kind.

        Without an excitation a solution is told by any of its states, however often it is run through.
        """
        alike = self.periods == other.periods and len(self.starts) == len(other.starts)
        if np.isfinite(self.cycle) and not alike:
            return np.inf
        return min(self._apart_from(there) for there in (other.starts, other.images))

    def _apart_from(self, there: FloatArray) -> float:
        """Return how far joints are from the starts: in their order, unless they have none."""
        from contfric.orbit.canonical.distance import cyclic_apart, farthest_apart

        measure = cyclic_apart if self.ordered else farthest_apart
        return float(measure(self.starts, there, self._cycles))

    @cached_property
    def _cycles(self) -> FloatArray:
        """What times and states are modulo; infinite where they are not, shape (1 + n,)."""
        cycles = np.full(self.starts.shape[1], np.inf)
        cycles[[0, *self.angles]] = [self.cycle, *(2.0 * np.pi for _ in self.angles)]
        return cycles

    def is_part_of(self, other: Outline, within: float) -> bool:
        """Tell whether the slides are those of another solution (or its image) in order, some left out.

        Both over the same number of periods, and with an order.
        """
        return any(self._in_order(there, within) for there in (other.starts, other.images))

    def _in_order(self, there: FloatArray, within: float) -> bool:
        gaps, cycles = np.abs(self.starts[:, None] - there[None]), self._cycles
        turns = np.isfinite(cycles)
        gaps[..., turns] = np.abs(
            (gaps[..., turns] + 0.5 * cycles[turns]) % cycles[turns] - 0.5 * cycles[turns]
        )
        near = np.max(gaps, axis=2) < within
        for first in map(int, np.flatnonzero(near[0])):
            row = 0
            for column in np.roll(near, -first, axis=1).T:  # the next one that fits is the best one
                row += int(row < len(near) and column[row])
            if row == len(near):
                return True
        return False

    def repeated(self, periods: int) -> Outline:
        """Return the same solution over a multiple of its periods."""
        times = periods // self.periods
        starts, images = np.tile(self.starts, (times, 1)), np.tile(self.images, (times, 1))
        return replace(self, periods=periods, starts=starts, images=images)

    @cached_property
    def apart_from_image(self) -> float:
        """How far the solution is from its symmetry image."""
        return self._apart_from(self.images)


def outline_of(orbit: Orbit) -> Outline:
    """Return the outline of an orbit."""
    whole, model = orbit.as_whole(), orbit.model
    if model.joined and not model.autonomous:
        return _at_one_phase(whole)
    slides = slides_of(whole)
    turns = repetitions(whole, slides)
    starts = np.array(whole.begins[slides[: len(slides) // turns]])
    cycle = np.inf if model.autonomous else whole.period / whole.periods
    starts[:, 0] = 0.0 if model.autonomous else starts[:, 0] % cycle
    images = starts
    if model.symmetry is not None:
        images = starts.copy()
        images[:, 1:] = starts[:, 1:] @ model.symmetry.array().T
        if not model.autonomous:
            images[:, 0] += model.symmetry.fraction * cycle
    return Outline(max(1, whole.periods // turns), cycle, starts, images, _columns(model))


def _at_one_phase(whole: Orbit) -> Outline:
    """Return the states of an orbit at one phase of the excitation, for models with sections.

    There a slide begins anywhere: which crossings of a section are joints is of no importance.
    """
    model, cycle = whole.model, whole.period / whole.periods
    states = np.array([whole.state(k * cycle) for k in range(whole.periods)])
    periods = next(
        k
        for k in range(1, whole.periods + 1)
        if whole.periods % k == 0
        and np.abs(np.roll(states, -k, axis=0) - states).max() < SAME_SOLUTION
    )
    starts = np.column_stack([np.zeros(periods), states[:periods]])
    impacts = _impacts(whole)
    impacts = impacts[: len(impacts) * periods // whole.periods]
    impacts[:, 0] %= cycle
    starts = np.vstack([starts, impacts])
    images = starts
    if model.symmetry is not None:
        back, mirror = model.symmetry.fraction * cycle, model.symmetry.array()
        others = np.array([whole.state(k * cycle - back) for k in range(periods)])
        images = np.column_stack([np.zeros(periods), others @ mirror.T])
        turned = np.column_stack([(impacts[:, 0] + back) % cycle, impacts[:, 1:] @ mirror.T])
        images = np.vstack([images, turned])
    return Outline(periods, cycle, starts, images, _columns(model), ordered=False)


def _impacts(whole: Orbit) -> FloatArray:
    """Return time and state in front of each reset that changes the state: a grazing impact changes none."""
    following = np.roll(whole.begins[:, 1:], -1, axis=0)
    jumps = np.abs(following - whole.ends[:, 1:]).max(axis=1) >= SAME_SOLUTION
    struck = [whole.model.reset_at(*joint) is not None for joint in whole.itinerary]
    return np.array(whole.ends[jumps & np.array(struck)])


def _columns(model: Model) -> tuple[int, ...]:
    return tuple(1 + i for i in model.angles)


def modulo(gaps: FloatArray, cycle: float) -> FloatArray:
    """Return distances on a circle of circumference ``cycle``."""
    return np.asarray(np.abs((gaps + 0.5 * cycle) % cycle - 0.5 * cycle))
