"""Zeros of a system of equations that are proved to exist and to be the only ones in a box.

For ``G(x) = 0`` with Jacobian J, a box ``X = c +- r`` and any matrix C,

    K = c - C G(c) + (I - C J(X)) (X - c) .

If K lies in the interior of X, there is exactly one zero in X, it lies in K, and every matrix in J(X) is
regular. If K and X are disjoint there is no zero. (R. Krawczyk, Computing 4 (1969) 187-201; S. M. Rump,
Acta Numerica 19 (2010) 287-449, theorem 13.3.) C is an approximate inverse of J(c); nothing depends on how
good it is, but whether the proof succeeds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from flint import arb, arb_mat

from contfric.certify.verdict import Verdict
from contfric.models.balls.numbers import Vector, around, column, identity, numbers

#: Residual and Jacobian of a system of equations.
Equations = Callable[[Vector], tuple[Vector, arb_mat]]
#: Newton steps towards the centre: each doubles the digits, from 10 to beyond 1000.
_STEPS = 8
#: The thin box is this many times the last correction: a factor that leaves space for the second order.
_THIN = 4
#: Most steps of Newton's method with one inverse: each adds as many digits as the Jacobian changes little.
_SIMPLE = 16
#: How often the thin box is widened sixteenfold where it was too narrow for rounding.
_WIDER = 6


@dataclass(frozen=True, eq=False)
class Inclusion:
    """What was found in a box.

    Attributes
    ----------
    verdict : whether there is exactly one zero in the box
    zero : an enclosure of it, if it was found
    inverse : the approximate inverse that was used; None if the Jacobian could not be inverted
    why : what kept it from a proof; empty if nothing did
    share : bound of ``|I - C J|``, in the norm in which the box is the unit ball
    """

    verdict: Verdict
    zero: Vector
    inverse: arb_mat | None = None
    why: str = ""
    share: arb | None = None


def approximate_inverse(jacobian: arb_mat) -> arb_mat | None:
    """Return an approximate inverse without error bounds; None where it is not finite."""
    middle, size = jacobian.mid(), jacobian.nrows()
    try:
        inverse = middle.solve(identity(size), algorithm="approx")
    except ZeroDivisionError:
        return None
    return inverse.mid() if all(x.is_finite() for x in inverse.entries()) else None


def krawczyk(
    equations: Equations,
    centre: Vector,
    radii: Vector,
    inverse: arb_mat | None = None,
    at_centre: tuple[Vector, arb_mat] | None = None,
) -> Inclusion:
    """Look for the zero in a box.

    Parameters
    ----------
    centre : exact numbers
    radii : the half-widths of the box
    inverse : approximate inverse of the Jacobian at the centre; computed where it is not given
    at_centre : residual and Jacobian there, if they are known
    """
    residual, jacobian = at_centre or equations(centre)
    if inverse is None:
        inverse = approximate_inverse(jacobian)
    if inverse is None:
        return Inclusion(Verdict.UNDECIDED, [], why="the Jacobian cannot be inverted")
    box = [around(c, r) for c, r in zip(centre, radii, strict=True)]
    _, wide = equations(box)
    offset = column([arb(0, r.abs_upper()) for r in radii])
    size = len(centre)
    spread = (identity(size) - inverse * wide) * offset
    moved = numbers(spread - inverse * column(residual))
    if all(k.abs_upper() < r.abs_lower() for k, r in zip(moved, radii, strict=True)):
        zero = [c + k for c, k in zip(centre, moved, strict=True)]
        return Inclusion(Verdict.PROVED, zero, inverse, share=_weighted(numbers(spread), radii))
    if any(
        k.is_finite() and k.abs_lower() > r.abs_upper() for k, r in zip(moved, radii, strict=True)
    ):
        return Inclusion(Verdict.REFUTED, [], inverse, "the box holds no zero")
    return Inclusion(Verdict.UNDECIDED, [], inverse, "the Jacobian changes too much over the box")


def _weighted(values: Vector, radii: Vector) -> arb:
    """Return a bound of the largest modulus, each over its half-width."""
    shares = (abs(v).upper() / r.abs_lower() for v, r in zip(values, radii, strict=True))
    return max((share.upper() for share in shares), key=float)


def narrowed(
    residual: Callable[[Vector], Vector], found: Inclusion, centre: Vector, radii: Vector
) -> Vector | None:
    """Return a narrow enclosure of the only zero of a box, from residuals alone; None if there is no zero.

    For c in the box, ``x - c = (I - C J)(x - c) - C G(c)`` with J in the Jacobians of the box. In the norm
    in which that is the unit ball, ``|x - c| <= |C G(c)| / (1 - share)``.

    Parameters
    ----------
    found : what Krawczyk's operator has shown of the box
    centre, radii : the box
    """
    if found.inverse is None or found.share is None or not found.share < 1:
        return None
    x, last = [c.mid() for c in found.zero], None
    for _ in range(_SIMPLE):
        step = numbers(found.inverse * column(residual(x)))
        size = _weighted(step, radii)
        if last is not None and not size < last / 2:
            break
        x, last = [(c - s).mid() for c, s in zip(x, step, strict=True)], size
    else:
        return None
    error = size / (1 - found.share)
    zero = [around(c, error * r) for c, r in zip(x, radii, strict=True)]
    within = zip(zero, centre, radii, strict=True)
    return zero if all(abs(z - c) < r for z, c, r in within) else None


def refined(equations: Equations, start: Vector) -> tuple[Vector, Vector] | None:
    """Return Newton's limit, as exact numbers, and the moduli of the last correction.

    None where an iterate is not finite or the Jacobian singular.
    """
    x, last = [c.mid() for c in start], None
    for _ in range(_STEPS):
        residual, jacobian = equations(x)
        try:
            step = numbers(jacobian.mid().solve(column(residual).mid(), algorithm="approx"))
        except ZeroDivisionError:
            return None
        if not all(s.is_finite() for s in step):
            return None
        x = [(c - s).mid() for c, s in zip(x, step, strict=True)]
        size = max((s.abs_upper() for s in step), key=float)
        if last is not None and not size < last / 2:
            return x, [s.abs_upper() for s in step]
        last = size
    return x, [s.abs_upper() for s in step]


def enclosed(equations: Equations, start: Vector, tiny: arb) -> Inclusion:
    """Return a narrow enclosure of the zero next to a start, with the proof that it exists.

    Parameters
    ----------
    tiny : least half-width, relative to 1 + the size of each number: a little more than rounding
    """
    found = refined(equations, start)
    if found is None:
        why = "a step of Newton's method is not finite, or its Jacobian singular"
        return Inclusion(Verdict.UNDECIDED, [], why=why)
    centre, steps = found
    radii = [_THIN * s + tiny * (1 + c.abs_upper()) for c, s in zip(centre, steps, strict=True)]
    for _ in range(_WIDER):
        inclusion = krawczyk(equations, centre, radii)
        if inclusion.verdict is Verdict.PROVED or inclusion.inverse is None:
            return inclusion
        radii = [16 * r for r in radii]
    return inclusion
