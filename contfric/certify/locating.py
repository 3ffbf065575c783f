"""Where an event happens: on the shortest problem that its orbit solves, and what vanishes there.

A stick that has shrunk to nothing at the event is taken out of the itinerary, and an orbit that is its own
mirror image is solved on its half: so a symmetric pair of stops that meet their limits together is one
condition and not two.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contfric.certify.extended import Condition
from contfric.continuation.events import Bifurcation, Kind
from contfric.errors import ContfricError
from contfric.models.definition import FloatArray, Model
from contfric.orbit.itineraries import half_of
from contfric.orbit.margins import Margin, Test
from contfric.orbit.orbit import Orbit
from contfric.orbit.system import build_system

#: A segment shorter than this has vanished at the event, which is located to 1e-9 at worst.
_VANISHED = 1e-7


class NotLocatedError(ContfricError):
    """What happens at an event is not known well enough for a proof; the message says what."""


@dataclass(frozen=True, eq=False)
class Location:
    """An orbit at an event, and what vanishes there; None for a multiplier.

    Attributes
    ----------
    orbit : on the shortest problem
    condition : what vanishes in addition to the equations of the orbit
    after : approximate time of a touch after the start of its segment
    """

    orbit: Orbit
    condition: Condition | None
    after: float = 0.0


def location_of(event: Bifurcation) -> Location:
    """Return where an event happens.

    Raises
    ------
    NotLocatedError
        If several conditions meet, or none is known.
    """
    if not event.located:
        raise NotLocatedError("the event was not located")
    orbit, tests = _released(event.orbit, event.tests)
    if not tests:
        return Location(_multiplier_orbit(event), None)
    orbit, found = _shortest(orbit, tests)
    if len(found) != 1:
        raise NotLocatedError(f"{len(found)} independent conditions meet")
    test = found[0]
    if event.kind is Kind.T:
        return _tangency(orbit, test)
    if test.margin is Margin.JOINT:
        return Location(orbit, Condition(test.segment, test.surface))
    if test.margin is Margin.EXIT:
        return Location(orbit, Condition(test.segment, test.surface, rate=True))
    if test.margin is Margin.INTERIOR:
        _, after = _nearest_touch(orbit, test.segment, test.surface)
        return Location(orbit, Condition(test.segment, test.surface, within=True), after)
    raise NotLocatedError(f"events of a margin of the kind '{test.margin.value}' are not proved")


def _released(orbit: Orbit, tests: tuple[Test, ...]) -> tuple[Orbit, tuple[Test, ...]]:
    """Return an orbit whose hold ends where it would be released anyway, as the regular orbit that it is.

    A hold that is pinned to the limit of rest and is left on it again: a bridge ends there. What is left
    of it is that the stop before lies on the limit. Other holds stay what they are.
    """
    itinerary, moved = list(orbit.system.itinerary), []
    for test in tests:
        hold = next((h for h in orbit.system.holds if h.segment == test.segment), None)
        if hold is None:
            moved.append(test)
        elif hold.pin == test.surface and test.margin is Margin.JOINT:
            itinerary[hold.segment] = (itinerary[hold.segment][0], test.surface)
            moved.append(Test(Margin.JOINT, hold.segment - 1, test.surface))
        else:
            raise NotLocatedError(
                "a hold that ends in another way than by its release is not proved"
            )
    if tuple(itinerary) == orbit.system.itinerary:
        return orbit, tests
    system = build_system(orbit.model, tuple(itinerary), orbit.system.periods, orbit.system.half)
    return replace(orbit, system=system), tuple(moved)


def _multiplier_orbit(event: Bifurcation) -> Orbit:
    orbit = event.orbit
    if event.kind is Kind.BP:
        orbit = orbit.as_half()
        if not orbit.system.half:
            raise NotLocatedError("a branch point without a symmetry is not proved")
    elif event.kind is Kind.PD:
        orbit = orbit.as_whole()
    elif event.kind not in (Kind.SN, Kind.NS):
        raise NotLocatedError(f"{event.kind.value} is not proved")
    return orbit


def _shortest(orbit: Orbit, tests: tuple[Test, ...]) -> tuple[Orbit, list[Test]]:
    """Return an orbit without vanished segments, on its half if it is symmetric; and the tests there."""
    whole, model = orbit.as_whole(), orbit.model
    lasts = whole.ends[:, 0] - whole.cycle[:, 0]
    kept = [i for i, duration in enumerate(lasts) if duration > _VANISHED]
    itinerary = tuple(whole.itinerary[i] for i in kept)
    joints = whole.cycle[kept]
    half = half_of(model, itinerary, whole.periods)
    if half is not None and _is_symmetric(model, joints, whole.period):
        itinerary, joints = half, joints[: len(half)]
    else:
        half = None
    try:
        system = build_system(model, itinerary, whole.periods, half=half is not None)
    except (KeyError, ValueError) as error:
        raise NotLocatedError(f"no orbit is left without the vanished segments ({error})") from None
    found: list[Test] = []
    for test in tests:
        at, surface = kept.index(test.segment) if test.segment in kept else -1, test.surface
        if at < 0:
            continue
        if half is not None and at >= len(half) and model.symmetry is not None:
            back = {image: name for name, image in model.symmetry.surfaces.items()}
            at, surface = at - len(half), back.get(surface, surface)
        moved = Test(test.margin, at, surface)
        if moved not in found:
            found.append(moved)
    return replace(whole, system=system, joints=joints.copy()), found


def _is_symmetric(model: Model, joints: FloatArray, period: float) -> bool:
    assert model.symmetry is not None
    n = len(joints) // 2
    image = joints[:n].copy()
    image[:, 0] += 0.5 * period
    image[:, 1:] = image[:, 1:] @ model.symmetry.array().T
    return bool(np.max(np.abs(image - joints[n:])) < _VANISHED)


def _tangency(orbit: Orbit, test: Test) -> Location:
    """Return where a surface of the test's observable is touched: inside of its segment, or at its end."""
    model = orbit.model
    names = [s.name for s in model.surfaces if test.surface in (s.name, s.observable)]
    end = orbit.ends[test.segment]
    found = []
    for name in names:
        gap, after = _nearest_touch(orbit, test.segment, name)
        found.append((gap, Condition(test.segment, name, within=True), after))
        if name != orbit.system.itinerary[test.segment][1]:
            value = orbit.flow.observe(
                model.surface_by_name[name].observable, float(end[0]), end[1:]
            )
            found.append((abs(value - orbit.flow.level(name)), Condition(test.segment, name), 0.0))
    gap, condition, after = min(found, key=lambda row: row[0])
    return Location(orbit, condition, after)


def _nearest_touch(orbit: Orbit, segment: int, surface: str) -> tuple[float, float]:
    """Return how near a stationary point of an observable comes to its surface, and when."""
    start = orbit.begins[segment]
    duration = float(orbit.ends[segment, 0] - orbit.cycle[segment, 0])
    observable = orbit.model.surface_by_name[surface].observable
    times, values = orbit.flow.stationary(
        orbit.system.itinerary[segment][0], observable, float(start[0]), start[1:], duration
    )
    gaps = np.abs(values - orbit.flow.level(surface))
    if not len(gaps):
        return float("inf"), 0.0
    k = int(np.argmin(gaps))
    return float(gaps[k]), float(times[k])
