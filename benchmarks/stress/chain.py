"""Orbits of the oscillator in 50 digits, from formulas of their own.

At every joint of an orbit the mass is at rest: a slide ends where v = 0, a stick where
``|x - f(t)| = S0``. So an orbit is the list of the instants and positions ``z_i = (t_i, x_i)`` of its
joints, with two equations a segment::

    slide in direction s:  X(t_i, x_i; t_{i+1}) = x_{i+1},  V(t_i, x_i; t_{i+1}) = 0
    stick:                 x_i = x_{i+1},                   x_{i+1} - f(t_{i+1}) = side S0

and the closure ``z_N = (t_0 + turn, x_0)``, or ``(t_0 + turn, -x_0)`` after half of a symmetric orbit.
X and V are those of a textbook: undetermined coefficients, and the free solution that makes up the
difference. They cancel next to resonance; there are digits to be spent.

Of contfric's results only the order of the segments and a start for Newton are used.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from mpmath import mp, mpf
from numpy.typing import NDArray

import contfric as cf

#: Working digits. The worst case is a frequency 1e-16 off resonance: 1/(1 - w^2) costs 16 digits
#: in the response and 16 more in its difference; more than 60 are left.
DIGITS = 100
#: Corrections below this end Newton's iteration: 50 digits.
SMALLEST = mpf(10) ** -50
NAMES = ("Omega", "S", "S0", "h", "zeta")

Joint = tuple[Any, Any]
FloatArray = NDArray[np.float64]


class NoReference(Exception):
    """The reference did not converge; the text says why."""


def force(p: Sequence[Any], t: Any) -> tuple[Any, Any, Any]:
    """Return f, f' and f''."""
    w, h = p[0], p[3]
    c, s = mp.cos_sin(w * t)
    c3, s3 = mp.cos_sin(3 * w * t)
    return c + h * c3, -w * (s + 3 * h * s3), -w * w * (c + 9 * h * c3)


def free(zeta: Any, d: Any) -> tuple[Any, Any, Any]:
    """Return the free solution after d: x from x0 = 1, x from v0 = 1, v from v0 = 1.

    (The fourth, v from x0 = 1, is minus the second.)
    """
    decay = mp.exp(-zeta * d)
    if zeta == 1:
        c, s = mpf(1), d
    else:
        root = mp.sqrt(abs(1 - zeta * zeta))
        c = mp.cos(root * d) if zeta < 1 else mp.cosh(root * d)
        s = (mp.sin(root * d) if zeta < 1 else mp.sinh(root * d)) / root
    return decay * (c + zeta * s), decay * s, decay * (c - zeta * s)


def particular(p: Sequence[Any], s: int, t: Any, since: Any) -> tuple[Any, Any]:
    """Return a particular solution at t; at resonance without damping it grows from ``since``."""
    w, S, _, h, zeta = p
    x, v = -s * S, mpf(0)
    for k, size in ((1, mpf(1)), (3, h)):
        if size == 0:
            continue
        kw = k * w
        c, sine = mp.cos_sin(kw * t)
        real, imaginary = 1 - kw * kw, 2 * zeta * kw
        below = real * real + imaginary * imaginary
        if below == 0:  # x'' + x = cos t
            x += size * (t - since) * sine / 2
            v += size * (sine + (t - since) * c) / 2
        else:
            x += size * (real * c + imaginary * sine) / below
            v += size * kw * (imaginary * c - real * sine) / below
    return x, v


def slide(p: Sequence[Any], s: int, start: Joint, t: Any) -> tuple[Any, Any, tuple[Any, Any, Any]]:
    """Return x and v at t of a slide from rest, and the free solution in between."""
    t0, x0 = start
    x1, v1 = particular(p, s, t, t0)
    xa, va = particular(p, s, t0, t0)
    g11, g12, g22 = free(p[4], t - t0)
    a, b = x0 - xa, -va
    return x1 + a * g11 + b * g12, v1 - a * g12 + b * g22, (g11, g12, g22)


def acceleration(p: Sequence[Any], s: int, joint: Joint) -> Any:
    """Return the acceleration of a slide at rest."""
    return force(p, joint[0])[0] - joint[1] - s * p[1]


@dataclass(frozen=True)
class Piece:
    """Residuals of one segment and their derivatives with respect to its two joints."""

    residual: tuple[Any, Any]
    a: tuple[tuple[Any, Any], tuple[Any, Any]]
    b: tuple[tuple[Any, Any], tuple[Any, Any]]


