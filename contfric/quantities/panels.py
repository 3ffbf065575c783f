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

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.interrupts import whole
from contfric.errors import ContfricError
from contfric.models.definition import Model
from contfric.quantities.duals import Dual, Kinks
from contfric.quantities.motion import IndexArray, MeasuredSegment, Pieces, Place

#: Nodes of a panel: a segment of half a period of the excitation is resolved by one panel, or two.
NODES = 16
#: Last coefficients of a series, relative to the largest value: the square of it is rounding. Of an
#: integrated flow no better than its rounding, a hundred times over.
RESOLVED, _UNITS = 1e-9, 100.0
#: Rounding of a function, relative to its largest value on the orbit.
ROUNDING = 1e-16
#: Coefficients that no longer fall when a panel is halved are noise of the integrator, if they are below this
#: share of the largest value; a kink or a jump that nobody noted has larger ones.
NOISE, FALLS, HALVED = 1e-4, 0.7, 4
#: Halvings of a segment: a billionth of its duration holds nothing that a quantity could feel.
DEEPEST = 30
#: Duration of a panel, relative to 1 + its time, within which nodes are hardly told apart: the rounding of
#: the time, a thousand times over. What is sampled there is noise, and as good as any value of the function.
_NO_TIME = 1e3 * float(np.finfo(float).eps)
#: An argument of a kink this small, relative to its largest value, has no sign: at a joint it is rounding.
_NO_SIGN = 1e-12
#: Distance from a jump at which its sides are evaluated, as a share of the segment: far above rounding, far
#: below anything that changes.
_NEARBY = 1e-12


