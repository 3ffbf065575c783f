"""Checks that rest can be held at an event: released it would accelerate, and it is inside its region."""

from __future__ import annotations

from functools import cache

from contfric.base.arrays import FloatArray
from contfric.bvp.system import EventFunction, Margin
from contfric.errors import NotationError
from contfric.events.local.jumps import leaving_rate, nothing_jumps
from contfric.events.local.touching import is_rate_of
from contfric.models.definition import Model
from contfric.orbit.orbit import Orbit
from contfric.signature.holds import ends_rest
from contfric.simulation.starts import signs_at

#: Rest that is left with less than this acceleration, or lies nearer than this to the boundary of its
#: region (nondimensional), has no jump: far above rounding, far below any difference of two limits.
NO_JUMP = 1e-9


class NoJump(NotationError):
    """Nothing can be held at an event: the solution there is continuous."""


def leaves_smoothly(orbit: Orbit, rest: str, departs: str) -> bool:
    """Tell whether a rest is left to a mode without acceleration, at the parameters of an orbit."""
    return left_at_rest(orbit.model, rest, departs) or nothing_jumps(orbit)


@cache
def left_at_rest(model: Model, rest: str, departs: str) -> bool:
    """Tell whether rest is left to a mode without acceleration: the solution does not jump where it begins.

    So it is everywhere in some models. In others there are contacts that jump, and Jenkins elements that do
    not: the stretch of one that slips rests at its limit until its rate, the velocity, vanishes.
    """
    if model.filippov:
        return True
    leaves = [
        is_rate_of(model, model.domain_by_name[target].mode, on, back)
        for domain in model.domains_of(rest)
        for on in (name for name, side in domain.signs.items() if side == 0)
        if not model.lies_on(departs, on)
        for back, target in model.exits_of(domain.name)
        if not model.lies_on(model.domain_by_name[target].mode, on)
    ]
    return bool(leaves) and all(leaves)


def check_held(orbit: Orbit, rest: str, departs: str | None, joint: FloatArray) -> None:
    """Check that rest would be left with an acceleration: only then can it be held."""
    if departs is not None and (
        leaves_smoothly(orbit, rest, departs)  # a rate is rounding, however large
        or leaving_rate(orbit, rest, departs, joint) <= NO_JUMP
    ):
        raise NoJump(f"'{rest}' is left without acceleration: nothing can be held there")


def vanishes_with(orbit: Orbit, location: EventFunction) -> bool:
    """Tell whether a margin of a hold says that it has no length: one at the edge on which it begins.

    A hold begins on one edge of the strip: at the limit, or, at a touch of rest, where it can just be left.
    At the other edge it has crossed the strip, in no time to speak of where the strip is narrow.
    """
    own = location.segment % orbit.system.segments
    hold = next((hold for hold in orbit.system.holds if hold.segment == own), None)
    if hold is None:
        return False
    at_touch = hold.pin is None and not hold.after_rest
    if location.margin is Margin.JOINT:
        mode = orbit.itinerary[location.segment][0]
        return not (at_touch and ends_rest(orbit.model, mode, location.surface))
    return location.margin is not Margin.EXIT or at_touch


def check_inside(orbit: Orbit, rest: str, joint: FloatArray) -> None:
    """Check that something jumps, and that a state lies inside the region of a rest, not on its boundary.

    A surface on which the state lies does not bound it where both of its sides are of the rest: where a mass
    rests that a gap ends at, the rate of that gap is zero.
    """
    if nothing_jumps(orbit):
        raise NoJump(f"'{rest}' is left without acceleration: nothing can be held there")
    model = orbit.model
    location = signs_at(model, float(joint[0]), joint[1:].copy(), orbit.vector, within=NO_JUMP)
    own = [domain.signs for domain in model.domains_of(rest)]
    for signs in own:
        sides = {s: sign for s, sign in signs.items() if sign != 0}
        met = [s for s in sides if location[s] == 0]
        inside = all(location[s] in (side, 0) for s, side in sides.items())
        if inside and all({**signs, s: -sides[s]} in own for s in met):
            return
    raise NoJump(f"'{rest}' begins on the boundary of its region: nothing can be held there")


def rest_mode(orbit: Orbit, i: int, surface: str) -> str:
    """Return the mode of rest on a surface that a slide comes to at its end, or at a touch of it."""
    model = orbit.model
    for domain in model.domains_of(model.whole_mode(orbit.itinerary[i][0])):
        for through, target in model.exits_of(domain.name):
            rest = model.domain_by_name[target].mode
            if through == surface and model.lies_on(rest, surface):
                return rest
    mode = orbit.itinerary[i][0]
    raise NoJump(f"mode '{mode}' of model '{model.name}' never comes to rest on {surface}")
