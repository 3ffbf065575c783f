r"""The Jacobian of a chain along a chord, up to second order in how long the chord is.

The unknowns are ``X(s) = m + s d +- R`` for s in [-h, h]: joints and parameter, time in phases
(:mod:`contfric.certify.tubes.strand`), so that neither period nor harmonics depend on the parameter p. With a
duration ``D(s)``, D_m at the middle, and ``delta = D - D_m``,

    exp(M D) = exp(M D_m) exp(M delta),        exp(M delta) = 1 + M delta + (M delta)^2 Y / 2,

Y in the hull of all ``exp(tau M delta)``, tau in [0, 1]; the first factor depends on p only.
"""

from __future__ import annotations

from dataclasses import dataclass

from flint import arb, arb_mat

from contfric.certify.enclosures.affine import AffineMatrix, enclosing
from contfric.certify.equations.chain import Chain, Segments, block_exponential
from contfric.certify.equations.kept import keep_residual, keep_rows
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector, around, column, identity, zeros


@dataclass(frozen=True, eq=False)
class Chord:
    """Unknowns ``m + s d +- R``.

    Attributes
    ----------
    middle : m, exact
    change : d, exact
    radii : R
    half : ball of all s, [-h, h]
    """

    middle: Vector
    change: Vector
    radii: Vector
    half: arb

    @property
    def line(self) -> Vector:
        """The unknowns on the chord, for all s."""
        return [m + self.half * d for m, d in zip(self.middle, self.change, strict=True)]

    @property
    def box(self) -> Vector:
        """All unknowns, for all s."""
        return [around(c, r) for c, r in zip(self.line, self.radii, strict=True)]


@dataclass(frozen=True, eq=False)
class Linear:
    """What is known of a chain along a chord: residual at its middle, Jacobian without and of the closure.

    Each Jacobian is (value, slope, rest) as those of
    :class:`contfric.certify.enclosures.affine.AffineMatrix`; the last column is the parameter.
    """

    residual: Vector
    own: tuple[arb_mat, arb_mat, arb_mat]
    closing: tuple[arb_mat, arb_mat, arb_mat]

    def whole(self, sigma: int) -> list[arb_mat]:
        """Return the Jacobian with sigma times the closure."""
        if sigma == 1:
            return [a + b for a, b in zip(self.own, self.closing, strict=True)]
        return [a - b for a, b in zip(self.own, self.closing, strict=True)]


