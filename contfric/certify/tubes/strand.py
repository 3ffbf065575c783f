r"""A branch in balls: its chain with the phase for its time, its orbits, and its events as solutions of it.

Time is measured in phases of the excitation, ``theta = 2 pi t / T``. Along a branch in a frequency all
times of an orbit change with it, and the phases hardly do. In a box the product of the two balls of a
frequency and of a time would be wide; with phases the harmonics are ``cos n_k theta``, n_k whole numbers,
and the period is 2 pi at every value of the parameter. The fields of the states are multiplied by
``T / (2 pi)``, a positive number: signs of rates, and so all inequalities, stay what they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from flint import arb, arb_mat

from contfric.base.arrays import FloatArray
from contfric.certify.certificate import Certificate
from contfric.certify.equations.chain import Segments, segments_of
from contfric.certify.equations.closing import closing_of, is_symmetry
from contfric.certify.equations.extended import Builder
from contfric.certify.equations.kept import with_kept
from contfric.certify.equations.zeros import in_span
from contfric.certify.events import EventCertificate
from contfric.certify.inequalities.along_segments import DURATION, EXIT, InequalityName
from contfric.certify.tubes.meeting import as_zero_of
from contfric.continuation.branch import Branch
from contfric.events.bifurcation import TERMINAL, EndReason
from contfric.models.balls.build import ball_model
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector
from contfric.orbit.orbit import Orbit

#: Shortest step that is halved, as a share of the branch; events at its ends are as near to them and nearer.
_SHORTEST, _AT_END = 1e-5, 1e-8
#: Points nearer than this to an event or a limit at an end are no ends of boxes, as a share of the branch.
_NEAR = 1e-4
#: How far the box of a PD or BP may reach, as a share of the branch.
_FAR = 0.1


class Strand:
    """A branch in balls."""

    def __init__(self, branch: Branch) -> None:
        self.branch, self.parameter = branch, branch.parameter
        orbit = branch[len(branch) // 2]
        self.orbit = orbit
        low, high = float(branch.values.min()), float(branch.values.max())
        exact = self._model(arb(low))
        wide = self._model(arb(low).union(arb(high)))
        between = replace(exact, slopes=wide.slopes)
        half = branch.system.half
        self.whole = half and not is_symmetry(orbit, segments_of(orbit.system), between)
        chosen = orbit.as_whole() if self.whole else orbit
        self.system = chosen.system
        self.segments: Segments = with_kept(segments_of(self.system), wide, chosen.joints[0])
        self.build: Builder = self._build
        # the closure is that of whole numbers at every value of the parameter
        self.closes = closing_of(self.segments, self.build(arb(low)), self.system.half)
        length = float(branch.arc[-1] - branch.arc[0])
        self.shortest, self.far, self.end = _SHORTEST * length, _FAR * length, _AT_END * length

    def _model(self, value: arb) -> BallModel:
        return ball_model(self.branch.model, self.orbit.params, self.parameter, value)

    def _build(self, value: arb) -> BallModel:
        return in_phases(self._model(value))

    def plain(self, value: arb) -> BallModel:
        """Return the model without derivatives by the parameter."""
        branch = self.branch
        found = ball_model(branch.model, self.orbit.params, self.parameter, value, slopes=False)
        return in_phases(found)

    def point(self, orbit: Orbit) -> Vector:
        """Return joints (phase and state) and parameter of an orbit of the branch's chain, exact numbers."""
        if self.whole:
            orbit = orbit.as_whole()
        value = arb(orbit.params[self.parameter])
        period = self._model(value).period
        found = [[arb(float(c)) for c in row] for row in orbit.joints]
        if not period.is_zero():
            for joint in found:
                joint[0] *= 2 * arb.pi() / period
        return [*(c.mid() for joint in found for c in joint), value]

    def printed(self, point: Vector) -> FloatArray:
        """Return an orbit (z, p) as floats, with times for phases."""
        period = self._model(point[-1]).period
        scale = arb(1) if period.is_zero() else period / (2 * arb.pi())
        found = [float(c.mid()) for c in point]
        m = self.segments.states + 1
        found[:-1:m] = [float((c * scale).mid()) for c in point[:-1:m]]
        return np.array(found)

    def met_by(self, proofs: list[EventCertificate]) -> list[tuple[str, Vector, bool]]:
        """Return label and solution of the proved events on the branch, and whether one may end there."""
        found = []
        for proof in proofs:
            event = proof.event
            own = event.orbit.system is self.branch.system
            near = event.orbit if own else self.branch[0 if self._starts(proof) else -1]
            at = self.point(near)
            zero = as_zero_of(proof, self.system, self.segments, self.build, at)
            if proof.proved and zero is not None:
                found.append((event.label, zero, event.kind in TERMINAL))
        return found

    def _starts(self, proof: EventCertificate) -> bool:
        arc = self.branch.arc
        return proof.event.position <= 0.5 * float(arc[0] + arc[-1])

    def far_from(self, end: int) -> Vector:
        """Return the orbit of the branch up to which the box of an event at an end may reach."""
        apart = np.abs(self.branch.arc - self.branch.arc[end]) - self.far
        inner = np.flatnonzero(apart >= 0)
        return self.point(self.branch[int(inner[np.argmin(apart[inner])])])

    def enclosed(self, points: Sequence[Certificate]) -> dict[int, Vector]:
        """Return balls (z, p) of the printed orbits that are known in the chain of the branch, by number."""
        if self.whole:
            return {}
        found = {}
        for k, point in enumerate(points):
            if not point.enclosure or point.orbit.system.half != self.branch.system.half:
                continue
            value, m = arb(float(self.branch.values[k])), self.segments.states + 1
            period = self._model(value).period
            scale = arb(1) if period.is_zero() else 2 * arb.pi() / period
            joints = [x * scale if i % m == 0 else x for i, x in enumerate(point.enclosure)]
            found[k] = [*joints, value]
        return found

    def is_singular(self, name: InequalityName) -> bool:
        """Tell whether the chain is singular where an inequality ends, by its equations.

        It is where an exit is tangential and the next mode moves on as this one: then the time of the exit
        has no part in any equation. And where a hold after a touch has no duration and is left without
        acceleration: then the time of its end has none. The difference of the fields of the two modes is to
        be a combination of the observable and its rate, which vanish there. Where all matrices are affine
        in the parameter the minors that say so are of degree four at most: they vanish if they do at five
        values.
        """
        modes, i = [mode for mode, _ in self.orbit.itinerary], name.segment
        mode, after, pin = modes[i], modes[(i + 1) % len(modes)], self.segments.pins[i]
        held = isinstance(pin, tuple)
        if name.what != (DURATION if held else EXIT):
            return False
        along, met = pin if isinstance(pin, tuple) else (mode, self.segments.exits[i])
        low, high = float(self.branch.values.min()), float(self.branch.values.max())
        slopes = self._model(arb(low).union(arb(high))).slopes
        if slopes is None or not met or any(self.segments.resets) or not low < high:
            return False
        fields = (slopes.fields[own] for own in {mode, after, along})
        matrices = (*fields, slopes.surfaces[met])
        if not all(x.is_exact() for matrix in matrices for x in matrix.entries()):
            return False
        for value in np.linspace(low, high, 5):
            model = self._model(arb(float(value)))
            known = [model.rows[met], model.rate(met, along)]
            change = (model.fields[mode] - model.fields[after]).tolist()
            if not all(in_span(row, known) for row in change[: model.states]):
                return False
        return True

    def end_of(self, forward: bool) -> tuple[float, float]:
        """Return arclength and parameter at an end of the branch."""
        k = -1 if forward else 0
        return float(self.branch.arc[k]), float(self.branch.values[k])

    def is_twice(self, k: int) -> bool:
        """Tell whether the step from point k has no length: where a branch starts at the end of its range."""
        arc = self.branch.arc
        at_end = (k == 0 and self.has_edge(0)) or (k + 2 == len(arc) and self.has_edge(-1))
        return bool(arc[0] < arc[-1] and arc[k] == arc[k + 1]) and not at_end

    def is_limit(self, end: int) -> bool:
        """Tell whether the branch ends at a limit of its parameter."""
        return self.branch.ends[end].reason is EndReason.LIMIT

    def after(self, k: int) -> int:
        """Return the next point, or the one after those that are very near to an event or a limit at an end.

        Boxes next to them would reach beyond it. At events only of orbits with holds: next to a continuum,
        which others come to, long steps fail.
        """
        arc = self.branch.arc
        near, last = _NEAR * float(arc[-1] - arc[0]), len(arc) - 1
        if k == 0 and self._is_skipped(0):
            return next((j for j in range(1, last) if arc[j] - arc[0] > near), last)
        return last if self._is_skipped(-1) and arc[-1] - arc[k + 1] < near else k + 1

    def _is_skipped(self, end: int) -> bool:
        """Tell whether points very near to an end are no ends of boxes."""
        return self.is_limit(end) or (bool(self.system.holds) and self.has_edge(end))

    def has_edge(self, end: int) -> bool:
        """Tell whether the branch ends at an event of its inequalities, or at a limit of its parameter."""
        if self.branch.ends[end].reason.name in [kind.value for kind in TERMINAL]:
            return True
        if self.is_limit(end):
            return True
        at = float(self.branch.arc[end])
        return any(
            event.kind in TERMINAL and abs(event.position - at) <= self.end
            for event in self.branch.bifurcations
        )


