"""The law of friction over the whole of every segment, multipliers, and events (see the package).

At an event something changes its sign over a ball of one parameter, along the curve of orbits: a load less
its limit, det(M + 1), det M - 1, or what is touched, where it is stationary. At a fold one equation is left
out for one joint s: phi(s) has two zeros at one end of the ball, none at the other.
"""

from __future__ import annotations

from typing import Any

from flint import acb, arb, arb_mat

from contfric.verify.solution import Refused, Scene, Undecided, ball, decided

#: Most pieces of a slide or a stick, halvings of one, half-widths about a fold in roots of the ball's radius.
MOST_PIECES, MOST_HALVINGS, WIDER = 20_000, 90, (64, 1024, 16384)
BESIDE = 2.0**-40  # half-width of the box of times about a touch


def check_admissible(scene: Scene, zero: list[arb], at: int, level: int, touches: Any) -> None:
    """See that the law of friction is obeyed; the load is S0 at the end of segment ``at`` if ``level``."""
    for i, (direction, side) in enumerate(scene.segments):
        (t, x), (end, y) = scene.joint(zero, i), scene.joint(zero, i + 1)
        what = f"segment {i + 1}"
        decided(end > t, end <= t, f"{what} lasts")
        after = scene.segments[(i + 1) % scene.count][0]
        after *= -1 if scene.half and i + 1 == scene.count else 1
        rate = (direction or side) * scene.observed(zero, i, "v" if direction else "F+", end - t)[1]
        if direction:
            decided(rate < 0, rate > 0, f"{what} stops transversally")
            limit, load = level * (i == at), y - scene.force(end)
            if after == direction or (limit and after not in (0, -limit)):
                raise Refused(f"{what}: a stop does not lead on in that direction")
            size = -after * load if after else abs(load)
            sides = bool(size < scene.s0), bool(size > scene.s0)
            if not limit:  # at an event the load is S0
                decided(*(sides[::-1] if after else sides), f"{what}: what follows its end")
            # after rest with S0 = S it starts with acceleration 0
            smooth = scene.segments[i - 1][0] == 0 and (scene.s0 - scene.s).is_zero()
            _positive(scene, zero, i, "v", direction, 1 + smooth, True, touches.get((i, "v")))
            continue
        decided(rate > 0, rate < 0, f"{what} is released transversally")
        if after != -side:
            raise Refused(f"{what}: a release at that load leads elsewhere")
        start = level * (at == (i - 1) % scene.count) * (-1 if scene.half and i == 0 else 1)
        for limit, name in ((1, "F+"), (-1, "F-")):
            load = limit * (x - scene.force(t))
            if limit != start:
                decided(load < scene.s0, load > scene.s0, f"{what} begins within its limits")
            touch, ends = touches.get((i, name)), limit == side
            _positive(scene, zero, i, name, -limit, int(limit == start), ends, touch)


def _positive(
    scene: Scene, z: list[arb], i: int, surface: str, sign: int, order: int, ends: bool, touch: Any
) -> None:
    """See that an observable has a sign inside of a segment, but for zeros at its ends and at a touch."""
    duration = (scene.joint(z, i + 1)[0] - scene.joint(z, i)[0]).upper()
    waiting, what = [(0, 0)], f"segment {i + 1}: {surface} is not met inside"
    for _ in range(MOST_PIECES):
        if not waiting:
            return
        level, index = waiting.pop()
        width = duration / 2**level
        piece = (width * index).union(width * (index + 1))
        middle = arb(piece.mid())
        _, rate, bend = (sign * c for c in scene.observed(z, i, surface, piece))
        # the mean value form, which a wide piece needs
        value = sign * scene.observed(z, i, surface, middle)[0] + rate * (piece - middle)
        if value > 0:
            continue
        if value < 0:
            raise Refused(f"false: {what}")
        first, last = index == 0, index == 2**level - 1
        starts = first and not last and order > 0 and (rate, bend)[order - 1] > 0
        lowest = touch is not None and piece.overlaps(touch) and bend > 0
        if starts or lowest or (last and not first and ends and rate < 0):
            continue
        if level >= MOST_HALVINGS:
            break
        waiting += [(level + 1, 2 * index + 1), (level + 1, 2 * index)]
    raise Undecided(what)


