r"""The end of a tube where a slide between two rests has no length, in one box with the orbit there.

With the equations of :mod:`contfric.certify.equations.short_slide` the chain is regular where the slide
lasts d = 0, but for the parameter. The box holds exactly one solution for each d in [0, r] (Krawczyk's
operator for all of them at once); for d > 0 they are those of the branch. Their rates by d are ``d^k`` times
numbers that solve a regular system, but for the times of the slide: where that of the parameter has a sign,
the parameter is monotone up to the end.

Inside of the slide v vanishes at both ends and nowhere else if v'' has a sign over all of it, as
``v(tau) = tau (tau - d) v''(xi) / 2``; if it ends in a touch, ``v(tau) = tau (tau - d)^2 v'''(xi) / 6``. From
that follow the signs of the acceleration with which the hold before it is left, and of v' at its end. All
other inequalities are proved over the box.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from flint import arb, arb_mat

from contfric.certify.enclosures.bounds import supersolution, upper
from contfric.certify.enclosures.krawczyk import approximate_inverse, refined
from contfric.certify.equations.chain import Chain
from contfric.certify.equations.short_slide import (
    ACCELERATION,
    FALL,
    GROWTH,
    ShortSlide,
    ShortSlideChain,
    short_slide,
    stands_between,
)
from contfric.certify.equations.zeros import at_start, order_at_start, zeros_at_joints
from contfric.certify.events import EventCertificate
from contfric.certify.inequalities.along_segments import (
    ACCELERATED,
    DURATION,
    EXIT,
    INSIDE,
    Inequality,
    InequalityName,
    inequalities,
)
from contfric.certify.inequalities.sign import Path, higher, positive
from contfric.certify.tubes.leaving import NUMBERS, WITHIN, Edge, slope_along
from contfric.certify.tubes.meeting import as_zero_of
from contfric.certify.tubes.piece import UNKNOWN, Piece
from contfric.certify.tubes.tube import orbit_in
from contfric.certify.verdict import Finding, Verdict, all_of
from contfric.models.balls.numbers import Vector, around, column, identity, numbers

if TYPE_CHECKING:
    from contfric.certify.tubes.tracing import Tracer

#: A slide at an end of a branch that is shorter than this may have no length there.
_SHORT = 1e-3
#: Halvings of the reach, and how far the orbit without the slide may be from the printed end.
_HALVINGS, _NEAR = 24, 1e-2
#: How far a printed orbit may be from the box next to it.
_PRINTED = 1e-8
#: Least half-widths, relative to 1 + the size of each number: rounding of 80 bits.
_LEAST = 2.0**-60
#: Half-widths of the box in units of what suffices if it is narrow, and how often others are tried.
_MORE, _TRIES = 1.3, 4


@dataclass(frozen=True, eq=False)
class Vanishing:
    """The box of an end at which a slide has no length.

    Attributes
    ----------
    place : the slide
    at : numbers of the times of its ends among the unknowns
    middle, change : about the solution (z, p) at half the reach, and its rate by d
    radii : half-widths of the box about that
    reach, least : the largest d, and the one up to which all are admissible; 0 but at limits of the parameter
    slack : the most that the slide of a printed orbit may be too short, as events are known
    piece : what is proved in it, but for its place
    plane : normal of the planes in which the tube meets it
    """

    place: ShortSlide
    at: tuple[int, int]
    middle: Vector
    change: Vector
    radii: Vector
    reach: arb
    least: arb
    slack: float
    piece: Piece
    plane: Vector

    @property
    def box(self) -> Vector:
        """All solutions in it."""
        return [around(c, r) for c, r in zip(self.middle, self.radii, strict=True)]

    def contains(self, zero: Vector, slack: float = 0.0) -> bool:
        """Tell whether some balls lie in it, or no further from it than some slack."""
        pairs = zip(zero, self.middle, self.radii, strict=True)
        return all(abs(x - c) < r + slack for x, c, r in pairs)

    def holds(self, zero: Vector) -> bool:
        """Tell whether a solution (z, p) in some balls is one of the box, and admissible."""
        d = zero[self.at[1]] - zero[self.at[0]]
        return self.surrounds(zero) and self.piece.proved and bool(d > self.least)

    def surrounds(self, zero: Vector) -> bool:
        """Tell whether a solution (z, p) in some balls is one of the box, with a slide that lasts."""
        d = zero[self.at[1]] - zero[self.at[0]]
        return bool(0 < d < self.reach) and self.contains(zero)

    def amplitude(self, point: Vector) -> float:
        """Return the d of an orbit (z, p) of the branch, as a share of the reach."""
        return float(((point[self.at[1]] - point[self.at[0]]) / self.reach).mid())

    def covers(self, point: Vector) -> bool:
        """Tell whether the tube meets the box before a printed orbit (z, p), which lies in it."""
        late = bool(point[self.at[1]] - point[self.at[0]] > -self.slack)
        return late and self.amplitude(point) < WITHIN and self.contains(point, _PRINTED)

    def guess(self, share: float) -> Vector:
        """Return about the orbit at a share of the reach."""
        off = self.reach * (share - 0.5)
        return [m + off * c for m, c in zip(self.middle, self.change, strict=True)]


def vanishing_at(tracer: Tracer, proofs: list[EventCertificate], end: int) -> Vanishing | None:
    """Return the box of an end of a branch at which a slide has no length, as wide as it can be proved."""
    near, far = tracer.point(tracer.branch[end]), tracer.far_from(end)
    m, system, segments = tracer.segments.states + 1, tracer.system, tracer.segments
    lasts = [float((near[k + m] - near[k]).mid()) for k in range(0, (segments.count - 1) * m, m)]
    model, best = tracer.build(near[-1]), None
    for i in (k for k, d in enumerate(lasts) if -tracer.end < d < _SHORT):
        place = short_slide(system, segments, model, i)
        if place is None:
            continue
        at = i * m, (i + 1) * m
        last = _last(tracer, place, near) if tracer.is_limit(end) else None
        reach = float((far[at[1]] - far[at[0]]).mid())
        for _ in range(_HALVINGS if reach > 0 else 0):
            tracer.count += 1
            found = box_up_to(tracer, place, near, reach, last)
            if found is not None:
                best = _with_event(tracer, found, proofs, end)
                if found.piece.regular or not tracer.goes_on():
                    return best
            reach /= 2
    return best


def _last(tracer: Tracer, place: ShortSlide, near: Vector) -> Vector | None:
    """Return balls of the orbit next to a printed end, a little before it, with the duration of its slide."""
    at = _times(tracer, place)
    point = solution_with(tracer, place, near, (near[at[1]] - near[at[0]] + tracer.end).mid())
    plane = _by_times(at, len(near))
    return None if point is None else orbit_in(tracer.segments, tracer.build, point, plane)


def _times(tracer: Tracer, place: ShortSlide) -> tuple[int, int]:
    """Return the numbers of the times of the ends of the slide among the unknowns."""
    m = tracer.segments.states + 1
    return place.segment * m, (place.segment + 1) * m


def _by_times(at: tuple[int, int], size: int) -> Vector:
    """Return the derivatives of the duration of the slide by the unknowns."""
    return [arb(int(k == at[1]) - int(k == at[0])) for k in range(size)]


def solution_with(tracer: Tracer, place: ShortSlide, near: Vector, d: arb) -> Vector | None:
    """Return the solution whose slide lasts d, next to a point: exact numbers, or None."""

    def equations(x: Vector) -> tuple[Vector, arb_mat]:
        return _equations(tracer, place, x, d)

    found = refined(equations, near)
    if found is None or not all(
        abs(a - b) < _NEAR + 2 * d for a, b in zip(found[0], near, strict=True)
    ):
        return None
    return found[0]


def _equations(tracer: Tracer, place: ShortSlide, x: Vector, d: arb) -> tuple[Vector, arb_mat]:
    """Return the residuals at the duration d of the slide, and their Jacobian."""
    at = _times(tracer, place)
    length = x[at[1]] - x[at[0]]
    chain = ShortSlideChain(tracer.segments, tracer.build(x[-1]), place, x, length)
    residual, rows = chain.regular()
    return [*residual, length - d], arb_mat([*rows, _by_times(at, len(x))])


def box_up_to(
    tracer: Tracer, place: ShortSlide, near: Vector, reach: float, end: Vector | None
) -> Vanishing | None:
    """Return the box up to d = reach, or None if it is not proved."""
    middle = solution_with(tracer, place, near, arb(reach) / 2)
    if middle is None:
        return None
    residual, jacobian = _equations(tracer, place, middle, arb(0, reach / 2) + arb(reach) / 2)
    inverse = approximate_inverse(jacobian)
    if inverse is None:
        return None
    size = len(middle)
    one = identity(size)
    moved = upper(inverse * column(residual))[:, 0]
    least = np.array([_LEAST * float(1 + x.abs_upper()) for x in middle])
    radii = _MORE * moved + least
    for _ in range(_TRIES):
        box = [around(x, arb(float(r))) for x, r in zip(middle, radii, strict=True)]
        gap = upper(one - inverse * _equations(tracer, place, box, arb(0))[1])
        if not np.all(np.isfinite(gap)):
            return None
        if np.all((gap @ radii + moved) * (1 + 1e-9) < radii):
            at = _times(tracer, place)
            change = [inverse[k, size - 1] for k in range(size)]
            plane = _by_times(at, size)
            widths = [arb(float(r)) for r in radii]
            piece = _piece(tracer, place, box, arb(reach), end)
            least = arb(0) if end is None else end[at[1]] - end[at[0]]
            reaches = arb(reach), least, tracer.end
            return Vanishing(place, at, middle, change, widths, *reaches, piece, plane)
        wanted = supersolution(gap, moved)
        if wanted is None:
            return None
        radii = _MORE * wanted + least
    return None


def _piece(tracer: Tracer, place: ShortSlide, box: Vector, reach: arb, end: Vector | None) -> Piece:
    """Return what is proved of the orbits of a box, but for their place.

    Parameters
    ----------
    end : balls of the orbit up to which they are to be admissible, where the branch ends at a limit of its
        parameter; else all are to be
    """
    i, segments, model = place.segment, tracer.segments, tracer.build(box[-1])
    ends = (InequalityName(i, segments.exits[i], DURATION),)
    if not stands_between(segments, model, place):
        why = Finding(Verdict.UNDECIDED, "what rests may move")
        return Piece(0, 0, (0, 0), False, why, ends=ends)
    chain = ShortSlideChain(segments, model, place, box, arb(0).union(reach))
    rates = _rates(chain)
    found = _admissible(tracer, chain, rates, end)
    folds = UNKNOWN if rates is None or rates[-1].contains(0) else 0
    # orbits with holds have no multipliers
    return Piece(0, 0, (0, 0), True, found, folds, flips=0, tori=0, ends=ends)


def _rates(chain: ShortSlideChain) -> Vector | None:
    """Return the rates by d of all unknowns but the times of the slide, over ``d^order``; or None."""
    rows = chain.scaled(chain.regular()[1])
    if rows is None:
        return None
    last = column([arb(int(k + 1 == len(rows))) for k in range(len(rows))])
    try:
        return numbers(arb_mat(rows).solve(last))
    except ZeroDivisionError:
        return None


def _admissible(
    tracer: Tracer, chain: ShortSlideChain, rates: Vector | None, end: Vector | None
) -> Finding:
    """Return whether all orbits of a box with d > 0, or up to some, obey every inequality.

    Numbers that vanish with d (at S = 0) grow with it over all of the box, and are positive at the last
    orbit.
    """
    left = _failing(tracer, chain, chain.x, ())
    loose = [found.name for found in left if found.what in NUMBERS]
    if loose and end is not None and rates is not None:
        still = _failing(tracer, chain, chain.x, loose)
        if all(_grows(tracer, chain, rates, name) for name in loose) and not still:
            left = _failing(tracer, chain, end, ())
    if left:
        return left[0].named(tracer.system)
    joints = Chain(chain.segments, chain.model).joints(chain.x[:-1])
    if _slides(chain) and _is_left(tracer, chain, joints):
        return all_of([])
    return Finding(Verdict.UNDECIDED, "a slide of no length")


def _failing(
    tracer: Tracer, chain: ShortSlideChain, x: Vector, loose: Sequence[InequalityName]
) -> list[Inequality]:
    """Return the inequalities that are not proved for the orbits in some balls, but those of the slide."""
    place, i = chain.place, chain.place.segment
    exit_ = chain.segments.exits[i]
    ours = {InequalityName(i, exit_, what) for what in (DURATION, INSIDE, EXIT)}
    ours |= {InequalityName(at, exit_, ACCELERATED) for at in place.holds}
    plain = Chain(chain.segments, tracer.plain(x[-1]))
    known = (InequalityName(i, exit_, DURATION), *loose)
    every = inequalities(plain, tracer.system, plain.joints(x[:-1]), tracer.closes, loose=known)
    return [found for found in every if found.name not in ours and not found.finding.proved]


def _grows(tracer: Tracer, chain: ShortSlideChain, rates: Vector, name: InequalityName) -> bool:
    """Tell whether the number of an inequality grows with d; it is not to be one at the slide."""
    i, segments = chain.place.segment, chain.segments
    if name.what == DURATION or name.segment in (i - 1, i, i + 1):
        return False
    edge = Edge(tracer.system, segments, tracer.build, tracer.closes, True)
    slope = slope_along(edge, chain.x, rates, name, None)
    return slope is not None and bool(slope > 0)


def _slides(chain: ShortSlideChain) -> bool:
    """Tell whether v has its sign inside of the slide, for all d > 0."""
    order = 3 if chain.place.touches else 2
    row = chain.model.surfaces[chain.segments.exits[chain.place.segment]]
    row = higher(Path(chain.field, chain.start, chain.length), row, order)
    bend = (row * (chain.field * chain.length).exp() * chain.start)[0, 0] * chain.place.sign
    return bool(bend > 0 if chain.place.touches else bend < 0)


def _is_left(tracer: Tracer, chain: ShortSlideChain, joints: list[Vector]) -> bool:
    """Tell whether the holds next to the slide could be left at any time.

    At its end the acceleration of the hold before it is positive, as v is inside of the slide; where that
    ends in a touch, it falls there, and rises from 0 in the hold that follows.
    """
    place, i, q, sign = chain.place, chain.place.segment, chain.place.state, chain.place.sign
    model, segments = chain.model, chain.segments
    exit_, mode = segments.exits[i], segments.modes[i]
    if place.touches:
        kappa, fall, growth = (chain.value(form) for form in (ACCELERATION, FALL, GROWTH))
        own = (model.surfaces[exit_] * model.fields[mode])[0, q]
        signs = (-kappa, 2 * fall - chain.length * own * kappa, growth - 2 * fall)
        if not all(sign * number > 0 for number in signs):
            return False
    known = zeros_at_joints(segments, model, tracer.closes)
    row = model.rate(exit_, mode)
    for at in place.holds:
        if int(tracer.system.layout.exit_signs[at]) != sign:
            return False
        move, lasts = chain.move(at, joints), chain.duration(at, joints)
        path = Path(move.field, move.start, lasts.upper(), lasts.lower())
        start = order_at_start(
            model, row, segments.modes[at], at_start(segments, model, at, known[at])
        )
        end = chain.order_at_end if at < i else 0
        rises = at > i and start == 1
        if not positive(path, arb_mat([row]) * sign, start, end, rises=rises).proved:
            return False
    return True


def _with_event(
    tracer: Tracer, found: Vanishing, proofs: list[EventCertificate], end: int
) -> Vanishing:
    """Return a box with the labels of the proved events whose orbit is that without the slide."""
    at_end = solution_with(tracer, found.place, found.guess(0.0), arb(0))
    if at_end is None:
        return found
    labels = []
    for proof in proofs:
        if (
            not proof.proved
            or abs(proof.event.position - float(tracer.branch.arc[end])) > tracer.end
        ):
            continue
        zero = as_zero_of(proof, tracer.system, tracer.segments, tracer.build, at_end, found.place)
        if zero is not None and found.contains(zero):
            labels.append(proof.event.label)
    return replace(found, piece=replace(found.piece, events=tuple(labels)))
