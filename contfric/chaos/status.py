"""The kinds of motion that a followed solution can turn out to be."""

from __future__ import annotations

from contfric.base.tabled import Coded


class Motion(Coded):
    """What a solution turned out to be; the text says what its exponents mean.

    The order is that of the numbers in the arrays of a :class:`~contfric.chaos.map.LyapunovMap`.

    Examples
    --------
    >>> Motion.CHAOTIC.code
    2
    """

    PERIODIC = "converged to a periodic orbit; the exponents are exact"
    TRANSIENT = (
        "irregular for a time, then converged to a periodic orbit, whose exponents are given"
    )
    CHAOTIC = "no period found, and the largest exponent is positive beyond doubt"
    SETTLING = "not periodic yet, but the largest exponent is negative beyond its error"
    UNDECIDED = "no period found, and the sign of the largest exponent is not certain"
    HELD = "the solution ends at rest, for ever; the exponents are those of the rest position"
    UNBOUNDED = "the solution grew with no bound in sight; there are no exponents"
    NO_SOLUTION = "no solution starts there, or its events follow each other at once; no exponents"
    NO_MOTION = NO_SOLUTION  # the earlier name
    OUTSIDE = "the model is not defined at these parameters; there are no exponents"
    MISSING = "not computed: the map was interrupted"
    BROKEN = "the integration of the solution or of its tangent broke off; there are no exponents"
    CHATTER = "impacts follow each other faster and faster, and the solution ends; no exponents"
    UNCUT = (
        "the solution meets no surface any more and does not converge: the model needs a section"
    )

    @property
    def exact(self) -> bool:
        """Whether the exponents come from a multiplier, not from an average."""
        return self in (Motion.PERIODIC, Motion.TRANSIENT, Motion.HELD)
