r"""A function of time along a segment, resolved on Gauss panels: nothing is sampled.

On a panel the function is known at the 16 nodes of Gauss and Legendre, and with it its Legendre series. A
panel is halved until the last coefficients of the series are below :data:`RESOLVED` of the largest value:
for a smooth function coefficients fall geometrically, and the integral, exact to twice the degree, then is
good to the square of that, which is rounding (L. N. Trefethen, Approximation Theory and Approximation
Practice, SIAM 2013, chapter 19). Where an argument of ``abs``, ``sign`` or ``where`` changes its sign the
panel is cut at that root, found by Brent's method to the last digits, so that kinks and jumps lie at ends
of panels.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from contfric.errors import ContfricError
from contfric.models.definition import FloatArray
from contfric.quantities.duals import Dual, Kinks
from contfric.quantities.motion import Segment

#: Nodes of a panel: a segment of half a period of the excitation is resolved by one panel, or two.
_NODES = 16
#: Last coefficients of a series, relative to the largest value: the square of it is rounding. Of an
#: integrated flow no better than its rounding, a hundred times over.
RESOLVED, _UNITS = 1e-9, 100.0
#: Rounding of a function, relative to its largest value on the orbit.
_ROUNDING = 1e-16
#: Coefficients that no longer fall when a panel is halved are noise of the integrator, if they are below this
#: share of the largest value; a kink or a jump that nobody noted has larger ones.
_NOISE, _FALLS, _HALVED = 1e-4, 0.7, 4
#: Halvings of a segment: a billionth of its duration holds nothing that a quantity could feel.
_DEEPEST = 30
#: An argument of a kink this small, relative to its largest value, has no sign: at a joint it is rounding.
_NO_SIGN = 1e-12
#: Distance from a jump at which its sides are evaluated, as a share of the segment: far above rounding, far
#: below anything that changes.
_BESIDE = 1e-12

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(_NODES)
#: From the values at the nodes to the coefficients of the Legendre series.
_SERIES = (
    (np.arange(_NODES) + 0.5)[:, None]
    * np.polynomial.legendre.legvander(_POINTS, _NODES - 1).T
    * _WEIGHTS
)

#: A function of time along a segment, at nodes; the arguments of its kinks are noted.
Function = Callable[[Segment, FloatArray, Kinks], Dual]


@dataclass(frozen=True, eq=False)
class Panel:
    """Part of a segment on which a function is resolved.

    Attributes
    ----------
    low, high : its ends, as shares of the segment
    values : at the nodes, shape (nodes,), with derivatives
    """

    low: float
    high: float
    values: Dual

    def integral(self, segment: Segment) -> Dual:
        """Return the integral over the panel by time, where its ends are fixed shares of the segment."""
        half = 0.5 * (self.high - self.low)
        mean = half * (_WEIGHTS @ self.values.values)
        slopes = half * (_WEIGHTS @ self.values.slopes) * segment.lasts
        if segment.exact:
            slopes[:-1] += mean * segment.d_lasts
        return Dual(np.array([mean * segment.lasts]), slopes[None, :])

    def stationary(self) -> FloatArray:
        """Return the shares of the segment at which the function is stationary inside of the panel."""
        rate = np.polynomial.legendre.legder(_SERIES @ self.values.values)
        size = np.max(np.abs(rate))
        last = np.flatnonzero(np.abs(rate) > 1e-14 * size)  # rounding has roots anywhere
        if size == 0.0 or not len(last):
            return np.empty(0)
        roots = np.polynomial.legendre.legroots(rate[: last[-1] + 1])
        real = roots.real[(np.abs(roots.imag) < 1e-6) & (np.abs(roots.real) <= 1.0 + 1e-9)]
        inside = self.low + 0.5 * (np.clip(np.sort(real), -1.0, 1.0) + 1.0) * (self.high - self.low)
        return np.asarray(inside)


@dataclass(frozen=True)
class Cut:
    """A share of a segment at which an argument of a kink changes its sign; ``number`` says which one."""

    share: float
    number: int


@dataclass(eq=False)
class Resolved:
    """A function on a segment: its panels, and the cuts at kinks and jumps between them."""

    segment: Segment
    function: Function
    what: str
    panels: list[Panel] = field(default_factory=list)
    cuts: list[Cut] = field(default_factory=list)

    def value(self, shares: FloatArray) -> Dual:
        """Return the function at some shares of the segment."""
        return self.function(self.segment, shares, Kinks())

    def integral(self) -> Dual:
        """Return the integral over the segment by time; moving jumps contribute to its derivatives."""
        zero = Dual(np.zeros(1), np.zeros((1, self.segment.d_start.size + int(self.segment.exact))))
        total = sum((panel.integral(self.segment) for panel in self.panels), zero)
        if self.segment.exact:
            for cut in self.cuts:
                total = total + self._moving(cut)
        return total

    def _moving(self, cut: Cut) -> Dual:
        """Return what the motion of a jump adds: the jump times how far its time moves against the segment.

        At the jump the argument a is zero; a fixed share moves it by da, time by its rate, so that the jump
        moves by -da / rate against that share.
        """
        sides = self.value(np.array([cut.share - _BESIDE, cut.share + _BESIDE]))
        jump = sides.values[0] - sides.values[1]
        slopes = np.zeros((1, sides.slopes.shape[1]))
        if abs(jump) > 1e3 * _BESIDE * (1.0 + np.max(np.abs(sides.values))):
            kinks = Kinks()
            self.function(self.segment, np.array([cut.share]), kinks)
            moved = kinks.arguments[cut.number].slopes[0]
            if moved[-1] == 0.0:
                raise ContfricError(
                    f"{self.what} jumps where its condition is only touched: it has no derivative there"
                )
            slopes[0, :-1] = -jump * moved[:-1] / moved[-1]
        return Dual(np.zeros(1), slopes)


def least_size(segments: Sequence[Segment], function: Function) -> float:
    """Return the size below which values of a function are rounding of those elsewhere on the orbit."""
    shares, largest = 0.5 * (_POINTS + 1.0), 0.0
    for segment in segments:
        if segment.lasts > 0.0:
            with np.errstate(all="ignore"):
                values = function(segment, shares, Kinks()).values
            largest = max(largest, float(np.max(np.abs(values))))
    return _ROUNDING / RESOLVED * largest if np.isfinite(largest) else 0.0


def resolve(segment: Segment, function: Function, what: str, size: float = 0.0) -> Resolved:
    """Resolve a function on a segment.

    Parameters
    ----------
    what : the function's name, for messages
    size : values below it are rounding (:func:`least_size`): a slide that has just appeared has no others

    Raises
    ------
    ContfricError
        If it is not finite, or nothing resolves it.
    """
    found = Resolved(segment, function, what)
    if segment.lasts > 0.0:
        _resolve(found, 0.0, 1.0, 0, size, np.inf)
    return found


def _resolve(
    found: Resolved, low: float, high: float, depth: int, size: float, before: float
) -> None:
    """Resolve a part of a segment; ``before`` is the share of noise of the part that it is a half of."""
    shares = low + 0.5 * (high - low) * (_POINTS + 1.0)
    kinks = Kinks()
    with np.errstate(all="ignore"):
        values = found.function(found.segment, shares, kinks)
    if not (np.all(np.isfinite(values.values)) and np.all(np.isfinite(values.slopes))):
        time = found.segment.start + shares[0] * found.segment.lasts
        raise ContfricError(
            f"{found.what} has no finite value in segment {found.segment.index + 1} near t = {time:.6g}"
        )
    cut = _change(found, shares, kinks)
    if cut is not None and low < cut.share < high:
        found_size = max(size, float(np.max(np.abs(values.values))))
        _resolve(found, low, cut.share, depth, found_size, np.inf)
        found.cuts.append(cut)
        _resolve(found, cut.share, high, depth, found_size, np.inf)
        return
    size = max(size, float(np.max(np.abs(values.values))))
    left, level = _left(values, size), max(RESOLVED, _UNITS * found.segment.model.rounding)
    noise = depth >= _HALVED and _FALLS * before < left < _NOISE
    if left <= level or noise:
        found.panels.append(Panel(low, high, values))
    elif depth == _DEEPEST:
        time = found.segment.start + low * found.segment.lasts
        raise ContfricError(
            f"{found.what} is not smooth near t = {time:.12g}: no panel resolves it"
        )
    else:
        middle = 0.5 * (low + high)
        _resolve(found, low, middle, depth + 1, size, left)
        _resolve(found, middle, high, depth + 1, size, left)


def _left(values: Dual, size: float) -> float:
    """Return the last coefficients of the series, relative to the largest values; of derivatives too."""
    columns = np.column_stack([values.values, values.slopes])
    tail = np.max(np.abs(_SERIES[-2:] @ columns), axis=0)
    sizes = np.max(np.abs(columns), axis=0)
    sizes[0] = max(sizes[0], size)
    return float(np.max(tail / np.maximum(np.maximum(sizes, size), 1e-300)))


def _change(found: Resolved, shares: FloatArray, kinks: Kinks) -> Cut | None:
    """Return the first root of an argument of a kink between nodes; None if no sign changes."""
    best: tuple[float, int, float] | None = None
    for number, argument in enumerate(kinks.arguments):
        a = argument.values
        clear = np.flatnonzero(np.abs(a) > _NO_SIGN * (1.0 + np.max(np.abs(a))))
        for j, k in pairwise(clear.tolist()):
            if a[j] * a[k] < 0.0 and (best is None or shares[j] < best[0]):
                best = shares[j], number, shares[k]
    if best is None:
        return None
    from scipy.optimize import brentq

    low, number, high = best

    def argument_at(share: float) -> float:
        noted = Kinks()
        found.function(found.segment, np.array([share]), noted)
        return float(noted.arguments[number].values[0])

    # to the last digits of a share
    return Cut(float(brentq(argument_at, low, high, xtol=1e-16, rtol=1e-15)), number)
