"""Faults of a branch: orbits of another itinerary, or of a shorter period, that solve its equations."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.continuation.accuracy.moved_by_errors import duration_error
from contfric.continuation.branch import Branch
from contfric.continuation.located_event import ROUGH
from contfric.events.bifurcation import Decision, Proposal
from contfric.events.outcomes.standing_slides import STANDS, goes_nowhere
from contfric.orbit.canonical.repetition import shortest
from contfric.orbit.itinerary.one_way import only_grows
from contfric.orbit.orbit import Orbit

#: Why an itinerary is refused in which a mode can only last for no time.
ONLY_GROWS = "something only grows along it, as a slider's offset that slips to one side: it cannot come back"
#: Why one is refused along which a slide stands in its equilibrium: how long is free, so that it is a line.
STANDS_STILL = "a slide of it goes nowhere: the solution of another itinerary, that rests"
#: A hold shorter than this share of the arclength is rounding: on a bridge joints move as its length does, by
#: 300 times it where one of four periods is held next to a doubling.
_NO_TIME = 1e-4
#: A segment this short may have no length: where it touches a surface it is known to the root of rounding,
#: and a slide to its cube root, as it moves the mass by the third power of its length: 5e-6, and 30 times
#: that over a slope that is small. Whether it has one is told by what rounding makes of it.
_NO_LENGTH = 1e-3
#: What comes in at an event moves at least by this share of the arclength.
_NO_SHARE = 1e-2
#: A bridge on which the parameter changes by less (relative to 1 + its value) may consist of rounding.
_NARROW = 1e-5
#: A branch shorter than this (arclength) is asked whether it is admissible at all: beyond, the march notices.
#: And what a margin misses by rounding, where states are known to its root.
_SHORT, _ROUNDING = 1e-3, 1e-11
#: Places on a branch, as shares of its points or of its length, that are asked whether its segments last: a
#: segment that does not vanish all along lasts at one of them.
_ASKED = (0.25, 0.5, 0.75)


def fault_of_itinerary(orbit: Orbit) -> str | None:
    """Return what is wrong with the itinerary of an orbit, whatever its branch is; None if nothing is."""
    return ONLY_GROWS if only_grows(orbit.model, orbit.as_whole().itinerary) else None


def slips_to_one_side(orbit: Orbit, proposals: Iterable[Proposal]) -> bool:
    """Tell whether a contact that an orbit keeps stuck slips to one side only, whatever follows an event.

    With a static limit above the kinetic one it slips by some length at once. It sticks at another position
    after that: the orbits there are others, of a continuum, and none of them meets the event.
    """
    refused = [p.why for p in proposals if p.verdict is Decision.REFUSED]
    return len(orbit.system.layout.conserved) > 0 and set(refused) == {ONLY_GROWS}


def fault_of(branch: Branch, width: float) -> str | None:
    """Return what is wrong with a branch; None if nothing is. ``width`` is that of the parameter's range."""
    at = sorted({round(share * (len(branch) - 1)) for share in _ASKED})
    asked = [branch[k] for k in at]
    found = next((why for is_so, why in _FAULTS if is_so(branch, at, asked)), None)
    if found is None and _undetermined(branch, width):
        return "rounding leaves no place of its end in the range: its equations are singular there"
    return found


def _only_touches(branch: Branch, at: list[int], asked: list[Orbit]) -> bool:
    """Tell whether an itinerary has modes that no periodic motion is in (``orbit.itinerary.one_way``)."""
    return fault_of_itinerary(asked[0]) is not None


def _never_held(branch: Branch, at: list[int], asked: list[Orbit]) -> bool:
    """Tell whether a hold has no length at any point of a branch: the equations hold, and nothing is held.

    Where orbits are a continuum, those of them that touch rest solve the equations of a hold for every value
    of the parameter. On a bridge a hold grows at least with the distance from its event, unless it turns
    back at once: then it is told from none by what rounding makes of it.
    """
    holds = [hold.segment for hold in branch.system.holds]
    if not holds:
        return False
    return any(_no_longer(branch, range(len(branch)), holds, _NO_TIME * min(1.0, branch.arc[-1])))


def _no_longer(
    branch: Branch, asked: Iterable[int], segments: Iterable[int], least: float
) -> Iterator[bool]:
    """Yield of each segment whether it is shorter than a number, and has no length as far as can be told.

    The points of a short branch may all be near its ends: it is asked between them, too.
    """
    at = list(asked)
    times = branch.joints[at, :, 0]
    ends = times[:, :1] + branch.turns_at(at)[:, None]
    lasts: FloatArray = np.concatenate([times[:, 1:], ends], axis=1) - times
    for segment in segments:
        k = int(np.argmax(lasts[:, segment]))
        if lasts[k, segment] >= least:
            yield False
            continue
        between = (branch.between(share * float(branch.arc[-1])) for share in _ASKED)
        yield not any(
            _lasts(orbit, branch.parameter, segment) for orbit in chain((branch[at[k]],), between)
        )


