"""Pieces of a tube: where they begin and end, and which events of multipliers are in them.

In a piece ``1 - tr M + det M`` (SN), ``1 + tr M + det M`` (PD, BP) and ``det M - 1`` (NS) have a sign, or
pass 0 once: the rate has a sign, and the signs at the two ends say whether it passes. The orbits have the
direction c' + y', ``J y' = -dF(c + y)/ds``.
"""

from __future__ import annotations

from typing import Any

from flint import arb

from contfric.verify.box import HALF, INSIDE, Box, below, size, spread
from contfric.verify.scene import Scene, Undecided, part

STEEP = 0.02  # a parameter that changes less than this share of another number is not kept


def piece(data: Any, a: list[arb], b: list[arb]) -> Box:
    """Return the box between two knots, not proved; near a fold another number than the parameter is kept."""
    share = [float(abs(q - p) / (1 + abs(p))) for p, q in zip(a, b, strict=True)]
    steep = share[-1] < STEEP * max(share)
    return Box(data, share.index(max(share)) if steep else len(a) - 1, a, b)


def moving(box: Box) -> tuple[Scene, list[Any]]:
    """Return scene and unknowns of all orbits of a box, as power series in the direction of their curve."""
    turned = box.gap.solve(size(box.inverse * box.rates(INSIDE, 1)))
    return box.moving(INSIDE, box.along + spread(box.rest * turned))


def holds(box: Box, point: Box) -> bool:
    """Tell whether the orbit next to a point is one of a box."""
    off, others = point.curve(arb(0)) - box.middle, box.rest.transpose()
    s = off[box.kept, 0] / box.along[box.kept, 0]
    near = below(others * size(off - s * box.along), others * box.radii)
    return bool(abs(s) < HALF) and near


def counted(box: Box) -> list[str]:
    """Return the kinds of the events of multipliers between the ends of a box, each passed once."""
    found, (scene, z) = list[str](), moving(box)
    trace, det = scene.multipliers(z)
    ends = [Scene.multipliers(*box.orbits(s)) for s in (-0.5, 0, 0.5)]
    pair = trace[0] * trace[0] - 4 * det[0]
    for kind, sign in (("SN", -1), ("BP" if box.data["half"] else "PD", 1), ("NS", 0)):
        if kind == "SN" and not part(scene.given, 1).contains(0):
            continue  # the parameter is monotone
        first, value, last = (d + sign * t + (1 if sign else -1) for t, d in ends)
        rate = det[1] + sign * trace[1]
        if (value + rate * INSIDE).contains(0) and (sign or not pair > 0):
            if rate.contains(0) or not (sign or pair < 0) or (first * last).contains(0):
                raise Undecided(f"a {kind} may be in a box")
            found += [kind] * bool(first * last < 0)
    return found
