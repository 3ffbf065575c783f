"""Turn a computed orbit into a theorem.

1. Interval Newton (:mod:`contfric.certify.krawczyk`) on the chain of segments, in a box around the printed
   joints that is ten times as wide as the orbit's stated error: there is exactly one solution in it.
2. The same in a thin box around the limit of Newton's method in many digits: the solution is known to
   1e-30.
3. With that, every inequality over every segment, and the multipliers. What is not decided is tried again
   with twice the digits.

Where a contact never slips the orbits are a continuum. One of them is proved, alone among those that keep
the same (:mod:`contfric.certify.kept`).

The stated error of the joints is what rounding of the flow and the residual do to them:
``|C| rho`` with C the inverse of the Jacobian and rho the rounding of one equation.
"""

from __future__ import annotations

from functools import partial

from flint import acb, arb, arb_mat

from contfric.certify.certificate import Certificate
from contfric.certify.chain import Chain, Segments, segments_of
from contfric.certify.closing import closing_of, is_symmetry
from contfric.certify.inequalities import inequalities
from contfric.certify.kept import Kept, kept_by_chain, with_kept
from contfric.certify.krawczyk import Inclusion, approximate_inverse, enclosed, krawczyk
from contfric.certify.multipliers import poincare_map, stability, turn_multipliers
from contfric.certify.verdict import Finding, Verdict, all_of
from contfric.certify.zeros import zeros_at_joints
from contfric.models.balls.build import ball_model
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector, working
from contfric.orbit.orbit import Orbit
from contfric.orbit.slack import margin_rounding

#: Bits tried one after the other: 128 leave 1e-30 of a state of size 1.
_BITS = (128, 256, 512)
#: The box of uniqueness is this many times the stated error to each side: ten times as wide as it.
_WIDE = 5
#: Bits of the working precision that rounding of a chain may take: condition numbers to 1e9.
_SPARE = 30
#: Least share of the box that is tried where the Jacobian changes too much over it.
_SMALLEST = 16
_FAMILY = "it is one of a family of orbits, and it is not known exactly what a contact keeps"


def certify_orbit(orbit: Orbit) -> Certificate:
    """Prove what can be proved of an orbit.

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
    found: Certificate | None = None
    for bits in _BITS:
        with working(bits):
            found = _attempt(orbit, segments, bits)
        if found.proved or Verdict.REFUTED in (found.exists.verdict, found.admissible.verdict):
            break
    assert found is not None
    return found


def provable_form(orbit: Orbit) -> Orbit:
    """Return the orbit as the problem that is proved: on its half only where the symmetry is exact."""
    if not orbit.system.half:
        return orbit
    with working(_BITS[0]):
        model = ball_model(orbit.model, orbit.params)
        return orbit if is_symmetry(orbit, segments_of(orbit.system), model) else orbit.as_whole()


def equations_of(
    segments: Segments, model: BallModel, kept: list[Kept], printed: Vector, x: Vector
) -> tuple[Vector, arb_mat]:
    """Return residual and Jacobian of a chain that keeps what the printed joints do."""
    residual, rows = with_kept(*Chain(segments, model).linearised(x), kept, x, printed)
    return residual, arb_mat(rows)


def stated_error(orbit: Orbit, inverse: arb_mat) -> Vector:
    """Return how well each joint of an orbit is known, by its own account."""
    size = 1.0 + float(abs(orbit.joints).max())
    rounding = arb(margin_rounding(orbit.system, orbit.joints) + abs(orbit.residual) * size)
    return [
        sum((inverse[i, j].abs_upper() for j in range(inverse.ncols())), arb(0)).upper() * rounding
        for i in range(inverse.nrows())
    ]


def _attempt(orbit: Orbit, segments: Segments, bits: int) -> Certificate:
    model = ball_model(orbit.model, orbit.params)
    printed = [arb(float(x)) for x in orbit.joints.ravel()]
    kept = kept_by_chain(segments, model)
    equations = partial(equations_of, segments, model, kept, printed)
    inverse = approximate_inverse(equations(printed)[1])
    if inverse is None:
        return _nothing(orbit, _singular(orbit, "at the printed joints"), bits)
    radii = [_WIDE * e for e in stated_error(orbit, inverse)]
    box = krawczyk(equations, printed, radii, inverse)
    if box.verdict is Verdict.REFUTED:
        return _nothing(
            orbit, "no solution so near to the printed joints", bits, Verdict.REFUTED, radii
        )
    thin = enclosed(equations, printed, arb(2) ** (_SPARE - bits))
    if thin.verdict is not Verdict.PROVED:
        return _nothing(orbit, _singular(orbit, "to working precision"), bits)
    inside = all(abs(x - p) < r for x, p, r in zip(thin.zero, printed, radii, strict=True))
    exists = Finding(Verdict.PROVED)
    if not inside:
        exists = Finding(Verdict.UNDECIDED, "the solution is not within the stated error")
    unique = Finding(box.verdict)
    if not unique.proved:
        unique = Finding(
            Verdict.UNDECIDED, "the equations are nearly singular over the stated error"
        )
    chain = Chain(segments, model)
    return _with_solution(orbit, chain, kept, thin, exists, unique, radii, bits)


def _singular(orbit: Orbit, where: str) -> str:
    return _FAMILY if len(orbit.system.layout.conserved) else f"the equations are singular {where}"


def _with_solution(
    orbit: Orbit,
    chain: Chain,
    kept: list[Kept],
    thin: Inclusion,
    exists: Finding,
    unique: Finding,
    radii: Vector,
    bits: int,
) -> Certificate:
    segments, model = chain.segments, chain.model
    joints = chain.joints(thin.zero)
    closing = closing_of(segments, model, orbit.system.half)
    admissible = all_of(
        [found.named(orbit.system) for found in inequalities(chain, orbit.system, joints, closing)]
    )
    discs: list[acb] = []
    stable = Finding(Verdict.REFUTED, "the least disturbance ends a hold")
    if not orbit.system.holds:
        stable = Finding(Verdict.UNDECIDED, "a stop may be tangential")
        known = zeros_at_joints(segments, model, closing)
        matrix = poincare_map(chain, joints, known, [one.row for one in kept])
        if matrix is not None:
            discs = turn_multipliers(matrix, orbit.model.directions - len(kept))
            stable = stability(discs)
    return Certificate(
        orbit, exists, unique, admissible, stable, radii, thin.zero, discs, bits, len(kept)
    )


def _nothing(
    orbit: Orbit,
    why: str,
    bits: int,
    verdict: Verdict = Verdict.UNDECIDED,
    radii: Vector | None = None,
) -> Certificate:
    finding, unknown = Finding(verdict, why), Finding(Verdict.UNDECIDED, "no solution to speak of")
    return Certificate(orbit, finding, unknown, unknown, unknown, radii or [], [], [], bits)
