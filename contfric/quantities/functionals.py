r"""Functionals of an orbit: integrals, means, extrema and harmonics of a function of time.

With T the period of the orbit and :math:`\omega` the frequency of the excitation (of the orbit itself
without excitation),

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
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.attributes import cached_property
from contfric.errors import ParameterError, number_and
from contfric.models.language.quantity_texts import WORK, Functional
from contfric.quantities.duals import Dual, Kinks, Number, apply, constant
from contfric.quantities.extreme import is_compiled, moved_peak, peak_in
from contfric.quantities.inside import Inside
from contfric.quantities.motion import Directions, IndexArray, OrbitMotion, Place, SegmentNodes
from contfric.quantities.panels import Function, Resolved, evaluated, integral, least_size, resolve
from contfric.quantities.tape import Tape

#: Extrema that differ by less than this, relative to 1 + their size, are equal: orbits are solved to 1e-13.
_EQUAL = 1e-10
#: Derivatives of equal extrema that differ by more than this, relative to 1 + their size, differ; or by so
#: many units of the flow's rounding, which fast motion amplifies.
_APART, _UNITS = 1e-7, 1e8
#: A harmonic this small next to the root mean square is rounding: orbits are solved to 1e-13, and less than
#: two digits of its phase would be left; or so many units of the flow's rounding.
_SILENT, _SILENT_UNITS = 1e-12, 100.0
#: Newton steps to a stationary point from its place in the Legendre series, which is good to 1e-9.
_STEPS = 2
#: Shares over which the bend is a difference: the root of rounding of a rate, and less in a boundary layer.
_WIDTHS = (1e-4, 1e-6, 1e-8)

#: Integrals over an orbit, with their derivatives, shape (L + 1, D): those of its period are the last row.
Totals = tuple[list[float], FloatArray]
#: What is integrated: for which functional, and the rate of its waves, 0 without them.
Asked = tuple[Functional, float]


@dataclass(eq=False)
class Measuring:
    """One measurement: the solution, and where derivatives turned out to be one-sided.

    Attributes
    ----------
    motion : the orbit and its directions
    inside : evaluates expressions along it
    kinks : what is one-sided, and why
    known : integrals that were computed together (:mod:`contfric.quantities.at_once`)
    """

    motion: OrbitMotion
    inside: Inside
    kinks: list[str] = field(default_factory=list)
    known: Mapping[Asked, Totals] = field(default_factory=dict)

    def number(self, value: float, slopes: FloatArray) -> Dual:
        """Return a number with its derivatives, the same on both sides."""
        return Dual(np.array((value, value)), np.array((slopes, slopes)))

    def functional(self, asked: Functional) -> Dual:
        """Return a functional as a number."""
        if asked.kind == WORK:
            return self._work(asked)
        if asked.kind in ("max", "min"):
            return self._peak(asked) or self._extremum(asked, self.inside.function(asked))
        return self.number(*self.smooth(asked))

    def smooth(self, asked: Functional) -> tuple[float, FloatArray]:
        """Return a functional that is made of integrals, with its derivatives, shape (D,)."""
        if asked.kind in ("amplitude", "phase"):
            return self._harmonic(asked)
        (total,), (slopes, d_lasts) = self._compiled(asked) or self._on_panels(asked)
        if asked.kind == "integral":
            return total, slopes
        lasts = self._period
        mean = total / lasts
        slopes = (slopes - mean * d_lasts) / lasts
        if asked.kind == "mean":
            return mean, slopes
        root = math.sqrt(mean)
        return root, _over(slopes, 2.0 * root)

    def period(self) -> Dual:
        """Return the period of the orbit."""
        return self.number(self._period, self.motion.d_period)

    @cached_property
    def _period(self) -> float:
        return self.motion.orbit.period

    def _integral(self, asked: Functional, function: Function, size: float = 0.0) -> Dual:
        return self.number(*self._on_panel(asked, function, size))

    def _on_panel(
        self, asked: Functional, function: Function, size: float = 0.0
    ) -> tuple[float, FloatArray]:
        value, slopes = integral(self._resolved(self.motion, asked, function, size))
        return value, np.zeros(self.motion.count) + slopes

    def _on_panels(self, asked: Functional) -> Totals:
        """Return what :meth:`_compiled` does, by the panels of Python."""
        function = self.inside.function(asked)
        functions = [_squared(function) if asked.kind == "rms" else function]
        if asked.kind in ("amplitude", "phase"):
            cycles = self._cycles(asked)
            functions = [_turning(function, self.motion, cycles, wave) for wave in ("cos", "sin")]
        found = [self._on_panel(asked, each) for each in functions]
        slopes = [*(slopes for _, slopes in found), self.motion.d_period]
        return [value for value, _ in found], np.array(slopes)

    def _compiled(self, asked: Functional, rate: float = 0.0) -> Totals | None:
        """Return what is integrated for a functional by compiled code; None where it leaves it to panels.

        Parameters
        ----------
        rate : of the waves of a harmonic, which moves against the period
        """
        known = self.known.get((asked, rate))
        if known is not None or not is_compiled(asked, self.motion.orbit.model):
            return known
        return self.integrals(self.inside.tape(asked), rate)

    def asked(self, functional: Functional) -> Asked:
        """Return what is integrated for a functional."""
        waves = functional.kind in ("amplitude", "phase")
        return functional, self._rate(functional) if waves else 0.0

    def _rate(self, asked: Functional) -> float:
        return 2.0 * math.pi * self._cycles(asked) / self._period

    def integrals(self, tape: Tape, rate: float) -> Totals | None:
        """Return integrals by compiled code; None where it leaves them to panels."""
        found = self.motion.orbit.integrals(tape, rate, self.motion.directions)
        finite = found is not None and math.isfinite(sum(found.slopes.ravel().tolist()))
        return found if finite else None

    def _work(self, asked: Functional) -> Dual:
        """Return what a contact dissipates in a period of the orbit: where it slides, and at impacts."""
        contact = asked.text
        # where it has just begun to slide all values are small: next to those of any mode they are rounding
        laws = self.inside.powers(contact)
        size = max(least_size(self.motion.pieces, function) for function in laws)
        total = self._integral(asked, self.inside.power(contact), size)
        loss, orbit = self.inside.loss(contact), self.motion.orbit
        for segment, joint in zip(self.motion.segments, orbit.itinerary, strict=True):
            if joint[1] == contact and orbit.model.reset_at(*joint) is not None:
                lost = loss(segment, np.ones(1), Kinks())
                slopes = lost.slopes[0, : self.motion.count]
                total = _dual(total + self.number(float(lost.values[0]), slopes))
        return total

    def _resolved(
        self, motion: OrbitMotion, asked: Functional, function: Function, size: float = 0.0
    ) -> list[Resolved]:
        for each in () if asked.kind == WORK else self.inside.variants(asked):
            size = max(size, least_size(motion.pieces, each))
        return resolve(motion.pieces, function, asked.text, size, bool(asked.contacts))

    # ---------------------------------------------------------------------------- harmonics

    def _harmonic(self, asked: Functional) -> tuple[float, FloatArray]:
        scale, rate = 2.0 / self._period, self._rate(asked)
        totals, slopes = self._compiled(asked, rate) or self._on_panels(asked)
        a, b = scale * totals[0], -scale * totals[1]
        size = math.hypot(a, b)
        if asked.kind == "phase":
            if size <= self._silent(asked):
                name = f"phase({asked.text}, {asked.harmonic:g})"
                self.kinks.append(f"{name}: this harmonic vanishes, and has no phase")
                return math.nan, np.full(self.motion.count, math.nan)
            turned = np.array((-b * scale, -a * scale, 0.0)).dot(slopes)
            return math.atan2(b, a), _over(turned, size**2)
        grown = np.array((a * scale, -b * scale, -size * size / self._period)).dot(slopes)
        return size, _over(grown, size)

    def _silent(self, asked: Functional) -> float:
        """Return the amplitude below which a harmonic is rounding: the even ones of a symmetric orbit are."""
        share = max(_SILENT, _SILENT_UNITS * self.motion.orbit.model.rounding)
        return share * Measuring(self._still, self.inside).smooth(asked.rms)[0]

    def _cycles(self, asked: Functional) -> int:
        """Return the number of waves of a harmonic in the period of the orbit.

        Raises
        ------
        ParameterError
            If the orbit does not have this harmonic.
        """
        orbit = self.motion.orbit
        cycles = asked.harmonic * (1 if orbit.model.autonomous else orbit.periods)
        if abs(cycles - round(cycles)) > 1e-9:
            raise ParameterError(
                f"{asked.kind}({asked.text}, {asked.harmonic:g}): an orbit of "
                f"{number_and(orbit.periods, 'period')} has the harmonics 1/{orbit.periods}, "
                f"2/{orbit.periods}, ... of the excitation"
            )
        return round(cycles)

    # ------------------------------------------------------------------------------ extrema

    def _extremum(self, asked: Functional, function: Function) -> Dual:
        sign = 1.0 if asked.kind == "max" else -1.0
        if self._at_joints(asked):
            joints, moved = self.motion.orbit.cycle[:, 1], self.motion.d_cycle[:, 1]
            what = f"{asked.kind}({asked.text})"
            return self.largest(what, sign * joints, lambda rows: sign * moved[rows]) * sign
        # without derivatives: only those of the extrema themselves are wanted
        pieces = self._still.pieces
        each = self._candidates(asked, function)
        where = np.repeat(np.arange(len(each)), [len(shares) for shares in each])
        shares, by_mode = np.concatenate(each), bool(asked.contacts)
        values = np.empty(len(shares))
        for rows, found, _ in evaluated(pieces, function, where, shares, by_mode):
            values[rows] = found.values
        if not np.all(np.isfinite(values)):
            raise ParameterError(f"{asked.kind}({asked.text}) has no finite value")

        def slopes(rows: IndexArray) -> FloatArray:
            return sign * self._envelopes(function, where[rows], shares[rows], by_mode)

        return self.largest(f"{asked.kind}({asked.text})", sign * values, slopes) * sign

    def _peak(self, asked: Functional) -> Dual | None:
        """Return the extremum of an observable by compiled code; None where it is reached twice."""
        orbit, directions = self.motion.orbit, self.motion.directions
        peak = peak_in(asked, orbit.model)
        if peak is None or directions is None:
            return None
        found = moved_peak(peak, orbit, directions)
        return None if found is None else self.number(*found)

    def _at_joints(self, asked: Functional) -> bool:
        """Tell whether it is the displacement of a model whose motion is cut at its stops, without resets."""
        model = self.motion.orbit.model
        at_stops = model.stops_at_joints and not model.displacement and not model.reset_by_surface
        return at_stops and asked.text == model.states[0]

    def _candidates(self, asked: Functional, function: Function) -> list[FloatArray]:
        """Return the shares of each segment at which the function can be extreme.

        The displacement has its extrema at joints where the model's motion is cut at its stops; observables
        have stationary points that the flow certifies; of any other expression the resolved series has them.
        """
        model, name, segments = self.motion.orbit.model, asked.text, self._still.segments
        at_ends = name == model.states[0] and model.stops_at_joints and not model.displacement
        if name == model.states[0]:
            name = model.displacement or name
        inside: list[list[FloatArray]] = [[] for _ in segments]
        if not at_ends and name in model.observable_index:
            view = model.view(self.motion.orbit.vector)
            for found, s in zip(inside, segments, strict=True):
                if s.lasts > 0.0:
                    times, _ = view.stationary(s.mode, name, s.start, s.state, s.lasts)
                    found.append(times / s.lasts)
        elif not at_ends:
            resolved = self._resolved(self._still, asked, function)
            for found, of in zip(inside, resolved, strict=True):
                found.append(np.array([panel.low for panel in of.panels[1:]]))
                found += [panel.stationary() for panel in of.panels]
        return [
            np.concatenate([[0.0, 1.0] if s.lasts > 0.0 else [0.0], *found])
            for found, s in zip(inside, segments, strict=True)
        ]

    def _envelopes(
        self, function: Function, where: IndexArray, shares: FloatArray, by_mode: bool
    ) -> FloatArray:
        """Return the derivatives of values that are extreme at shares of segments, shape (k, D).

        A stationary point inside is sharpened first, by its rate and that of its rate (by a difference).
        """
        sharp = shares.copy()
        for k in np.flatnonzero((shares > 0.0) & (shares < 1.0)):
            for _ in range(_STEPS):
                nodes = self._timed.pieces.nodes(np.repeat(where[k : k + 1], 3))
                sharp[k] = _sharper(nodes, float(sharp[k]), function)
        slopes = np.empty((len(shares), self.motion.count))
        for rows, found, _ in evaluated(self.motion.pieces, function, where, sharp, by_mode):
            slopes[rows] = found.slopes[:, :-1]
        return slopes

    def largest(
        self, what: str, values: FloatArray, slopes_of: Callable[[IndexArray], FloatArray]
    ) -> Dual:
        """Return the largest of some values; their derivatives are asked for by number.

        Where several are the largest, and move differently, the derivatives of both sides differ: that
        ahead is the largest derivative, that after the smallest.
        """
        best = float(np.max(values))
        if not self.motion.count:
            return self.number(best, np.empty(0))
        tied = np.flatnonzero(values >= best - _EQUAL * (1.0 + abs(best)))
        slopes = slopes_of(tied[np.argsort(-values[tied], kind="stable")])
        ahead, behind = np.max(slopes, axis=0), np.min(slopes, axis=0)
        apart = max(_APART, _UNITS * self.motion.orbit.model.rounding)
        if np.any(ahead - behind > apart * (1.0 + np.abs(ahead))):
            self.kinks.append(f"{what} is reached at several times at once")
        else:
            ahead = behind = slopes[0]  # of the value that is returned
        return Dual(np.full(2, best), np.array([ahead, behind]))

    @cached_property
    def _still(self) -> OrbitMotion:
        """The same solution without directions."""
        return self.motion if self.motion.directions is None else OrbitMotion(self.motion.orbit)

    @cached_property
    def _timed(self) -> OrbitMotion:
        """The same solution in one direction in which nothing moves: for rates, its derivatives by time."""
        joints, vector = self.motion.orbit.joints, self.motion.orbit.vector
        nothing = np.zeros((*joints.shape, 1)), np.zeros((len(vector), 1))
        return OrbitMotion(self.motion.orbit, Directions(*nothing))


def _over(slopes: FloatArray, divisor: float) -> FloatArray:
    """Divide derivatives by a number; one that is 0 stays 0, divided by 0 too."""
    return slopes / divisor if divisor else np.where(slopes == 0.0, 0.0, slopes * np.inf)


def _dual(number: Number) -> Dual:
    assert isinstance(number, Dual)
    return number


def _squared(function: Function) -> Function:
    def square(place: Place, shares: FloatArray, kinks: Kinks) -> Dual:
        g = function(place, shares, kinks)
        return g * g

    return square


def _turning(function: Function, motion: OrbitMotion, cycles: int, wave: str) -> Function:
    """Return a function times a wave of so many cycles in the period of the orbit."""
    period = motion.orbit.period
    rate = 2.0 * math.pi * cycles / period

    def turning(place: Place, shares: FloatArray, kinks: Kinks) -> Dual:
        time, _ = place.at(shares)
        slopes = np.zeros(time.slopes.shape[1])
        if place.exact:
            slopes[:-1] = -rate / period * motion.d_period
        frequency = constant(rate, time) + Dual(np.zeros(1), slopes[None, :])
        return _dual(function(place, shares, kinks) * apply(wave, frequency * time))

    return turning


def _sharper(nodes: SegmentNodes, share: float, function: Function) -> float:
    """Return a stationary point by one step of Newton's method on the rate; as it was at a kink.

    The bend is a difference over shares as wide as it is the same on: a step that is not inside of them
    says that it is not.
    """
    for width in _WIDTHS:
        step = min(width, 0.5 * share, 0.5 * (1.0 - share))
        around = np.array([share - step, share, share + step])
        rates = function(nodes, around, Kinks()).slopes[:, -1]
        bend = (rates[2] - rates[0]) / (2.0 * step)
        if bend != 0.0 and abs(rates[1]) < abs(bend) * step:
            return share - float(rates[1] / bend)
    return share
