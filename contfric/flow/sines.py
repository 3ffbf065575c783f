"""Sines and cosines of several angles at once, in the processor's vectors.

The closed forms ask for those of two or three angles at one time. The C library takes them one after the
other, each call through memory. Here all go through the same arithmetic side by side, within the kernel:

* ``x = n pi/2 + r`` with n whole and ``|r| <= pi/4``: pi/2 in three parts of 33, 33 and 53 bits, so that
  ``n`` times each of the first two is exact, and r is known to twice the digits (W. J. Cody, W. Waite,
  "Software Manual for the Elementary Functions", 1980);
* polynomials of degree 13 and 14 for sin r and cos r (minimax, error below 2^-57; those of fdlibm, Sun
  Microsystems 1993), with what r has beyond a double to first order;
* the quadrant n mod 4 swaps and negates.

The error is below one unit in the last place. Angles beyond 5e5, and what is no number, go to the C library.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.extending import intrinsic

#: The largest angle whose whole quarter turns times 33 bits are exact.
_LARGEST = 5e5
_QUARTERS = 0.6366197723675814
#: pi/2 in parts.
_PARTS = 1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624879595063154e-21
#: Added to a number, it leaves the nearest whole number in the last bits.
_ROUNDS = 6755399441055744.0
_SINE = (
    -1.66666666666666324348e-01,
    8.33333333332248946124e-03,
    -1.98412698298579493134e-04,
    2.75573137070700676789e-06,
    -2.50507602534068634195e-08,
    1.58969099521155010221e-10,
)
_COSINE = (
    4.16666666666666019037e-02,
    -1.38888888888741095749e-03,
    2.48015872894767294178e-05,
    -2.75573143513906633035e-07,
    2.08757232129817482790e-09,
    -1.13596475577881948265e-11,
)
_DOUBLE, _WORD = ir.DoubleType(), ir.IntType(64)


class _Vector:
    """Arithmetic of vectors of one length, or of single numbers."""

    def __init__(self, builder: Any, count: int) -> None:
        self.builder, self.count = builder, count
        self.kind = ir.VectorType(_DOUBLE, count) if count > 1 else _DOUBLE
        self.whole = ir.VectorType(_WORD, count) if count > 1 else _WORD

    def constant(self, value: float) -> Any:
        """Return a number in all places."""
        return ir.Constant(self.kind, [value] * self.count if self.count > 1 else value)

    def integer(self, value: int) -> Any:
        """Return a whole number in all places."""
        return ir.Constant(self.whole, [value] * self.count if self.count > 1 else value)

    def times_plus(self, a: Any, b: Any, c: Any) -> Any:
        """Return ``a b + c``, rounded once where the processor can."""
        name = f"llvm.fmuladd.v{self.count}f64" if self.count > 1 else "llvm.fmuladd.f64"
        kind = ir.FunctionType(self.kind, [self.kind] * 3)
        function = cgutils.get_or_insert_function(self.builder.module, kind, name)
        return self.builder.call(function, [a, b, c])

    def polynomial(self, coefficients: tuple[float, ...], z: Any) -> Any:
        """Return a polynomial, in pairs: half as long a chain as one after the other."""
        square = self.builder.fmul(z, z)
        pairs = [
            self.times_plus(z, self.constant(high), self.constant(low))
            for low, high in zip(coefficients[::2], coefficients[1::2], strict=True)
        ]
        found = pairs.pop()
        while pairs:
            found = self.times_plus(found, square, pairs.pop())
        return found

    def reduced(self, x: Any) -> tuple[Any, Any, Any]:
        """Return the whole quarters (in the last bits), and r with what it has beyond a double."""
        b, parts = self.builder, [self.constant(-part) for part in _PARTS]
        rounds = self.constant(_ROUNDS)
        marked = self.times_plus(x, self.constant(_QUARTERS), rounds)
        n = b.fsub(marked, rounds)
        near = self.times_plus(n, parts[0], x)
        left = self.times_plus(n, parts[1], near)
        lost = self.times_plus(n, parts[1], b.fsub(near, left))
        rest = self.times_plus(n, parts[2], lost)
        r = b.fadd(left, rest)
        return b.bitcast(marked, self.whole), r, b.fadd(b.fsub(left, r), rest)

    def of_remainder(self, r: Any, rest: Any) -> tuple[Any, Any]:
        """Return sine and cosine of ``r + rest``."""
        b, unit = self.builder, self.constant(1.0)
        z = b.fmul(r, r)
        drop = b.fmul(self.constant(0.5), z)
        near = b.fsub(unit, drop)
        sine = self.times_plus(b.fmul(z, r), self.polynomial(_SINE, z), b.fmul(rest, near))
        lost = b.fsub(b.fsub(b.fsub(unit, near), drop), b.fmul(r, rest))
        cosine = self.times_plus(b.fmul(z, z), self.polynomial(_COSINE, z), lost)
        return b.fadd(r, sine), b.fadd(near, cosine)

    def flipped(self, value: Any, quarters: Any) -> Any:
        """Negate where the second last bit is set."""
        b = self.builder
        sign = b.shl(b.and_(quarters, self.integer(2)), self.integer(62))
        return b.bitcast(b.xor(b.bitcast(value, self.whole), sign), self.kind)

    def sines(self, x: Any) -> tuple[Any, Any]:
        """Return sine and cosine of angles that are not too large."""
        b = self.builder
        quarters, r, rest = self.reduced(x)
        sine, cosine = self.of_remainder(r, rest)
        odd = b.icmp_signed("!=", b.and_(quarters, self.integer(1)), self.integer(0))
        one, other = b.select(odd, cosine, sine), b.select(odd, sine, cosine)
        return self.flipped(one, quarters), self.flipped(other, b.add(quarters, self.integer(1)))


def _from_library(builder: Any, angles: list[Any]) -> list[Any]:
    found = []
    for name in ("sin", "cos"):
        kind = ir.FunctionType(_DOUBLE, [_DOUBLE])
        function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.f64")
        found += [builder.call(function, [angle]) for angle in angles]
    return found


def _in_vectors(builder: Any, angles: list[Any]) -> list[Any]:
    count = len(angles)
    width = count if count < 3 else 4
    vector = _Vector(builder, width)
    if count == 1:
        return list(vector.sines(angles[0]))
    places = [ir.Constant(ir.IntType(32), k) for k in range(width)]
    x = ir.Constant(vector.kind, [0.0] * width)
    for place, angle in zip(places, angles, strict=False):
        x = builder.insert_element(x, angle, place)
    both = vector.sines(x)
    return [builder.extract_element(each, place) for each in both for place in places[:count]]


def _all_small(builder: Any, angles: list[Any]) -> Any:
    """Return whether all angles are small enough."""
    kind = ir.FunctionType(_DOUBLE, [_DOUBLE])
    size = cgutils.get_or_insert_function(builder.module, kind, "llvm.fabs.f64")
    found = None
    for angle in angles:
        small = builder.fcmp_ordered(
            "<=", builder.call(size, [angle]), ir.Constant(_DOUBLE, _LARGEST)
        )
        found = small if found is None else builder.and_(found, small)
    return found


def _typed(typing: Any, angles: Any) -> Any:
    count = len(angles)

    def written(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        given = cgutils.unpack_tuple(builder, arguments[0], count)
        with builder.if_else(_all_small(builder, given), likely=True) as (small, large):
            with small:
                one, first = _in_vectors(builder, given), builder.block
            with large:
                two, second = _from_library(builder, given), builder.block
        found = []
        for a, b in zip(one, two, strict=True):
            either = builder.phi(_DOUBLE)
            either.add_incoming(a, first)
            either.add_incoming(b, second)
            found.append(either)
        return context.make_tuple(builder, signature.return_type, found)

    return types.UniTuple(types.float64, 2 * count)(types.UniTuple(types.float64, count)), written


#: ``sines((a, b, ..))``: the sines of up to four angles, then their cosines.
sines: Any = intrinsic(_typed)