def gauss_rule(nodes: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return points and weights of Gauss' formula, and the matrix from values to the Legendre series."""
    points, weights = np.polynomial.legendre.leggauss(nodes)
    values = np.polynomial.legendre.legvander(points, nodes - 1).T * weights
    return points, weights, (np.arange(nodes) + 0.5)[:, None] * values


#: Points and weights on a panel; from the values there to the coefficients of the Legendre series.
POINTS, WEIGHTS, SERIES = gauss_rule(NODES)

#: A function of time along segments, at nodes; the arguments of its kinks are noted.
Function = Callable[[Place, FloatArray, Kinks], Dual]


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

    def stationary(self) -> FloatArray:
        """Return the shares of the segment at which the function is stationary inside of the panel."""
        rate = np.polynomial.legendre.legder(SERIES @ self.values.values)
        size = np.max(np.abs(rate))
        last = np.flatnonzero(np.abs(rate) > 1e-14 * size)  # rounding has roots anywhere
        if size == 0.0 or not len(last):
            return np.empty(0)
        roots = np.polynomial.legendre.legroots(rate[: last[-1] + 1])
        real = roots.real[(np.abs(roots.imag) < 1e-6) & (np.abs(roots.real) <= 1.0 + 1e-9)]
        inside = self.low + 0.5 * (np.clip(np.sort(real), -1.0, 1.0) + 1.0) * (self.high - self.low)
        return np.asarray(inside)


@dataclass(frozen=True)
class ArgumentZero:
    """A share of a segment at which an argument of a kink changes its sign; ``number`` says which one."""

    share: float
    number: int


@dataclass(eq=False)
class Resolved:
    """A function on a segment: its panels, and the cuts at kinks and jumps between them."""

    segment: MeasuredSegment
    function: Function
    what: str
    panels: list[Panel] = field(default_factory=list)
    cuts: list[ArgumentZero] = field(default_factory=list)

    def value(self, shares: FloatArray) -> Dual:
        """Return the function at some shares of the segment."""
        return self.function(self.segment, shares, Kinks())

    def jumps(self) -> FloatArray:
        """Return what jumps that move add to the derivatives of the integral, shape (D,)."""
        found = np.zeros(self.segment.d_vector.shape[1])
        for cut in self.cuts if self.segment.exact else ():
            found += self._moving(cut)
        return found

    def _moving(self, cut: ArgumentZero) -> FloatArray:
        """Return what the solution of a jump adds: the jump times how far its time moves against the segment.

        At the jump the argument a is zero; a fixed share moves it by da, time by its rate, so that the jump
        moves by -da / rate against that share.
        """
        sides = self.value(np.array([cut.share - _NEARBY, cut.share + _NEARBY]))
        jump = sides.values[0] - sides.values[1]
        if abs(jump) <= 1e3 * _NEARBY * (1.0 + np.max(np.abs(sides.values))):
            return np.zeros(sides.slopes.shape[1] - 1)
        kinks = Kinks()
        self.function(self.segment, np.array([cut.share]), kinks)
        moved = kinks.arguments[cut.number].slopes[0]
        if moved[-1] == 0.0:
            raise ContfricError(
                f"{self.what} jumps where its condition is only touched: it has no derivative there"
            )
        return np.asarray(-jump * moved[:-1] / moved[-1])


@dataclass(frozen=True, eq=False)
class _PanelPart:
    """A part of a segment to resolve; ``before`` is the share of noise of the part that it is a half of."""

    index: int
    low: float
    high: float
    depth: int = 0
    size: float = 0.0
    before: float = math.inf


@dataclass(frozen=True, eq=False)
class _Sampled:
    """A function at the nodes of P parts, its values and derivatives as columns.

    Attributes
    ----------
    columns : shape (P, nodes, 1 + columns of slopes)
    tail, sizes : the last coefficients of the series, and the largest values, shape (P, 1 + ...)
    kinks : arguments of kinks that change their sign, of the parts where one does
    """

    columns: FloatArray
    tail: FloatArray
    sizes: FloatArray
    kinks: dict[int, list[Dual]]

    def values(self, k: int) -> Dual:
        """Return the function at the nodes of a part."""
        return Dual(self.columns[k, :, 0].copy(), self.columns[k, :, 1:].copy())


def evaluated(
    pieces: Pieces, function: Function, where: IndexArray, shares: FloatArray, by_mode: bool
) -> Iterator[tuple[IndexArray, Dual, Kinks]]:
    """Yield a function at shares of segments, and which of them these are: all at once, or mode by mode."""
    groups: dict[str, list[int]] = {}
    for k, index in enumerate(where.tolist() if by_mode else ()):
        groups.setdefault(pieces.segments[index].mode, []).append(k)
    for rows in [np.array(g) for g in groups.values()] or [np.arange(len(where))]:
        kinks = Kinks()
        with np.errstate(all="ignore"):
            found = function(pieces.nodes(where[rows]), shares[rows], kinks)
        yield rows, found, kinks


def resolved_level(model: Model) -> float:
    """Return the share of the last coefficients at which a panel is resolved."""
    return max(RESOLVED, _UNITS * model.rounding)


def least_size(pieces: Pieces, function: Function) -> float:
    """Return the size below which values of a function, the same in all modes, are rounding of others."""
    parts = _whole(pieces)
    return _least(_sampled(pieces, function, parts, False)) if parts else 0.0


def resolve(
    pieces: Pieces, function: Function, what: str, size: float = 0.0, by_mode: bool = False
) -> list[Resolved]:
    """Resolve a function on segments: all their parts at once, then the halves of those that need it.

    Parameters
    ----------
    what : the function's name, for messages
    size : values below it are rounding (:func:`least_size`): a slide that has just appeared has no others;
        as are those below what is rounding of the function itself
    by_mode : whether the function is another one in each mode

    Raises
    ------
    ContfricError
        If it is not finite, or nothing resolves it.
    """
    found = [Resolved(segment, function, what) for segment in pieces.segments]
    parts = _whole(pieces)
    least: float | None = None  # of the function itself, known from whole segments
    while parts:
        sampled = _sampled(pieces, function, parts, by_mode)
        least = max(size, _least(sampled)) if least is None else least
        sizes = np.array([max(least, part.size) for part in parts])
        sizes = np.maximum(sizes, sampled.sizes[:, 0])
        own = np.maximum(np.maximum(sampled.sizes, sizes[:, None]), 1e-300)
        left = np.max(sampled.tail / own, axis=1)
        parts = [
            further
            for k, part in enumerate(parts)
            for further in _judged(
                found[part.index], part, sampled, k, float(sizes[k]), float(left[k])
            )
        ]
    for each in found:
        each.panels.sort(key=lambda panel: panel.low)
        each.cuts.sort(key=lambda cut: cut.share)
    return found


def _whole(pieces: Pieces) -> list[_PanelPart]:
    return [_PanelPart(k, 0.0, 1.0) for k, s in enumerate(pieces.segments) if s.lasts > 0.0]


def _least(sampled: _Sampled) -> float:
    largest = 0.0
    for value in sampled.sizes[:, 0].tolist():
        largest = max(largest, value)
    return ROUNDING / RESOLVED * largest if np.isfinite(largest) else 0.0


def _sampled(
    pieces: Pieces, function: Function, parts: list[_PanelPart], by_mode: bool
) -> _Sampled:
    """Return a function at the nodes of some parts."""
    where = np.repeat(np.array([part.index for part in parts], dtype=np.int64), NODES)
    low, high = np.array([[part.low, part.high] for part in parts]).T[:, :, None]
    shares = (low + 0.5 * (high - low) * (POINTS + 1.0)).ravel()
    columns = np.empty((0, 0))
    changing: dict[int, list[Dual]] = {}
    for rows, values, kinks in evaluated(pieces, function, where, shares, by_mode):
        if not columns.size:
            columns = np.empty((len(where), 1 + values.slopes.shape[1]))
        columns[rows, 0], columns[rows, 1:] = values.values, values.slopes
        arguments = np.array([a.values for a in kinks.arguments]).reshape(
            -1, len(rows) // NODES, NODES
        )
        both = (arguments.min(axis=2) < 0.0) & (arguments.max(axis=2) > 0.0)
        for k in np.flatnonzero(both.any(axis=0)).tolist():
            own = slice(k * NODES, (k + 1) * NODES)
            changing[int(rows[own][0]) // NODES] = [a[own] for a in kinks.arguments]
    by_part = columns.reshape(len(parts), NODES, -1)
    with np.errstate(all="ignore"):
        tail = np.max(np.abs(SERIES[-2:] @ by_part), axis=1)
    return _Sampled(by_part, tail, np.max(np.abs(by_part), axis=1), changing)


def _judged(
    found: Resolved, part: _PanelPart, sampled: _Sampled, k: int, size: float, left: float
) -> list[_PanelPart]:
    """Take a part as a panel, or return the parts that it is cut into; ``left`` is its share of noise."""
    segment, low, high = found.segment, part.low, part.high
    if not np.all(np.isfinite(sampled.sizes[k])):
        time = segment.start + low * segment.lasts
        raise ContfricError(
            f"{found.what} has no finite value in segment {segment.index + 1} near t = {time:.6g}"
        )
    shares = low + 0.5 * (high - low) * (POINTS + 1.0)
    cut = _change(found, shares, sampled.kinks[k]) if k in sampled.kinks else None
    if cut is not None and low < cut.share < high:
        found.cuts.append(cut)
        return [
            _PanelPart(part.index, low, cut.share, part.depth, size),
            _PanelPart(part.index, cut.share, high, part.depth, size),
        ]
    level = resolved_level(segment.model)
    noise = part.depth >= HALVED and FALLS * part.before < left < NOISE
    lasts = (high - low) * segment.lasts
    if left <= level or noise or lasts <= _NO_TIME * (1.0 + abs(segment.start)):
        found.panels.append(Panel(low, high, sampled.values(k)))
        return []
    if part.depth == DEEPEST:
        time = segment.start + low * segment.lasts
        raise ContfricError(
            f"{found.what} is not smooth near t = {time:.12g}: no panel resolves it"
        )
    middle, depth = 0.5 * (low + high), part.depth + 1
    return [
        _PanelPart(part.index, low, middle, depth, size, left),
        _PanelPart(part.index, middle, high, depth, size, left),
    ]


def integral(resolved: Sequence[Resolved]) -> tuple[float, FloatArray]:
    """Return the integral over all segments by time, and its derivatives, shape (D,).

    The ends of panels are fixed shares of their segments; jumps that move against these contribute.
    """
    panels = [(each.segment, panel) for each in resolved for panel in each.panels]
    jumps = sum((each.jumps() for each in resolved), np.zeros(1))
    if not panels:
        return 0.0, jumps
    half = np.array([0.5 * (panel.high - panel.low) for _, panel in panels])
    lasts = np.array([segment.lasts for segment, _ in panels])
    means = half * np.array([WEIGHTS @ panel.values.values for _, panel in panels])
    value = math.fsum(means * lasts)
    if not panels[0][0].exact:
        return value, jumps
    slopes = np.array([WEIGHTS @ panel.values.slopes[:, :-1] for _, panel in panels])
    d_lasts = np.array([segment.d_lasts for segment, _ in panels])
    return value, jumps + (half * lasts) @ slopes + means @ d_lasts


def _change(found: Resolved, shares: FloatArray, arguments: list[Dual]) -> ArgumentZero | None:
    """Return the first root of an argument of a kink between nodes; None if no sign changes."""
    best: tuple[float, int, float] | None = None
    for number, argument in enumerate(arguments):
        a = argument.values
        clear = np.flatnonzero(np.abs(a) > _NO_SIGN * (1.0 + np.max(np.abs(a))))
        for j, k in pairwise(clear.tolist()):
            if a[j] * a[k] < 0.0 and (best is None or shares[j] < best[0]):
                best = shares[j], number, shares[k]
    if best is None:
        return None
    brentq = whole("scipy.optimize").brentq

    low, number, high = best

    def argument_at(share: float) -> float:
        noted = Kinks()
        found.function(found.segment, np.array([share]), noted)
        return float(noted.arguments[number].values[0])

    # to the last digits of a share
    return ArgumentZero(float(brentq(argument_at, low, high, xtol=1e-16, rtol=1e-15)), number)