def _lasts(orbit: Orbit, parameter: str, segment: int) -> bool:
    """Tell whether a segment lasts longer than the errors of all equations let it seem to."""
    error = duration_error(orbit, orbit.model.index_of(parameter), segment)
    return error is not None and bool(orbit.durations[segment] > error)


def _never_lasts(branch: Branch, at: list[int], asked: list[Orbit]) -> bool:
    """Tell whether a segment has no length at any point of a branch: the orbits are those without it.

    Where orbits are a continuum those of them that touch a surface solve the equations of an itinerary with a
    segment there, of no length. So do those that touch two crests of equal height, with a slide in between. A
    segment that comes in at an event grows at least with the distance.
    """
    least = min(_NO_LENGTH, branch.arc[-1])
    return any(_no_longer(branch, at, range(branch.system.segments), least))


def _stands(branch: Branch, at: list[int], asked: list[Orbit]) -> bool:
    """Tell whether a slide stands in its equilibrium all along a branch: its orbits are those without it.

    How long it stands is free, so the equations hold along a line on which the solution does not change.
    Where it moves, its acceleration grows at least with the distance.
    """
    least = min(STANDS, _NO_SHARE * branch.arc[-1])
    return any(
        all(goes_nowhere(orbit, i, least) for orbit in asked) for i in range(branch.system.segments)
    )


def _repeats(branch: Branch, at: list[int], asked: list[Orbit]) -> bool:
    """Tell whether the orbits of a branch are shorter ones that are run through several times.

    Where an orbit begins at a graze its rounding is the root of rounding, and does not tell; the branch does.
    """
    if branch.system.periods == 1:
        return False
    return all(shortest(orbit) is not orbit for orbit in asked)


def _is_symmetric(branch: Branch, at: list[int], asked: list[Orbit]) -> bool:
    """Tell whether the orbits of a branch that is solved as a whole are their own symmetry images.

    A symmetric branch is solved on its half: this one is reached by a step off an event near its end. Near
    that end asymmetry may be the root of rounding, and an asymmetric branch may pass a symmetric orbit: two
    locations of three tell.
    """
    if branch.system.half or branch.model.symmetry is None:
        return False
    return sum(orbit.symmetric for orbit in asked) > len(asked) / 2


def _undetermined(branch: Branch, width: float) -> bool:
    """Tell whether a narrow bridge ends where rounding leaves no location of the event within its own width.

    Its equations are singular there. Such a bridge is one of many that a continuum of holds without damping
    seems to consist of: each begins and ends where rounding has it. A wide one is known by its points, and
    an event that is known better than to the root of rounding is regular.
    """
    own = float(np.ptp(branch.values))
    size = branch.model.size_of(
        branch.model.index_of(branch.parameter), np.abs(branch.values).max()
    )
    if not branch.bridge or own >= _NARROW * size:
        return False
    known = [end.bifurcation.accuracy for end in branch.ends if end.bifurcation is not None]
    return any(accuracy > ROUGH and accuracy * width > own for accuracy in known)


def _violates(branch: Branch, at: list[int], asked: list[Orbit]) -> bool:
    """Tell whether a short branch violates one condition at all of its points after the first.

    Near a singular event conditions change by the square of the distance. A branch that leaves it on the
    wrong side violates them by less than the march notices, until another event ends it.
    """
    if branch.arc[-1] >= _SHORT or len(branch) < 2:
        return False
    margins = np.array([branch[k].margins for k in range(1, len(branch))])
    return bool(margins.size and np.min(np.max(margins, axis=0)) < -_ROUNDING)


#: What a branch must not be, and why it is refused then; asked with some of its points and their orbits.
_FAULTS = (
    (_only_touches, ONLY_GROWS),
    (
        _never_held,
        "its hold has no length anywhere: the solution of another itinerary, that only touches rest",
    ),
    (
        _never_lasts,
        "a segment of it has no length anywhere: the solution of another itinerary, that touches a surface",
    ),
    (_stands, STANDS_STILL),
    (_is_symmetric, "its orbits are symmetric: it is another branch, which is solved on its half"),
    (_violates, "it violates a condition all along, by little more than rounding"),
    (_repeats, "its orbits are shorter ones, run through several times"),
)
