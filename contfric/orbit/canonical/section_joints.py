"""An orbit in one mode with joints on a section as well, for what follows when its other joints vanish.

An orbit whose only joint is an impact that comes to graze, or a rest that vanishes, goes on without any: it
is smooth after the event.
So that both are itineraries of one solution, joints are put where the solution crosses a section.

None is put where a wall is touched at that moment (velocity is zero there). An impact of speed zero comes in
between the joints or goes from there. Where a solution has no other crossing, as one between two walls that
touches both, its touches have joints, and the impact takes the place of one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.system import build_system
from contfric.orbit.canonical.sections import at_wall, is_smooth, lies_on, only_touches
from contfric.orbit.canonical.slides import SHORT, time_unit
from contfric.orbit.clock import clocked
from contfric.orbit.orbit import Orbit

#: Most crossings of one segment that are looked for, and how near to its end one is the end itself.
_MOST, _AT_JOINT = 1000, 1e-8
#: Crossings whose rates differ by less than this share are equally fast.
_AS_FAST = 1e-6


def divided(whole: Orbit, turns: int) -> Orbit | None:
    """Return a whole orbit with joints on a section too, where all of it that lasts is in one mode.

    One each way in each of the equal ``turns`` of the motion, where no wall is touched. Rest of no length at
    a touch vanishes with it. None where there is no section, or where it is of no use.
    """
    model = whole.model
    if is_smooth(model, whole.itinerary):
        return _off_walls(whole)
    lasts = whole.durations
    lasting = {
        model.whole_mode(mode)
        for (mode, _), last in zip(whole.itinerary, lasts, strict=True)
        if last > SHORT * time_unit(whole)
    }
    if len(lasting) != 1:
        return None
    (mode,) = lasting
    sections = {s for part, s in model.sections if model.whole_mode(part) == mode}
    if not sections:
        return None
    surface = min(sections, key=model.surface_index.__getitem__)
    chosen = _by_turns(whole, mode, surface, turns)
    if not chosen:
        return None
    pairs = {-side: pair for side, pair in model.section_pairs(mode, surface).items()}
    itinerary: list[tuple[str, str]] = []
    joints: list[FloatArray] = []
    for i, pair in enumerate(whole.itinerary):
        cuts = sorted((c for c in chosen if c.segment == i), key=lambda c: c.time)
        joints += [whole.cycle[i], *(c.joint for c in cuts)]
        itinerary += [*(pairs[c.way] for c in cuts), pair]
    system = build_system(model, tuple(itinerary), whole.periods)
    found = clocked(model, np.array(joints), float(joints[0][0]) + whole.period)
    return replace(whole, system=system, joints=found)


def _off_walls(whole: Orbit) -> Orbit | None:
    """Return a smooth orbit without its joints at which a wall is touched; None if all or none are."""
    count = len(whole.itinerary)
    modes = [whole.itinerary[i - 1][0] for i in range(count)]  # in which a joint is reached
    kept = [i for i in range(count) if not at_wall(whole, modes[i], whole.cycle[i])]
    if len(kept) in (0, count):
        return None
    itinerary = tuple(whole.itinerary[i - 1] for i in [*kept[1:], kept[0]])
    joints = whole.cycle[kept]
    system = build_system(whole.model, itinerary, whole.periods)
    found = clocked(whole.model, joints, float(joints[0, 0]) + whole.period)
    return replace(whole, system=system, joints=found)


def crossed_at_graze(whole: Orbit, i: int) -> tuple[str, str] | None:
    """Return the pair of the section that is crossed where segment ``i`` ends with an impact of no speed.

    None where the solution has a joint that is at no touch: then it needs none here without the impact.
    """
    model, flow = whole.model, whole.flow
    if not only_touches(whole):
        return None
    end, mode = whole.ends[i], model.whole_mode(whole.itinerary[i][0])
    for surface in {s for part, s in model.sections if model.whole_mode(part) == mode}:
        observable = model.surface_by_name[surface].observable
        if lies_on(whole, surface, end):
            rises = flow.rate(mode, observable, float(end[0]), end[1:]) > 0.0
            return model.section_pairs(mode, surface).get(-1 if rises else 1)
    return None


@dataclass(frozen=True, eq=False)
class _Crossing:
    """A crossing of the section: the segment in which it is, its time and state, and how fast it is."""

    segment: int
    joint: FloatArray
    rate: float

    @property
    def time(self) -> float:
        return float(self.joint[0])

    @property
    def way(self) -> int:
        """1 upwards, -1 downwards."""
        return 1 if self.rate > 0.0 else -1


def _by_turns(whole: Orbit, mode: str, surface: str, turns: int) -> list[_Crossing]:
    """Return the fastest crossings of a surface in a mode, one each way in each turn.

    One way only where there is no other crossing, or a wall is touched at it.
    """
    own = [i for i, (part, _) in enumerate(whole.itinerary) if whole.model.whole_mode(part) == mode]
    every = [c for i in own for c in _inside(whole, i, surface)]
    free = [c for c in every if not at_wall(whole, whole.itinerary[c.segment][0], c.joint)]
    ways = {way: [c for c in free if c.way == way] for way in (-1, 1)}
    if not free:
        return every if only_touches(whole) else []  # else an impact of some speed is a joint

    def apart(crossing: _Crossing, time: float) -> float:
        period = whole.period
        return abs((crossing.time - time + 0.5 * period) % period - 0.5 * period)

    if not all(ways.values()):
        first = max(free, key=lambda c: abs(c.rate)).time
        again = [first + k * whole.period / turns for k in range(turns)]
        return [min(free, key=lambda c, t=t: apart(c, t)) for t in again]  # type: ignore[misc]
    down = max(ways[-1], key=lambda c: abs(c.rate)).time
    fast = (1.0 - _AS_FAST) * max(c.rate for c in ways[1])
    half = down + 0.5 * whole.period / turns  # where a symmetric solution has the image
    up = min((c for c in ways[1] if c.rate >= fast), key=lambda c: apart(c, half)).time
    starts = [
        (way, t + k * whole.period / turns)
        for way, t in ((-1, down), (1, up))
        for k in range(turns)
    ]
    return [min(ways[way], key=lambda c, t=t: apart(c, t)) for way, t in starts]  # type: ignore[misc]


def _inside(whole: Orbit, i: int, surface: str) -> list[_Crossing]:
    """Return the crossings of a surface inside of one segment."""
    flow, mode = whole.flow, whole.itinerary[i][0]
    observable, level = whole.model.surface_by_name[surface].observable, flow.level(surface)
    place, end = whole.begins[i], float(whole.ends[i, 0])
    found, on = [], whole.itinerary[i - 1][1] == surface
    for _ in range(_MOST):
        time = float(place[0])
        hit = flow.first(mode, observable, level, time, place[1:], end - time, on=on)
        if hit is None or end - time - hit[0] < _AT_JOINT:
            break
        place, on = np.array([time + hit[0], *hit[1]]), True
        if place[0] - whole.begins[i, 0] < _AT_JOINT:
            continue  # behind an impact that grazes
        rate = flow.rate(mode, observable, float(place[0]), place[1:])
        found.append(_Crossing(i, place, rate))
    return found
