"""A certificate file, read and checked."""

import json
from itertools import combinations, pairwise, product
from typing import Any, NamedTuple

from flint import acb, arb, ctx

from contfric.verify.curve import INSIDE, Link, check_admissible, met_in
from contfric.verify.motion import Refused, Scene, Undecided, ball, see

FORMAT, CHECKED_MODELS, BITS = 3, ("coulomb",), (106, 212, 424, 848)  # until all is decided
CLAIMS = "unique", "admissible", "stable", "unstable"  # of an orbit that exists
PARTS = [arb(0, 0.5)], [arb(k / 128, 1 / 128) for k in range(-63, 64, 2)]  # of a box


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
        moved = {k for p in parts for k, _ in p["params"].items() ^ parts[0]["params"].items()}
        see(parts != [] and len(moved) < 2, "it has parts, all of one diagram")
        stated, orbits, bits = zip(*map(_check, parts), strict=True)
        for (p, one, boxes), (q, other, more) in combinations(orbits, 2):
            ends, others = ([x[k][k in y] for k in x] for x, y in ((one, other), (other, one)))
            pairs = [*product(ends, more), *product(others, boxes)] if p == q else []
            see(all(_apart(*pair) for pair in pairs), "no two parts are the same, or overlap")
        counts = [f"{sum(p['certificate'] == name for p in parts)} {name}s" for name in CHECKS]
        counts += [f"{sum(not end for p in parts for end in p.get('ends', []))} open ends"]
        return Answer(True, "", tuple(stated[0] if parts == [data] else counts), max(bits))
    except Exception as error:
        return Answer(False, str(error) if isinstance(error, Refused) else f"damaged: {error!r}")
    finally:
        ctx.cap = cap


def _apart(orbit: Any, box: Link) -> bool:
    """Tell whether an orbit is not one of those in a box."""
    return any(all(orbit[0].misses(orbit[1], box.orbits(s)) for s in parts) for parts in PARTS)


def _check(data: Any) -> tuple[list[str], list[Any], int]:
    name, why = data["certificate"], ""
    known = name in CHECKS and data.get("format") == FORMAT and data.get("model") in CHECKED_MODELS
    see(known, f"it is a certificate of format {FORMAT} of {', '.join(CHECKED_MODELS)}")
    see((len(data), len(data["params"])) == (12, 4 + (name == "orbit")), "it states nothing else")
    for bits in BITS[name != "tube" :]:
        with ctx.workprec(bits):
            try:
                return *CHECKS[name](data), bits
            except (Undecided, ZeroDivisionError) as error:
                why = str(error)
    raise Refused(f"not decided with {BITS[-1]} bits: {why}")


def _knot(data: Any, row: Any) -> list[arb]:
    *joints, value = map(ball, row[:])
    omega = Scene(data, value).omega
    return [*(c if k % 2 else c * omega for k, c in enumerate(joints)), value]


def orbits_at(data: Any, known: Any = ()) -> list[Link]:
    """Return the orbits next to the knots of a curve, the first ones if known; near folds normal to it."""
    knots = [_knot(data, row) for row in data["knots"][:]]
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
    stop, knots, _ = len(points) - 2, [point.orbits(0) for point in points], data["unchecked"]
    see(stop >= bool(left and right) and "T" not in f"{left}{right}", "a tube may have such ends")
    for k, (a, b) in enumerate(pairwise(points)):
        first, last, end = (b, a, left) if left and k == 0 else (a, b, right if k == stop else None)
        if end:
            check_admissible(*first.orbits(0))
        kinds, box = events_between(data, first, last, end)
        found, boxes = [*found, *([k, kind] for kind in kinds)], [*boxes, box]
        others = [(0, box), (k - 1, box), (k + 1, boxes[k - 1])] if k else []
        see(all(_apart(knots[j], part) for j, part in others), "no orbit comes again")
    stated = [[k, end[0]] for k, end in ((0, left), (stop, right)) if end]
    see(sorted(found) == sorted(stated + data["events"]), f"it has those events, not {found}")
    same = sorted((k * d, k * e) for d, e in knots[0][0].segments for k in {1, knots[0][0].closing})
    shown, ends = f"{len(data['events'])} events of multipliers", dict[Any, Any]()
    for k, inner in ((0, 1), (-1, -2)):  # with the next knot, as tubes may go on from one
        known = str((data["segments"], data["half"], data["periods"], data["knots"][k], ctx.prec))
        ends[known if points[k].fixed else object()] = knots[k], knots[inner]
    return ["one curve", "admissible", shown], [same, ends, boxes]


def _check_event(data: Any) -> tuple[list[str], list[Any]]:
    kind, at, (a, b) = data["kind"], data["at"], orbits_at(data)
    found, box = events_between(data, a, b, None if at is None else (kind, [at]))
    see(found == [kind], f"it has those events, not {found}")
    near, what = box.orbits(INSIDE), f"is a {kind} in {data['parameter']}"
    see(ball(data["value"]).contains(near[0].value), "it is in the ball", False)
    return ["exists", what, "admissible"], [kind, {0: [near] * 2}, [box]]


def _check_orbit(data: Any) -> tuple[list[str], list[Any]]:
    data, claims, s = data | {"parameter": "S"}, data["statements"], data["params"]["S"] - 0
    see(claims == ["exists", *(c for c in CLAIMS if c in claims)], "it states what an orbit is")
    printed, radius = (_knot(data, [*data[name][:], s])[:-1] for name in ("joints", "radius"))
    scene, z = (box := Link(data, [*printed, ball(s)]).proved()).orbits(0)
    for k, (c, near, r, b) in enumerate(zip(z, printed, radius, data["enclosure"][:], strict=True)):
        see(r - abs(c - near), "it lies in the box around the printed joints")
        see(ball(b).contains(c if k % 2 else c / scene.omega), "its ball holds it", False)
    if "unique" in claims:
        Link(data, [*printed, ball(s)]).proved([*radius, arb(0)])
    if "admissible" in claims:
        check_admissible(scene, z)
    trace, det, jury = scene.multipliers(z)
    see("stable" not in claims or min(jury, key=arb.lower), "multipliers are inside of the circle")
    see("unstable" not in claims or -min(jury, key=float), "a multiplier is outside of the circle")
    root, mean = acb(trace * trace / 4 - det).sqrt(), trace / 2
    found = [acb(trace), acb(0)] if det.is_zero() else [mean + root, mean - root]
    for d, mu in zip(discs := data["multipliers"][:], found, strict=bool(discs)):
        see(len(d) == 2 and acb(ball(d["re"]), ball(d["im"])).contains(mu), "its disc", False)
    return claims + ["multipliers"] * bool(discs), [data["params"], {0: [(scene, z)] * 2}, [box]]


CHECKS = {"event": _check_event, "orbit": _check_orbit, "tube": _check_tube}  # each reads all
