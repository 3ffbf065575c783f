"""The two halves of an orbit on a branch that ends at a period doubling, or at a symmetric orbit (BP)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from flint import arb, arb_mat

from contfric.bvp.system import System
from contfric.certify.equations.chain import Segments, segments_of
from contfric.certify.equations.closing import closure_of_states
from contfric.certify.events import EventCertificate
from contfric.events.bifurcation import Kind
from contfric.models.balls.build import ball_model
from contfric.models.balls.numbers import Vector, column, dot, identity, numbers
from contfric.orbit.orbit import Orbit

#: A joint of the branch is taken for that of the event within this distance.
_NEAR = 1e-5


@dataclass(frozen=True, eq=False)
class Turns:
    """How the chain of a branch is that of two turns; of a BP the second one is seen in the mirror.

    Attributes
    ----------
    system, segments : of one turn
    near : joints (phase and state) and parameter of the turn at the event, printed
    places : for each joint of the first turn and then of the second one, the joint of the branch that it
        is, and by how much that is later; without excitation how many periods it is earlier
    later : duration of a turn, in phases; None without excitation, where time 0 is the end of each turn
    closure : matrix of the closure of a turn
    proof : of the event
    """

    system: System
    segments: Segments
    near: Vector
    places: tuple[tuple[int, arb], ...]
    later: arb | None
    closure: arb_mat
    proof: EventCertificate

    def of(self, z: Vector) -> tuple[Vector, Vector]:
        """Return the joints of the two turns from those of the branch's chain."""
        m, count = self.segments.states + 1, self.segments.count
        found: tuple[Vector, Vector] = ([], [])
        for i, ((k, _), time) in enumerate(zip(self.places, self._times_of(z), strict=True)):
            state = z[k * m + 1 : (k + 1) * m]
            if i >= count:
                state = numbers(self.closure * column(state))
            found[i >= count].extend([time, *state])
        return found

    def _times_of(self, z: Vector) -> Vector:
        """Return the times of the joints of both turns, each in the clock of its own turn."""
        m, count = self.segments.states + 1, self.segments.count
        if self.later is None:
            times = [z[k * m] - shift * z[0] for k, shift in self.places]
            ends = times[count], times[0] - z[0]
        else:
            times = [z[k * m] - shift for k, shift in self.places]
            ends = arb(0), self.later
        return [time - ends[i >= count] for i, time in enumerate(times)]

    def is_event(self, box: Vector, functional: Vector) -> bool:
        """Tell whether the proved event is the one in a box of (u, v, p), c v = 1."""
        proof, m, size = self.proof, self.segments.states + 1, (len(box) - 1) // 2
        event = proof.event
        model = ball_model(event.orbit.model, event.params, proof.parameter, proof.value)
        scale = arb(1) if self.later is None else 2 * arb.pi() / model.period
        scaled = [x * scale if k % m == 0 else x for k, x in enumerate(proof.zero[:-1])]
        u, phi = scaled[:size], scaled[size:]
        factor = dot(functional, phi)
        found = [*u, *(x / factor for x in phi), proof.zero[-1]]
        return all(ball.contains(x) for ball, x in zip(box, found, strict=True))

    def joined(self, first: Vector, second: Vector) -> Vector:
        """Return the joints of the branch's chain from those of the two turns."""
        return self._joined(first, second, arb(1))

    def directed(self, first: Vector, second: Vector) -> Vector:
        """Return a disturbance of the joints of the branch's chain from those of the two turns."""
        return self._joined(first, second, arb(0))

    def _joined(self, first: Vector, second: Vector, clock: arb) -> Vector:
        m, count = self.segments.states + 1, self.segments.count
        z = [arb(0)] * (len(first) + len(second))
        times = self._times_in_branch([*first[::m], *second[::m]], clock)
        for i, ((k, _), time) in enumerate(zip(self.places, times, strict=True)):
            own = first if i < count else second
            at = (i % count) * m
            state = own[at + 1 : at + m]
            if i >= count:
                state = numbers(self.closure * column(state))
            z[k * m : (k + 1) * m] = [time, *state]
        return z

    def _times_in_branch(self, own: Vector, clock: arb) -> Vector:
        """Return the times of the joints of both turns in the clock of the branch."""
        count = self.segments.count
        shifts = [shift for _, shift in self.places]
        if self.later is not None:
            ends = arb(0), self.later
            pairs = enumerate(zip(own, shifts, strict=True))
            return [time + clock * (shift + ends[i >= count]) for i, (time, shift) in pairs]
        period = -own[0] - own[count]
        ends = own[count], arb(0)
        pairs = enumerate(zip(own, shifts, strict=True))
        times = [time + ends[i >= count] - shift * period for i, (time, shift) in pairs]
        first = times[[k for k, _ in self.places].index(0)]
        return [time - first - period for time in times]


