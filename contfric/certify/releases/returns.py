r"""One return of the release map, proved for a whole interval of phases.

A release at phase ``t = m + s d``, s in [-1, 1], has the state on both surfaces of the release. The segments
until the next one are those of a simulation in the middle. Along each the extended state is known as
``w_0 + s w_1 + w_r``, the time of its end as ``tau_0 + s tau_1 + rho``
(:mod:`contfric.certify.releases.stretch`). All inequalities of the motion hold over all segments
(:mod:`contfric.certify.inequalities.along_segments`), so that the end is the
first meeting with the exit, and the law leads on as the simulation did. So the map is continuous on the
interval.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from flint import arb

from contfric.base.arrays import FloatArray
from contfric.bvp.system import System, build_system
from contfric.certify.enclosures.affine import AffineMatrix
from contfric.certify.equations.chain import Chain, segments_of
from contfric.certify.equations.closing import closing_of, keeps
from contfric.certify.inequalities.along_segments import inequalities
from contfric.certify.releases.stretch import LineInS, UndecidedError, ended, released
from contfric.models.balls.build import ball_model
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector, numbers
from contfric.models.definition import Model
from contfric.simulation.simulate import run

#: A return has at most this many segments, and lasts at most this many periods.
_EVENTS, _PERIODS = 60, 50.0


@dataclass(frozen=True)
class Release:
    """Where rest is left: at which surface, from which mode, and what follows.

    Attributes
    ----------
    mode, surface : of the rest, and where it ends
    rests : the surface that is rested on
    following, on : index of the mode that follows, surfaces that it starts on as bits
    image : the surface of the image of the release under the symmetry; empty without one
    """

    mode: str
    surface: str
    rests: str
    following: int
    on: int
    image: str


class ReturnMap:
    """The release map in balls."""

    def __init__(self, model: Model, vector: FloatArray, release: Release) -> None:
        self.model, self.vector, self.release = model, vector, release
        self.balls: BallModel = ball_model(model, model.mapping(vector))
        self.systems: dict[tuple[tuple[str, str], ...], System] = {}

    def follow(self, phase: LineInS) -> tuple[LineInS, tuple[tuple[str, str], ...]]:
        """Return the phase of the next release, and the segments until then.

        Raises
        ------
        UndecidedError
            If it is not proved.
        """
        state = released(self.balls, (self.release.surface, self.release.rests), phase)
        itinerary, lasts = self._simulated(phase.at, state)
        time, joints = phase, [self._joint(phase, state)]
        for (mode, exit_), last in zip(itinerary, lasts, strict=True):
            after, state = ended(self.balls, mode, exit_, state, last)
            time = time + after
            joints.append(self._joint(time, state))
        system = self._system(itinerary)
        segments = segments_of(system)
        chain = Chain(segments, self.balls)
        closing = closing_of(segments, self.balls, system.half)
        for found in inequalities(chain, system, joints, closing):
            if not found.finding.proved:
                raise UndecidedError(str(found.named(system)))
        shift = self.balls.period / 2 if system.half else arb(0)
        return LineInS(time.at - shift, time.slope, time.rest), itinerary

    def _system(self, itinerary: tuple[tuple[str, str], ...]) -> System:
        if itinerary not in self.systems:
            half = itinerary[-1][1] != self.release.surface
            system = build_system(self.model, itinerary, 1, half)
            segments = segments_of(system)
            if half and not keeps(system, segments, self.balls, self.balls):
                raise UndecidedError("the symmetry is not exact")
            self.systems[itinerary] = system
        return self.systems[itinerary]

    def _joint(self, time: LineInS, state: AffineMatrix) -> Vector:
        return [time.whole, *numbers(state.whole)[: self.balls.states]]

    def _simulated(
        self, time: arb, state: AffineMatrix
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
        for k, (mode, exit_) in enumerate(found.itinerary):
            if mode == release.mode and exit_ in (release.surface, release.image):
                return found.itinerary[: k + 1], lasts[: k + 1]
        raise UndecidedError("no release follows in the simulation")
