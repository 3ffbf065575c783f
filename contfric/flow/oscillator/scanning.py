"""The certificates of :mod:`contfric.flow.pieces` for several motions: a piece, its halves, its quarters."""

from __future__ import annotations

from contfric.compiled import helper, inlined_helper
from contfric.compiling.lanes import LANES, bits, choose, without
from contfric.flow.pieces import RATIO, SLOPE, VALUE

#: What is decided of a piece: no root, one root in a part, nothing.
FREE, ALONE, OPEN = 0.0, 1.0, 2.0
_ALL = (1 << LANES) - 1


@inlined_helper
def least(a, b):  # type: ignore[no-untyped-def]
    """Return the smaller of two numbers."""
    return choose(a < b, a, b)


@inlined_helper
def most(a, b):  # type: ignore[no-untyped-def]
    """Return the larger of two numbers."""
    return choose(a > b, a, b)


@inlined_helper
def halves(c):  # type: ignore[no-untyped-def]
    """Return the Bernstein coefficients over both halves (de Casteljau)."""
    c0, c1, c2, c3, c4, c5 = c
    a0, a1, a2 = 0.5 * (c0 + c1), 0.5 * (c1 + c2), 0.5 * (c2 + c3)
    a3, a4 = 0.5 * (c3 + c4), 0.5 * (c4 + c5)
    b0, b1, b2, b3 = 0.5 * (a0 + a1), 0.5 * (a1 + a2), 0.5 * (a2 + a3), 0.5 * (a3 + a4)
    d0, d1, d2 = 0.5 * (b0 + b1), 0.5 * (b1 + b2), 0.5 * (b2 + b3)
    e0, e1 = 0.5 * (d0 + d1), 0.5 * (d1 + d2)
    f = 0.5 * (e0 + e1)
    return (c0, a0, b0, d0, e0, f), (f, e1, d2, b3, a4, c5)


@inlined_helper
def free(c, error):  # type: ignore[no-untyped-def]
    """Tell whether a part has no root."""
    smallest = least(least(least(c[0], c[1]), least(c[2], c[3])), least(c[4], c[5]))
    return smallest > VALUE * error


@inlined_helper
def free_behind(c, error, share, leaving):  # type: ignore[no-untyped-def]
    """Tell the same of a part at the beginning; ``leaving``: no root but the one that it starts on."""
    plain = free(c, error)
    if bits(leaving) == 0:
        return plain
    inner = least(least(5.0 * c[1], 2.5 * c[2]), least((5.0 / 3.0) * c[3], 1.25 * c[4]))
    return ((least(inner, c[5]) > (RATIO * share) * error) & leaving) | without(plain, leaving)


@inlined_helper
def alone(c, error, share, below):  # type: ignore[no-untyped-def]
    """Tell whether a part ends below a number, and falls all along."""
    first = most(c[1] - c[0], c[2] - c[1])
    steepest = most(most(first, most(c[3] - c[2], c[4] - c[3])), c[5] - c[4])
    return (c[5] < below) & (steepest < (-0.2 * SLOPE * share) * error)


@helper
def scanned(c, error, leaving):  # type: ignore[no-untyped-def]
    """Look along pieces for the first root, as :func:`contfric.flow.pieces.scan` does.

    Returns
    -------
    tuple
        (what is decided; place and width of the part with the only root).
    """
    none, margin = 0.0 * error, (-VALUE) * error
    whole = free_behind(c, error, 1.0, leaving)
    one = without(alone(c, error, 1.0, none), leaving)
    if bits(whole | one) == _ALL:
        return choose(whole, FREE, none + ALONE), none, none + 1.0
    left, right = halves(c)
    free_l = free_behind(left, error, 0.5, leaving)
    one_l = without(alone(left, error, 0.5, margin), leaving)
    free_r, one_r = free(right, error), alone(right, error, 0.5, none)
    found_l, low_l, wide_l = none + ALONE, none, none + 0.5
    found_r, low_r, wide_r = choose(free_r, FREE, none + ALONE), none + 0.5, none + 0.5
    if bits((whole | one) | ((free_l & (free_r | one_r)) | one_l)) != _ALL:
        found_0, low_0, found_2, low_2 = quarters(left, right, error, leaving)
        found_r = choose(free_r, FREE, choose(one_r, ALONE, found_2))
        low_r, wide_r = choose(one_r, 0.5, low_2), choose(one_r, 0.5, none + 0.25)
        found_l = choose(one_l, ALONE, found_0)
        low_l, wide_l = choose(one_l, 0.0, low_0), choose(one_l, 0.5, none + 0.25)
    found = choose(free_l, found_r, found_l)
    low, wide = choose(free_l, low_r, low_l), choose(free_l, wide_r, wide_l)
    found = choose(whole, FREE, choose(one, ALONE, found))
    return found, choose(one, 0.0, low), choose(one, 1.0, wide)


@inlined_helper
def quarters(left, right, error, leaving):  # type: ignore[no-untyped-def]
    """Return what is decided and where, from the first quarter on, and from the third."""
    none, margin = 0.0 * error, (-VALUE) * error
    (a, b), (c, d) = halves(left), halves(right)
    found_3 = choose(free(d, error), FREE, choose(alone(d, error, 0.25, none), ALONE, none + OPEN))
    found_2, low_2 = following(c, error, free(c, error), margin, found_3, none + 0.75, 0.5)
    found_1, low_1 = following(b, error, free(b, error), margin, found_2, low_2, 0.25)
    first = free_behind(a, error, 0.25, leaving)
    single = without(alone(a, error, 0.25, margin), leaving)
    found_0 = choose(first, found_1, choose(single, ALONE, none + OPEN))
    return found_0, choose(first, low_1, none), found_2, low_2


@inlined_helper
def following(c, error, empty, margin, found, low, place):  # type: ignore[no-untyped-def]
    """Return what is decided from a quarter on: of an empty one, what is from the next one on."""
    single, none = alone(c, error, 0.25, margin), 0.0 * error
    return (
        choose(empty, found, choose(single, ALONE, none + OPEN)),
        choose(empty, low, none + place),
    )
