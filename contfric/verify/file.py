"""A certificate file, read and checked."""

from __future__ import annotations

import json
from itertools import combinations, pairwise, permutations
from typing import Any, NamedTuple

from flint import acb, arb, ctx

from contfric.verify.curve import INSIDE, Link, check_admissible, met_in
from contfric.verify.motion import Refused, Scene, Undecided, ball, see

FORMAT, CHECKED_MODELS, BITS = 2, ("coulomb",), (106, 212, 424, 848)  # until all is decided
CLAIMS = "exists", "unique", "admissible", "stable", "unstable"  # of an orbit


class Answer(NamedTuple):
    """Whether all statements of a file hold; if not, why; those that hold; the bits asked for."""

    yes: bool
    why: str
    statements: tuple[str, ...] = ()
    bits: int = 0


def check_text(text: str) -> Answer:
    """Check the text of a certificate file."""
    cap, ctx.cap = ctx.cap, 3
    try:
        data = json.loads(text)
        json.loads(text, object_pairs_hook=lambda p: see(len(dict(p)) == len(p), "names come once"))
        parts = data["checkable"] if data["certificate"] == "diagram" else [data]
        moved = {k for p in parts[1:] for k, v in p["params"].items() if v != parts[0]["params"][k]}
        moved |= {p["parameter"] for p in parts if "parameter" in p}
        see(len(moved) < 2, "its parts are of one diagram")
        stated, orbits, bits = zip(*map(_check, parts), strict=True)
        for (p, *own), (q, *others) in combinations(orbits, 2):
            apart = p != q or any(all(s.misses(z, b) for b in others) for s, z in own)
            see(apart, "no two parts are the same")
        counts = [f"{sum(p['certificate'] == name for p in parts)} {name}s" for name in CHECKS]
        counts += [f"{sum(p.get('ends', []).count(None) for p in parts)} open ends"]
        return Answer(True, "", tuple(stated[0] if parts == [data] else counts), max(bits))
    except Exception as error:
        return Answer(False, str(error) if isinstance(error, Refused) else f"damaged: {error!r}")
    finally:
        ctx.cap = cap


def _check(data: Any) -> tuple[list[str], list[Any], int]:
    name, why = data["certificate"], ""
    known = name in CHECKS and data.get("format") == FORMAT and data.get("model") in CHECKED_MODELS
    see(known, f"it is a certificate of format {FORMAT} of {', '.join(CHECKED_MODELS)}")
    for bits in BITS[name != "tube" :]:
        with ctx.workprec(bits):
            try:
                return *CHECKS[name](data), bits
            except (Undecided, ZeroDivisionError) as error:
                why = str(error)
    raise Refused(f"not decided with {BITS[-1]} bits: {why}")


def _knot(data: Any, row: Any) -> list[arb]:
    *joints, value = map(ball, row)
    omega = Scene(data, value).omega
    return [*(c if k % 2 else c * omega for k, c in enumerate(joints)), value]


def orbits_at(data: Any, known: Any = ()) -> list[Link]:
    """Return the orbits next to the knots of a curve, the first ones if known; near folds normal to it."""
    knots = [_knot(data, row) for row in data["knots"]]
    pairs = list(zip(knots, [*knots[1:2], *knots], strict=False))[len(known) :]
    return [*known, *(Link(data, at, None, Link(data, by, at).border).proved() for at, by in pairs)]


def events_between(data: Any, a: Link, b: Link, end: Any) -> tuple[list[str], Link]:
    """Return the events on the one curve of admissible orbits from a to b, or to an end; and its box."""
    box = Link(data, a.middle.entries(), b.middle.entries()).proved()
    see(box.holds(a) and box.holds(b), "one curve from knot to knot", False)
    met, (scene, z) = met_in(box, a, b, *end) if end else {}, box.orbits(INSIDE)
    check_admissible(scene, z, met, bool(end) and end[0] == "CS")
    return box.events(a, b) + ([end[0]] if end else []), box


def _check_tube(data: Any) -> tuple[list[str], list[Any]]:
    points, (left, right), found, boxes = orbits_at(data), data["ends"], list[Any](), list[Link]()
    stop, ends = len(points) - 2, [points[k].orbits(0) for k in (0, -1)]
    see(stop >= bool(left and right) and "T" not in f"{left}{right}", "a tube may have such ends")
    for k, (a, b) in enumerate(pairwise(points)):
        first, last, end = (b, a, left) if left and k == 0 else (a, b, right if k == stop else None)
        if end:
            check_admissible(*first.orbits(0))
        kinds, box = events_between(data, first, last, end)
        found, boxes = [*found, *([k, kind] for kind in kinds)], [*boxes, box]
        turn, pairs = -1 if left and k == 1 else 1, permutations((boxes[k - 1], box))
        goes = [(p.border * p.along * p.border * q.slope)[0, 0] * turn for p, q in pairs]
        see(max(goes, key=arb.lower), "it goes on and does not turn back")
        past = k == 0 or Scene.misses(*box.orbits(INSIDE), ends[0])
        see(past or INSIDE * (not box.holds(points[0])), "the first orbit does not come again")
    stated = [[k, end[0]] for k, end in ((0, left), (stop, right)) if end]
    see(sorted(found) == sorted(stated + data["events"]), f"it has those events, not {found}")
    return ["one curve", "admissible", f"{len(data['events'])} events of multipliers"], ["", *ends]


def _check_event(data: Any) -> tuple[list[str], list[Any]]:
    kind, at, value, (a, b) = data["kind"], data["at"], ball(data["value"]), orbits_at(data)
    found, box = events_between(data, a, b, None if at is None else (kind, [at]))
    see(found == [kind], f"it has those events, not {found}")
    see(value.rad() - abs((near := box.orbits(INSIDE))[0].value - value.mid()), "it is in the ball")
    return ["exists", f"is a {kind} in {data['parameter']}", "admissible"], [kind, near]


def _check_orbit(data: Any) -> tuple[list[str], list[Any]]:
    data, claims, s = data | {"parameter": "S"}, data["statements"], data["params"]["S"]
    see({"exists"} <= set(claims) <= set(CLAIMS), "its statements are those of an orbit")
    printed, radius = (_knot(data, [*data[name], s])[:-1] for name in ("joints", "radius"))
    scene, z = Link(data, [*printed, ball(s)]).proved().orbits(0)
    for value, near, r in zip(z, printed, radius, strict=True):
        see(r - abs(value - near), "it lies in the box around the printed joints")
    for k, text in enumerate(data["enclosure"]):
        see(ball(text).contains(z[k] if k % 2 else z[k] / scene.omega), "its ball holds it", False)
    if "unique" in claims:
        Link(data, [*printed, ball(s)]).proved([*radius, arb(0)])
    if "admissible" in claims:
        check_admissible(scene, z)
    trace, det, jury = scene.multipliers(z)
    see("stable" not in claims or min(jury, key=arb.lower), "multipliers are inside of the circle")
    see("unstable" not in claims or -min(jury, key=float), "a multiplier is outside of the circle")
    root, mean = acb(trace * trace / 4 - det).sqrt(), trace / 2
    found = [acb(trace), acb(0)] if det.is_zero() else [mean + root, mean - root]
    discs = [acb(ball(disc["re"]), ball(disc["im"])) for disc in data["multipliers"]]
    pairs = zip(discs, found, strict=bool(discs))
    see(all(disc.contains(mu) for disc, mu in pairs), "the multipliers lie in their discs", False)
    return [*claims, *["multipliers"] * bool(discs)], [data["params"], (scene, z)]


CHECKS = {"event": _check_event, "orbit": _check_orbit, "tube": _check_tube}
