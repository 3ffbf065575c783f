"""Events: along a piece of a curve of orbits something passes 0, or the parameter turns.

What passes 0 is ``1 + tr M + det M`` at a multiplier -1 (PD, BP), ``det M - 1`` at a pair on the circle (NS),
a load less its limit at a stop (CS, SS), or what is touched where it is stationary (AS, GS, T).
"""

from __future__ import annotations

from typing import Any

from flint import arb, arb_mat

from contfric.verify.box import INSIDE, Box
from contfric.verify.curves.piece import holds
from contfric.verify.law import check_admissible
from contfric.verify.scene import Refused, Scene, Undecided, ball, phases, positive

MET = {"CS": "slide F", "SS": "slide F", "GS": "slide v", "T": "slide F", "AS": "stick F"}


class Place:
    """What vanishes at an event, where and when."""

    def __init__(self, scene: Scene, kind: str, at: Any) -> None:
        self.kind, self.surface, self.level, self.times = kind, "", 0, list[arb]()
        if kind in ("NS", "BP" if scene.half else "PD") and at is None:
            return
        self.i, what, *times = at
        self.level = what if kind in ("CS", "SS") else 0
        self.surface = {1: "F+", -1: "F-", 0: what}.get(self.level, "")
        mode = "slide " if scene.segments[range(scene.count)[self.i]][0] else "stick "
        if self.surface not in ("v", "F+", "F-") or mode + self.surface[0] != MET.get(kind):
            raise Refused(f"a {kind} at {at} is not checked here")
        self.times = [] if self.level else [ball(*times)]

    def value(self, scene: Scene, z: list[Any], time: Any = None) -> Any:
        """Return what vanishes."""
        if self.surface:
            time = time or self.time(scene, z)
            return scene.observed(z, self.i, self.surface, time)[0]
        trace, det = scene.multipliers(z)
        return det - 1 if self.kind == "NS" else 1 + trace + det

    def time(self, scene: Scene, z: list[Any]) -> Any:
        """Return how long a slide lasts, or when an observable is stationary, which it is once in a box."""
        found = duration = scene.duration(z, self.i)
        for box in self.times:
            positive(box.min(duration - box), "it is touched inside")
            found = box
            for again in range(6):
                middle = arb(found.mid())
                rate = scene.observed(z, self.i, self.surface, middle)[1]
                image = middle - rate / scene.observed(z, self.i, self.surface, found)[2]
                if not (again or box.contains_interior(image)):
                    raise Undecided("a surface is touched")
                found = image
        return found

    def met(self, scene: Scene, z: list[arb]) -> dict[tuple[int, str], Any]:
        """Return what the law finds met there; see that it is an event of its kind."""
        if self.kind == "NS":
            trace, det = scene.multipliers(z)
            positive(4 * det - trace * trace, "the multipliers are a pair")
        if not self.surface or self.kind == "T":  # which the law allows
            return {}
        time = self.time(scene, z)
        if self.level:
            rate = self.level * scene.observed(z, self.i, self.surface, time)[1]
            positive(rate if self.kind == "CS" else -rate, f"the load moves as at a {self.kind}")
        return {(self.i, self.surface): time}


def check_event(data: dict[str, Any]) -> list[str]:
    """Check that an event of its kind happens within the ball of its parameter."""
    name, kind, value = data["parameter"], data["kind"], ball(data["value"])
    middle, radius = arb(value.mid()), arb(value.rad())
    scene, n = Scene(data, middle), 2 * len(data["segments"])
    near = [arb(v.mid()) for v in phases([map(ball, row) for row in data["near"]], scene)]
    kept, step, wide, met = n, [arb(0)] * n, radius, dict[tuple[int, str], Any]()
    if kind == "SN":  # the piece is one on which the parameter turns
        way = (arb_mat(scene.equations(near)[1]).mid().inv() * arb_mat(n, 1, [1] * n)).entries()
        kept = max(range(n), key=lambda j: abs(float(way[j])))
        step = [radius.sqrt() / 64 * v / way[kept] for v in way]
        wide = arb(0)
    knots = (
        [*(p + s * d for p, d in zip(near, step, strict=True)), middle + s * wide]
        for s in (-1, 0, 1)
    )
    first, at, last = (Box(data, kept, knot).proved() for knot in knots)
    box = Box(data, kept, first.middle.entries(), last.middle.entries()).proved()
    scene, z = box.orbits(INSIDE)
    if kind == "SN":
        low, here, high = (point.curve(arb(0))[n, 0] for point in (first, at, last))
        positive((here - low) * (here - high), "the parameter turns")
        positive(radius - abs(box.curve(INSIDE)[n, 0] - middle), "it does so in the ball")
    else:
        place = Place(scene, kind, data["at"])
        if any(time.rad() < 100 * radius for time in place.times):
            raise Refused("its ball of times is too narrow, as in older files: write it anew")
        product = place.value(*first.orbits(0)) * place.value(*last.orbits(0))
        positive(-product, f"what vanishes at a {kind} changes its sign")
        met = place.met(scene, z)
    inside = all(holds(box, point) for point in (first, at, last))
    if not inside or (kind == "SN" and data["at"] is not None):
        raise Undecided("one curve through the event")
    check_admissible(scene, z, met)
    return ["exists", f"is a {kind} in {name}", "admissible"]
