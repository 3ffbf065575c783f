r"""Prove a computed orbit.

1. Interval Newton (:mod:`contfric.certify.enclosures.krawczyk`) on the chain of segments, in a box around the
   printed joints that is ten times as wide as the orbit's stated error: there is exactly one solution in it.
2. Within that box Newton's method goes on in many digits: its last residual bounds how far the solution is
   from it, to 1e-30. (Where the first box fails: interval Newton in a thin one around the limit.)
3. With that, every inequality over every segment, and the multipliers. What is not decided is tried again
   with twice the digits.

Where a contact never slips the orbits are a continuum. One of them is proved, alone among those that keep
the same (:mod:`contfric.certify.equations.kept`).

The stated error of the joints is what rounding of the flow and the residual do to them:
``|C| rho`` with C the inverse of the Jacobian and rho the rounding of one equation.
"""

from __future__ import annotations

import math
from dataclasses import replace

from flint import acb, arb, arb_mat

from contfric.certify.certificate import Certificate
from contfric.certify.enclosures.krawczyk import approximate_inverse, enclosed, krawczyk, narrowed
from contfric.certify.equations.chain import Chain, Segments, segments_of
from contfric.certify.equations.closing import closing_of, is_symmetry
from contfric.certify.equations.kept import with_kept
from contfric.certify.equations.multipliers import poincare_map, stability, turn_multipliers
from contfric.certify.equations.zeros import zeros_at_joints
from contfric.certify.inequalities.along_segments import inequalities
from contfric.certify.limit import LATE, TimeOverError, check_time
from contfric.certify.verdict import Finding, Verdict, all_of
from contfric.models.balls.build import ball_model
from contfric.models.balls.numbers import Vector, working
from contfric.orbit.orbit import Orbit
from contfric.orbit.tolerances import margin_rounding

#: Bits tried one after the other: 128 leave 1e-30 of a state of size 1.
_BITS = (128, 256, 512)
#: The box of uniqueness is this many times the stated error to each side: ten times as wide as it.
_WIDE = 5
#: Bits of the working precision that rounding of a chain may take: condition numbers to 1e9.
_SPARE = 30
_FAMILY = "it is one of a family of orbits, and it is not known exactly what a contact keeps"


#: Of an orbit whose inequalities are for others to show.
NOT_YET = Finding(Verdict.UNDECIDED, "not looked at")


def certify_orbit(orbit: Orbit, inside: bool = True, until: float = math.inf) -> Certificate:
    """Prove what can be proved of an orbit.

    Parameters
    ----------
    inside : whether its inequalities are looked at; else the finding on them is NOT_YET
    until : when to end, by ``time.time``: within one product of matrices, or one inequality

    Raises
    ------
    ParameterError
        If proofs are not offered for its model: the message says for which part.

    Examples
    --------
    >>> import contfric as cf
    >>> certify_orbit(cf.find_orbit("coulomb", {"Omega": 0.5})).proved
    True
    """
    orbit = provable_form(orbit)
    segments = segments_of(orbit.system)
    found = _nothing(orbit, LATE, _BITS[0])
    try:
        for bits in _BITS:
            check_time(until)
            with working(bits):
                found = _attempt(orbit, segments, bits, inside, until)
            refuted = Verdict.REFUTED in (found.exists.verdict, found.admissible.verdict)
            if _is_proved(found) or refuted or found.ended:
                break
    except TimeOverError:  # with fewer digits it may have been tried
        return replace(found, ended=True)
    return found


def with_inequalities(found: Certificate, until: float = math.inf) -> Certificate:
    """Return a certificate with the finding on the inequalities, if they were not looked at."""
    if found.admissible is not NOT_YET:
        return found
    orbit, bits = found.orbit, found.precision
    with working(bits):
        chain = Chain(segments_of(orbit.system), ball_model(orbit.model, orbit.params))
        admissible = _obeys(orbit, chain, chain.joints(found.enclosure), until)
        found = replace(found, admissible=admissible, ended=found.ended or admissible.why == LATE)
    undecided = found.admissible.verdict is Verdict.UNDECIDED and bits < _BITS[-1]
    if not undecided or found.ended:
        return found
    again = certify_orbit(orbit, until=until)
    return replace(found, ended=True) if again.ended else again


def _is_proved(found: Certificate) -> bool:
    """Tell whether all is proved that was looked at."""
    if found.admissible is NOT_YET:
        found = replace(found, admissible=Finding(Verdict.PROVED))
    return found.proved


def provable_form(orbit: Orbit) -> Orbit:
    """Return the orbit as the problem that is proved: on its half only where the symmetry is exact."""
    if not orbit.system.half:
        return orbit
    with working(_BITS[0]):
        model = ball_model(orbit.model, orbit.params)
        return orbit if is_symmetry(orbit, segments_of(orbit.system), model) else orbit.as_whole()


