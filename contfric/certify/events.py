"""Prove a located event: its parameter to 30 digits, its kind, and that it is nondegenerate.

The extended system of :mod:`contfric.certify.equations.extended` has exactly one zero in a thin box around
Newton's limit, and its Jacobian is regular there. The orbit at the event obeys every inequality, but for the
one that is the event. What tells kinds apart is a sign: at a stop on ``|u| = S0`` the load grows (CS) or
falls (SS), a touch has a second derivative.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from flint import arb, arb_mat

from contfric.base.shown import Shown
from contfric.bvp.margins import EventFunction, Margin
from contfric.certify.enclosures.krawczyk import Equations, Inclusion, approximate_inverse, enclosed
from contfric.certify.equations.chain import Chain, Segments, segments_of
from contfric.certify.equations.closing import closing_of, is_symmetry
from contfric.certify.equations.extended import (
    Builder,
    at_joint,
    null_vector,
    pair_of,
    rows_of,
    touched_within,
    with_multiplier,
    with_pair,
)
from contfric.certify.equations.kept import Kept, with_kept
from contfric.certify.equations.locating import EventPlace, location_of
from contfric.certify.equations.shortest import NotLocatedError
from contfric.certify.inequalities.along_segments import Touch, grazes_at_end, inequalities
from contfric.certify.limit import LATE, TimeOverError, check_time
from contfric.certify.verdict import Finding, Verdict, all_of
from contfric.errors import ParameterError
from contfric.events.bifurcation import ACCURACY, Bifurcation, Kind
from contfric.events.local.touching import rest_at
from contfric.models.balls.build import ball_model
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector, around, column, identity, row_norm, working
from contfric.orbit.orbit import Orbit

#: Bits tried one after the other: 160 leave 30 digits where the condition is 1e10.
_BITS = (160, 320)
#: Bits of the working precision that rounding may take.
_SPARE = 30
#: An extended system with a larger inverse at its zero is said to be singular: 1e4 is usual.
_SINGULAR = 1e12


@dataclass(frozen=True, eq=False, repr=False)
class EventCertificate(Shown):
    """What was proved of an event.

    Attributes
    ----------
    event : Bifurcation
        The printed event.
    parameter : str
        The parameter that is free; the others are the exact binary numbers that they are.
    value : arb or None
        A ball that contains the parameter at the event.
    exists : Finding
        There is such an orbit, and no other one near it.
    simple : Finding
        The event is passed with speed: transversality, and a quadratic term at a fold or a touch.
    kind : Finding
        The event is of its kind.
    admissible : Finding
        The orbit obeys every other inequality over the whole of every segment.
    location : EventPlace or None
        Its orbit on the shortest problem, and what vanishes there.
    zero : tuple of arb
        The zero of the extended system: joints, what the event needs next to them, the parameter.
    kept : tuple of Kept
        What all orbits meant here keep: that of a contact that never slips.
    ended : bool
        Whether a time limit ended the work before anything was known.
    """

    event: Bifurcation
    parameter: str
    value: arb | None
    exists: Finding
    simple: Finding
    kind: Finding
    admissible: Finding
    location: EventPlace | None = None
    zero: tuple[arb, ...] = ()
    kept: tuple[Kept, ...] = ()
    ended: bool = False

    @property
    def proved(self) -> bool:
        """Whether all of it is proved."""
        return self._whole.proved

    @property
    def why(self) -> str:
        """What is not proved, and why; empty if all is."""
        return "" if self.proved else str(self._whole)

    @property
    def _whole(self) -> Finding:
        return all_of([self.exists, self.simple, self.kind, self.admissible])

    def save(self, path: Any) -> None:
        """Write the certificate as a JSON file, which ``contfric verify`` checks.

        Raises
        ------
        ParameterError
            If the event is not proved, or is of a kind that the checker does not know.
        ResultFileError
            If the file cannot be written.
        """
        from contfric.certify.files import event_data, write_data

        write_data(event_data(self), path)

    @property
    def radius(self) -> float:
        """How well the parameter is known; infinite if it is not."""
        return float("inf") if self.value is None else float(self.value.rad())

    @property
    def error(self) -> float:
        """How far the printed parameter is off."""
        if self.value is None:
            return float("inf")
        return float(abs(self.value.mid() - arb(self.event.params[self.parameter])).mid())

    def __repr__(self) -> str:
        if self.value is None:
            return f"<{self.event.label}: {self.why}>"
        text = self.value.str(40, more=True, radius=True)
        return f"<{self.event.label} at {self.parameter} = {text}: {self.why or 'proved'}>"


def certify_event(
    event: Bifurcation, parameter: str = "", until: float = math.inf, like: Orbit | None = None
) -> EventCertificate:
    """Prove what can be proved of an event.

    Parameters
    ----------
    parameter : that is free; by default the one along which the event was located
    until : when to end, by ``time.time``: within one step of Newton's method, or one inequality
    like : an orbit that keeps what the event's does, where a contact never slips; by default that one

    Raises
    ------
    ParameterError
        If the parameter is not known, or proofs are not offered for the model.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.54})
    >>> branch = cf.continue_orbit(orbit, "Omega", (0.538, 0.545))
    >>> certify_event(branch.bifurcations[0]).proved
    True
    """
    parameter = parameter or event.parameter
    if not parameter:
        raise ParameterError("say in which parameter the event is located: certify('Omega')")
    event.orbit.model.index_of(parameter)
    ball_model(event.orbit.model, event.params)  # whether proofs are offered
    found = replace(_undecided(event, parameter, LATE), ended=True)
    try:
        check_time(until)
        location = location_of(event)
        for bits in _BITS:
            with working(bits):
                segments = _segments(event, location, parameter, like or event.orbit)
                found = _attempt(event, location, segments, (parameter, bits), until)
            if found.proved:
                break
    except NotLocatedError as error:
        return _undecided(event, parameter, str(error))
    except TimeOverError:  # with fewer digits it may have been tried
        pass
    return found


def _undecided(event: Bifurcation, parameter: str, why: str) -> EventCertificate:
    finding = Finding(Verdict.UNDECIDED, why)
    return EventCertificate(event, parameter, None, finding, finding, finding, finding)


def _segments(event: Bifurcation, location: EventPlace, parameter: str, like: Orbit) -> Segments:
    """Return the chain of an event, with what it keeps: where the orbits about the event keep it, too."""
    value = arb(event.params[parameter])
    near = around(value, arb(_off(event, parameter)))
    wide = ball_model(event.orbit.model, dict(event.params), parameter, near)
    own, short = (
        with_kept(segments_of(orbit.system), wide, like.joints[0])
        for orbit in (event.orbit, location.orbit)
    )
    return short if len(own.kept) == len(short.kept) else replace(short, kept=())


def _off(event: Bifurcation, parameter: str) -> float:
    """Return how far an event may be from where it is printed."""
    return ACCURACY * (1.0 + abs(event.params[parameter]))


def _attempt(
    event: Bifurcation,
    location: EventPlace,
    segments: Segments,
    asked: tuple[str, int],
    until: float,
) -> EventCertificate:
    """Try with the parameter and the bits that are asked for."""
    (parameter, bits), orbit = asked, location.orbit
    params = dict(event.params)

    def build(value: arb) -> BallModel:  # for each evaluation of the equations
        check_time(until)
        return ball_model(orbit.model, params, parameter, value)

    equations, start = _extended(event, location, segments, build)
    inclusion = enclosed(equations, [*start, arb(params[parameter])], arb(2) ** (_SPARE - bits))
    if inclusion.verdict is not Verdict.PROVED:
        return _undecided(event, parameter, f"the extended system: {_why(inclusion)}")
    value, z = inclusion.zero[-1], inclusion.zero[: orbit.joints.size]
    exact = build(arb(params[parameter]))  # at one value, and its slopes from there to the event
    between = replace(exact, slopes=build(value.union(arb(params[parameter]))).slopes)
    if orbit.system.half and not is_symmetry(orbit, segments, between):
        return _undecided(event, parameter, "the symmetry is not exact")
    off = float(abs(value.mid() - arb(params[parameter])).upper())
    if off > _off(event, parameter):
        return _undecided(event, parameter, f"the extended system leads {off:.1e} away")
    chain = Chain(segments, build(value))
    touch = _touch(location, inclusion)
    return EventCertificate(
        event,
        parameter,
        value,
        Finding(Verdict.PROVED),
        _simple(event, chain, z, touch, inclusion.zero[-3:-1]),
        _of_kind(event, location, chain, z, touch),
        _admissible(orbit, chain, z, touch, until),
        location,
        tuple(inclusion.zero),
        segments.kept,
    )


def _extended(
    event: Bifurcation, location: EventPlace, segments: Segments, build: Builder
) -> tuple[Equations, Vector]:
    """Return the extended system of an event, and where to start but for the parameter."""
    joints = [arb(float(x)) for x in location.orbit.joints.ravel()]
    if event.kind is Kind.NS:
        start, functional = pair_of(location.orbit, segments)
        return with_pair(segments, build, functional), [*joints, *start]
    if location.condition is None:
        sigma = 1 if event.kind is Kind.SN else -1
        phi = null_vector(location.orbit, segments, sigma)
        return with_multiplier(segments, build, sigma, phi), [*joints, *phi]
    if location.condition.within:
        after = arb(location.after)
        return touched_within(segments, build, location.condition), [*joints, after]
    return at_joint(segments, build, location.condition), joints


def _why(inclusion: Inclusion) -> str:
    """Return what kept an event from a proof, in words: mostly that its system is singular."""
    if inclusion.inverse is not None and row_norm(inclusion.inverse) > _SINGULAR:
        return "it is singular: the event is one of a continuum, or is not passed with speed"
    return inclusion.why


def _resonates(c: arb, s: arb) -> bool:
    """Tell whether a multiplier ``c + i s`` may be a strong resonance: a power up to the fourth is 1."""
    return bool(s.contains(0) or c.contains(0) or (2 * c + 1).contains(0))


def _touch(location: EventPlace, inclusion: Inclusion) -> Touch | None:
    if location.condition is None:
        return None
    return Touch(location.condition, inclusion.zero[-2] if location.condition.within else None)


def _simple(
    event: Bifurcation,
    chain: Chain,
    z: Vector,
    touch: Touch | None,
    pair: Vector,
) -> Finding:
    """Find whether the event is passed with speed.

    The extended system is regular. With a regular chain a margin, or the multiplier -1, has a slope along
    the branch; a fold is simple by the extended system alone, and so is a tangential stop, at which the
    chain is singular: there the second derivative counts.
    """
    if event.kind is Kind.SN:
        return Finding(Verdict.PROVED)
    if event.kind is Kind.NS and _resonates(*pair):
        return Finding(Verdict.UNDECIDED, "a power of the multiplier up to the fourth may be 1")
    if touch is not None and (touch.condition.within or touch.condition.rate):
        if _second(chain, z, touch).contains(0):
            return Finding(Verdict.UNDECIDED, "the second derivative of the touch may vanish")
        if touch.condition.rate:
            return Finding(Verdict.PROVED)
    _, rows = chain.linearised(z)
    jacobian = arb_mat([row[: chain.size] for row in rows])
    inverse = approximate_inverse(jacobian)
    if inverse is not None and row_norm(identity(chain.size) - inverse * jacobian) < 1:
        return Finding(Verdict.PROVED)
    return Finding(Verdict.UNDECIDED, "the orbit may have a multiplier 1 at the event")


def _second(chain: Chain, z: Vector, touch: Touch) -> arb:
    """Return the second derivative of an observable where it is touched."""
    joints, condition = chain.joints(z), touch.condition
    move = chain.move(condition.segment, joints)
    row, _ = rows_of(chain.model, chain.segments, condition, 2)
    state = move.end if touch.after is None else (move.field * touch.after).exp() * move.start
    return (row * state)[0, 0]


def _of_kind(
    event: Bifurcation, location: EventPlace, chain: Chain, z: Vector, touch: Touch | None
) -> Finding:
    """Find whether the event is of its kind: at a stop on the limit of rest, by the rate of the load."""
    if touch is None or event.kind is Kind.T:
        return Finding(Verdict.PROVED)
    condition = touch.condition
    if condition.rate or condition.within or condition.departs or condition.before:
        return Finding(Verdict.PROVED)
    test = EventFunction(Margin.JOINT, condition.segment, condition.surface)
    resting = rest_at(test, location.orbit)
    if event.kind is Kind.GS and grazes_at_end(condition, chain.segments, chain.model):
        return Finding(Verdict.PROVED)
    if resting is None:
        proved = event.kind is Kind.CS
        return Finding(Verdict.PROVED if proved else Verdict.UNDECIDED, "nothing rests there")
    after = chain.joints(z)[condition.segment + 1]
    state = column(chain.model.extended(after[0], after[1:]))
    row = chain.model.surfaces[condition.surface] * chain.model.fields[resting.mode]
    outward = -resting.signs[condition.surface] * (row * state)[0, 0]
    wanted = outward > 0 if event.kind is Kind.CS else outward < 0
    if wanted:
        return Finding(Verdict.PROVED)
    decided = outward > 0 or outward < 0
    return Finding(
        Verdict.REFUTED if decided else Verdict.UNDECIDED, f"the load moves outward at {outward}"
    )


def _admissible(
    orbit: Orbit, chain: Chain, z: Vector, touch: Touch | None, until: float
) -> Finding:
    closing = closing_of(chain.segments, chain.model, orbit.system.half)
    plain = Chain(chain.segments, replace(chain.model, slopes=None))
    found = []
    for inequality in inequalities(plain, orbit.system, chain.joints(z), closing, touch):
        check_time(until)
        found.append(inequality.named(orbit.system))
    return all_of(found)
