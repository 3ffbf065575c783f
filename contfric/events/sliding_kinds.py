"""Decides which kind of sliding event it is when a margin vanishes.

A margin that reaches zero is a sliding event; which one follows from the model's definition alone:

=========  ======================================  ==========================================
margin     where                                   kind
=========  ======================================  ==========================================
interior   segment that stays on a surface         AS: the stick touches its limit inside; GS where the
                                                   surface is another contact's, and the stick goes on
interior   other segment, surface that switches    GS: the slide touches rest inside, a slider its limit
interior   surface with the same field after it    T
any        surface with a reset in the mode        GS: a grazing impact
exit       as the interior of the same segment     AS, GS or T: the exit becomes tangential
joint      a reset chooses its mode by that side   SS: the map jumps (entry: the same)
joint      what crosses there is mapped on its way GS: the map jumps
           back
joint      the state at a stop meets a surface     CS if it leaves the stick there (distance to
                                                   the limit grows outward), SS if it enters it;
                                                   CS where there is no rest that the surface ends, and GS
                                                   where one of the two is the zero of the other's rate;
                                                   as the interior where a section is touched
entry      after a reset the state is on another  CS: another mode follows; GS where what just passes or
           surface                                 turns back is mapped again
lasting    slide between two holds                 GS: the first can be left no more
lasting    last part of a hold in several modes    CS: it is left as another contact changes
lasting    what begins as another contact changes,  CS: the hold begins as that does
           up to the touch at which a hold begins
any        of a segment that vanishes between two  as the exit by which it begins: AS of a slip, GS of a
           of one mode (:func:`beginning_of`)      stick
=========  ======================================  ==========================================

For CS and SS the sign of the observable's rate at the stop decides: rest is left if the state moves
out of the region where it can stay.
"""

from __future__ import annotations

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.holds import Hold
from contfric.bvp.margins import begun_by_another
from contfric.bvp.segment_starts import joints_before
from contfric.bvp.system import EventFunction, Margin, System
from contfric.events.bifurcation import Kind
from contfric.events.local.jumps import nothing_jumps
from contfric.events.local.touching import (
    chosen_at,
    is_corner,
    rate_along,
    rate_scale,
    rest_at,
    resting_domain,
    thrown_at,
    touched_at_joint,
)
from contfric.models.definition import Domain, Model
from contfric.models.mode_domains import inside_sign
from contfric.orbit.orbit import Orbit
from contfric.signature.holds import ends_rest, of_another

#: A segment that is this short (in periods) has vanished where one of its margins has: they are its length
#: times a rate, and Newton may fail before they are below 1e-5.
_VANISHED = 1e-4
#: A load that changes this slowly at a stop, against how fast it may, stands still there: a stop at a minimum
#: is known to the root of rounding. Where it is faster, a stick as short as its rate still ends in a jump.
ROUNDED = 1e-6
#: Time, in periods, by which it is asked before and after a stop whether it turns there.
_LATER = 1e-4


def kind_of_margin(system: System, test: EventFunction, orbit: Orbit) -> Kind:
    """Classify the vanishing of a margin; see the table of the module."""
    began = beginning_of(test, orbit)
    if began is not None:
        mode, surface = orbit.itinerary[began]
        return _kind_of_touch(system.model, mode, surface)
    model, mode = system.model, system.itinerary[test.segment][0]
    hold = hold_of_test(test, orbit)
    if hold is not None:
        return kind_of_hold(hold, test, orbit)
    if test.margin is Margin.LASTING and _begins_with_another(system, test.segment):
        return Kind.CS
    if chosen_at(system, test):
        return Kind.SS
    if test.margin is Margin.ENTRY:
        return Kind.GS if thrown_at(orbit, test) else Kind.CS
    if model.reset_at(mode, test.surface) is not None:
        return Kind.CS if is_corner(system, test, orbit) else Kind.GS
    if test.margin is Margin.JOINT and thrown_at(orbit, test):
        return Kind.GS
    if test.margin is Margin.JOINT and test.surface in model.section_surfaces:
        resting = resting_domain(system, test)
        if resting is None and inside_sign(model, mode, test.surface) == 0:
            return Kind.T
    if test.margin is not Margin.JOINT:
        return _kind_of_touch(model, mode, test.surface)
    resting = rest_at(test, orbit)
    touched = touched_at_joint(test, orbit, resting)
    if touched is not None:
        return _kind_of_touch(model, mode, touched)
    if resting is None or not ends_rest(model, resting.mode, test.surface):
        return Kind.CS  # such as by the velocity of another contact, which comes to rest with it
    return Kind.CS if _leaves(resting, test, orbit) else Kind.SS


def beginning_of(test: EventFunction, orbit: Orbit) -> int | None:
    """Return the segment before one without length, after which motion goes on as before it; else None.

    Where nothing jumps. All margins of such a segment vanish together, and which of them is met first is
    rounding: the event is what its beginning is.
    """
    k, itinerary = test.segment, orbit.itinerary
    if len(itinerary) < 3:
        return None
    before, following = (itinerary[j % len(itinerary)][0] for j in (k - 1, k + 1))
    same = orbit.model.whole_mode(before) == orbit.model.whole_mode(following)
    vanished = bool(orbit.durations[k] < _VANISHED * orbit.period)
    return (k - 1) % len(itinerary) if same and vanished and nothing_jumps(orbit) else None


