"""Surfaces that are only touched: where a joint does so, and whether sliding begins there or ends."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.system import EventFunction, Margin, System
from contfric.errors import NotationError
from contfric.events.local.zero_acceleration import touch_of
from contfric.models.definition import Domain, Model
from contfric.models.mode_domains import is_section
from contfric.models.view import FlowView
from contfric.orbit.orbit import Orbit
from contfric.signature.holds import is_hold

if TYPE_CHECKING:
    from contfric.events.bifurcation import Bifurcation

#: A rate this small, at a joint on a section that is a rate itself, is rounding.
_TANGENTIAL = 1e-9
#: A surface that is met faster than this, against how fast it may be met, is passed: a graze is located to
#: the root of rounding.
_PASSED = 1e-4
#: A state this far beyond a surface is not inside: an event at a corner is located to the root of rounding.
_OUTSIDE = 1e-6
#: Phases of the excitation at which the rate of an observable is asked for how large it becomes.
_PHASES = 4
#: Random states by which two functions are compared.
_STATES = 6


def touched_at_joint(test: EventFunction, orbit: Orbit, resting: Domain | None) -> str | None:
    """Return the surface that is touched where two are met at a joint; None if that is a corner of them.

    A slider that begins to slip reaches its limit where its velocity vanishes, and that may be the section:
    nothing stops there, and the touch is that inside of the segment, whose margin vanishes too. So it is
    where one of the two is the zero of the other one's rate, and nothing rests there: they are met at once
    by a tangency alone, and which of them ends the segment is a matter of the itinerary.

    Parameters
    ----------
    resting : what :func:`rest_at` says of the joint
    """
    model, (mode, exit_) = orbit.model, orbit.system.itinerary[test.segment]
    end = orbit.ends[test.segment]
    if is_section(model, mode, exit_):
        return (
            test.surface if abs(rate_along(orbit, mode, test.surface, end)) < _TANGENTIAL else None
        )
    if exit_ not in model.surface_by_name or resting is not None:
        return None
    for touched, other in ((test.surface, exit_), (exit_, test.surface)):
        if is_rate_of(model, mode, touched, other) and not is_passed(orbit, mode, touched, end):
            return touched
    return None


def is_corner(system: System, test: EventFunction, orbit: Orbit) -> bool:
    """Tell whether two surfaces are met at once at a joint, each with a speed: neither is only touched."""
    if test.margin is not Margin.JOINT:
        return False
    mode, _ = system.itinerary[test.segment]
    return is_passed(orbit, mode, test.surface, orbit.ends[test.segment])


def is_passed(orbit: Orbit, mode: str, surface: str, joint: np.ndarray) -> bool:
    """Tell whether a surface is met with a speed at a joint (t, y): it is not only touched."""
    rate = abs(rate_along(orbit, mode, surface, joint))
    return rate > _PASSED * rate_scale(orbit, mode, surface)


def resting_domain(system: System, test: EventFunction) -> Domain | None:
    """Return the domain of rest that a joint is next to, which the surface of a test ends; None if none.

    Where the surface is that of another contact, whose state changes at the same time, the rest goes on.
    """
    return next(iter(_resting(system.model, *system.itinerary[test.segment], test.surface)), None)


def rest_at(test: EventFunction, orbit: Orbit) -> Domain | None:
    """Return the domain of rest that the state at a joint is next to, which the surface of a test ends.

    None where the state is outside of it by another of its surfaces: a mass that meets a wall as it turns,
    under a load above the limit of rest, does not rest there on either side of the wall.
    """
    mode, exit_ = orbit.system.itinerary[test.segment]
    end = orbit.ends[test.segment]
    for domain in _resting(orbit.model, mode, exit_, test.surface):
        if all(
            sign * orbit.flow.height(name, float(end[0]), end[1:]) > -_OUTSIDE
            for name, sign in domain.signs.items()
            if sign and name not in (exit_, test.surface)
        ):
            return domain
    return None


@cache
def _resting(model: Model, mode: str, exit_: str, surface: str) -> tuple[Domain, ...]:
    resting = [
        d
        for d in _near(model, mode, exit_)
        if model.mode_by_name[d.mode].sliding and d.signs.get(surface, 0) != 0
    ]
    own = [d for d in resting if d.mode == mode and _ends_rest(model, d, surface)]
    others = [
        d for d in resting if d.signs.get(exit_) == 0 and _ends_rest(model, d, surface, exit_)
    ]
    before = model.domains_of(mode)
    reached = {name for d in before for name in model.targets.get((d.name, exit_), ())}
    on = {exit_, *(name for name, sign in before[0].signs.items() if sign == 0)}

    def unlike(domain: Domain) -> tuple[bool, int]:
        """Return how a rest is unlike the mode: an element that slips does so, too, where a contact stops."""
        lain_on = {name for name, sign in domain.signs.items() if sign == 0}
        return domain.name not in reached, len(lain_on ^ on)

    return (*own, *sorted(others, key=unlike))


def _near(model: Model, mode: str, exit_: str) -> Iterable[Domain]:
    """Return the domains that a joint may be next to: all, or those on both sides of it."""
    if not model.composed:
        return model.domains
    return [model.domain_by_name[name] for name in (mode, *model.targets.get((mode, exit_), ()))]


def _ends_rest(model: Model, domain: Domain, surface: str, on: str = "") -> bool:
    """Tell whether motion that meets a surface no longer rests: on one surface, or on any that it did."""
    held = [on] if on else [name for name, sign in domain.signs.items() if sign == 0]
    after = [
        model.domain_by_name[target].signs
        for target in model.targets.get((domain.name, surface), ())
    ]
    return any(signs.get(name, 1) != 0 for signs in after for name in held)


@cache
def is_rate_of(model: Model, mode: str, exit_: str, surface: str) -> bool:
    """Tell whether the observable of a surface is the rate of an exit's in a mode, up to a factor.

    So is the velocity of a slider that of its stretch. At random states: a load is the rate of no velocity,
    for friction stands between them.
    """
    view, draw = FlowView(model, model.vector({})), np.random.default_rng(2)
    wide = np.abs(model.spread(model.defaults))
    one, other = (model.surface_by_name[name].observable for name in (exit_, surface))
    found = []
    for _ in range(_STATES):
        t, y = (
            float(draw.uniform(0.0, view.period or 10.0)),
            wide * draw.uniform(-1.0, 1.0, len(wide)),
        )
        found.append((view.rate(mode, one, t, y), view.observe(other, t, y)))
    rates, values = np.array(found).T
    factor = rates @ values / (values @ values) if np.any(values) else 0.0
    return bool(factor and np.allclose(rates, factor * values, rtol=1e-9, atol=1e-12))


def rate_along(orbit: Orbit, mode: str, surface: str, joint: FloatArray) -> float:
    """Rate of a surface's observable along a mode at a joint (t, y)."""
    observable = orbit.model.surface_by_name[surface].observable
    return orbit.flow.rate(mode, observable, float(joint[0]), joint[1:])


