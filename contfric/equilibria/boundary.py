r"""Boundary equilibria: an equilibrium reaches a surface, and persists in another mode or folds.

Let ``f1`` hold where ``H > 0`` and have an equilibrium that reaches ``H = 0`` at ``p*``, ``N = f1_y``,
``C = H_y``, and let ``delta`` be the rate of H along its branch. On the other side holds ``f2``.

* The field jumps (Filippov): with ``E = f2 - f1`` at the point, equilibria of the sliding field
  ``(1 - a) f1 + a f2`` have ``a = delta (p - p*) / (C N^{-1} E)`` to first order, and a > 0 on the surface.
  The equilibrium of f1 is admissible where ``delta (p - p*) > 0``. So ``C N^{-1} E < 0`` is **persistence**
  (one turns into the other) and ``C N^{-1} E > 0`` a **non-smooth fold** (both on one side, none on the
  other).
* The field is continuous: ``f2 = f1 + E H``, and ``det N2 / det N1 = 1 + C N1^{-1} E`` decides, as
  ``H = delta (p - p*) / (1 + C N1^{-1} E)`` along the branch of f2: positive is persistence, negative a
  non-smooth fold.

(M. di Bernardo, C. J. Budd, A. R. Champneys, P. Kowalczyk, Piecewise-smooth Dynamical Systems, Springer 2008,
chapter 5.) The same is told by the two sides: where each of the two branches is admissible. That also holds
for modes on surfaces that were typed, and is what decides here; the product is kept with it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.equilibria.regions import ModeRegion, regions_of
from contfric.equilibria.zero_curve import Arc, CurvePoint

#: A field vanishes: relative to what its rates are at a natural distance.
_VANISHES = 1e-7


class Unfolding(str, Enum):
    """What becomes of an equilibrium beyond the surface that it reaches; the text says it."""

    PERSISTENCE = "persistence: it goes on in another mode"
    FOLD = "non-smooth fold: it meets an equilibrium of another mode, and beyond there is neither"
    ALONE = "no equilibrium of another mode is there"
    DEGENERATE = "several surfaces or branches meet: not told"


@dataclass(frozen=True, eq=False)
class Partner:
    """What meets an equilibrium on the boundary of its region.

    Attributes
    ----------
    unfolding : what happens
    start : the curve of the other mode and its point there, directed into its region; None without one
    mode : name of the other mode; empty without one
    product : the number whose sign decides; nan where the surface has no field on its other side
    """

    unfolding: Unfolding
    start: tuple[Arc, CurvePoint] | None = None
    mode: str = ""
    product: float = float("nan")


def partner_of(arc: Arc, point: CurvePoint) -> Partner:
    """Return what meets an equilibrium on a surface; its branch arrives there along its tangent."""
    y, p = arc.at(point)
    others = [
        r for r in regions_of(arc.region.model) if r is not arc.region and _rests(r, arc, y, p)
    ]
    if not others:
        return Partner(Unfolding.ALONE)
    if len(others) > 1 or len(arc.region.touched(y, p)) > 1:
        return Partner(Unfolding.DEGENERATE)
    region = others[0]
    product = product_of(arc.region, region, y, p)
    on_each_side = replace(arc, region=region)
    inwards = _inwards(on_each_side, y, arc.parameter(point.x))
    if inwards is None:
        return Partner(Unfolding.DEGENERATE, product=product)
    onwards = inwards.tangent[-1] * point.tangent[-1] > 0.0
    unfolding = Unfolding.PERSISTENCE if onwards else Unfolding.FOLD
    return Partner(unfolding, (on_each_side, inwards), region.mode, product)


def _rests(region: ModeRegion, arc: Arc, y: FloatArray, p: FloatArray) -> bool:
    """Tell whether the field of a region vanishes at a state in its closure."""
    rates = region.fields.value(y, p)
    size = np.abs(region.fields.jacobian(y, p)) @ arc.scale + 1e-300
    near = region.near(y, p)
    on = all(near[s] == 0.0 for s in region.on)
    return on and bool(np.all(np.abs(rates) <= _VANISHES * size)) and not region.domain_of(y, p)[1]


def _inwards(arc: Arc, y: FloatArray, value: float) -> CurvePoint | None:
    """Return the point of a curve at the boundary of its region, directed inwards; None if it stays on it."""
    point = arc.start(y, value, 1.0)
    if point is None:
        return None
    touched = arc.region.touched(*arc.at(point))
    if len(touched) != 1:
        return None
    domain, _ = arc.region.domain_of(y, arc.parameters(point.x))
    rate = arc.region.sides(domain)[touched[0]] * height_rate(arc, point, touched[0])
    if rate == 0.0:
        return None
    return point if rate > 0.0 else CurvePoint(point.x, -point.tangent)


def height_rate(arc: Arc, point: CurvePoint, surface: str) -> float:
    """Return the rate of a height along a curve, by a central difference over a short chord of it."""
    k = arc.region.heights.names.index(surface)
    short = 1e-6  # the root of rounding is 1e-8; the height is smooth on the scale of the range
    ahead, behind = point.x + short * point.tangent, point.x - short * point.tangent
    heights = [
        arc.region.heights.value(arc.state(x), arc.parameters(x))[k] for x in (ahead, behind)
    ]
    return float((heights[0] - heights[1]) / (2.0 * short))


def product_of(one: ModeRegion, other: ModeRegion, y: FloatArray, p: FloatArray) -> float:
    """Return the number whose sign tells persistence from a non-smooth fold; nan where it has no meaning.

    ``det N2 / det N1`` of two modes that move, ``-C N^{-1} E`` of one that moves and one that slides:
    positive is persistence in both.
    """
    if not one.on and not other.on:
        dets = [np.linalg.slogdet(r.fields.jacobian(y, p)) for r in (one, other)]
        return float(dets[0][0] * dets[1][0] * np.exp(dets[1][1] - dets[0][1]))
    moving, sliding = (one, other) if other.on else (other, one)
    if moving.on or len(sliding.on) != 1:
        return float("nan")
    [held] = sliding.on
    side = moving.sides(moving.domain_of(y, p)[0]).get(held, 0)
    beyond = _beyond(moving, held, side, y, p)
    if beyond is None:
        return float("nan")
    k = moving.heights.names.index(held)
    slope = side * moving.heights.slopes(y, p)[k]
    jump = beyond.fields.value(y, p) - moving.fields.value(y, p)
    return float(-slope @ np.linalg.solve(moving.fields.jacobian(y, p), jump))


def _beyond(
    moving: ModeRegion, held: str, side: int, y: FloatArray, p: FloatArray
) -> ModeRegion | None:
    """Return the region on the other side of a surface, at a state on it."""
    for region in regions_of(moving.model):
        if region.on or region is moving or region.domain_of(y, p)[1]:
            continue
        if any(region.sides(d).get(held) == -side for d in region.domains):
            return region
    return None