def _kind_of_touch(model: Model, mode: str, surface: str) -> Kind:
    if ends_rest(model, mode, surface):
        return Kind.AS
    return Kind.T if inside_sign(model, mode, surface) == 0 else Kind.GS


def hold_of_test(test: EventFunction, orbit: Orbit) -> Hold | None:
    """Return the hold that a margin belongs to: its own, or of the slide after it that has vanished."""
    for hold in orbit.system.holds:
        if test.segment == hold.segment:
            return hold
        if hold.until is not None:
            continue
        following = (hold.segment + 1) % len(orbit.system.itinerary)
        if test.segment == following and test.margin is not Margin.JOINT:
            duration = orbit.durations[following]
            if duration < _VANISHED * orbit.period:
                return hold
    return None


def _begins_with_another(system: System, i: int) -> bool:
    """Tell whether a segment up to the touch at which a hold begins starts as another contact changes."""
    joints = joints_before(system.model, system.itinerary, system.half)
    return any(
        hold.segment == i + 1
        and begun_by_another(system.model, system.itinerary, joints, i, hold.leaves)
        for hold in system.holds
    )


def kind_of_hold(hold: Hold, test: EventFunction, orbit: Orbit) -> Kind:
    """Return the event that an end of a hold's freedom is: that which the hold is pinned to.

    Unless it touches its limit on the way (AS), or can just not be left there (GS). Where another contact
    changes its state as the hold ends it is CS; where that contact's surface is touched, as in other rests.
    """
    model, mode = orbit.model, orbit.system.itinerary[hold.segment][0]
    if test.segment == hold.segment:
        short = bool(orbit.durations[hold.segment] < _VANISHED * orbit.period)
        met = test.surface != hold.leaves and of_another(model, mode, test.surface, hold.leaves)
        if (met and test.margin is Margin.JOINT) or (
            short and hold.follows != (hold.until is not None)
        ):
            return Kind.CS
        if met:
            return _kind_of_touch(model, mode, test.surface)
    if test.margin is Margin.INTERIOR and test.segment == hold.segment:
        return Kind.AS
    if test.margin is Margin.HELD:
        return Kind.GS
    if test.margin is Margin.LASTING and test.segment != hold.segment:
        return Kind.GS  # the slide after it has vanished
    holds = orbit.system.holds
    while hold.follows:
        hold = holds[holds.index(hold) - 1]
    if hold.pin is not None:
        return Kind.SS
    return Kind.AS if hold.after_rest else Kind.GS


def outward_rate(resting: Domain, test: EventFunction, orbit: Orbit) -> float:
    """Rate at which a state that rests at the joint would leave the region where it can rest."""
    end = orbit.ends[test.segment]
    return -resting.signs[test.surface] * rate_along(orbit, resting.mode, test.surface, end)


def _leaves(resting: Domain, test: EventFunction, orbit: Orbit) -> bool:
    """Tell whether rest is left after a stop on its limit (CS), and not entered (SS).

    A load that stands still at the stop grows after it where it has its minimum: a stick around the minimum
    shrinks to nothing there, and the map is continuous. At its maximum motion from below is held.
    """
    rate = outward_rate(resting, test, orbit)
    if not _stands_still(rate, resting, test, orbit):
        return rate > 0.0
    sign, end = resting.signs[test.surface], orbit.ends[test.segment]
    return bends_outward(orbit, resting.mode, test.surface, sign, end)


def _stands_still(rate: float, resting: Domain, test: EventFunction, orbit: Orbit) -> bool:
    return abs(rate) <= ROUNDED * rate_scale(orbit, resting.mode, test.surface)


def load_stands_still(orbit: Orbit, test: EventFunction) -> bool:
    """Tell whether the load stands still at a stop and moves before or after: it is extreme there.

    Where it does not depend on time (a spring's) it stands still all through a rest, and releases nothing.
    """
    resting = rest_at(test, orbit)
    if resting is None:
        return False
    if not _stands_still(outward_rate(resting, test, orbit), resting, test, orbit):
        return False
    end = orbit.ends[test.segment]
    rates = _rates_around(orbit, resting.mode, test.surface, end)
    return any(rate != 0.0 for rate in rates)


def bends_outward(orbit: Orbit, mode: str, surface: str, inside: int, joint: FloatArray) -> bool:
    """Tell whether a load that stands still at its limit is beyond it before and after that.

    ``inside`` is the sign of the surface within it.
    """
    before, following = _rates_around(orbit, mode, surface, joint)
    return inside * (following - before) < 0.0


def _rates_around(orbit: Orbit, mode: str, surface: str, joint: FloatArray) -> tuple[float, float]:
    """Return the rates of a load a moment before and after a joint, at its state."""
    later = np.zeros_like(joint)
    later[0] = _LATER * (1.0 + orbit.period)
    before, following = (rate_along(orbit, mode, surface, joint + s * later) for s in (-1.0, 1.0))
    return before, following