@lru_cache(maxsize=8)  # an event asks for its kind and its accuracy, at one orbit
def rate_scale(orbit: Orbit, mode: str, surface: str) -> float:
    """Return how fast a surface's observable changes in a mode along an orbit: what its rates are small to.

    The largest rate at the joints, and at their states at other phases of the excitation, or the height over
    the surface in a period.
    """
    flow, observable = orbit.flow, orbit.model.surface_by_name[surface].observable
    period, level, largest = orbit.period, orbit.flow.level(surface), 0.0
    phases = [0.0] if orbit.model.autonomous else [k / _PHASES * period for k in range(_PHASES)]
    for end in orbit.ends:
        time, y = float(end[0]), np.ascontiguousarray(end[1:])
        largest = max(largest, abs(flow.observe(observable, time, y) - level) / period)
        for phase in phases:
            largest = max(largest, abs(flow.rate(mode, observable, time + phase, y)))
    return largest


def chosen_at(system: System, test: EventFunction) -> str:
    """Return the surface of the reset that chooses the mode after it by the side of a test; else nothing."""
    joint = test.segment if test.margin is Margin.JOINT else test.segment - 1
    mode, exit_ = system.itinerary[joint % len(system.itinerary)]
    reset = system.model.reset_at(mode, exit_)
    chooses = reset is not None and test.surface in reset.chooses_by
    return exit_ if chooses and test.margin in (Margin.JOINT, Margin.ENTRY) else ""


