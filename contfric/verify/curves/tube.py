"""Tubes of boxes along a branch (see the package)."""

from __future__ import annotations

from functools import reduce
from itertools import pairwise
from typing import Any

from flint import arb

from contfric.verify.box import INSIDE, Box
from contfric.verify.curves.event import Place
from contfric.verify.curves.piece import counted, holds, moving, piece
from contfric.verify.law import check_admissible
from contfric.verify.scene import Refused, Scene, Undecided, number, phases, positive

HALVINGS = 14  # of a box


def check_end(box: Box, kind: str, spots: list[Any]) -> None:
    """See that the orbits of a box are admissible up to one event, on the way to its last knot."""
    if kind not in ("AS", "CS", "GS", "SS"):
        raise Refused(f"no tube ends at a {kind}")
    scene, z = box.orbits(INSIDE)
    moved = moving(box)
    products, met = [arb(1)], dict[tuple[int, str], Any]()
    for place in (Place(scene, kind, at) for at in spots):
        first, last = (place.value(*box.orbits(s)) for s in (-0.5, 0.5))
        rate = place.value(*moved, place.times and place.times[0])[1]
        positive(-first * rate, "what vanishes at the end of a tube falls")
        products.append(first * last)
        met |= place.met(scene, z)
    positive(-reduce(arb.min, products), f"what vanishes at a {kind} changes its sign")
    check_admissible(scene, z, met, kind == "CS")
    check_admissible(*box.orbits(-0.5))


def covered(data: Any, a: list[arb], b: list[arb], end: Any = None, level: int = 0) -> list[Any]:
    """Return boxes from knot to knot, or to an end, with their events; halved until all is decided."""
    box = piece(data, a, b)
    try:
        box.proved()
        if end:
            check_end(box, *end)
        else:
            check_admissible(*box.orbits(INSIDE))
        return [(box, counted(box))]
    except (Undecided, ArithmeticError, ValueError) as error:
        if level == HALVINGS:
            raise Undecided(str(error)) from error
    middle = box.middle.entries()
    point = Box(data, box.kept, middle).proved()
    middle = point.middle.entries()
    try:
        if end:
            check_admissible(*point.orbits(0))
    except (Refused, Undecided):  # the end lies before it
        return covered(data, a, middle, end, level + 1)
    first = covered(data, a, middle, None, level + 1)
    return linked(first, point, covered(data, middle, b, end, level + 1))


def linked(first: list[Any], point: Box, last: list[Any]) -> list[Any]:
    """Return all boxes, which hold one curve where they meet."""
    if not (holds(first[-1][0], point) and holds(last[0][0], point)):
        raise Undecided("neighbouring boxes hold one orbit")
    return first + last


def check_tube(data: dict[str, Any]) -> list[str]:
    """Check that one curve of admissible orbits leads from knot to knot, with the stated events only."""
    knots, found, ends = list[list[arb]](), list[Any](), data["ends"]
    if type(ends) is not list or len(ends) != 2:
        raise Refused("it has not two ends")
    for *joints, value in ([number(c) for c in row] for row in data["knots"]):
        pairs = list(zip(joints[::2], joints[1::2], strict=True))
        knots.append([*phases(pairs, Scene(data, value)), value])
    if len(knots) < 2 + all(ends) or any(
        end and end[0] not in ("AS", "CS", "GS", "SS") for end in ends
    ):
        raise Refused("it has too few knots, or no tube ends in this way")
    before = None
    for k, (a, b) in enumerate(pairwise(knots)):
        if k == 0 and ends[0]:
            boxes = covered(data, b, a, ends[0])[::-1]
        else:
            boxes = covered(data, a, b, ends[1] if k == len(knots) - 2 else None)
        if before:
            linked(before, Box(data, before[-1][0].kept, a).proved(), boxes)
        found += [[k, kind] for _, events in boxes for kind in events]
        before = boxes
    if sorted(found) != sorted(data["events"]):
        raise Refused(f"false: its events are {found}")
    open_ends = sum(end is None for end in ends)
    return [
        "one curve",
        "admissible",
        f"{len(found)} events of multipliers",
        f"{open_ends} open ends",
    ]
