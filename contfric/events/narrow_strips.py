"""What follows an event where a hold at a limit crosses the strip to the other one in no time.

A hold crosses the strip in a time d, the width of the strip over the rate of the load. Until it is left the
mass stands still; what it then does differs by the third power of d from what it would have done at once.
Where that is rounding the branch of the hold has no width: both of its ends are at the same event, and the
regular itineraries at both are its outcomes: the slide of no length and rest, as at equal limits.
A hold at a touch of rest is none of these: while it lasts its branch moves by the square of d.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product

import numpy as np

from contfric.bvp.holds import Hold
from contfric.bvp.system import EventFunction, Margin
from contfric.events.outcomes import Successor
from contfric.orbit.orbit import Orbit
from contfric.orbit.slides import SAME_SOLUTION, time_unit
from contfric.signature.edits import Edit, drop
from contfric.signature.holds import TOUCH

#: A hold that takes longer to cross a strip (in units of time) has a branch of its own: it moves stops by
#: about the third power of this, 8e-12, which is less than what two events are told apart by (1e-11).
CROSSES = 2e-4
#: A regular slide from the limit on lasts twice as long as the hold that crosses the strip; Newton's method
#: starts farther out, where the equation is convex.
_FARTHER = 2.0
#: Most combinations of edges that are tried: three holds of a unit.
_MOST = 8

#: A hold of a unit, and of its repetitions, passed regularly.
Passed = list[Successor]


def regular_outcomes(orbit: Orbit, count: int) -> Iterator[Passed]:
    """Yield what makes regular passages of the holds that cross a strip in no time.

    The orbit repeats a unit of ``count`` segments: its holds are passed as those of the unit are. Alone each
    of them may have no orbit, as a slide of no length after another one has no certain end.
    """
    holds = [hold for hold in orbit.system.holds if _crosses(orbit, hold)]
    own = [
        [hold for hold in holds if hold.segment % count == h]
        for h in sorted({hold.segment % count for hold in holds})
    ]
    ways = [list(zip(*(_regular(orbit, hold) for hold in images), strict=True)) for images in own]
    if not own or math.prod(map(len, ways)) > _MOST:
        return
    for chosen in product(*ways):
        yield [passed for images in chosen for passed in images]


def is_same(orbit: Orbit, other: Orbit, least: float) -> bool:
    """Tell whether an orbit that was solved is admissible, and the solution of another one."""
    if not other.converged or float(other.margins.min(initial=0.0)) < -least:
        return False
    return bool(
        np.min(other.durations) > 0.0 and orbit.outline.apart(other.outline) < SAME_SOLUTION
    )


def _crosses(orbit: Orbit, hold: Hold) -> bool:
    """Tell whether a hold lasts no time, and needs no time to cross the strip."""
    h, near = hold.segment, CROSSES * time_unit(orbit)
    if hold.pin is None or hold.after_rest or orbit.durations[h] > near:
        return False
    left = EventFunction(Margin.EXIT, h, hold.leaves)
    return abs(float(orbit.margins[orbit.system.tests.index(left)])) < near


def _regular(orbit: Orbit, hold: Hold) -> Iterator[Successor]:
    """Yield the regular passages at the two edges of the strip: left at once, and kept at rest."""
    h, itinerary, model = hold.segment, orbit.itinerary, orbit.model
    count, vanishes = len(itinerary), f"hold {h + 1} vanishes"
    slide, rest = (h + 1) % count, (h + 2) % count
    end = orbit.cycle[rest].copy()
    end[0] += _FARTHER * orbit.durations[h]
    yield Successor(drop(h), {(rest, -1): end}, vanishes)
    kept = rest not in (h, (h - 1) % count) and itinerary[rest][1] != TOUCH
    if kept and model.lies_on(itinerary[rest][0], itinerary[slide][1]):
        edit = Edit(frozenset({slide, rest}), {h: itinerary[rest][1]})
        yield Successor(edit, {}, f"the slide after hold {h + 1} vanishes: it is held")
