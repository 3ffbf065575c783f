r"""Floquet multipliers in discs.

A segment leads from a disturbance of its start ``z_i = (t_i, y_i)`` to one of its end on the exit
surface: with ``dy' = A dz + B dt'`` (A, B from the Jacobian of the chain) and ``g_t dt' + g_y dy' = 0``,

    dt' = - g_y A dz / (g_t + g_y B) .

The product over one turn, with the closure taken back, is the derivative of a Poincare map on the rows
that vanish at its joint by construction (:mod:`contfric.certify.equations.zeros`): r of them leave 1 + n - r
coordinates, whose map is eliminated from the product; its eigenvalues are multipliers, and r - 1 more are
exactly zero. So a stick costs nothing: its zero is not one of rounding. Without excitation the shift in
time is left out: it is the trivial multiplier 1. Arb encloses the eigenvalues (S. M. Rump, Linear Algebra
Appl. 434 (2011)); where they cluster about zero, all lie within ``|P^k|^(1/k)``.
"""

from __future__ import annotations

from flint import acb, acb_mat, arb, arb_mat

from contfric.certify.equations.chain import Chain
from contfric.certify.equations.closing import closure_of_states
from contfric.certify.verdict import Finding, Verdict
from contfric.models.balls.numbers import Vector, column, row_norm

#: Squarings of the map for the bound of its spectral radius: a norm of 10,000 costs 0.3 % of it.
_SQUARINGS = 12


def poincare_map(
    chain: Chain,
    joints: list[Vector],
    known: list[list[Vector]],
) -> arb_mat | None:
    """Return the derivative of a Poincare map, over one turn, at the joint with the most vanishing rows.

    The multipliers 1 of what the chain keeps are taken out. None where an exit may be tangential.

    Parameters
    ----------
    joints : enclosures of joints 0 .. N
    known : rows that vanish at each joint
    """
    count = chain.segments.count
    at, rows = _most_known(chain, joints, known)
    steps = [_step(chain, joints, i) for i in range(count)]
    total: arb_mat | None = None
    for i in [*range(at, count), -1, *range(at)]:
        step = _closed_back(chain) if i < 0 else steps[i]
        if step is None:
            return None
        total = step if total is None else step * total
    assert total is not None
    if chain.segments.turn == 0.0:
        m = chain.m
        total = arb_mat([[total[a, b] for b in range(1, m)] for a in range(1, m)])
    timed = chain.segments.turn != 0.0
    return restricted(total, [*rows, *([arb(0)] * timed + one.row for one in chain.segments.kept)])


def _most_known(
    chain: Chain, joints: list[Vector], known: list[list[Vector]]
) -> tuple[int, list[Vector]]:
    """Return the joint with the most vanishing rows, and these by its coordinates."""
    at = max(range(chain.segments.count), key=lambda i: len(known[i]))
    rows = []
    for row in known[at]:
        by_time = (arb_mat([row]) * column(chain.model.by_time(joints[at][0], 1)))[0, 0]
        rows.append([by_time, *row[: chain.n]])
    return at, rows if chain.segments.turn != 0.0 else [row[1:] for row in rows]


def dimension(chain: Chain, joints: list[Vector], known: list[list[Vector]]) -> int:
    """Return the dimension of the Poincare map, which a tangential exit does not change."""
    _, rows = _most_known(chain, joints, known)
    size = chain.m - (chain.segments.turn == 0.0)
    return len(_coordinates(size, rows)[0]) - len(chain.segments.kept)