class Ray:
    """The chain along a chord.

    Parameters
    ----------
    central : model at the middle of the parameter, with slopes
    wide : model over the box of the parameter, with slopes
    """

    def __init__(
        self, segments: Segments, central: BallModel, wide: BallModel, chord: Chord
    ) -> None:
        self.chain, self.segments = Chain(segments, central), segments
        self.central, self.wide, self.chord = central, wide, chord
        self.n, self.m = segments.states, segments.states + 1
        self.half, self.step = chord.half, chord.change[-1]
        self.slack = arb(0, chord.radii[-1].abs_upper())
        self.values = self.chain.joints(chord.middle[:-1])
        self._fields: dict[str, AffineMatrix] = {}

    def linear(self) -> Linear:
        """Return residual and Jacobian."""
        count = self.segments.count
        size = count * self.m
        self.own = [zeros(size, size + 1) for _ in range(3)]
        self.closing = [zeros(size, size + 1) for _ in range(3)]
        residual: Vector = []
        for i in range(count):
            residual += self._segment(i)
            at, row, slope = self._condition(i)
            residual.append(self._observed(i * self.m + self.n, at, row, slope))
        kept = self.segments.kept
        residual = keep_residual(kept, residual, self.chord.middle)
        for order, three in ((1, self.own), (2, self.closing)):
            for k, rows in enumerate(three):
                keep_rows(kept, rows, max(order, k + 1))
        own, closing = (
            tuple(arb_mat(rows) for rows in three) for three in (self.own, self.closing)
        )
        return Linear(residual, own, closing)

    # ------------------------------------------------------------------ matrices of the model

    def _by_parameter(self, at: arb_mat, slope: arb_mat, wide: arb_mat) -> AffineMatrix:
        """Return what depends on the parameter only, from its derivative at the middle and over the box."""
        found = enclosing(at, slope * self.step, wide * self.step, self.half)
        return AffineMatrix(at, found.slope, found.rest + wide * self.slack, self.half)

    def _field(self, mode: str) -> AffineMatrix:
        if mode not in self._fields:
            central, wide = self.central, self.wide
            assert central.slopes is not None
            assert wide.slopes is not None
            self._fields[mode] = self._by_parameter(
                central.fields[mode], central.slopes.fields[mode], wide.slopes.fields[mode]
            )
        return self._fields[mode]

    def _surface(self, name: str) -> tuple[AffineMatrix, AffineMatrix]:
        """Return a surface's row, and its derivative by the parameter."""
        central, wide = self.central.slopes, self.wide.slopes
        assert central is not None
        assert wide is not None
        row = self._by_parameter(
            self.central.surfaces[name], central.surfaces[name], wide.surfaces[name]
        )
        return row, self._split(wide.surfaces[name])

    def _split(self, ball: arb_mat) -> AffineMatrix:
        """Return an enclosure whose dependence on s is not known."""
        middle = ball.mid()
        nothing = arb_mat(ball.nrows(), ball.ncols())
        return AffineMatrix(middle, nothing, ball - middle, self.half)

    # ------------------------------------------------------------------ a joint

    def _time(self, k: int) -> tuple[arb, arb, arb]:
        """Return time of joint k at the middle, its change, and the ball of what is next to the chord."""
        count = self.segments.count
        if k == count and self.segments.turn == 0.0:
            return self.values[k][0], arb(0), arb(0)
        at = (k % count) * self.m
        slack = arb(0, self.chord.radii[at].abs_upper())
        return self.values[k][0], self.chord.change[at], slack

    def _state(self, k: int) -> AffineMatrix:
        """Return the extended state at joint k."""
        t, change, slack = self._time(k)
        wide = around(t + self.half * change, slack)
        rates, spread = self.central.by_time(t, 1), self.central.by_time(wide, 1)
        at, n = self.central.extended(t, self.values[k][1:]), self.n
        moving = self._moved_states(k)
        slope = [moving[j][0] if j < n else rates[j] * change for j in range(len(at))]
        rest = [
            moving[j][1]
            if j < n
            else (spread[j] - rates[j]) * change * self.half + spread[j] * slack
            for j in range(len(at))
        ]
        return AffineMatrix(column(at), column(slope), column(rest), self.half)

    def _moved_states(self, k: int) -> list[tuple[arb, arb]]:
        """Return change and slack of the states at joint k."""
        at = 1 if k == self.segments.count else k * self.m + 1
        radii = [arb(0, r.abs_upper()) for r in self.chord.radii[at : at + self.n]]
        own = list(zip(self.chord.change[at : at + self.n], radii, strict=True))
        if k < self.segments.count:
            return own
        return [
            tuple(
                sum((arb(c) * x[q] for c, x in zip(row, own, strict=True)), arb(0)) for q in (0, 1)
            )
            for row in self.segments.closure
        ]

    def _rate(self, k: int) -> AffineMatrix:
        """Return the derivative of the extended state at joint k by time."""
        t, change, slack = self._time(k)
        wide = around(t + self.half * change, slack)
        rates, spread = self.central.by_time(t, 2), self.central.by_time(wide, 2)
        slope = [r * change for r in rates]
        rest = [
            (w - r) * change * self.half + w * slack for w, r in zip(spread, rates, strict=True)
        ]
        value = self.central.by_time(t, 1)
        return AffineMatrix(column(value), column(slope), column(rest), self.half)

    def _duration(self, i: int) -> tuple[arb, arb, arb]:
        """Return the duration of a segment at the middle, its change, and what is next to the chord."""
        first, last = self._time(i), self._time(i + 1)
        value = self.values[i + 1][0] - self.values[i][0]
        if self.segments.count == 1 and self.segments.turn != 0.0:
            return value, arb(0), arb(0)
        return value, last[1] - first[1], first[2] + last[2]

    # ------------------------------------------------------------------ a segment

    def _flow(self, i: int) -> tuple[AffineMatrix, AffineMatrix]:
        """Return exp(M D), and its derivative by the parameter at the same D."""
        mode = self.segments.modes[i]
        field, wide = self._field(mode), self.wide
        assert wide.slopes is not None
        duration, change, slack = self._duration(i)
        delta = self.half * change + slack
        middle = arb(duration.mid())
        delta += duration - middle
        matrix, by = field.whole, wide.slopes.fields[mode]
        near = (matrix * delta).exp()
        square = arb(0, (delta * delta / 2).abs_upper())
        slope = (self.central.fields[mode] * change).mid()
        rest = matrix * (slack + duration - middle) + (matrix * change - slope) * self.half
        rest += matrix * matrix * near * square
        size = matrix.nrows()
        one = identity(size)
        short = AffineMatrix(one, slope, rest, self.half)
        if all(x.is_zero() for x in by.entries()):
            nothing = arb_mat(size, size)
            at = (self.central.fields[mode] * middle).exp()
            flow = AffineMatrix(at, nothing, nothing, self.half) * short
            return flow, AffineMatrix(nothing, nothing, nothing, self.half)
        first, first_by = self._at_middle(mode, middle, matrix, by)
        mean = near * by * near  # d/dp exp(M delta) = delta times a mean of products
        slope = (by * change).mid()
        rest = (mean * change - slope) * self.half + mean * (slack + duration - middle)
        other = AffineMatrix(arb_mat(size, size), slope, rest, self.half)
        return first * short, first_by * short + first * other

    def _at_middle(
        self, mode: str, duration: arb, field: arb_mat, by: arb_mat
    ) -> tuple[AffineMatrix, AffineMatrix]:
        """Return exp(M d) and its derivative by the parameter for a fixed duration d."""
        central, wide = self.central.slopes, self.wide.slopes
        assert central is not None
        assert wide is not None
        narrow = [self.central.fields[mode], central.fields[mode]]
        at, at_by = block_exponential(narrow, duration, self.n)
        if wide.slopes is None:
            change = block_exponential([field, by], duration, self.n)[1]
            return self._by_parameter(at, at_by, change), self._split(change)
        terms = [field, by, wide.slopes.fields[mode] / 2]
        _, change, bend = block_exponential(terms, duration, self.n)
        bend = bend * 2
        return self._by_parameter(at, at_by, change), self._by_parameter(at_by, bend.mid(), bend)

    def _segment(self, i: int) -> Vector:
        """Write the rows of a segment; return its residual."""
        field, reset = self._field(self.segments.modes[i]), self.segments.resets[i]
        before = self._state(i)
        start, rate = before, self._rate(i)
        flow, by = self._flow(i)
        by_state, late_by = flow, by * before
        if reset:
            central, wide = self.central, self.wide
            assert central.slopes is not None
            assert wide.slopes is not None
            slopes = wide.slopes.resets[reset]
            mapped = self._by_parameter(central.resets[reset], central.slopes.resets[reset], slopes)
            start, rate, by_state = mapped * before, mapped * rate, flow * mapped
            late_by = by * start + flow * (self._split(slopes) * before)
        end = flow * start
        speed = field * end
        late = flow * rate - speed
        first, n = i * self.m, self.n
        for j in range(n):
            row = first + j
            self._add(row, i, 0, late, j, 0)
            self._add(row, i + 1, 0, speed, j, 0)
            for k in range(n):
                self._add(row, i, 1 + k, by_state, j, k)
            self._put(row, i + 1, 1 + j, arb(-1))
            for rows, value in zip(self.own, late_by.entry(j, 0), strict=True):
                rows[row][-1] += value
        return [end.at[j, 0] - self.values[i + 1][1 + j] for j in range(n)]

    def _condition(self, i: int) -> tuple[int, AffineMatrix, AffineMatrix]:
        """Return the last equation of a segment: at which joint which row vanishes, and its slope."""
        pin = self.segments.pins[i]
        name = pin if isinstance(pin, str) else pin[1] if pin else self.segments.exits[i]
        row, slope = self._surface(name)
        if isinstance(pin, tuple):  # the rate along the mode before
            wide = self.wide.slopes
            assert wide is not None
            slope = slope * self._field(pin[0]) + row * self._split(wide.fields[pin[0]])
            row = row * self._field(pin[0])
        return (i if pin else i + 1), row, slope

    def _observed(self, row: int, at: int, observable: AffineMatrix, slope: AffineMatrix) -> arb:
        """Write the derivatives of an observable at a joint; return its value at the middle."""
        state, rate = self._state(at), self._rate(at)
        self._add(row, at, 0, observable * rate, 0, 0)
        for k in range(self.n):
            self._add(row, at, 1 + k, observable, 0, k)
        for rows, value in zip(self.own, (slope * state).entry(0, 0), strict=True):
            rows[row][-1] += value
        return (observable * state).at[0, 0]

    # ------------------------------------------------------------------ rows

    def _put(self, row: int, joint: int, k: int, value: arb) -> None:
        one = arb_mat([[value]])
        self._add(row, joint, k, AffineMatrix(one, arb_mat(1, 1), arb_mat(1, 1), self.half), 0, 0)

    def _add(self, row: int, joint: int, k: int, values: AffineMatrix, a: int, b: int) -> None:
        """Add an entry by number k of a joint; those by the last joint belong to the first one."""
        three = values.entry(a, b)
        if joint < self.segments.count:
            for rows, value in zip(self.own, three, strict=True):
                rows[row][joint * self.m + k] += value
            return
        if k == 0:
            if self.segments.turn != 0.0:
                for rows, value in zip(self.closing, three, strict=True):
                    rows[row][0] += value
            return
        for j, c in enumerate(self.segments.closure[k - 1]):
            if c:
                for rows, value in zip(self.closing, three, strict=True):
                    rows[row][1 + j] += arb(c) * value