def turn(scene: Scene, zero: list[arb]) -> tuple[arb, arb]:
    """Return trace and determinant of the derivative of (t, x) after a turn: v = 0 is the section."""
    total = arb_mat([[1, 0], [0, 1]])
    for i in range(scene.count):
        _, own, after = scene.segment(zero, i)
        total = arb_mat(after).solve(arb_mat(own)) * total * -1
    total = arb_mat([[1, 0], [0, -1 if scene.half else 1]]) * total
    slides = all(direction for direction, _ in scene.segments)  # rest leaves one multiplier only
    return total[0, 0] + total[1, 1], total.det() if slides else arb(0)


def check_multipliers(scene: Scene, data: Any, zero: list[arb], stable: str) -> list[str]:
    """Check the multipliers of a turn; return which statements on them hold."""
    (trace, det), done = turn(scene, zero), []
    sides = [abs(det) < 1 and abs(trace) < 1 + det, abs(det) > 1 or abs(trace) > 1 + det]  # Jury
    if stable != "undecided":
        done = ["stable" if stable == "proved" else "unstable"]
        inside, outside = sides if stable == "proved" else sides[::-1]
        decided(inside, outside, "the multipliers lie on their side of the unit circle")
    root = acb(trace * trace - 4 * det).sqrt()
    found = [acb(trace), acb(0)] if det.is_zero() else [(trace + root) / 2, (trace - root) / 2]
    stated = [acb(ball(mu["re"]), ball(mu["im"])) for mu in data["multipliers"]]
    if not stated:
        return done
    pairs = [list(zip(stated, order, strict=True)) for order in (found, found[::-1])]
    inside = any(all(disc.contains(mu) for disc, mu in pair) for pair in pairs)
    outside = all(any(not disc.overlaps(mu) for disc, mu in pair) for pair in pairs)
    decided(inside, outside, "the multipliers lie in their discs")
    return [*done, "multipliers"]


def check_event(data: dict[str, Any]) -> list[str]:
    """Check that an event of its kind happens within the ball of its parameter."""
    name, kind, value = data["parameter"], data["kind"], ball(data["value"])
    if name not in data["params"] or not value.rad() > 0:
        raise Refused(f"a {kind} in {name} is not checked here")
    ends = (value.mid() - value.rad(), value.mid() + value.rad())
    scene, *sides = (Scene(data, {name: p}) for p in (value, *ends))
    near = [arb(ball(row[k]).mid()) for row in data["near"] for k in (0, 1)]
    at, level, surface, box = _place(scene, kind, data["at"])
    touches, widths = dict[tuple[int, str], arb](), list[arb]()
    if len(near) != 2 * scene.count:
        raise Refused("there is not one joint for each segment")
    if kind == "SN":
        zero = _fold(scene, sides, near, value.rad())
    else:
        zero, widths = scene.enclosed(near, None, "an orbit")
    if surface:
        touches = {(at, surface): _stationary(scene, zero, at, surface, box)}
        left = scene.joint(zero, at + 1)[0] - scene.joint(zero, at)[0] - box
        decided(box > 0 and left > 0, left < 0, "it is touched inside")

    def vanishing(own: Scene) -> arb:
        z = own.enclosed(near, widths, "ends")[0]
        if surface:
            return own.observed(z, at, surface, _stationary(own, z, at, surface, box))[0]
        (end, y), (trace, det) = own.joint(z, at + 1), turn(own, z)
        other = det - 1 if kind == "NS" else 1 + trace + det
        return y - own.force(end) - level * own.s0 if level else other

    if kind != "SN":
        product = vanishing(sides[0]) * vanishing(sides[1])
        decided(product < 0, product > 0, f"what vanishes at a {kind} changes its sign")
    if kind == "NS":
        trace, det = turn(scene, zero)
        decided(trace * trace < 4 * det, trace * trace > 4 * det, "the multipliers are a pair")
    if level:
        out = level * scene.force(scene.joint(zero, at + 1)[0], 1) * (-1 if kind == "CS" else 1)
        decided(out > 0, out < 0, f"the load moves as at a {kind}")
    check_admissible(scene, zero, at, level, touches)
    return ["exists", f"is a {kind} in {name}", "admissible"]


