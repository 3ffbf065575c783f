"""The law of friction over the whole of every segment (see the package)."""

from __future__ import annotations

from typing import Any

from flint import acb, arb

from contfric.verify.scene import Refused, Scene, Undecided, ball, positive

MOST_PIECES, MOST_HALVINGS = 20_000, 90  # of a slide or a stick


def check_admissible(scene: Scene, z: list[arb], met: Any = (), short: bool = False) -> None:
    """See that the law is obeyed, where some surfaces may be met: F+, F- at a stop, others at a time.

    Such a stop may be followed by a short stick, released at that load, which may vanish.
    """
    met, count = dict(met), scene.count
    levels = [((i, "F+") in met) - ((i, "F-") in met) for i in range(count)]
    for i, (direction, side) in enumerate(scene.segments):
        what, tau = f"segment {i + 1}", scene.duration(z, i)
        after = scene.segments[(i + 1) % count][0] * (scene.closing if i + 1 == count else 1)
        start = levels[i - 1] * (scene.closing if i == 0 else 1) * abs(scene.segments[i - 1][0])
        vanishes = short and side != 0 and start == side
        if not vanishes:
            positive(tau, f"{what} lasts")
        if direction:
            if after == direction or (levels[i] and after not in (0, -levels[i])):
                raise Refused(f"{what}: a stop does not lead on in that direction")
            if not levels[i]:  # else the load is S0
                end, x = scene.joint(z, i + 1)
                load = x - scene.force(end)
                room = -after * load - scene.s0 if after else scene.s0 - abs(load)
                positive(room, f"{what}: what follows its end")
            # after rest with S0 = S it starts with acceleration 0
            order = 1 + (scene.segments[i - 1][0] == 0 and (scene.s0 - scene.s).is_zero())
            _inside(scene, z, i, "v", direction, order, True, met.get((i, "v")))
            continue
        if after != -side:
            raise Refused(f"{what}: a release at that load leads elsewhere")
        for limit, name in ((1, "F+"), (-1, "F-")):
            if vanishes and limit == side:  # the load grows on the way
                rate = scene.observed(z, i, name, tau.union(arb(0)))[1]
                positive(side * rate, f"{what} is released transversally")
            else:
                order, ends, at = int(limit == start), limit == side, met.get((i, name))
                _inside(scene, z, i, name, -limit, order, ends, at)


def _inside(
    scene: Scene, z: list[arb], i: int, surface: str, sign: int, order: int, ends: bool, touch: Any
) -> None:
    """See that an observable has a sign inside of a segment, but for zeros at its ends and at a touch."""
    waiting, what = [(0, 0)], f"segment {i + 1}: {surface} is not met inside"
    duration = scene.duration(z, i).upper()
    for _ in range(MOST_PIECES):
        if not waiting:
            return
        level, index = waiting.pop()
        piece = (duration * index / 2**level).union(duration * (index + 1) / 2**level)
        middle = arb(piece.mid())
        _, rate, bend = (sign * c for c in scene.observed(z, i, surface, piece))
        # the mean value form, which a wide piece needs
        value = sign * scene.observed(z, i, surface, middle)[0] + rate * (piece - middle)
        if value < 0:
            raise Refused(f"false: {what}")
        first, last = index == 0, index == 2**level - 1
        starts = first and not last and order > 0 and (rate, bend)[order - 1] > 0
        lowest = touch is not None and piece.overlaps(touch) and bend > 0
        if value > 0 or starts or lowest or (last and not first and ends and rate < 0):
            continue
        if level >= MOST_HALVINGS:
            break
        waiting += [(level + 1, 2 * index + 1), (level + 1, 2 * index)]
    raise Undecided(what)


def check_multipliers(scene: Scene, data: Any, z: list[arb], stable: str) -> list[str]:
    """Check the multipliers of a turn; return which statements on them hold."""
    trace, det = scene.multipliers(z)
    if stable != "undecided":
        room = (1 - abs(det)).min(1 + det - abs(trace))  # Jury
        positive(room if stable == "proved" else -room, "the multipliers lie on that side of 1")
    root, mean = acb(trace * trace / 4 - det).sqrt(), trace / 2
    found = [acb(trace), acb(0)] if det.is_zero() else [mean + root, mean - root]
    stated = [acb(ball(mu["re"]), ball(mu["im"])) for mu in data["multipliers"]]
    if stated:
        pairs = [list(zip(stated, order, strict=True)) for order in (found, found[::-1])]
        if not any(all(disc.contains(mu) for disc, mu in pair) for pair in pairs):
            raise Undecided("the multipliers lie in their discs")
    named = {"proved": ["stable"], "refuted": ["unstable"]}.get(stable, [])
    return named + ["multipliers"] * bool(stated)