@dataclass(frozen=True)
class Chain:
    """The equations of one itinerary.

    Attributes
    ----------
    modes : direction of each segment: +1, -1, or 0 for a stick
    sides : side at which each stick is left; 0 for a slide
    turns : duration of one turn in periods
    sign : of the closure: -1 after half of a symmetric orbit
    """

    modes: tuple[int, ...]
    sides: tuple[int, ...]
    turns: Any
    sign: int

    @classmethod
    def of(cls, orbit: cf.Orbit) -> Chain:
        """Return the chain of an orbit's itinerary, on its half if it is solved there."""
        mode = {"slide+": 1, "slide-": -1, "stick": 0}
        side = {"F+": 1, "F-": -1, "v": 0}
        itinerary, half = orbit.system.itinerary, orbit.system.half
        turns = mpf(orbit.periods) / (2 if half else 1)
        modes, exits = zip(*itinerary, strict=True)
        return cls(
            tuple(mode[m] for m in modes),
            tuple(side[e] for e in exits),
            turns,
            -1 if half else 1,
        )

    def __len__(self) -> int:
        return len(self.modes)

    def closed(self, z: Sequence[Joint], p: Sequence[Any]) -> list[Joint]:
        """Return the joints and the closure of the first."""
        return [*z, (z[0][0] + self.turns * 2 * mp.pi / p[0], self.sign * z[0][1])]

    def piece(self, i: int, a: Joint, b: Joint, p: Sequence[Any]) -> Piece:
        """Return the equations of one segment."""
        s = self.modes[i]
        if s == 0:
            f, rate, _ = force(p, b[0])
            return Piece((a[1] - b[1], b[1] - f - self.sides[i] * p[2]), ((0, 1), (0, 0)), (
                (0, -1),
                (-rate, 1),
            ))  # fmt: skip
        x, v, (g11, g12, g22) = slide(p, s, a, b[0])
        before = acceleration(p, s, a)  # a later start is a push -a0 dt at the same place
        after = force(p, b[0])[0] - x - s * p[1] - 2 * p[4] * v
        return Piece((x - b[1], v), ((-before * g12, g11), (-before * g22, -g12)), (
            (v, -1),
            (after, 0),
        ))  # fmt: skip

    def pieces(self, z: Sequence[Joint], p: Sequence[Any]) -> list[Piece]:
        """Return the equations of all segments."""
        closed = self.closed(z, p)
        return [self.piece(i, closed[i], closed[i + 1], p) for i in range(len(self))]

    def jacobian(self, pieces: Sequence[Piece], mu: float = 1.0) -> FloatArray:
        """Return the Jacobian on the joints; ``mu`` multiplies the closure (1: the equations)."""
        n = len(self)
        full = np.zeros((2 * n, 2 * n))
        for i, piece in enumerate(pieces):
            rows, j = slice(2 * i, 2 * i + 2), (i + 1) % n
            b = np.array(piece.b, dtype=float)
            if i == n - 1:
                b = mu * b @ np.diag([1.0, float(self.sign)])
            full[rows, rows] += np.array(piece.a, dtype=float)
            full[rows, 2 * j : 2 * j + 2] += b
        return full

    def turn_map(self, pieces: Sequence[Piece]) -> tuple[Any, Any]:
        """Return trace and determinant of the derivative of one turn on (t_0, x_0)."""
        m = mp.eye(2)
        for piece in pieces:
            m = mp.inverse(mp.matrix(piece.b)) * mp.matrix(piece.a) * m * -1
        m = mp.diag([1, self.sign]) * m
        return m[0, 0] + m[1, 1], m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0]


def parameters(orbit: cf.Orbit) -> tuple[Any, ...]:
    """Return the parameters, exactly."""
    return tuple(mpf(orbit.params[name]) for name in NAMES)


def joints_of(orbit: cf.Orbit) -> list[Joint]:
    """Return the joints of one turn, exactly."""
    return [(mpf(t), mpf(x)) for t, x, _ in orbit.joints.tolist()]


def flat(z: Sequence[Joint]) -> list[Any]:
    """Return joints as a list of unknowns."""
    return [value for joint in z for value in joint]


def paired(y: Sequence[Any]) -> list[Joint]:
    """Return a list of unknowns as joints."""
    return list(zip(y[::2], y[1::2], strict=True))


def newton(
    residual: Callable[[list[Any]], list[Any]],
    jacobian: Callable[[list[Any]], FloatArray],
    y: list[Any],
) -> list[Any]:
    """Solve ``residual(y) = 0`` to 50 digits.

    The Jacobian in double precision is kept while every correction has at least a tenth of the size
    of the one before: each gains as many digits as it is exact, and its rounding does not matter.
    """
    y, last, fresh = list(y), mp.inf, 0
    inverse = inverse_of(jacobian(y))
    for _ in range(100):  # twelve digits a correction if well conditioned; one digit at worst
        r = residual(y)
        scale = max(map(abs, r))
        if scale == 0:
            return y
        step = inverse @ np.array([float(v / scale) for v in r])
        size = scale * float(np.max(np.abs(step)))
        y = [value - scale * mpf(d) for value, d in zip(y, step.tolist(), strict=True)]
        if size < SMALLEST:
            return y
        if not size < last / 10:
            fresh += 1
            if fresh > 8 or not size < 1:
                raise NoReference(f"Newton is lost at a correction of {mp.nstr(size, 3)}")
            inverse = inverse_of(jacobian(y))
        last = size
    raise NoReference("Newton is too slow: the system is singular to rounding")


def inverse_of(matrix: FloatArray) -> FloatArray:
    """Return the inverse of a Jacobian.

    Raises
    ------
    NoReference
        If it is singular.
    """
    try:
        with np.errstate(all="ignore"):
            return np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        raise NoReference("the system is singular") from None


@dataclass(frozen=True)
class Exact:
    """An orbit in 50 digits: its chain, parameters and joints, with the equations there."""

    chain: Chain
    p: tuple[Any, ...]
    z: tuple[Joint, ...]
    pieces: tuple[Piece, ...]

    def moved(self, z: Sequence[Joint]) -> Exact:
        """Return the same with other joints (not solved)."""
        return replace(self, z=tuple(z), pieces=tuple(self.chain.pieces(z, self.p)))


def solve(orbit: cf.Orbit) -> Exact:
    """Return the orbit next to a computed one.

    Raises
    ------
    NoReference
        If Newton does not converge from there.
    """
    chain, p = Chain.of(orbit), parameters(orbit)

    def residual(y: list[Any]) -> list[Any]:
        return [r for piece in chain.pieces(paired(y), p) for r in piece.residual]

    def jacobian(y: list[Any]) -> FloatArray:
        return chain.jacobian(chain.pieces(paired(y), p))

    z = paired(newton(residual, jacobian, flat(joints_of(orbit))))
    return Exact(chain, p, tuple(z), tuple(chain.pieces(z, p)))
