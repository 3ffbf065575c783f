"""The law of friction over the whole of every segment, and multipliers (see the package)."""

from __future__ import annotations

from typing import Any

from flint import acb, arb

from contfric.verify.solution import Refused, Scene, Undecided, ball, decided

MOST_PIECES, MOST_HALVINGS = 20_000, 90  # of a slide or a stick


def check_admissible(
    scene: Scene, zero: list[arb], limits: Any = (), touches: Any = (), short: bool = False
) -> None:
    """See that the law is obeyed; at the end of some segments the load is +-S0, and a stick may be short."""
    limits, touches, count = dict(limits), dict(touches), scene.count
    for i, (direction, side) in enumerate(scene.segments):
        (t, x), (end, y) = scene.joint(zero, i), scene.joint(zero, i + 1)
        what = f"segment {i + 1}"
        start = limits.get((i - 1) % count, 0) * (-1 if scene.half and i == 0 else 1)
        vanishes = short and start != 0 and start == side
        decided(vanishes or bool(end > t), end <= t, f"{what} lasts")
        after = scene.segments[(i + 1) % count][0]
        after *= -1 if scene.half and i + 1 == count else 1
        times = (end - t).union(arb(0)) if vanishes else end - t
        rate = (direction or side) * scene.observed(zero, i, "v" if direction else "F+", times)[1]
        if direction:
            decided(rate < 0, rate > 0, f"{what} stops transversally")
            limit, load = limits.get(i, 0), y - scene.force(end)
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
        for limit, name in ((1, "F+"), (-1, "F-")):
            load = limit * (x - scene.force(t))
            if vanishes and limit == side:
                continue  # the load grows on the way
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


def turn(scene: Scene, zero: list[Any]) -> tuple[Any, Any]:
    """Return trace and determinant of the derivative of (t, x) after a turn: v = 0 is the section."""
    one, closing = 0 * zero[0] + 1, -1 if scene.half else 1
    total, det = [[one, 0 * one], [0 * one, one]], closing * one
    for i in range(scene.count):
        _, own, ((a, b), (c, d)) = scene.segment(zero, i)
        moved = [[row[0] * total[0][k] + row[1] * total[1][k] for k in (0, 1)] for row in own]
        size, pairs = a * d - b * c, list(zip(*moved, strict=True))
        total = [
            [(b * q - d * p) / size for p, q in pairs],
            [(c * p - a * q) / size for p, q in pairs],
        ]
        det *= (own[0][0] * own[1][1] - own[0][1] * own[1][0]) / size
    slides = all(direction for direction, _ in scene.segments)  # rest leaves one multiplier only
    return total[0][0] + closing * total[1][1], det if slides else 0 * det


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
