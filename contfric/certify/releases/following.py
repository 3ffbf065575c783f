r"""All solutions of a dry friction oscillator that are released in an interval of phases, in balls.

A release on F+ at phase t has the state ``x = S0 + f(t), v = 0``. What follows is read off the law: a slide
ends where v vanishes for the first time; at a stop it rests if ``|u| < S0``, and reverses if ``|u| > S0``;
rest ends where ``|u| = S0`` for the first time, and the slide that follows has the direction ``-sgn u``. Each
segment is first tried for the interval as a whole: its end is met transversally
(:mod:`contfric.certify.releases.stretch`) and not before (:mod:`contfric.certify.inequalities.sign`); then
the time of the end is a smooth function of the phase. Where that is not so, and the interval is narrow, the
set is *split*: the first times are known to lie in some clusters
(:mod:`contfric.certify.releases.first_times`), each of which is followed by itself, with its whole width as a
ball; at a stop whose load may lie on either side of S0, rest and reversal are both followed. Every solution
of the law is one of those that are followed, whatever it does at a jump of the map; not all that are followed
are solutions.

The derivative of the time of a release by the phase of the first one is the product of the derivatives of the
segments, for disturbances (dt, dx) of time and place of a stop: with the free response E of a slide, and the
accelerations a_0 and a_1 at its ends,

    dt' = (a_0 E_vv dt - E_vx dx) / a_1,     dx' = E_xx dx - E_xv a_0 dt,

and for rest ``dt' = dx / f'(t')``, ``dx' = dx``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from flint import arb, arb_mat

from contfric.base.arrays import FloatArray
from contfric.certify.enclosures.affine import AffineMatrix
from contfric.certify.inequalities.sign import Path, positive
from contfric.certify.releases.first_times import FirstTimes, first_times
from contfric.certify.releases.stretch import (
    HALF,
    LineInS,
    UndecidedError,
    ended,
    released,
    with_zero,
)
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import column

Itinerary = tuple[tuple[str, str], ...]
#: Entries of the extended state: displacement and velocity.
_X, _V = 0, 1
#: Steps of a period in which the end of a segment is looked for, and how far beyond the period.
_STEPS, _BEYOND = 256, 1.04
#: Longest spread of the times of a set that is split, as a share of the period.
_SPREAD = 0.01
#: Most segments of all solutions of one set.
_SEGMENTS = 200
_LIMIT = {"F+": 1, "F-": -1}
_DIRECTION = {"slide+": 1, "slide-": -1}
_SLIDES = {1: "slide+", -1: "slide-"}


@dataclass(frozen=True, eq=False)
class SolutionSet:
    """A set of solutions at the start of a segment.

    Attributes
    ----------
    mode : of the segment
    time : when it starts
    state : the extended state there
    change : derivatives (dt, dx) of time and place of the start by the phase of the release
    itinerary : segments since the release
    joints : times and displacements where these began, for the middle of the interval
    smooth : whether the start is a smooth function of the phase
    begins : whether v and its rate vanish at the start (2), or v only (1)
    """

    mode: str
    time: LineInS
    state: AffineMatrix
    change: tuple[arb, arb]
    itinerary: Itinerary = ()
    joints: tuple[tuple[float, float], ...] = ()
    smooth: bool = True
    begins: int = 1


@dataclass(frozen=True, eq=False)
class Returned:
    """A release that follows, on F+ or F-.

    Attributes
    ----------
    surface : F+ or F-
    time : when it is
    apart : how much later than a period after the first one
    slope : derivative of its time by the phase of the first release; a ball over the interval
    itinerary, joints, smooth : see :class:`SolutionSet`
    """

    surface: str
    time: LineInS
    apart: LineInS
    slope: arb
    itinerary: Itinerary
    joints: tuple[tuple[float, float], ...]
    smooth: bool


class Follower:
    """Follows sets of releases on F+ for one period.

    Parameters
    ----------
    balls : the oscillator with the modes slide+, slide- and stick and the surfaces F+, F- and v
    """

    def __init__(self, balls: BallModel) -> None:
        self.balls = balls

    @cached_property
    def _released(self) -> int:
        """How many of v and its rate vanish after a release: with S0 = S the acceleration does, too."""
        level = -self.balls.rows["F+"][2]  # S0
        kinetic = self.balls.fields["slide-"][_V, 2]  # S
        return 2 if (level - kinetic).is_zero() else 1

    @cached_property
    def _tables(self) -> dict[str, FloatArray]:
        """Powers of the flow of one step in floats, shape (_STEPS + 1, D, D)."""
        step = self.balls.period / _STEPS
        found = {}
        for mode, field in self.balls.fields.items():
            flow = (field * step).exp()
            one = np.array([float(c.mid()) for c in flow.entries()]).reshape(flow.nrows(), -1)
            powers = [np.eye(len(one))]
            for _ in range(int(_STEPS * _BEYOND)):
                powers.append(one @ powers[-1])
            found[mode] = np.array(powers)
        return found

    def follow(self, phase: LineInS, splits: bool) -> list[Returned]:
        """Return the releases that may follow a set of releases on F+ within a period.

        Parameters
        ----------
        phase : of the releases, for s in [-1, 1]
        splits : whether the set may be split where what follows is not the same for all

        Raises
        ------
        UndecidedError
            If what follows is not known.
        """
        state = with_zero(released(self.balls, ("F+", "v"), phase), _V)
        shift = self.force_rate(phase.whole)
        start = SolutionSet("slide-", phase, state, (arb(1), shift), begins=self._released)
        found: list[Returned] = []
        waiting = [start]
        for _ in range(_SEGMENTS):
            if not waiting:
                return found
            stretch = waiting.pop()
            left = LineInS(phase.at + self.balls.period, phase.slope, phase.rest) - stretch.time
            if left.whole < 0:
                continue
            after = self._after(stretch, left.whole.upper(), splits)
            for mode, exit_, end in after:
                if mode == "stick":
                    found.append(self._returned(end, exit_, phase))
                waiting.append(end)
        raise UndecidedError("too many segments follow")

    def force_rate(self, t: arb) -> arb:
        """Return f'(t): minus the rate of the load at rest."""
        at_rest = column(self.balls.extended(t, [arb(0), arb(0)]))
        return -(self.balls.surfaces["F+"] * self.balls.fields["stick"] * at_rest)[0, 0]

    def _returned(self, end: SolutionSet, exit_: str, phase: LineInS) -> Returned:
        apart = end.time - LineInS(phase.at + self.balls.period, phase.slope, phase.rest)
        return Returned(
            exit_, end.time, apart, end.change[0], end.itinerary, end.joints, end.smooth
        )

    # ------------------------------------------------------------------ one segment

    def _after(
        self, stretch: SolutionSet, longest: arb, splits: bool
    ) -> list[tuple[str, str, SolutionSet]]:
        """Return mode and exit of a segment with what starts after it, for all that may follow in a time."""
        if not stretch.smooth and stretch.time.whole.rad() > _SPREAD * self.balls.period:
            raise UndecidedError("what follows a split is spread over a long time")
        try:
            return self._together(stretch, self._guess(stretch), longest, splits)
        except UndecidedError:
            if not splits and stretch.time.slope > _SPREAD:  # a shorter interval is cheaper
                raise
        times = self._times(stretch, longest)
        ends = [
            (float(low.union(high).mid()), exit_) for exit_, f in times for low, high in f.clusters
        ]
        if len(ends) == 1:  # one that steps of the period are too long for
            try:
                return self._together(stretch, ends[0][::-1], longest, splits)
            except UndecidedError:
                pass
        if not splits:
            raise UndecidedError("a contact may be a grazing one")
        return self._apart(stretch, times)

    def _together(
        self, stretch: SolutionSet, guess: tuple[str, float] | None, longest: arb, splits: bool
    ) -> list[tuple[str, str, SolutionSet]]:
        """Return what follows a segment that ends in one way for all solutions of the set."""
        exits = self._exits(stretch.mode)
        path = Path(self.balls.fields[stretch.mode], stretch.state.whole, longest)
        if guess is None:
            for exit_, sign in exits:
                self._shown(path, exit_, sign, stretch, False)
            return []
        exit_, lasts = guess
        after, state = ended(self.balls, stretch.mode, exit_, stretch.state, lasts)
        if not after.whole > 0:
            raise UndecidedError("a segment may have no length")
        path = replace(path, duration=after.whole.upper())
        for name, sign in exits:
            self._shown(path, name, sign, stretch, name == exit_)
        change = self._changed(stretch, state, after)
        return self._onward(stretch, exit_, stretch.time + after, state, change, splits)

    def _exits(self, mode: str) -> list[tuple[str, int]]:
        """Return the surfaces that end a mode, with the sign of their observable in it."""
        return [("F+", -1), ("F-", 1)] if mode == "stick" else [("v", _DIRECTION[mode])]

    def _shown(self, path: Path, surface: str, sign: int, stretch: SolutionSet, ends: bool) -> None:
        order = stretch.begins if surface == "v" else 0
        finding = positive(path, self.balls.surfaces[surface] * sign, order, ends)
        if not finding.proved:
            raise UndecidedError(f"{stretch.mode}, {surface}: {finding.why}")

    def _guess(self, stretch: SolutionSet) -> tuple[str, float] | None:
        """Return the exit of the solution in the middle, and about when it is, or None."""
        start = np.array([float(c.mid()) for c in stretch.state.at.entries()])
        states = self._tables[stretch.mode] @ start
        step = float(self.balls.period.mid()) / _STEPS
        found = []
        for surface, sign in self._exits(stretch.mode):
            row = np.array([float(c.mid()) for c in self.balls.rows[surface]])
            values = sign * (states @ row)
            below = np.flatnonzero((values[1:] <= 0) & (values[:-1] > 0))
            if stretch.mode != "stick":
                below = below[below > 0]
            if len(below):
                k = int(below[0])
                share = values[k] / (values[k] - values[k + 1])
                found.append(((k + share) * step, surface))
        if not found:
            return None
        lasts, surface = min(found)
        return surface, float(lasts)

    def _changed(self, stretch: SolutionSet, end: AffineMatrix, after: LineInS) -> tuple[arb, arb]:
        """Return the derivatives of time and place of the end of a segment by the phase."""
        dt, dx = stretch.change
        field = self.balls.fields[stretch.mode]
        if stretch.mode == "stick":
            return dx / -(self.balls.surfaces["F+"] * field * end.whole)[0, 0], dx
        flow = (field * after.whole).exp()
        first, last = ((field * w)[_V, 0] for w in (stretch.state.whole, end.whole))
        changed = (first * flow[_V, _V] * dt - flow[_V, _X] * dx) / last
        return changed, flow[_X, _X] * dx - flow[_X, _V] * first * dt

    def _onward(
        self,
        stretch: SolutionSet,
        exit_: str,
        time: LineInS,
        state: AffineMatrix,
        change: tuple[arb, arb],
        splits: bool,
    ) -> list[tuple[str, str, SolutionSet]]:
        """Return what starts at the end of a segment, by the law."""
        state = with_zero(state, _V)
        itinerary = (*stretch.itinerary, (stretch.mode, exit_))
        middle = float(stretch.time.at.mid()), float(stretch.state.at[_X, 0].mid())
        joints = (*stretch.joints, middle)
        base = SolutionSet("stick", time, state, change, itinerary, joints, stretch.smooth)
        if stretch.mode == "stick":
            slide = _SLIDES[-_LIMIT[exit_]]
            return [(stretch.mode, exit_, replace(base, mode=slide, begins=self._released))]
        modes = self._modes_after_stop(state)
        if len(modes) > 1 and not splits:
            raise UndecidedError("the load at a stop may be S0")
        smooth = stretch.smooth and len(modes) == 1
        return [(stretch.mode, exit_, replace(base, mode=mode, smooth=smooth)) for mode in modes]

    def _modes_after_stop(self, state: AffineMatrix) -> list[str]:
        """Return the modes that may follow a stop: rest, a slide, or one of several."""
        above, below = ((self.balls.surfaces[k] * state.whole)[0, 0] for k in ("F+", "F-"))
        found = []
        if not above > 0 and not below < 0:
            found.append("stick")
        if not above < 0:
            found.append("slide-")
        if not below > 0:
            found.append("slide+")
        return found

    # ------------------------------------------------------------------ a set that is split

    def _times(self, stretch: SolutionSet, longest: arb) -> list[tuple[str, FirstTimes]]:
        """Return for each exit when it may be met first."""
        path = Path(self.balls.fields[stretch.mode], stretch.state.whole, longest)
        order = 0 if stretch.mode == "stick" else stretch.begins
        return [
            (exit_, first_times(path, self.balls.surfaces[exit_] * sign, order))
            for exit_, sign in self._exits(stretch.mode)
        ]

    def _apart(
        self, stretch: SolutionSet, times: list[tuple[str, FirstTimes]]
    ) -> list[tuple[str, str, SolutionSet]]:
        """Return what may follow a segment, for each cluster of times at which it may end."""
        field, start = self.balls.fields[stretch.mode], stretch.state.whole
        if any(found.all_end and not found.clusters for _, found in times):
            raise UndecidedError(f"{stretch.mode}: the times of its end are not known")
        lasts = [found.clusters[-1][1] for _, found in times if found.all_end]
        nowhere = (arb("nan"), arb("nan"))
        split = replace(stretch, smooth=False)
        after = []
        for exit_, found in times:
            for low, high in found.clusters:
                if any(low > last for last in lasts):
                    continue
                duration = low.union(high)
                state = _within(field, start, duration)
                time = _ball(stretch.time.whole + duration)
                after += self._onward(split, exit_, time, state, nowhere, True)
        return after


def _ball(t: arb) -> LineInS:
    return LineInS(arb(t.mid()), arb(0), arb(0, t.rad()))


def _within(field: arb_mat, start: arb_mat, times: arb) -> AffineMatrix:
    """Return all states at some times after a start.

    By Taylor's theorem to the third order: about a grazing contact the first two terms nearly vanish.
    """
    middle, delta = arb(times.mid()), arb(0, times.rad())
    there = (field * middle).exp() * start
    rate = field * there
    bend = field * rate
    rest = field * (field * delta).exp() * bend
    # the signs of delta and its third power are free, that of its square is not
    square = arb(0, 1) * (delta.abs_upper() ** 2) / 4 + delta.abs_upper() ** 2 / 4
    end = there + rate * delta + bend * square + rest * arb(0, (delta.abs_upper() ** 3) / 6)
    centre = end.mid()
    return AffineMatrix(centre, arb_mat(end.nrows(), 1), end - centre, HALF)