def turns_of(proof: EventCertificate, system: System, near: Vector) -> Turns | None:
    """Return how the chain of a branch is that of two turns of the event at which it ends; None if it is not.

    Parameters
    ----------
    near : approximate solution (z, p) of the branch's chain at the event, in phases
    """
    if proof.location is None or proof.event.kind not in (Kind.BP, Kind.PD):
        return None
    orbit = proof.location.orbit
    if system.half or orbit.model is not system.model:
        return None
    pair = orbit.as_whole() if orbit.system.half else orbit.doubled()
    if pair.system.segments != system.segments or pair.periods != system.periods:
        return None
    segments = segments_of(orbit.system)
    closure = closure_of_states(segments)
    one = identity(segments.states)
    autonomous = orbit.model.autonomous
    scale = arb(1) if autonomous else 2 * arb.pi() / orbit.flow.period
    places = _turned(pair, system, near) if autonomous else _places(pair, system, near, scale)
    twice = closure * closure == one  # for certain
    if places is None or not twice:
        return None
    joints = [
        [(arb(float(z[0])) * scale).mid(), *(arb(float(y)) for y in z[1:])] for z in orbit.joints
    ]
    return Turns(
        orbit.system,
        segments,
        [*(c for joint in joints for c in joint), near[-1]],
        places,
        None if autonomous else arb(segments.turn) * 2 * arb.pi(),
        closure,
        proof,
    )


def _places(
    pair: Orbit, system: System, near: Vector, scale: arb
) -> tuple[tuple[int, arb], ...] | None:
    m, whole = pair.joints.shape[1], arb(system.layout.turn) * 2 * arb.pi()
    own = [near[k * m : (k + 1) * m] for k in range(system.segments)]
    found: list[tuple[int, arb]] = []
    for i, joint in enumerate(pair.joints):
        for k, z in enumerate(own):
            off = z[0] - arb(float(joint[0])) * scale
            shift = whole * round(float((off / whole).mid()))
            gaps = [
                off - shift,
                *(a - arb(float(b)) for a, b in zip(z[1:], joint[1:], strict=True)),
            ]
            same = system.itinerary[k] == pair.system.itinerary[i]
            if same and all(abs(float(g.mid())) < _NEAR for g in gaps):
                found.append((k, shift))
                break
    places = tuple(found)
    return places if sorted(k for k, _ in places) == list(range(system.segments)) else None


def _turned(pair: Orbit, system: System, near: Vector) -> tuple[tuple[int, arb], ...] | None:
    """Return the places where there is no excitation: the branch begins with any joint of the pair."""
    count, m, joints = system.segments, pair.joints.shape[1], pair.joints
    own = np.array([float(c.mid()) for c in near[: count * m]]).reshape(count, m)
    for first in range(count):
        order = (first + np.arange(count)) % count
        found = own[order]
        found[:, 0] -= np.where(first + np.arange(count) >= count, own[0, 0], 0.0)
        found[:, 0] += joints[0, 0] - found[0, 0]
        same = all(system.itinerary[k] == pair.system.itinerary[i] for i, k in enumerate(order))
        if same and np.abs(found - joints).max() < _NEAR:
            return tuple((int(k), arb(int(first + i >= count))) for i, k in enumerate(order))
    return None