def _step(chain: Chain, joints: list[Vector], i: int) -> arb_mat | None:
    """Return the derivative of joint i + 1 by joint i; None where the exit may be tangential."""
    m, n, model = chain.m, chain.n, chain.model
    move, after = chain.move(i, joints), joints[i + 1]
    late = move.flow * move.by_time - move.speed
    by_state = move.flow if move.reset is None else move.flow * move.reset
    own = arb_mat([[late[j, 0], *(by_state[j, k] for k in range(n))] for j in range(n)])
    row = model.surfaces[chain.segments.exits[i]]
    slope = arb_mat([[row[0, k] for k in range(n)]])
    speed = column([move.speed[j, 0] for j in range(n)])
    rate = (row * column(model.by_time(after[0], 1)) + slope * speed)[0, 0]
    if rate.contains(0):
        return None
    time = slope * own * (-1 / rate)
    state = own + speed * time
    return arb_mat(
        [[time[0, k] for k in range(m)], *([state[j, k] for k in range(m)] for j in range(n))]
    )


def _closed_back(chain: Chain) -> arb_mat:
    """Return the inverse of the closure."""
    n = chain.n
    back = closure_of_states(chain.segments).inv()
    rows = [[arb(1), *[arb(0)] * n]]
    return arb_mat([*rows, *([arb(0), *(back[a, b] for b in range(n))] for a in range(n))])


def _coordinates(size: int, rows: list[Vector]) -> tuple[list[int], dict[int, Vector]]:
    """Return the coordinates that some vanishing rows leave free, and all coordinates by these.

    A row that cannot be told from a combination of others is not used.
    """
    basis = {k: [arb(int(k == j)) for j in range(size)] for k in range(size)}
    free = list(range(size))
    for row in rows:
        factors = {f: sum((row[k] * basis[k][f] for k in range(size)), arb(0)) for f in free}
        pivot = max(free, key=lambda f: float(factors[f].abs_lower()))
        if factors[pivot].contains(0):
            continue
        free.remove(pivot)
        for k in range(size):
            share = basis[k][pivot] / factors[pivot]
            for f in free:
                basis[k][f] -= share * factors[f]
            basis[k][pivot] = arb(0)
    return free, basis


def restricted(matrix: arb_mat, rows: list[Vector]) -> arb_mat:
    """Return a map on the space where some rows vanish, in the coordinates that they leave free."""
    size = matrix.nrows()
    free, basis = _coordinates(size, rows)
    if not free:
        return arb_mat(0, 0)
    image = matrix * arb_mat([[basis[k][f] for f in free] for k in range(size)])
    return arb_mat([[image[a, b] for b in range(len(free))] for a in free])


def turn_multipliers(matrix: arb_mat, count: int) -> list[acb]:
    """Return discs of the ``count`` multipliers of one turn, largest first.

    Those that the Poincare map does not have are exactly zero.
    """
    size = matrix.nrows()
    found: list[acb] = []
    if size == 1:
        found = [acb(matrix[0, 0])]
    elif size > 1:
        try:
            found = acb_mat(matrix).eig(multiple=True)
        except (ValueError, ZeroDivisionError):
            square = arb(0, spectral_radius(matrix))
            found = [acb(square, square)] * size
    found = sorted(found, key=lambda mu: -float(abs(mu).mid()))
    return (found + [acb(0)] * count)[:count]


def spectral_radius(matrix: arb_mat) -> arb:
    """Return a bound of the moduli of all eigenvalues."""
    power = matrix
    for _ in range(_SQUARINGS):
        power = power * power
    return row_norm(power).root(2**_SQUARINGS).upper()


def stability(discs: list[acb], matrix: arb_mat | None = None) -> Finding:
    """Find whether all multipliers lie inside of the unit circle.

    Parameters
    ----------
    matrix : the map of which they are the eigenvalues, by which it is decided where they are not told apart

    Examples
    --------
    >>> from flint import acb
    >>> stability([acb(0.5), acb(0)]).proved
    True
    """
    sizes = [abs(mu) for mu in discs]
    if all(size < 1 for size in sizes):
        return Finding(Verdict.PROVED)
    if any(size > 1 for size in sizes):
        return Finding(Verdict.REFUTED, "a multiplier lies outside of the unit circle")
    if matrix is not None and matrix.nrows() and spectral_radius(matrix) < 1:
        return Finding(Verdict.PROVED)
    return Finding(Verdict.UNDECIDED, "a multiplier may lie on the unit circle")
