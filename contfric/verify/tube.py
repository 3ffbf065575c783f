"""Events, and tubes of boxes along a branch (see the package).

Along a curve of orbits something passes 0 at an event: ``1 - tr M + det M`` at a fold, ``1 + tr M + det M``
at a multiplier -1, ``det M - 1`` at a pair on the circle, a load less its limit, or what is touched. In a box
it has a sign, or passes 0 once: its rate has a sign, and its signs at the two ends say whether it does.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from flint import arb, arb_mat

from contfric.verify.box import HALF, INSIDE, Box
from contfric.verify.law import check_admissible, turn
from contfric.verify.solution import Refused, Scene, Undecided, ball, decided, number

HALVINGS, PARTS = 12, (1, 4, 16)  # halvings of a box; parts of it for the inequalities


def counted(box: Box) -> list[str]:
    """Return the kinds of the events of multipliers between the ends of a box, each passed once."""
    found, half = list[str](), box.data["half"]
    low, middle, high = (turn(*box.orbits(s)) for s in (-0.5, 0, 0.5))
    trace, det = turn(*box.orbits(INSIDE, box.slope))
    pair = trace[0] * trace[0] - 4 * det[0]
    for kind, sign in (("SN", -1), ("BP" if half else "PD", 1), ("NS", 0)):
        first, value, last = (d + sign * t + (1 if sign else -1) for t, d in (low, middle, high))
        if kind == "SN" and not box.slope[-1].contains(0):
            continue  # the parameter is monotone
        rate = det[1] + sign * trace[1]
        if (value + rate * INSIDE).contains(0) and (sign or not pair > 0):
            passed = bool(first * last < 0)
            if rate.contains(0) or not (sign or pair < 0) or (first * last).contains(0):
                raise Undecided(f"a {kind} may be in a box")
            found += [kind] * passed
    return found


class Place:
    """Where an event happens: the load's limit at a stop, or what is touched, and when."""

    def __init__(self, scene: Scene, kind: str, at: Any) -> None:
        self.at, self.level, self.surface, self.box, self.kind = -1, 0, "", arb(0), kind
        if kind in ("SN", "NS", "BP" if scene.half else "PD") and at is None:
            return
        if not at or at[0] not in range(scene.count):
            raise Refused(f"a {kind} at {at} is not checked here")
        (self.at, what), slides = at[:2], scene.segments[at[0]][0] != 0
        if kind in ("CS", "SS") and slides and what in (-1, 1):
            self.level = what
        elif (slides, what[0]) == {"GS": (True, "v"), "T": (True, "F"), "AS": (False, "F")}[kind]:
            self.surface, self.box = what, ball(at[2])
        else:
            raise Refused(f"a {kind} at {at} is not checked here")

    def given(
        self, scene: Scene, z: list[arb]
    ) -> tuple[dict[int, int], dict[tuple[int, str], arb]]:
        """Return the limits that are reached, and what is touched when."""
        if not self.surface:
            return ({self.at: self.level} if self.level else {}), {}
        left = scene.joint(z, self.at + 1)[0] - scene.joint(z, self.at)[0] - self.box
        decided(self.box > 0 and left > 0, left < 0, "it is touched inside")
        return {}, {(self.at, self.surface): self._time(scene, z)}

    def check_kind(self, scene: Scene, z: list[arb]) -> None:
        """See that the load moves as at an event of its kind, or that the multipliers are a pair."""
        if self.level:
            rate = self.level * scene.force(scene.joint(z, self.at + 1)[0], 1)
            rates = bool(rate < 0), bool(rate > 0)
            decided(
                *(rates if self.kind == "CS" else rates[::-1]),
                f"the load moves as at a {self.kind}",
            )
        if self.kind == "NS":
            trace, det = turn(scene, z)
            decided(trace * trace < 4 * det, trace * trace > 4 * det, "the multipliers are a pair")

    def value(self, scene: Scene, z: list[Any], times: arb | None = None) -> Any:
        """Return what vanishes at the event; for all of some times at which a surface may be touched."""
        if self.surface:
            return scene.observed(z, self.at, self.surface, times or self._time(scene, z))[0]
        if self.level:
            end, y = scene.joint(z, self.at + 1)
            return y - scene.force(end) - self.level * scene.s0
        trace, det = turn(scene, z)
        return det - 1 if self.kind == "NS" else 1 + trace + det

    def _time(self, scene: Scene, z: list[arb]) -> arb:
        """Return when an observable is stationary, which it is once in a box of times."""
        found = self.box
        for again in range(6):
            rate = scene.observed(z, self.at, self.surface, arb(found.mid()))[1]
            image = found.mid() - rate / scene.observed(z, self.at, self.surface, found)[2]
            if not (again or self.box.contains_interior(image)):
                raise Undecided("a surface is touched")
            found = image
        return found


