r"""Functionals of an orbit: integrals, means, extrema and harmonics of a function of time.

With T the period of the orbit and :math:`\omega` the frequency of the excitation (of the orbit itself
where there is none),

.. math:: \bar g = \frac1T\int_0^T g\,dt, \quad \mathrm{rms} = \Bigl(\frac1T\int_0^T g^2 dt\Bigr)^{1/2}, \quad
   A_k e^{i\varphi_k} = \frac2T\int_0^T g\,e^{-ik\omega t} dt ,

so that g contains :math:`A_k\cos(k\omega t + \varphi_k)`. An extremum is the largest (least) of the values
at both ends of every panel and at every stationary point. Its derivative is that of the value at a fixed
share of the segment, as the time of a stationary point does not move the value (the envelope theorem).
Where two extrema are equal and move differently the derivative is one-sided: rows 0 and 1 of a number are
the derivatives as each direction is followed, and against it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np

from contfric.errors import ParameterError
from contfric.models.definition import FloatArray
from contfric.models.quantity_texts import WORK, Functional
from contfric.quantities.duals import Dual, Kinks, Number, apply, constant, divide
from contfric.quantities.inside import Inside
from contfric.quantities.motion import Motion, Segment
from contfric.quantities.panels import Function, Resolved, least_size, resolve

#: Extrema that differ by less than this, relative to 1 + their size, are equal: orbits are solved to 1e-13.
_EQUAL = 1e-10
#: Derivatives of equal extrema that differ by more than this, relative to 1 + their size, differ; or by so
#: many units of the flow's rounding, which fast motion amplifies.
_APART, _UNITS = 1e-7, 1e8
#: Newton steps to a stationary point from its place in the Legendre series, which is good to 1e-9.
_STEPS = 2
#: Shares over which the bend is a difference: the root of rounding of a rate, and less in a boundary layer.
_WIDTHS = (1e-4, 1e-6, 1e-8)


@dataclass(eq=False)
class Measuring:
    """One measurement: the motion, and where derivatives turned out to be one-sided.

    Attributes
    ----------
    motion : the orbit and its directions
    inside : evaluates expressions along it
    kinks : what is one-sided, and why
    """

    motion: Motion
    inside: Inside
    kinks: list[str] = field(default_factory=list)

    def number(self, value: float, slopes: FloatArray) -> Dual:
        """Return a number with its derivatives, the same on both sides."""
        return Dual(np.full(2, value), np.tile(slopes, (2, 1)))

    def functional(self, asked: Functional) -> Dual:
        """Return a functional as a number."""
        if asked.kind == WORK:
            return self._work(asked)
        function = self.inside.function(asked)
        if asked.kind in ("max", "min"):
            return self._extremum(asked, function)
        if asked.kind in ("amplitude", "phase"):
            return self._harmonic(asked, function)
        squared = asked.kind == "rms"
        total = self._integral(asked, _squared(function) if squared else function)
        if asked.kind == "integral":
            return total
        mean = _dual(divide(total, self.period()))
        return _dual(apply("sqrt", mean)) if squared else mean

    def period(self) -> Dual:
        """Return the period of the orbit."""
        return self.number(self.motion.orbit.period, self.motion.d_period)

    def _integral(self, asked: Functional, function: Function, size: float = 0.0) -> Dual:
        parts = [resolved.integral() for resolved in self._resolved(asked, function, size)]
        value = math.fsum(float(part.values[0]) for part in parts)
        slopes = np.zeros(self.motion.count)
        for part in parts:
            slopes = slopes + part.slopes[0, : self.motion.count]
        return self.number(value, slopes)

    def _work(self, asked: Functional) -> Dual:
        """Return what a contact dissipates in a period of the orbit: where it slides, and at impacts."""
        contact = asked.text
        # where it has just begun to slide all values are small: beside those of any mode they are rounding
        laws = self.inside.powers(contact)
        size = max(least_size(self.motion.segments, function) for function in laws)
        total = self._integral(asked, self.inside.power(contact), size)
        loss, word = self.inside.loss(contact), self.motion.orbit.word
        for segment, (_, exit_) in zip(self.motion.segments, word, strict=True):
            if exit_ == contact and exit_ in self.motion.orbit.model.reset_by_surface:
                lost = loss(segment, np.ones(1), Kinks())
                slopes = lost.slopes[0, : self.motion.count]
                total = _dual(total + self.number(float(lost.values[0]), slopes))
        return total

    def _resolved(self, asked: Functional, function: Function, size: float) -> Iterator[Resolved]:
        variants = () if asked.kind == WORK else self.inside.variants(asked)
        for each in (function, *variants):
            size = max(size, least_size(self.motion.segments, each))
        for segment in self.motion.segments:
            yield resolve(segment, function, asked.text, size)

    # ---------------------------------------------------------------------------- harmonics

    def _harmonic(self, asked: Functional, function: Function) -> Dual:
        orbit = self.motion.orbit
        cycles = asked.harmonic * (1 if orbit.model.autonomous else orbit.periods)
        if abs(cycles - round(cycles)) > 1e-9:
            raise ParameterError(
                f"{asked.kind}({asked.text}, {asked.harmonic:g}): an orbit of {orbit.periods} "
                f"period(s) has the harmonics 1/{orbit.periods}, 2/{orbit.periods}, ... of the excitation"
            )
        scale = divide(2.0, self.period())
        parts = [
            _dual(
                self._integral(asked, _turning(function, self.motion, round(cycles), wave)) * scale
            )
            for wave in ("cos", "sin")
        ]
        a, b = parts[0], -parts[1]
        if asked.kind == "amplitude":
            return _dual(apply("sqrt", a * a + b * b))
        square = a.values**2 + b.values**2
        slopes = (a.values / square)[:, None] * b.slopes - (b.values / square)[:, None] * a.slopes
        return Dual(np.arctan2(b.values, a.values), slopes)

    # ------------------------------------------------------------------------------ extrema

    def _extremum(self, asked: Functional, function: Function) -> Dual:
        sign = 1.0 if asked.kind == "max" else -1.0
        found: list[tuple[Segment, float, float]] = []
        size = max(
            least_size(self._still.segments, each)
            for each in (function, *self.inside.variants(asked))
        )
        # without derivatives: only those of the extrema themselves are wanted
        for still, segment in zip(self._still.segments, self.motion.segments, strict=True):
            shares = _candidates(asked, still, function, size)
            values = function(still, shares, Kinks()).values
            found += [(segment, float(s), float(v)) for s, v in zip(shares, values, strict=True)]
        if not all(math.isfinite(value) for _, _, value in found):
            raise ParameterError(f"{asked.kind}({asked.text}) has no finite value")
        candidates = [
            (sign * value, partial(_signed_envelope, sign, segment, share, function))
            for segment, share, value in found
        ]
        return self.largest(f"{asked.kind}({asked.text})", candidates) * sign

    def largest(
        self, what: str, candidates: Sequence[tuple[float, Callable[[], FloatArray]]]
    ) -> Dual:
        """Return the largest of some values, given with functions that return their derivatives.

        Where several are the largest, and move differently, the derivatives of both sides differ: that
        ahead is the largest derivative, that behind the smallest.
        """
        best = max(value for value, _ in candidates)
        if not self.motion.count:
            return self.number(best, np.empty(0))
        level = best - _EQUAL * (1.0 + abs(best))
        tied = sorted((c for c in candidates if c[0] >= level), key=lambda c: -c[0])
        slopes = np.array([slope() for _, slope in tied])
        ahead, behind = np.max(slopes, axis=0), np.min(slopes, axis=0)
        apart = max(_APART, _UNITS * self.motion.orbit.model.rounding)
        if np.any(ahead - behind > apart * (1.0 + np.abs(ahead))):
            self.kinks.append(f"{what} is reached at several times at once")
        else:
            ahead = behind = slopes[0]  # of the value that is returned
        return Dual(np.full(2, best), np.array([ahead, behind]))

    @cached_property
    def _still(self) -> Motion:
        """The same motion without directions."""
        return self.motion if self.motion.directions is None else Motion(self.motion.orbit)


def _candidates(asked: Functional, segment: Segment, function: Function, size: float) -> FloatArray:
    """Return the shares of a segment at which the function can be extreme.

    The displacement has its extrema at joints where the model's motion is cut at its stops; observables have
    stationary points that the flow certifies; of any other expression the resolved series has them.
    """
    ends, model, name = [0.0, 1.0], segment.model, asked.text
    if not segment.lasts > 0.0:
        return np.array(ends[:1])
    if name == model.states[0]:
        if model.stops_at_joints and not model.displacement:
            return np.array(ends)
        name = model.displacement or name
    if name in model.observable_index:
        view = model.view(segment.vector)
        times, _ = view.stationary(segment.mode, name, segment.start, segment.state, segment.lasts)
        return np.concatenate([ends, times / segment.lasts])
    resolved = resolve(segment, function, asked.text, size)
    inside = [panel.stationary() for panel in resolved.panels]
    cuts = [panel.low for panel in resolved.panels[1:]]
    return np.concatenate([ends, cuts, *inside])


def _dual(number: Number) -> Dual:
    assert isinstance(number, Dual)
    return number


def _squared(function: Function) -> Function:
    def square(segment: Segment, shares: FloatArray, kinks: Kinks) -> Dual:
        g = function(segment, shares, kinks)
        return g * g

    return square


def _turning(function: Function, motion: Motion, cycles: int, wave: str) -> Function:
    """Return a function times a wave of so many cycles in the period of the orbit."""
    period = motion.orbit.period
    rate = 2.0 * math.pi * cycles / period

    def turning(segment: Segment, shares: FloatArray, kinks: Kinks) -> Dual:
        time, _ = segment.at(shares)
        slopes = np.zeros(time.slopes.shape[1])
        if segment.exact:
            slopes[:-1] = -rate / period * motion.d_period
        frequency = constant(rate, time) + Dual(np.zeros(1), slopes[None, :])
        return _dual(function(segment, shares, kinks) * apply(wave, frequency * time))

    return turning


def _signed_envelope(sign: float, segment: Segment, share: float, function: Function) -> FloatArray:
    return sign * _envelope(segment, share, function)


def _envelope(segment: Segment, share: float, function: Function) -> FloatArray:
    """Return the derivatives of a value that is extreme at a share of a segment, shape (D,).

    A stationary point inside is sharpened first, by its rate and that of its rate (by a difference).
    """
    for _ in range(_STEPS if 0.0 < share < 1.0 else 0):
        share = _sharper(segment, share, function)
    return np.asarray(function(segment, np.array([share]), Kinks()).slopes[0, :-1])


def _sharper(segment: Segment, share: float, function: Function) -> float:
    """Return a stationary point by one step of Newton's method on the rate; as it was at a kink.

    The bend is a difference over shares as wide as it is the same on: a step that is not inside of them
    says that it is not.
    """
    for width in _WIDTHS:
        step = min(width, 0.5 * share, 0.5 * (1.0 - share))
        around = np.array([share - step, share, share + step])
        rates = function(segment, around, Kinks()).slopes[:, -1]
        bend = (rates[2] - rates[0]) / (2.0 * step)
        if bend != 0.0 and abs(rates[1]) < abs(bend) * step:
            return share - float(rates[1] / bend)
    return share
