"""Branch and bound over the phase of a release; the mathematics is that of :mod:`contfric.certify.census`."""

from __future__ import annotations

from dataclasses import dataclass
from heapq import heapify, heappop, heappush

import numpy as np
from flint import arb

from contfric.base.arrays import FloatArray
from contfric.bvp.system import build_system
from contfric.certify.census_result import CensusCertificate, ProvedOrbit, Strip
from contfric.certify.releases.following import Follower, Returned
from contfric.certify.releases.stretch import LineInS, UndecidedError
from contfric.models.balls.build import ball_model
from contfric.models.balls.numbers import working
from contfric.models.definition import Model
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine_with_symmetry

_BITS = 100
#: Intervals of a period at first; sets of narrower ones than a share of the period may be split; undecided
#: strips are narrower than that share.
_FIRST, _SPLITS, _STRIP = 64, 1 / 400, 2.0**-34
#: Most intervals that are tried: half a minute of work.
_MOST = 4_000
#: Steps of interval Newton towards a zero, and how narrow it is to be.
_NEWTON, _NARROW = 12, 1e-24


@dataclass(frozen=True, eq=False)
class _Zero:
    """The only release of a period-1 orbit within an interval of phases.

    Attributes
    ----------
    first, last : the interval
    phase : where in it
    returns : releases of the orbit that follow within a period, the last one the same again
    """

    first: float
    last: float
    phase: arb
    returns: list[Returned]

    def is_at(self, t: arb, period: arb) -> bool:
        """Tell whether a phase of a release of some period-1 orbit is this one."""
        for turns in (-2, -1, 0):
            moved = t + turns * period
            if moved > self.first and moved < self.last:
                return True
        return False


def searched(model: Model, vector: FloatArray) -> CensusCertificate:
    """Return all period-1 orbits with a stick, proved."""
    params = model.mapping(vector)
    with working(_BITS):
        search = _Search(model, vector)
        search.run()
        orbits = search.orbits()
        return CensusCertificate(params, tuple(orbits), tuple(_merged(search.strips)), search.count)


def _merged(strips: list[Strip]) -> list[Strip]:
    """Return strips in their order, those that touch as one."""
    found: list[Strip] = []
    for strip in sorted(strips, key=lambda s: s.first):
        if found and strip.first <= found[-1].last:
            found[-1] = Strip(found[-1].first, max(strip.last, found[-1].last), found[-1].why)
        else:
            found.append(strip)
    return found


