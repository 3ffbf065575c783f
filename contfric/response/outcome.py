"""The outcomes of following a solution."""

from __future__ import annotations

from contfric.base.tabled import Coded


class Outcome(Coded):
    """What a solution came to; the text says what its points are.

    The order is that of the numbers in arrays.

    Examples
    --------
    >>> Outcome.HELD.code
    2
    """

    PERIODIC = "it repeats itself to rounding; the points are those of one period"
    APERIODIC = "it did not repeat itself within the periods followed; the points are all of them"
    HELD = "it ends at rest, for ever"
    UNBOUNDED = "it grew with no bound in sight"
    NO_SOLUTION = "no solution starts there, or its events follow each other at once"
    NO_MOTION = NO_SOLUTION  # the earlier name
    CHATTER = (
        "impacts follow each other faster and faster; it goes on if the reset has chatter: true"
    )
    QUIET = "it meets no surface any more"
    OUTSIDE = "the model is not defined there"
    MISSING = "not computed: the computation was interrupted"
