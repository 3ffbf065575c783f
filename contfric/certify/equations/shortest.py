"""The orbit of an event on its shortest problem: without vanished segments, on one turn, on its half."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.holds import Itinerary
from contfric.bvp.margins import EventFunction, Margin
from contfric.bvp.system import build_system
from contfric.errors import ContfricError
from contfric.models.balls.build import ball_model
from contfric.models.definition import Model
from contfric.orbit.itinerary.itineraries import half_of
from contfric.orbit.orbit import Orbit
from contfric.signature.holds import is_hold

#: A segment shorter than this has vanished at the event, which is located to 1e-9 at worst.
VANISHED = 1e-7


class NotLocatedError(ContfricError):
    """What happens at an event is not known well enough for a proof; the message says what."""


def simplest(orbit: Orbit, tests: tuple[EventFunction, ...]) -> tuple[Orbit, list[EventFunction]]:
    """Return an orbit on its shortest problem, and the tests there.

    Where several meet, an impact without speed is a stop: so an orbit that hits a wall in one of two turns is
    one of half its period that is just about to.
    """
    found = _shortest(orbit, tests)
    if len(found[1]) != 1:
        with suppress(NotLocatedError):
            return _shortest(orbit, tests, stops=True)
    return found


def _shortest(
    orbit: Orbit, tests: tuple[EventFunction, ...], stops: bool = False
) -> tuple[Orbit, list[EventFunction]]:
    """Return an orbit without vanished segments, on its half if it is symmetric; and the tests there.

    Parameters
    ----------
    stops : whether impacts without speed are taken for stops
    """
    whole, model = orbit.as_whole(), orbit.model
    segments, tests = _lasting(whole, tests)
    if stops:
        segments, tests = _stopped(whole, segments, tests)
    kept, itinerary = list(segments), tuple(segments.values())
    joints = whole.cycle[kept]
    times = _repeats(itinerary, joints, whole)
    if times > 1:
        count, periods = len(kept) // times, whole.periods // times
        itinerary, joints = itinerary[:count], _dated(whole, joints[:count], whole.period / times)
        tests = tuple(
            replace(t, segment=kept[kept.index(t.segment) % count])
            for t in tests
            if t.segment in kept
        )
        short = build_system(model, itinerary, periods)
        whole, kept = replace(whole, system=short, joints=joints), kept[:count]
    half = half_of(model, itinerary, whole.periods)
    if half is not None and _is_symmetric(model, joints, whole.period):
        itinerary, joints = half, _dated(whole, joints[: len(half)], whole.period / 2)
    else:
        half = None
    try:
        system = build_system(model, itinerary, whole.periods, half=half is not None)
    except (KeyError, ValueError) as error:
        raise NotLocatedError(f"no orbit is left without the vanished segments ({error})") from None
    found: list[EventFunction] = []
    for test in tests:
        at, surface = kept.index(test.segment) if test.segment in kept else -1, test.surface
        if at < 0:
            continue
        if half is not None and at >= len(half) and model.symmetry is not None:
            back = {image: name for name, image in model.symmetry.surfaces.items()}
            at, surface = at - len(half), back.get(surface, surface)
        moved = EventFunction(test.margin, at, surface)
        if moved not in found:
            found.append(moved)
    least = replace(whole, system=system, joints=joints)
    return least, [test for test in found if not _is_kept(least, test, found)]


def _dated(orbit: Orbit, joints: FloatArray, turn: float) -> FloatArray:
    """Return the joints of a turn at the times of its problem: without excitation it ends at time 0."""
    joints = joints.copy()
    if orbit.model.autonomous:
        joints[:, 0] -= joints[0, 0] + turn
    return joints


def _lasting(
    orbit: Orbit, tests: tuple[EventFunction, ...]
) -> tuple[dict[int, tuple[str, str]], tuple[EventFunction, ...]]:
    """Return mode and exit of the segments of an orbit that last, by number; and tests of these.

    Two of one mode, between which only vanished ones are, are one that touches the exit of the first. What
    vanishes after an impact without speed does not move on: the segment before it ends where that one does.
    """
    count, resets, lasts = len(orbit.durations), orbit.system.layout.resets, orbit.durations
    found = {i: orbit.itinerary[i] for i in range(count) if lasts[i] > VANISHED}
    for i in [i for i in found if (i + 1) % count not in found]:
        if i not in found:  # a part of the one before it by now
            continue
        gone = (i + 1) % count
        after = next(k % count for k in range(gone, gone + count) if k % count in found)
        (mode, exit_), margin = found[i], Margin.EXIT
        if resets[gone] >= 0:
            exit_, margin = orbit.itinerary[gone][1], Margin.JOINT
        elif after != i and found[after][0] == mode and resets[after] < 0:
            last = found.pop(after)[1]
            if not (is_hold(exit_) and is_hold(last)):  # of two holds the first one goes on
                exit_, margin = last, Margin.INTERIOR
        found[i] = mode, exit_
        tests = tuple(
            replace(t, margin=margin) if (t.segment, t.margin) == (i, Margin.EXIT) else t
            for t in tests
        )
    return found, tests


def _stopped(
    orbit: Orbit, segments: dict[int, tuple[str, str]], tests: tuple[EventFunction, ...]
) -> tuple[dict[int, tuple[str, str]], tuple[EventFunction, ...]]:
    """Return segments and tests with stops, where a rate vanishes, for impacts without speed."""
    alike, resets = ball_model(orbit.model, orbit.params).alike, orbit.system.layout.resets
    found, moved = dict(segments), list[EventFunction]()
    for test in tests:
        (mode, exit_), after = (
            segments.get(test.segment, ("", "")),
            (test.segment + 1) % len(resets),
        )
        hits = (test.margin, test.surface) == (Margin.EXIT, exit_) and resets[after] >= 0
        rate = alike(exit_, mode) if hits and alike is not None else None
        if rate:
            found[test.segment] = mode, rate
        moved.append(replace(test, margin=Margin.JOINT) if rate else test)
    return found, tuple(moved)


def _is_kept(orbit: Orbit, test: EventFunction, tests: list[EventFunction]) -> bool:
    """Tell whether a surface is met at the end of a segment because it is met at its start, as in rest."""
    i, half = test.segment, orbit.system.half
    before = replace(test, segment=(i or orbit.system.segments * (not half)) - 1)
    if test.margin is not Margin.JOINT or before not in tests or before == test:
        return False
    if orbit.system.layout.resets[i] >= 0:
        return False
    balls = ball_model(orbit.model, orbit.params)
    return balls.keeps(balls.rows[test.surface], orbit.system.itinerary[i][0])


def _repeats(itinerary: Itinerary, joints: FloatArray, orbit: Orbit) -> int:
    """Return how often an orbit of some joints repeats itself within its period."""
    for times in range(orbit.periods, 1, -1):
        count = len(itinerary) // times
        if (
            orbit.periods % times
            or len(itinerary) % times
            or itinerary[count:] != itinerary[:-count]
        ):
            continue
        off = joints[count:] - joints[:-count]
        off[:, 0] -= orbit.period / times
        if np.max(np.abs(off)) < VANISHED:
            return times
    return 1


def _is_symmetric(model: Model, joints: FloatArray, period: float) -> bool:
    assert model.symmetry is not None
    n = len(joints) // 2
    image = joints[:n].copy()
    image[:, 0] += 0.5 * period
    image[:, 1:] = image[:, 1:] @ model.symmetry.array().T
    return bool(np.max(np.abs(image - joints[n:])) < VANISHED)
