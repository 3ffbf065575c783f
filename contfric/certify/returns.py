r"""One return of the release map, proved for a whole interval of phases.

A release at phase ``t = m + s d``, s in [-1, 1], has the state on both surfaces of the release. The segments
until the next one are those of a simulation in the middle. Along each the extended state is known as
``w_0 + s w_1 + w_r`` (:mod:`contfric.certify.affine`), the time of its end as ``tau_0 + s tau_1 + rho``:
interval Newton at ``tau_0 + s tau_1`` shows that the exit is met once. All inequalities of the motion hold
over all segments (:mod:`contfric.certify.inequalities`), so that this meeting is the first one, and the law
leads on as the simulation did. So the map is continuous on the interval.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from flint import arb, arb_mat

from contfric.certify.affine import Affine
from contfric.certify.chain import Chain, segments_of
from contfric.certify.closing import closing_of, keeps
from contfric.certify.inequalities import inequalities
from contfric.errors import ContfricError
from contfric.models.balls.build import ball_model
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector, column, numbers
from contfric.models.definition import FloatArray, Model
from contfric.orbit.simulation import run
from contfric.orbit.system import System, build_system

_HALF = arb(0, 1)  # all s
#: A return has at most this many segments, and lasts at most this many periods.
_EVENTS, _PERIODS = 60, 50.0
#: Newton steps towards an exit, and how often the width of its time is widened.
_NEWTON, _TRIES = 6, 6


class UndecidedError(ContfricError):
    """A return is not proved on an interval; a shorter one may be."""


@dataclass(frozen=True)
class Release:
    """Where rest is left: at which surface, from which mode, and what follows.

    Attributes
    ----------
    mode, surface : of the rest, and where it ends
    rests : the surface that is rested on
    following, on : index of the mode that follows, surfaces that it starts on as bits
    image : the surface of the image of the release under the symmetry; empty if there is none
    """

    mode: str
    surface: str
    rests: str
    following: int
    on: int
    image: str


@dataclass(frozen=True)
class Line:
    """A number that depends on s: ``at + s slope + rest``."""

    at: arb
    slope: arb
    rest: arb

    @property
    def whole(self) -> arb:
        """All values."""
        return self.at + self.slope * _HALF + self.rest


class ReturnMap:
    """The release map in balls."""

    def __init__(self, model: Model, vector: FloatArray, release: Release) -> None:
        self.model, self.vector, self.release = model, vector, release
        self.balls: BallModel = ball_model(model, model.mapping(vector))
        self.systems: dict[tuple[tuple[str, str], ...], System] = {}

    def follow(self, phase: Line) -> tuple[Line, tuple[tuple[str, str], ...]]:
        """Return the phase of the next release, and the segments until then.

        Raises
        ------
        UndecidedError
            If it is not proved.
        """
        state = self._start(phase)
        word, lasts = self._simulated(phase.at, state)
        time, joints = phase, [self._joint(phase, state)]
        for (mode, exit_), last in zip(word, lasts, strict=True):
            after, state = self._segment(mode, exit_, state, last)
            time = Line(time.at + after.at, time.slope + after.slope, time.rest + after.rest)
            joints.append(self._joint(time, state))
        system = self._system(word)
        segments = segments_of(system)
        chain = Chain(segments, self.balls)
        closing = closing_of(segments, self.balls, system.half)
        for found in inequalities(chain, system, joints, closing):
            if not found.finding.proved:
                raise UndecidedError(str(found.named(system)))
        shift = self.balls.period / 2 if system.half else arb(0)
        return Line(time.at - shift, time.slope, time.rest), word

    def _system(self, word: tuple[tuple[str, str], ...]) -> System:
        if word not in self.systems:
            half = word[-1][1] != self.release.surface
            system = build_system(self.model, word, 1, half)
            segments = segments_of(system)
            if half and not keeps(system, segments, self.balls, self.balls):
                raise UndecidedError("the symmetry is not exact")
            self.systems[word] = system
        return self.systems[word]

    # ------------------------------------------------------------------ the start

    def _start(self, phase: Line) -> Affine:
        """Return the extended state of a release: on both of its surfaces."""
        n, balls = self.balls.states, self.balls
        zero = [arb(0)] * n
        at, rates = balls.extended(phase.at, zero), balls.by_time(phase.at, 1)
        spread = balls.by_time(phase.whole, 1)
        change = phase.slope * _HALF
        slope = [r * phase.slope for r in rates]
        rest = [(w - r) * change + w * phase.rest for w, r in zip(spread, rates, strict=True)]
        parts = [column(part) for part in (at, slope, rest)]
        names = (self.release.surface, self.release.rests)
        rows = arb_mat([numbers(balls.surfaces[name]) for name in names])
        matrix = arb_mat([[rows[a, b] for b in range(n)] for a in range(len(names))])
        found = []
        for part in parts:
            y = matrix.solve(rows * part * -1)
            found.append(column([*(y[k, 0] for k in range(n)), *numbers(part)[n:]]))
        return Affine(found[0], found[1], found[2], _HALF)

    def _joint(self, time: Line, state: Affine) -> Vector:
        return [time.whole, *numbers(state.whole)[: self.balls.states]]

    def _simulated(
        self, time: arb, state: Affine
    ) -> tuple[tuple[tuple[str, str], ...], list[float]]:
        """Return the segments until the next release from a start in the middle, and how long they last."""
        start = float(time.mid())
        y = [float(state.at[k, 0].mid()) for k in range(self.balls.states)]
        release, period = self.release, float(self.balls.period.mid())
        start %= period
        found = run(
            self.model,
            self.vector,
            release.following,
            release.on,
            start,
            np.array(y),
            _PERIODS,
            _EVENTS,
        )
        ends = [start, *(found.cycles * period + found.times).tolist()]
        lasts = np.diff(ends).tolist()
        for k, (mode, exit_) in enumerate(found.word):
            if mode == release.mode and exit_ in (release.surface, release.image):
                return found.word[: k + 1], lasts[: k + 1]
        raise UndecidedError("no release follows in the simulation")

    # ------------------------------------------------------------------ a segment

    def _segment(self, mode: str, exit_: str, state: Affine, lasts: float) -> tuple[Line, Affine]:
        """Return how long a segment lasts, and the extended state at its end."""
        field, row = self.balls.fields[mode], self.balls.surfaces[exit_]
        middle = self._refined(field, row, state, arb(lasts))
        flow = (field * middle).exp()
        there = _fixed(flow) * state
        slope = -(row * there.slope)[0, 0] / (row * field * there.at)[0, 0]
        slope = arb(slope.mid())
        if not slope.is_finite():
            raise UndecidedError("a stop may be tangential")
        along = self._moved(field, there, slope, arb(0))
        missed = (_fixed(row) * along).whole[0, 0]
        width = 2 * missed.abs_upper() / (row * field * there.at)[0, 0].abs_lower()
        for _ in range(_TRIES):
            beside = arb(0, width.abs_upper() if width.is_finite() else 0)
            wide = self._moved(field, there, slope, beside)
            rate = (row * field * wide.whole)[0, 0]
            rest = -missed / rate
            if rest.is_finite() and beside.contains_interior(rest):
                end = self._moved(field, there, slope, rest)
                return Line(middle, slope, rest), _on(end, row, self.balls.states)
            width = 4 * width
        raise UndecidedError("a stop may be tangential")

    def _refined(self, field: arb_mat, row: arb_mat, state: Affine, guess: arb) -> arb:
        """Return about when the exit is met from the start in the middle; exact."""
        for _ in range(_NEWTON):
            there = (field * guess).exp() * state.at
            step = (row * there)[0, 0] / (row * field * there)[0, 0]
            if not step.is_finite():
                break
            guess = arb((guess - step).mid())
        return guess

    def _moved(self, field: arb_mat, there: Affine, slope: arb, beside: arb) -> Affine:
        """Return the state after a further time ``s slope + beside``."""
        delta = slope * _HALF + beside
        size = field.nrows()
        one = arb_mat([[int(a == b) for b in range(size)] for a in range(size)])
        linear = (field * slope).mid()
        rest = (field * slope - linear) * _HALF + field * beside
        square = arb(0, (delta * delta / 2).abs_upper())
        rest += field * field * (field * (delta * _HALF)).exp() * square
        return Affine(one, linear, rest, _HALF) * there


def _fixed(matrix: arb_mat) -> Affine:
    nothing = arb_mat(matrix.nrows(), matrix.ncols())
    return Affine(matrix, nothing, nothing, _HALF)


def _on(state: Affine, row: arb_mat, states: int) -> Affine:
    """Return a state that is known to lie on a surface: a row of one state says that it is exactly zero."""
    entries = numbers(row)
    found = [k for k, x in enumerate(entries) if not x.is_zero()]
    if len(found) != 1 or found[0] >= states:
        return state
    parts = [list(numbers(part)) for part in (state.at, state.slope, state.rest)]
    for part in parts:
        part[found[0]] = arb(0)
    at, slope, rest = (column(part) for part in parts)
    return Affine(at, slope, rest, _HALF)