def entered_at(system: System, test: EventFunction) -> str:
    """Return the mode that a touch of its surface leads into for good; else nothing.

    A mode that holds on both sides of the surface overlaps the one before it: motion that just crosses stays
    in it, motion that does not goes on as before. So the map jumps, and no orbit lies between the two.
    """
    model = system.model
    if model.composed or test.margin not in (Margin.INTERIOR, Margin.EXIT):
        return ""
    reset = model.reset_at(system.itinerary[test.segment][0], test.surface)
    if reset is not None and reset.changes:  # one that only says the mode moves no state
        return ""
    mode = model.whole_mode(system.itinerary[test.segment][0])
    for domain in model.domains_of(mode):
        for target in model.targets.get((domain.name, test.surface), ()):
            entered = model.domain_by_name[target].mode
            if entered != mode and any(d.signs == domain.signs for d in model.domains_of(entered)):
                return entered
    return ""


def thrown_at(orbit: Orbit, test: EventFunction) -> str:
    """Return the surface of a reset that takes what just touches it somewhere else; else nothing.

    An impact changes nothing at a touch, as ``v -> -e v`` at v = 0. A reset off its surface does, and so does
    one along it (a neuron that fires begins at x = 0, whatever x was). What the reset does not map on the way
    there it may map on the way back (``from: [falls]``).
    """
    if test.margin is Margin.ENTRY:
        return _kicked_again(orbit, test)
    reset = orbit.model.reset_by_surface.get(test.surface)
    if reset is None or reset.wraps:
        return ""
    mode = orbit.itinerary[test.segment][0]
    acts = orbit.model.reset_at(mode, test.surface) is not None
    if test.margin is Margin.JOINT:
        touched = None if acts else touched_at_joint(test, orbit, rest_at(test, orbit))
        if touched != test.surface:
            return ""
    elif test.margin not in (Margin.INTERIOR, Margin.EXIT):
        return ""
    try:
        inside = test.margin is Margin.INTERIOR
        touch = touch_of(orbit, test.segment, test.surface) if inside else orbit.ends[test.segment]
    except NotationError:  # nothing is touched inside
        return test.surface if acts and not reset.stays else ""
    if not acts:
        back = coming_back(orbit, mode, test.surface, touch)
        if back is None or not orbit.model.maps_at(back, test.surface):
            return ""
        after = orbit.model.targets[back.name, test.surface]
        whole = orbit.model.whole_mode(mode)
        if all(orbit.model.domain_by_name[name].mode != whole for name in after):
            return test.surface
    image = orbit.flow.reset(test.surface, float(touch[0]), touch[1:])
    moved = np.abs(image - touch[1:]).max()
    return test.surface if moved > _PASSED * (1.0 + np.abs(touch[1:]).max()) else ""


def _kicked_again(orbit: Orbit, test: EventFunction) -> str:
    """Return the surface of a kick that just turns motion back, or just lets it pass; nothing if not so.

    Motion that leaves the surface to the one side at once and motion that leaves it to the other one first
    are the same but for a moment, unless the reset maps it when it comes back.
    """
    model, i = orbit.model, test.segment
    mode, surface = orbit.itinerary[i - 1]
    reset = model.reset_at(mode, surface)
    if reset is None or not reset.ways:
        return ""
    t, y = float(orbit.begins[i, 0]), orbit.begins[i, 1:]
    own = orbit.itinerary[i][0]
    if is_passed(orbit, own, surface, orbit.begins[i]):
        return ""
    side = 1 if second_rate(orbit, own, surface, t, y) > 0.0 else -1
    first = [model.domain_by_name[name] for name in sorted(reset.ways)]
    for domain in (d for d in first if d.signs[surface] == -side):
        turned = model.transitions.get((domain.name, test.surface))
        if turned is not None and model.maps_at(model.domain_by_name[turned], surface):
            image = orbit.flow.reset(surface, t, y)
            moved = np.max(np.abs(image - y)) > _PASSED * (1.0 + np.max(np.abs(y)))
            return surface if moved else ""
    return ""