def check_event(data: dict[str, Any]) -> list[str]:
    """Check that an event of its kind happens within the ball of its parameter."""
    name, kind, value = data["parameter"], data["kind"], ball(data["value"])
    if name not in data["params"] or not value.rad() > 0:
        raise Refused(f"a {kind} in {name} is not checked here")
    middle, radius = arb(value.mid()), arb(value.rad())
    scene = Scene(data, {name: middle})
    place = Place(scene, kind, data["at"])
    near = [arb(ball(row[k]).mid()) for row in data["near"] for k in (0, 1)]
    if len(near) != 2 * scene.count:
        raise Refused("there is not one joint for each segment")
    if kind == "SN":  # a short piece of the curve on which the parameter turns, inside of the ball
        inverse = arb_mat(scene.equations(near)[1]).mid().inv().tolist()
        column = max(zip(*inverse, strict=True), key=lambda c: max(abs(float(v)) for v in c))
        k = max(range(len(near)), key=lambda j: abs(float(column[j])))
        step = [radius.sqrt() / 64 * v / column[k] for v in column]
        a, b = (
            [*(z + side * d for z, d in zip(near, step, strict=True)), middle] for side in (-1, 1)
        )
        box = Box(data, a, b, k).proved()
        decided(counted(box) == ["SN"] and box.radii[-1] < radius, False, "a fold in the ball")
    else:
        a, b = (Box(data, [*near, middle + side * radius]).proved().knot() for side in (-1, 1))
        box = Box(data, a, b, len(near)).proved()
        product = place.value(*box.orbits(-0.5)) * place.value(*box.orbits(0.5))
        decided(product < 0, product > 0, f"what vanishes at a {kind} changes its sign")
    scene, z = box.orbits(INSIDE)
    place.check_kind(scene, z)
    check_admissible(scene, z, *place.given(scene, z))
    return ["exists", f"is a {kind} in {name}", "admissible"]


def _leaves(box: Box, kind: str, spots: Any, way: int) -> list[str]:
    """See that the orbits of a box are admissible up to one event, on the way to its last or first knot."""
    if kind not in ("AS", "CS", "GS", "SS") or not spots:
        raise Refused(f"no tube ends at a {kind}")
    (scene, z), ends = box.orbits(INSIDE), [box.orbits(s * way) for s in (-0.5, 0.5)]
    places, passed = [Place(scene, kind, at) for at in spots], list[bool]()
    for place in places:
        (inner, outer), middle = (place.value(*at) for at in ends), place.value(*box.orbits(0))
        rate = place.value(*box.orbits(INSIDE, box.slope), place.box)[1]
        decided(
            not (inner * rate * way).contains(0) and inner * rate * way < 0,
            False,
            "what vanishes falls",
        )
        passed.append(bool(inner * outer < 0))
        place.check_kind(*box.orbits(-middle / rate if passed[-1] else arb(0.5 * way)))
    given = [place.given(scene, z) for place in places]
    limits, touches = ({k: v for pair in given for k, v in pair[n].items()} for n in (0, 1))
    check_admissible(scene, z, limits, touches, kind == "CS")
    check_admissible(*ends[0])
    decided(any(passed), False, f"the tube ends at a {kind}")
    return counted(box)


def covered(
    data: Any, a: list[arb], b: list[arb], end: Any, level: int = 0
) -> list[tuple[Box, list[str]]]:
    """Return boxes between two knots with their events; they are halved until all is decided."""
    box = Box(data, a, b)
    try:
        if end:
            return [(box.proved(), _leaves(box, *end))]
        found = counted(box.proved())
        for count in PARTS:
            edges = [HALF * (2 * arb(j) / count - 1) for j in range(count + 1)]
            try:
                for s, later in pairwise(edges):
                    check_admissible(*box.orbits(s.union(later)))
                return [(box, found)]
            except Undecided:
                if count == PARTS[-1]:
                    raise
    except (Undecided, ArithmeticError, ValueError) as error:
        if level == HALVINGS:
            raise Undecided(str(error)) from error
    point = Box(data, [(p + q) / 2 for p, q in zip(a, b, strict=True)], None, box.kept).proved()
    middle, way, beyond = point.knot(), end[-1] if end else 0, False
    if end:
        try:
            check_admissible(*point.orbits(0))
        except (Refused, Undecided):
            beyond = True  # the end lies before it
    halves = [] if beyond and way < 0 else [(a, middle, end if way < 0 or beyond else None)]
    halves += [] if beyond and way > 0 else [(middle, b, end if way > 0 or beyond else None)]
    return [part for p, q, last in halves for part in covered(data, p, q, last, level + 1)]


def check_tube(data: dict[str, Any]) -> list[str]:
    """Check that one curve of admissible orbits leads from knot to knot, with the stated events only."""
    knots, scene = [[number(c) for c in row] for row in data["knots"]], Scene(data)
    sizes = {len(row) for row in knots}
    if data["parameter"] not in data["params"] or len(knots) < 2 or sizes != {2 * scene.count + 1}:
        raise Refused("its knots are not a parameter and one joint for each segment")
    (first, last), final, before, found = data["ends"], len(knots) - 2, None, list[Any]()
    for k, (a, b) in enumerate(pairwise(knots)):
        way = -1 if k == 0 and first else 1 if k == final and last else 0
        end = [*(first if way < 0 else last), way] if way else None
        for box, events in covered(data, a, b, end):
            found += [[k, kind] for kind in events]
            if before:
                start = [m + d / 2 for m, d in zip(before.middle, before.along, strict=True)]
                point = Box(data, before.phases(start, -1), None, before.kept).proved()
                if not (before.holds(point) and box.holds(point)):
                    raise Undecided("neighbouring boxes hold one orbit")
            before = box
    if sorted(found) != sorted(data["events"]):
        raise Refused(f"false: its events are {found}")
    open_ends = sum(end is None for end in data["ends"])
    return [
        "one curve",
        "admissible",
        f"{len(found)} events of multipliers",
        f"{open_ends} open ends",
    ]