def stated_error(orbit: Orbit, inverse: arb_mat) -> Vector:
    """Return how well each joint of an orbit is known, by its own account."""
    size = 1.0 + float(abs(orbit.joints).max())
    rounding = arb(margin_rounding(orbit.system, orbit.joints) + abs(orbit.residual) * size)
    return [
        sum((inverse[i, j].abs_upper() for j in range(inverse.ncols())), arb(0)).upper() * rounding
        for i in range(inverse.nrows())
    ]


def _attempt(
    orbit: Orbit, segments: Segments, bits: int, inside: bool, until: float
) -> Certificate:
    model = ball_model(orbit.model, orbit.params)
    printed = [arb(float(x)) for x in orbit.joints.ravel()]
    segments = with_kept(segments, model, orbit.joints[0])

    def equations(x: Vector) -> tuple[Vector, arb_mat]:
        check_time(until)
        residual, rows = Chain(segments, model).linearised(x)
        return residual, arb_mat(rows)

    at_printed = equations(printed)
    inverse = approximate_inverse(at_printed[1])
    if inverse is None:
        return _nothing(orbit, _singular(orbit, "at the printed joints"), bits)
    radii = [_WIDE * e for e in stated_error(orbit, inverse)]
    box = krawczyk(equations, printed, radii, inverse, at_printed)
    if box.verdict is Verdict.REFUTED:
        return _nothing(
            orbit, "no solution so near to the printed joints", bits, Verdict.REFUTED, radii
        )
    chain = Chain(segments, model)

    def residual_at(x: Vector) -> Vector:
        check_time(until)
        return chain.residual(x)

    zero = narrowed(residual_at, box, printed, radii)
    if zero is None:
        thin = enclosed(equations, printed, arb(2) ** (_SPARE - bits))
        if thin.verdict is not Verdict.PROVED:
            return _nothing(orbit, _singular(orbit, "to working precision"), bits)
        zero = thin.zero
    within = all(abs(x - p) < r for x, p, r in zip(zero, printed, radii, strict=True))
    exists = Finding(Verdict.PROVED)
    if not within:
        exists = Finding(Verdict.UNDECIDED, "the solution is not within the stated error")
    unique = Finding(box.verdict)
    if not unique.proved:
        unique = Finding(
            Verdict.UNDECIDED, "the equations are nearly singular over the stated error"
        )
    admissible, joints = NOT_YET, chain.joints(zero)
    if inside:
        admissible = _obeys(orbit, chain, joints, until)
    late = admissible.why == LATE
    discs, stable = ([], admissible) if late else _stability(orbit, chain, joints)
    return Certificate(
        *(orbit, exists, unique, admissible, stable, radii, zero, discs, bits),
        kept=len(segments.kept),
        ended=late,
    )


def _singular(orbit: Orbit, where: str) -> str:
    return _FAMILY if len(orbit.system.layout.conserved) else f"the equations are singular {where}"


def _obeys(orbit: Orbit, chain: Chain, joints: list[Vector], until: float) -> Finding:
    """Return whether the solution with joints in some balls obeys every inequality."""
    closing = closing_of(chain.segments, chain.model, orbit.system.half)
    found = list[Finding]()
    try:
        for inequality in inequalities(chain, orbit.system, joints, closing):
            check_time(until)
            found.append(inequality.named(orbit.system))
    except TimeOverError:
        found = [Finding(Verdict.UNDECIDED, LATE), *found]
    return all_of(found)


def _stability(orbit: Orbit, chain: Chain, joints: list[Vector]) -> tuple[list[acb], Finding]:
    """Return discs of the multipliers of the solution with such joints, and whether it is stable."""
    if orbit.system.holds:
        return [], Finding(Verdict.REFUTED, "the least disturbance ends a hold")
    closing = closing_of(chain.segments, chain.model, orbit.system.half)
    known = zeros_at_joints(chain.segments, chain.model, closing)
    matrix = poincare_map(chain, joints, known)
    if matrix is None:
        return [], Finding(Verdict.UNDECIDED, "a stop may be tangential")
    discs = turn_multipliers(matrix, orbit.model.directions - len(chain.segments.kept))
    return discs, stability(discs, matrix)


def _nothing(
    orbit: Orbit,
    why: str,
    bits: int,
    verdict: Verdict = Verdict.UNDECIDED,
    radii: Vector | None = None,
) -> Certificate:
    finding, unknown = Finding(verdict, why), Finding(Verdict.UNDECIDED, "no solution to speak of")
    return Certificate(orbit, finding, unknown, unknown, unknown, radii or [], [], [], bits)
