"""Balls: real numbers that are known up to a radius (Arb, by python-flint).

Every operation on balls returns a ball that contains the results for all numbers in its arguments. So an
inequality that holds for balls holds for the numbers.

F. Johansson, Arb: efficient arbitrary-precision midpoint-radius interval arithmetic, IEEE Trans. Comput. 66
(2017) 1281-1292.
"""

from __future__ import annotations

import copyreg
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from threading import RLock

from flint import acb, arb, arb_mat, ctx

Vector = list[arb]

#: The working precision of flint belongs to the whole process: who sets it keeps all others waiting.
_PRECISION = RLock()
#: Bits of the mantissa of a radius (``MAG_BITS`` of Arb).
_RADIUS_BITS = 30


@contextmanager
def working(bits: int) -> Iterator[None]:
    """Compute with so many bits, in one thread at a time (``flint.ctx.workprec`` alone is for one thread)."""
    with _PRECISION, ctx.workprec(bits):
        yield


def _restored(mantissa: int, exponent: int, radius: int, scale: int) -> arb:
    return arb((mantissa, exponent), (radius, scale))


def _reduced(ball: arb) -> tuple[object, tuple[object, ...]]:
    """Return how a ball is pickled: exactly (python-flint pickles none)."""
    if not ball.is_finite():
        return arb, ("nan" if ball.mid().is_nan() else "[+/- inf]",)
    mantissa, exponent = (int(part) for part in ball.mid().man_exp())
    radius, scale = (int(part) for part in ball.rad().man_exp())
    # Arb rounds a radius of 30 bits up by one in the last: what is one less gives it back
    shift = max(_RADIUS_BITS - radius.bit_length(), 0)
    wide, fine = radius << shift, scale - shift
    for pair in ((radius, scale), (wide - 1, fine), (2 * wide - 1, fine - 1)):
        if _restored(mantissa, exponent, *pair).rad() == ball.rad():
            return _restored, (mantissa, exponent, *pair)
    return _restored, (mantissa, exponent, radius, scale)  # contains the ball


def _reduced_disc(disc: acb) -> tuple[object, tuple[object, ...]]:
    return acb, (disc.real, disc.imag)


copyreg.pickle(arb, _reduced)  # type: ignore[arg-type] # the stub knows classes of Python only
copyreg.pickle(acb, _reduced_disc)  # type: ignore[arg-type]


def column(values: Sequence[arb]) -> arb_mat:
    """Return numbers as a matrix of one column."""
    return arb_mat(len(values), 1, list(values))


def numbers(matrix: arb_mat) -> Vector:
    """Return the entries of a matrix, row by row."""
    return list(matrix.entries())


def identity(size: int) -> arb_mat:
    """Return the identity matrix."""
    return arb_mat(size, size, 1)


def dot(a: Sequence[arb], b: Sequence[arb]) -> arb:
    """Return the scalar product."""
    return sum((x * y for x, y in zip(a, b, strict=True)), arb(0))


def around(centre: arb, radius: arb) -> arb:
    """Return a ball that contains all numbers within a radius of a centre (itself a ball, or exact)."""
    return centre + arb(0, radius.abs_upper())


def zeros(rows: int, columns: int) -> list[Vector]:
    """Return rows of zeros that can be filled."""
    zero = arb(0)  # no ball is changed in its place
    return [[zero] * columns for _ in range(rows)]


def row_norm(matrix: arb_mat) -> arb:
    """Return an upper bound of the largest row sum of moduli: the operator norm of the maximum norm."""
    rows, columns = matrix.nrows(), matrix.ncols()
    sums = [
        sum((matrix[i, j].abs_upper() for j in range(columns)), arb(0)).upper() for i in range(rows)
    ]
    return max(sums, key=float)