def in_phases(model: BallModel) -> BallModel:
    """Return a model with the phase for its time; one without excitation as it is."""
    if model.period.is_zero():
        return model
    two_pi = 2 * arb.pi()
    scale, slopes = model.period / two_pi, None
    if model.slopes is not None:
        slopes = _slopes(model, model.slopes, scale, model.slopes.period / two_pi)
    turns = [arb(n) for n in model.turns]
    fields = {name: _scaled(model, field, scale) for name, field in model.fields.items()}
    return BallModel(
        model.states,
        turns,
        fields,
        model.surfaces,
        two_pi,
        model.turns,
        model.resets,
        slopes,
        model.alike,
        unscaled=model.fields,
        kept=model.kept,
    )


def _slopes(model: BallModel, slopes: BallModel, scale: arb, change: arb) -> BallModel:
    """Return the derivatives of a model in phases, and the second ones where they are known."""
    fields = {
        name: _sum(model.states, [(slopes.fields[name], scale), (field, change)])
        for name, field in model.fields.items()
    }
    still = [arb(0)] * len(model.turns)
    second = slopes.slopes
    bend = None
    if second is not None:
        twice = second.period / (2 * arb.pi())
        bends = {
            name: _sum(
                model.states,
                [(second.fields[name], scale), (slopes.fields[name], 2 * change), (field, twice)],
            )
            for name, field in model.fields.items()
        }
        bend = replace(second, frequencies=still, fields=bends, period=arb(0))
    return replace(slopes, frequencies=still, fields=fields, period=arb(0), slopes=bend)


@cache
def _only_states(states: int, size: int) -> arb_mat:
    """Return the matrix that keeps the rows of the states."""
    return arb_mat([[int(a == b < states) for b in range(size)] for a in range(size)])


@cache
def _harmonics(states: int, turns: tuple[int, ...]) -> arb_mat:
    """Return the rows of the harmonics by phase: whole numbers."""
    found = arb_mat(*[states + 1 + 2 * len(turns)] * 2)
    for k, n in enumerate(turns):
        at = states + 1 + 2 * k
        found[at, at + 1], found[at + 1, at] = arb(-n), arb(n)
    return found


def _scaled(model: BallModel, field: arb_mat, scale: arb) -> arb_mat:
    """Return the field by phase: its rows of the states scaled, those of the harmonics whole numbers."""
    own = _only_states(model.states, model.size) * field * scale
    return own + _harmonics(model.states, tuple(model.turns))


def _sum(states: int, parts: list[tuple[arb_mat, arb]]) -> arb_mat:
    """Return a sum of fields times factors, its rows of the states only."""
    total = arb_mat(parts[0][0].nrows(), parts[0][0].nrows())
    for matrix, factor in parts:
        total += matrix * factor
    return _only_states(states, total.nrows()) * total