def coming_back(orbit: Orbit, mode: str, surface: str, touch: FloatArray) -> Domain | None:
    """Return the domain in which motion that just crosses a surface comes back to it; None if it does not.

    Other surfaces that it meets at the touch, such as v = 0, are crossed between, in the direction of their
    rates.
    """
    model = orbit.model
    if model.composed:
        return None
    t, y = float(touch[0]), touch[1:]
    heights = {s.name: orbit.flow.height(s.name, t, y) for s in model.surfaces if s.name != surface}
    met = {name for name, height in heights.items() if abs(height) <= _PASSED}

    def rate(domain: Domain, name: str) -> float:
        return orbit.flow.rate(domain.own_mode, model.surface_by_name[name].observable, t, y)

    def holds(domain: Domain, ahead: bool) -> bool:
        turn = 1.0 if ahead else -1.0
        return all(
            domain.signs[name] * (turn * rate(domain, name) if name in met else height) >= 0.0
            for name, height in heights.items()
        )

    before = next((d for d in model.domains_of(model.whole_mode(mode)) if holds(d, False)), None)
    following = () if before is None else model.targets.get((before.name, surface), ())
    if not following:
        return None
    found = model.domain_by_name[following[0]]
    for name in sorted(met):
        onwards = model.transitions.get((found.name, name))
        if onwards is not None and found.signs[name] * rate(found, name) < 0.0:
            found = model.domain_by_name[onwards]
    speeds_up = second_rate(orbit, found.own_mode, surface, t, y)
    return found if found.signs[surface] * speeds_up < 0.0 else None


def crossed_at(orbit: Orbit, test: EventFunction) -> bool:
    """Tell whether a surface that is touched is crossed beyond the event: into another mode, not into rest.

    So it is at a preloaded stop, or a switch of the force.
    """
    model, (mode, exit_) = orbit.model, orbit.itinerary[test.segment]
    at_section = test.margin is Margin.JOINT and (mode, exit_) in model.sections
    if model.composed or is_hold(exit_):
        return False
    if not at_section and test.margin not in (Margin.INTERIOR, Margin.EXIT):
        return False
    rests = model.rests_on(test.surface) or model.mode_by_name[model.whole_mode(mode)].sliding
    if rests or test.surface in model.reset_by_surface:
        return False
    whole = model.whole_mode(mode)
    return any(
        model.domain_by_name[target].mode != whole
        for domain in model.domains_of(whole)
        for target in model.targets.get((domain.name, test.surface), ())
    )


def is_crossed(bifurcation: Bifurcation) -> bool:
    """Tell whether an event is the touch of a surface that is crossed beyond it."""
    whole = bifurcation.orbit.as_whole()
    return all(crossed_at(whole, test) for test in bifurcation.tests)


def speeds_of_crossing(orbit: Orbit, k: int) -> tuple[float, float]:
    """Return how fast the two joints of a passage of no length move in time, as the event is left.

    Let the surface be passed by e. Before it the height has the curvature c, so that it is met at ``-w``, w
    the root of ``2 e/c``, at the rate ``c w``. Beyond it the curvature is c', and it is met again after
    ``2 w c/c'``.
    """
    (mode, surface), (beyond, _) = orbit.itinerary[k - 1], orbit.itinerary[k]
    time, state = float(orbit.begins[k, 0]), orbit.begins[k, 1:]
    before, following = (second_rate(orbit, m, surface, time, state) for m in (mode, beyond))
    return -1.0, 2.0 * before / following - 1.0


def second_rate(orbit: Orbit, mode: str, surface: str, t: float, y: FloatArray) -> float:
    """Return how fast the rate of a surface's observable changes along a mode."""
    observable = orbit.model.surface_by_name[surface].observable
    moved = orbit.flow.rate_gradient(mode, observable, t, y, 0)
    speed = orbit.flow.jacobian(mode, t, y, 0.0)[:, 1 + len(y)]
    return float(moved[0] + moved[1 : 1 + len(y)] @ speed)


def leads_elsewhere(orbit: Orbit, test: EventFunction) -> bool:
    """Tell whether nothing lies between the solutions on both sides of an event.

    So it is where a reset takes what touches it somewhere else, where a reset chooses another mode, and where
    a touch leads into a mode that overlaps.
    """
    chosen = chosen_at(orbit.system, test) or entered_at(orbit.system, test)
    return bool(chosen or thrown_at(orbit, test))
