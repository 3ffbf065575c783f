r"""The derivative of a solution by its start after one turn, at fixed times.

Along a segment a disturbance of the state moves with the flow. At an exit with the observable g it meets the
surface later by ``- g dy / (g w')``, w' the rate before, so that after the reset R it is

    R dy - (R w' - w'_+) g dy / (g w') ,

w'_+ the rate after. Where the field is continuous the second term is exactly zero, however slowly the surface
is met: the Poincare map of :mod:`contfric.certify.equations.multipliers`, which has the same multipliers,
divides by that rate twice, and its balls are wider by far. Here a multiplier 0 of a stick is one up to
rounding.
"""

from __future__ import annotations

from flint import arb_mat

from contfric.certify.equations.chain import Chain
from contfric.certify.equations.closing import closure_of_states
from contfric.models.balls.numbers import Vector, column, identity


def monodromy(chain: Chain, joints: list[Vector]) -> arb_mat | None:
    """Return the derivative of one turn (the closure taken back) by the state at its start.

    None where an exit may be tangential.

    Parameters
    ----------
    joints : enclosures of joints 0 .. N
    """
    n, total = chain.n, None
    for i in range(chain.segments.count):
        flow = _states(chain.move(i, joints).flow, n)
        passing = _passing(chain, joints, i)
        if passing is None:
            return None
        total = passing * flow if total is None else passing * flow * total
    return total


def _passing(chain: Chain, joints: list[Vector], i: int) -> arb_mat | None:
    """Return the derivative of the start of the next segment by the end of segment i."""
    n, model, segments = chain.n, chain.model, chain.segments
    last = i + 1 == segments.count
    row, field = model.surfaces[segments.exits[i]], model.fields[segments.modes[i]]
    closure = closure_of_states(segments)
    one = identity(n)
    closes = last and closure != one
    at = joints[i + 1] if closes else joints[(i + 1) % segments.count]
    state = column(model.extended(at[0], at[1:]))
    rate = (row * field * state)[0, 0]
    if rate.contains(0):
        return None
    slope = arb_mat([[row[0, k] / rate for k in range(n)]])
    after = chain.move((i + 1) % segments.count, joints)
    reset = _states(after.reset, n) if after.reset is not None else one
    if not closes:
        image = field if after.reset is None else after.reset * field
        lead = after.field if after.reset is None else after.field * after.reset
        jump = (image - lead) * state
        return reset - _top(jump, n) * slope
    back = closure.inv()
    speed = back * _top(field * state, n)
    waves = model.by_time(joints[0][0], 1)[n:]
    before = column([*speed.entries(), *waves])
    image = before if after.reset is None else after.reset * before
    jump = image - after.field * after.start
    return reset * back - _top(jump, n) * slope


def _states(matrix: arb_mat, n: int) -> arb_mat:
    """Return the block of a matrix that leads from states to states."""
    return arb_mat([[matrix[a, b] for b in range(n)] for a in range(n)])


def _top(vector: arb_mat, n: int) -> arb_mat:
    """Return the states of an extended state."""
    return column([vector[a, 0] for a in range(n)])
