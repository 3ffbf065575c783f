"""The law of friction over the whole of every segment, and the multipliers (see the package)."""

from __future__ import annotations

from typing import Any

from flint import acb, arb, arb_mat

from contfric.verify.solution import Refused, Scene, Undecided, ball, decided

#: Most pieces of a slide or a stick, and how often one may be halved.
MOST_PIECES, MOST_HALVINGS = 20_000, 90


def check_admissible(scene: Scene, zero: list[arb]) -> None:
    """See that the solution is one of the law of friction, over the whole of every segment."""
    for i, (direction, side) in enumerate(scene.segments):
        (t, x), (end, y) = scene.joint(zero, i), scene.joint(zero, i + 1)
        decided(end > t, end <= t, f"segment {i + 1} lasts")
        after, after_side = scene.segments[(i + 1) % scene.count]
        if scene.half and i + 1 == scene.count:
            after, after_side = -after, -after_side
        if direction:
            before = scene.segments[i - 1]
            _check_slide(scene, i, t, x, end, released=before[0] == 0)
            _check_stop(scene, i, y - scene.force(end), after, direction)
        else:
            _check_stick(scene, i, t, x, end, side)
            if after != -side:
                raise Refused(f"segment {i + 1}: a release at that load leads elsewhere")


def _check_stop(scene: Scene, i: int, load: arb, after: int, direction: int) -> None:
    """See that a stop rests where the load is less than S0, and leaves against it where it is more."""
    if after == 0:
        held, left = abs(load) < scene.s0, abs(load) > scene.s0
        decided(held, left, f"segment {i + 1}: the mass is held at its end")
        return
    if after == direction:
        raise Refused(f"segment {i + 1}: a stop does not lead on in the same direction")
    left = -after * load
    decided(left > scene.s0, left < scene.s0, f"segment {i + 1}: the mass leaves at its end")


def _check_slide(scene: Scene, i: int, t: arb, x: arb, end: arb, released: bool) -> None:
    """See that the velocity keeps its sign between start and end, where it vanishes."""
    direction, duration = scene.segments[i][0], (end - t).upper()
    what = f"segment {i + 1}: the slide keeps its direction"
    smooth = released and (scene.s0 - scene.s).is_zero()  # it starts with acceleration 0

    def velocity(tau: arb) -> arb:
        return direction * scene.slide(direction, t, x, tau)[1]

    def rates(tau: arb) -> tuple[arb, arb]:
        y, v = scene.slide(direction, t, x, tau)
        a = scene.acceleration(direction, t + tau, y, v)
        return direction * a, direction * (scene.force(t + tau, 1) - v - 2 * scene.zeta * a)

    def starts(tau: arb) -> bool:
        return bool(rates(tau)[1 if smooth else 0] > 0)

    def stops(tau: arb) -> bool:
        return bool(rates(tau)[0] < 0)

    def sign(tau: arb) -> arb:  # the mean value form, which a wide piece needs
        middle = arb(tau.mid())
        return velocity(middle) + rates(tau)[0] * (tau - middle)

    decided(stops(end - t), bool(rates(end - t)[0] > 0), f"segment {i + 1} stops transversally")
    _positive(sign, duration, starts, stops, what)


def _check_stick(scene: Scene, i: int, t: arb, x: arb, end: arb, side: int) -> None:
    """See that the load stays below S0 in modulus, and reaches it from inside at the end."""
    what, duration = f"segment {i + 1}: the mass is held", (end - t).upper()
    load = x - scene.force(t)
    decided(abs(load) < scene.s0, abs(load) > scene.s0, what)
    out = -side * scene.force(end, 1)
    decided(out > 0, out < 0, f"segment {i + 1} is released transversally")
    for level in (1, -1):

        def sign(tau: arb, level: int = level) -> arb:
            middle = arb(tau.mid())
            margin = scene.s0 - level * (x - scene.force(t + middle))
            return margin + level * scene.force(t + tau, 1) * (tau - middle)

        def ends(tau: arb, level: int = level) -> bool:
            return level == side and bool(-side * scene.force(t + tau, 1) > 0)

        _positive(sign, duration, lambda tau: False, ends, what)


def _positive(sign: Any, duration: arb, starts: Any, ends: Any, what: str) -> None:
    """See that a function is positive on (0, duration); where it vanishes at an end, by its rate."""
    waiting = [(0, 0)]
    for _ in range(MOST_PIECES):
        if not waiting:
            return
        level, index = waiting.pop()
        width = duration / 2**level
        piece = (width * index).union(width * (index + 1))
        value = sign(piece)
        if value > 0:
            continue
        if value < 0:
            raise Refused(f"false: {what}")
        first, last = index == 0, index == 2**level - 1
        if (first and not last and starts(piece)) or (last and not first and ends(piece)):
            continue
        if level >= MOST_HALVINGS:
            break
        waiting += [(level + 1, 2 * index + 1), (level + 1, 2 * index)]
    raise Undecided(what)


def turn_matrix(scene: Scene, zero: list[arb]) -> arb_mat:
    """Return the derivative of (t, x) after a turn by (t, x): v = 0 is the section."""
    total = arb_mat([[1, 0], [0, 1]])
    for i, (direction, _) in enumerate(scene.segments):
        (t, x), (end, y) = scene.joint(zero, i), scene.joint(zero, i + 1)
        if direction == 0:
            step = arb_mat([[arb(0), 1 / scene.force(end, 1)], [0, 1]])
        else:
            c, dc, d, dd = scene.free(end - t)
            first = scene.acceleration(direction, t, x, arb(0))
            last = scene.acceleration(direction, end, y, arb(0))
            step = arb_mat([[first * dd / last, -dc / last], [-first * d, c]])
        total = step * total
    return arb_mat([[1, 0], [0, -1 if scene.half else 1]]) * total


def check_multipliers(
    scene: Scene, data: dict[str, Any], zero: list[arb], stable: str
) -> list[str]:
    """Check the multipliers of a turn; return which statements on them hold."""
    matrix, done = turn_matrix(scene, zero), []
    trace = matrix[0, 0] + matrix[1, 1]
    sticks = any(direction == 0 for direction, _ in scene.segments)
    det = arb(0) if sticks else matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
    inside = bool(abs(det) < 1 and abs(trace) < 1 + det)  # Jury
    outside = bool(abs(det) > 1 or abs(trace) > 1 + det)
    if stable == "proved":
        decided(inside, outside, "the multipliers lie inside of the unit circle")
        done.append("stable")
    elif stable == "refuted":
        decided(outside, inside, "a multiplier lies outside of the unit circle")
        done.append("unstable")
    root = acb(trace * trace - 4 * det).sqrt()
    found = [acb(trace), acb(0)] if sticks else [(trace + root) / 2, (trace - root) / 2]
    stated = [acb(ball(mu["re"]), ball(mu["im"])) for mu in data["multipliers"]]
    if not stated:
        return done
    if len(stated) != 2:
        raise Refused("there are not two multipliers")
    pairs = [list(zip(stated, order, strict=True)) for order in (found, found[::-1])]
    inside = any(all(disc.contains(mu) for disc, mu in pair) for pair in pairs)
    outside = all(any(not disc.overlaps(mu) for disc, mu in pair) for pair in pairs)
    decided(inside, outside, "the multipliers lie in their discs")
    return [*done, "multipliers"]