class _Search:
    """Covers the phases of one period."""

    def __init__(self, model: Model, vector: FloatArray) -> None:
        self.model, self.vector = model, vector
        balls = ball_model(model, model.mapping(vector))
        self.follower, self.period = Follower(balls), balls.period
        self.strips: list[Strip] = []
        self.zeros: list[_Zero] = []
        self.count = 0

    def run(self) -> None:
        """Decide intervals until all phases are decided, or in narrow strips."""
        period = float(self.period.upper()) * (1 + 1e-15)
        begin = self._begin(period)
        ends = begin + period * np.linspace(0.0, 1.0, _FIRST + 1)
        ends[-1] = max(ends[-1], float((begin + self.period).upper()) * (1 + 1e-15))
        waiting = [
            (a - b, a, b) for a, b in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True)
        ]
        heapify(waiting)
        while waiting:  # the widest first
            _, first, last = heappop(waiting)
            self.count += 1
            why = self._decided(first, last, period)
            if not why:
                continue
            if last - first < _STRIP * period or self.count > _MOST:
                self.strips.append(Strip(first, last, why))
                continue
            middle = 0.5 * (first + last)
            heappush(waiting, (first - middle, first, middle))
            heappush(waiting, (middle - last, middle, last))

    def _begin(self, period: float) -> float:
        """Return a phase at which no release is possible: intervals begin and end there."""
        phases = period * (np.arange(_FIRST) + 0.37) / _FIRST
        rates = [float(self.follower.force_rate(arb(t)).mid()) for t in phases.tolist()]
        return float(phases[int(np.argmax(rates))])

    def _decided(self, first: float, last: float, period: float) -> str:
        """Decide what is released in an interval of phases; return why not, empty if it is decided."""
        middle, half = (arb(first) + arb(last)) / 2, (arb(last) - arb(first)) / 2
        phase = LineInS(middle, half, arb(0))
        if self.follower.force_rate(phase.whole) > 0:
            return ""
        try:
            returns = self.follower.follow(phase, splits=last - first < _SPLITS * period)
        except UndecidedError as error:
            return str(error)
        again = [r for r in returns if r.surface == "F+" and r.apart.whole.contains(0)]
        if not again:
            return ""
        if len(again) > 1 or not again[0].smooth:
            return "a solution may return on one side of a jump"
        if (again[0].slope - 1).contains(0):
            return "the derivative of the return may be 1"
        signs = [self._sign(t, again[0]) for t in (first, last)]
        if 0 in signs:
            return "the end of an interval may be the release of an orbit"
        try:
            if signs[0] != signs[1]:
                self._narrow(first, last, again[0])
        except UndecidedError as error:
            return str(error)
        return ""

    def _sign(self, t: float, like: Returned) -> int:
        """Return the sign of g at a phase, 0 if it is not known."""
        try:
            apart = self._at(arb(t), like)[-1].apart.whole
        except UndecidedError:
            return 0
        return 1 if apart > 0 else -1 if apart < 0 else 0

    def _at(self, t: arb, like: Returned) -> list[Returned]:
        """Return the releases after that in a narrow ball of phases, up to that with the same itinerary."""
        returns = self.follower.follow(LineInS(arb(t.mid()), arb(t.rad()), arb(0)), splits=False)
        at = [k for k, r in enumerate(returns) if r.itinerary == like.itinerary]
        if not at:
            raise UndecidedError("the segments differ")
        return returns[: at[0] + 1]

    def _narrow(self, first: float, last: float, like: Returned) -> None:
        """Add the only zero in an interval, narrowed by interval Newton."""
        phase, slope = arb(first).union(arb(last)), like.slope - 1
        for _ in range(_NEWTON):
            middle = arb(phase.mid())
            moved = middle - self._at(middle, like)[-1].apart.whole / slope
            phase = phase.intersection(moved)
            if phase.rad() < _NARROW:
                break
            slope = self._at(phase, like)[-1].slope - 1
        self.zeros.append(_Zero(first, last, phase, self._at(phase, like)))

    # ------------------------------------------------------------------ orbits

    def orbits(self) -> list[ProvedOrbit]:
        """Return the orbits of all zeros, of two that are symmetry images of each other one."""
        left, found = list(range(len(self.zeros))), []
        while left:
            zero = self.zeros[left[0]]
            own = self._releases(zero, "F+", arb(0))
            images = self._releases(zero, "F-", self.period / 2)
            symmetric = bool(own & images)
            found.append(self._orbit(zero, sorted(own), symmetric))
            left = [k for k in left if k not in own | images and k != left[0]]
        return sorted(found, key=lambda one: (len(one.orbit.stops), one.orbit.name))

    def _releases(self, zero: _Zero, surface: str, shift: arb) -> set[int]:
        """Return the numbers of the zeros that are releases of an orbit, or of its image."""
        times = [r.time.whole + shift for r in zero.returns if r.surface == surface]
        return {
            k for k, other in enumerate(self.zeros) for t in times if other.is_at(t, self.period)
        }

    def _orbit(self, zero: _Zero, own: list[int], symmetric: bool) -> ProvedOrbit:
        last = zero.returns[-1]
        system = build_system(self.model, last.itinerary, 1)
        joints = np.array([[t, x, 0.0] for t, x in last.joints])
        near = Orbit(system, joints, self.vector, np.inf)
        refined = refine_with_symmetry(near)
        orbit = refined if refined.converged else near
        phases = [self._folded(self.zeros[k].phase) for k in own]
        multiplier = arb(last.slope)
        return ProvedOrbit(orbit, tuple(phases), multiplier, symmetric, not symmetric)

    def _folded(self, t: arb) -> arb:
        return t - self.period if t > self.period else t
