r"""One segment of a solution, for a whole interval of phases at once.

Where the solution starts and when depends on a number s in [-1, 1]: the time as ``t_0 + s t_1 + rho``, the
extended state as ``w_0 + s w_1 + w_r`` (:mod:`contfric.certify.enclosures.affine`). The end on an exit
surface is found at ``tau_0 + s tau_1 + rho`` after the start: interval Newton at ``tau_0 + s tau_1`` shows
that the exit is met exactly once near there, for every s, and transversally. That this meeting is the first
one is for others to show (:mod:`contfric.certify.inequalities.sign`).
"""

from __future__ import annotations

from dataclasses import dataclass

from flint import arb, arb_mat

from contfric.certify.enclosures.affine import AffineMatrix
from contfric.errors import ContfricError
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import column, identity, numbers

HALF = arb(0, 1)  # all s
#: Newton steps towards an exit, and how often the width of its time is widened.
_NEWTON, _TRIES = 6, 6


class UndecidedError(ContfricError):
    """A return is not proved on an interval; a shorter one may be."""


@dataclass(frozen=True)
class LineInS:
    """A number that depends on s: ``at + s slope + rest``."""

    at: arb
    slope: arb
    rest: arb

    @property
    def whole(self) -> arb:
        """All values."""
        return self.at + self.slope * HALF + self.rest

    def __add__(self, other: LineInS) -> LineInS:
        """Return the sum."""
        return LineInS(self.at + other.at, self.slope + other.slope, self.rest + other.rest)

    def __sub__(self, other: LineInS) -> LineInS:
        """Return the difference."""
        return LineInS(self.at - other.at, self.slope - other.slope, self.rest - other.rest)


def released(balls: BallModel, names: tuple[str, ...], phase: LineInS) -> AffineMatrix:
    """Return the extended state that lies on as many surfaces as it has states, at an interval of phases."""
    n = balls.states
    at, rates = balls.extended(phase.at, [arb(0)] * n), balls.by_time(phase.at, 1)
    spread = balls.by_time(phase.whole, 1)
    change = phase.slope * HALF
    slope = [r * phase.slope for r in rates]
    rest = [(w - r) * change + w * phase.rest for w, r in zip(spread, rates, strict=True)]
    parts = [column(part) for part in (at, slope, rest)]
    rows = arb_mat([numbers(balls.surfaces[name]) for name in names])
    matrix = arb_mat([[rows[a, b] for b in range(n)] for a in range(len(names))])
    found = []
    for part in parts:
        y = matrix.solve(rows * part * -1)
        found.append(column([*(y[k, 0] for k in range(n)), *numbers(part)[n:]]))
    return AffineMatrix(found[0], found[1], found[2], HALF)


def ended(
    balls: BallModel, mode: str, exit_: str, state: AffineMatrix, lasts: float
) -> tuple[LineInS, AffineMatrix]:
    """Return how long a segment lasts, and the extended state at its end.

    Parameters
    ----------
    lasts : about how long, from the start in the middle

    Raises
    ------
    UndecidedError
        If it is not proved that the exit is met once near there.
    """
    field, row = balls.fields[mode], balls.surfaces[exit_]
    middle = _refined(field, row, state, arb(lasts))
    flow = (field * middle).exp()
    there = _fixed(flow) * state
    slope = -(row * there.slope)[0, 0] / (row * field * there.at)[0, 0]
    slope = arb(slope.mid())
    if not slope.is_finite():
        raise UndecidedError("a stop may be tangential")
    along = _moved(field, there, slope, arb(0))
    missed = (_fixed(row) * along).whole[0, 0]
    width = 2 * missed.abs_upper() / (row * field * there.at)[0, 0].abs_lower()
    for _ in range(_TRIES):
        extra = arb(0, width.abs_upper() if width.is_finite() else 0)
        wide = _moved(field, there, slope, extra)
        rate = (row * field * wide.whole)[0, 0]
        if rate.contains(0):
            break  # a wider one contains 0, too
        rest = -missed / rate
        if rest.is_finite() and extra.contains_interior(rest):
            end = _moved(field, there, slope, rest)
            return LineInS(middle, slope, rest), _on(end, row, balls.states)
        width = 4 * width
    raise UndecidedError("a stop may be tangential")


def _refined(field: arb_mat, row: arb_mat, state: AffineMatrix, guess: arb) -> arb:
    """Return about when the exit is met from the start in the middle; exact."""
    for _ in range(_NEWTON):
        there = (field * guess).exp() * state.at
        step = (row * there)[0, 0] / (row * field * there)[0, 0]
        if not step.is_finite():
            break
        guess = arb((guess - step).mid())
    return guess


def _moved(field: arb_mat, there: AffineMatrix, slope: arb, extra: arb) -> AffineMatrix:
    """Return the state after a further time ``s slope + extra``."""
    delta = slope * HALF + extra
    size = field.nrows()
    one = identity(size)
    linear = (field * slope).mid()
    rest = (field * slope - linear) * HALF + field * extra
    square = arb(0, (delta * delta / 2).abs_upper())
    rest += field * field * (field * (delta * HALF)).exp() * square
    return AffineMatrix(one, linear, rest, HALF) * there


def _fixed(matrix: arb_mat) -> AffineMatrix:
    nothing = arb_mat(matrix.nrows(), matrix.ncols())
    return AffineMatrix(matrix, nothing, nothing, HALF)


def _on(state: AffineMatrix, row: arb_mat, states: int) -> AffineMatrix:
    """Return a state that is known to lie on a surface: a row of one state says that it is exactly zero."""
    entries = numbers(row)
    found = [k for k, x in enumerate(entries) if not x.is_zero()]
    if len(found) != 1 or found[0] >= states:
        return state
    return with_zero(state, found[0])


def with_zero(state: AffineMatrix, k: int) -> AffineMatrix:
    """Return a state of which one entry is known to be exactly zero."""
    parts = [list(numbers(part)) for part in (state.at, state.slope, state.rest)]
    for part in parts:
        part[k] = arb(0)
    at, slope, rest = (column(part) for part in parts)
    return AffineMatrix(at, slope, rest, HALF)