def _place(scene: Scene, kind: str, at: Any) -> tuple[int, int, str, Any]:
    """Return the segment of an event, the load's limit at its end, or what is touched in it and when."""
    if kind in ("SN", "NS", "BP" if scene.half else "PD") and at is None:
        return -1, 0, "", None
    if at and at[0] in range(scene.count):
        slides, what = scene.segments[at[0]][0] != 0, at[1]
        if kind in ("CS", "SS") and slides and what in (-1, 1):
            return at[0], what, "", None
        if (slides, what[0]) == {"GS": (True, "v"), "T": (True, "F"), "AS": (False, "F")}[kind]:
            return at[0], 0, what, arb(ball(at[2]).mid()) + arb(0, BESIDE)
    raise Refused(f"a {kind} at {at} is not checked here")


def _stationary(scene: Scene, z: list[arb], i: int, surface: str, box: arb) -> arb:
    """Return when an observable is stationary, which it is once in a box of times."""
    found = box
    for again in range(6):
        rate = scene.observed(z, i, surface, arb(found.mid()))[1]
        image = found.mid() - rate / scene.observed(z, i, surface, found)[2]
        if not (again or box.contains_interior(image)):
            raise Undecided("a surface is touched")
        found = image
    return found


def _fold(scene: Scene, ends: list[Scene], near: list[arb], radius: arb) -> list[arb]:
    """See that two orbits over one end of the ball become none over the other; return where they are."""
    inverse, size = scene.equations(near)[1].mid().inv().mid(), len(near)
    pairs = [(a, b) for a in range(size) for b in range(size)]
    k, j = max(pairs, key=lambda at: abs(float(inverse[at])))

    def phi(own: Scene, s: arb, widths: Any) -> tuple[arb, arb, list[arb], list[arb]]:
        z, widths = own.enclosed([*near[:k], s, *near[k + 1 :]], widths, "a curve", (j, k))
        values, jacobian = own.equations(z)
        rows, columns = ([a for a in range(size) if a != left] for left in (j, k))
        inner = arb_mat([[jacobian[a, b] for b in columns] for a in rows])
        slope = (-1) ** (j + k) * jacobian.det() / inner.det()
        return values[j], slope, z, widths

    for half in (factor * radius.sqrt() for factor in WIDER):
        _, _, zero, widths = phi(scene, near[k] + arb(0, half), None)
        sides = [phi(scene, near[k] + side * half, widths)[0] for side in (-1, 1)]
        sign = 1 if sides[0] > 0 else -1
        middles = [phi(own, near[k], widths)[0] * sign for own in ends]
        if all(c > 0 for c in middles):
            raise Refused("over neither end of the ball are two orbits nearby")
        if not all(c * sign > 0 for c in sides) or not any(c < 0 for c in middles):
            continue
        other, waiting = ends[int(middles[0] < middles[1])], [(near[k], half)]
        for _ in range(MOST_HALVINGS * 4):
            if not waiting:
                return zero
            middle, width = waiting.pop()
            slope = phi(other, middle + arb(0, width), widths)[1] * arb(0, width)
            if not (phi(other, middle, widths)[0] + slope) * sign > 0:
                waiting += [(middle + side * width / 2, width / 2) for side in (-1, 1)]
    raise Undecided("two orbits over one end of the ball, and none over the other")
