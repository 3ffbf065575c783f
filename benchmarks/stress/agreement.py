"""How far a computed orbit is from the one in 50 digits, and how far rounding may take it.

The equations are the same whoever solves them, so an error has to be judged by their condition:

* joints: rounding of the arguments leaves a residual r in the equations, hence ``|J^-1| r`` in the
  joints (componentwise, with r of each row);
* multipliers: the derivative of one turn is a product ``M = T_N .. T_1``; rounding of each factor, and
  the change that the error of the joints makes in it.

An error is *explained* if it is at most that bound, to first order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from chain import Chain, Exact, FloatArray, Joint, flat, force, joints_of, paired, slide, solve
from condition import EPS, rounding, sensitivity
from mpmath import mpf

import contfric as cf

#: Random moves of the joints, by their error, that are tried for its effect on the multipliers.
MOVES = 4
#: What an error may be where the condition is perfect: the accuracy that is asked for.
ASKED = 1e-14


@dataclass(frozen=True)
class Agreement:
    """Errors of an orbit against the reference.

    Attributes
    ----------
    joints : largest error of a joint, relative to the size of the orbit's unknowns
    joints_ratio : largest error of a joint in units of what rounding explains
    multipliers : error of trace and determinant of one turn, relative to 1 + their size
    multipliers_ratio : the same in units of what rounding explains
    """

    joints: float
    joints_ratio: float
    multipliers: float
    multipliers_ratio: float

    @property
    def fine(self) -> bool:
        """Whether every error is at most 1e-14, or explained."""
        joints = self.joints <= ASKED or self.joints_ratio <= 1.0
        return joints and (self.multipliers <= ASKED or self.multipliers_ratio <= 1.0)

    def __str__(self) -> str:
        return (
            f"joints {self.joints:.2g} ({self.joints_ratio:.2g} of rounding), "
            f"multipliers {self.multipliers:.2g} ({self.multipliers_ratio:.2g})"
        )


def compare(orbit: cf.Orbit, exact: Exact | None = None) -> Agreement:
    """Compare an orbit with the one next to it in 50 digits.

    Raises
    ------
    NoReference
        If there is none.
    """
    exact = exact or solve(orbit)
    allowed = sensitivity(exact)
    got, wanted = flat(joints_of(orbit)), flat(exact.z)
    error = np.array([float(abs(a - b)) for a, b in zip(got, wanted, strict=True)])
    # velocities at the joints are unknowns of the engine; all of them are zero
    error = np.append(error, np.abs(orbit.joints[:, 2]))
    allowed = np.append(allowed, np.full(len(orbit.joints), float(np.max(allowed))))
    scale = 1.0 + float(np.max(np.abs(orbit.joints)))
    one, other = _invariants(orbit), exact.chain.turn_map(exact.pieces)
    gap = np.array([abs(float(a - b)) for a, b in zip(one, other, strict=True)])
    bound = multiplier_bound(exact, allowed[: len(wanted)])
    size = 1.0 + np.abs([float(v) for v in other])
    return Agreement(
        float(np.max(error) / scale),
        float(np.max(error / allowed)),
        float(np.max(gap / size)),
        float(np.max(gap / bound)),
    )


def _invariants(orbit: cf.Orbit) -> tuple[float, float]:
    """Trace and determinant of one turn: smooth where two multipliers meet."""
    mu = orbit.turn_multipliers
    return float(np.sum(mu).real), float(np.prod(mu).real)


def multiplier_bound(exact: Exact, allowed: FloatArray) -> FloatArray:
    """Return what rounding explains in trace and determinant of one turn."""
    rng = np.random.default_rng(0)
    here = [float(v) for v in exact.chain.turn_map(exact.pieces)]
    moved = np.zeros(2)
    for _ in range(MOVES):
        signs = rng.choice([-1.0, 1.0], len(allowed)) * allowed
        z = paired([v + mpf(d) for v, d in zip(flat(exact.z), signs.tolist(), strict=True)])
        there = exact.chain.turn_map(exact.moved(z).pieces)
        moved = np.maximum(moved, np.abs([float(a - b) for a, b in zip(there, here, strict=True)]))
    product = product_bound(exact)
    size = 1.0 + abs(here[0])  # the determinant is bilinear in M
    return np.asarray(2.0 * moved + product * np.array([2.0, 2.0 * size]) + EPS * size)


def product_bound(exact: Exact) -> float:
    """Return the rounding of the product of the derivatives of all segments, in norm."""
    factors = [_factor(piece.a, piece.b) for piece in exact.pieces]
    right, left = [np.eye(2)], [np.eye(2)]
    for factor, _ in factors:
        right.append(factor @ right[-1])
    for factor, _ in reversed(factors):
        left.append(left[-1] @ factor)
    rows = rounding(exact).reshape(-1, 2).max(axis=1)
    pairs = zip(reversed(left[:-1]), factors, right[:-1], rows, strict=True)
    return float(
        sum(
            np.linalg.norm(after) * error * (row + EPS) * np.linalg.norm(before)
            for after, (_, error), before, row in pairs
        )
    )


def _factor(a: object, b: object) -> tuple[FloatArray, float]:
    """Return ``T = -B^-1 A`` and the factor by which rounding of A and B enters it."""
    one, two = np.array(a, dtype=float), np.array(b, dtype=float)
    inverse = np.linalg.inv(two)
    factor = -inverse @ one
    # the derivatives of a slide are differences of terms of order one: their rounding is absolute
    size = 1.0 + np.linalg.norm(one) + np.linalg.norm(two) * np.linalg.norm(factor)
    return factor, float(np.linalg.norm(inverse) * size)


def admissible(exact: Exact, samples: int = 9) -> str:
    """Return what an orbit in 50 digits violates, at joints and at samples between; empty if nothing.

    Independent of the engine's turning points; what a sample misses is not seen.
    """
    chain, p = exact.chain, exact.p
    closed = chain.closed(exact.z, p)
    for i, s in enumerate(chain.modes):
        (t0, x0), (t1, x1) = closed[i], closed[i + 1]
        if not t1 > t0:
            return f"segment {i + 1} lasts {float(t1 - t0):.3g}"
        inner = [t0 + (t1 - t0) * mpf(k + 1) / (samples + 1) for k in range(samples)]
        low = min(_inside(p, s, (t0, x0), t) for t in inner)
        if low < 0:
            return f"segment {i + 1} leaves its mode by {float(low):.3g}"
        if s != 0 and (low := _at_stop(chain, p, i, (t1, x1))) < 0:
            return f"the stop after segment {i + 1} is on the wrong side by {float(low):.3g}"
    return ""


def _inside(p: tuple[Any, ...], s: int, start: Joint, t: Any) -> Any:
    """Margin of a segment at an instant."""
    if s == 0:
        return p[2] - abs(start[1] - force(p, t)[0])
    return s * slide(p, s, start, t)[1]


def _at_stop(chain: Chain, p: tuple[Any, ...], i: int, joint: Joint) -> Any:
    """Margin of the load at a stop: held if a stick follows, released to the right side if not."""
    following = chain.modes[(i + 1) % len(chain)]
    if i + 1 == len(chain):
        following *= chain.sign
    u = joint[1] - force(p, joint[0])[0]
    return p[2] - abs(u) if following == 0 else -following * u - p[2]
