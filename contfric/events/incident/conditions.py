"""Local conditions: which sequences of forms can exist near an event, to first order.

A form (:mod:`contfric.events.incident.incident`) relates the joint u that a unit begins with to the joint u'
that it ends with, and to the distance lambda in the parameter:

    P u + Q u' + c lambda + sum_j d_j q_j = 0,        q_j >= 0,
    G u + H u' + g lambda + E q >= 0.

The rows are those of the boundary-value problem with the inner joints taken out: the left null vectors of the
columns of the inner joints. A null direction v of these columns is a freedom that moves nothing to first
order: the length of a hold at a touch of rest, the end of a slide that stops tangentially, a slide of no
length. What it does is of order p: ``F(z + eps v) = eps^p d``, and ``q = eps^p`` is its unknown. The
inequalities are the margins that vanish at the event.

Where a hold can just not be left inside any more, the acceleration ``a = k t^2 / 2 + w`` with which it would
be left touches zero. For w > 0 it lasts. For w < 0 there are a slide from -2 d to d, ``d^2 = -2 w / k``, and
a second hold. The slide moves the mass by the fourth power of d, the square of w. So to first order the
relation of this form is that of the form with one hold; its inequality is -w >= 0 in place of w >= 0. So it
is where nothing jumps and a load touches its limit inside of a rest: a slip of length 3 d,
``d^2 = 2 w / k``, moves the mass by d^4, too.

Without excitation every unit ends at time 0 (:mod:`contfric.orbit.clock`): the time of u is minus the
duration of its unit, and that of u' has no column. So the ring of a sequence is regular there, too.

For a sequence of n units these are n (m + k) + n units' joints and one lambda: a ray on each side. A sequence
exists on a side if its ray obeys all inequalities. For locations with two outcomes each this is the linear
complementarity problem of docs/bridges.md, written so that an outcome of any kind fits.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.linear import jacobian_blocks, linearised
from contfric.bvp.system import EventFunction, Margin
from contfric.events.incident.incident import vanishing
from contfric.events.incident.unit import Form
from contfric.events.local.gradients import closing, gradient_of
from contfric.events.local.jumps import nothing_jumps
from contfric.events.outcomes.outcomes import NEARLY_NO_LENGTH
from contfric.orbit.canonical.joint_units import joint_units
from contfric.orbit.canonical.slides import time_unit
from contfric.orbit.orbit import Orbit
from contfric.signature.holds import TOUCH, ends_rest, is_hold

#: Singular values below this, relative to the largest, belong to null directions: events are located to
#: 1e-13, and directions at a tangency to the root of that.
_NULL = 1e-6
#: Length of the finite step along a null direction, and what its order is told from: the next order is this
#: much smaller, rounding is 1e-16 over its cube.
_STEP = 1e-3
#: Orders that occur: a hold at a touch of rest (2), a slide of no length (3).
_ORDERS = (2, 3)
#: How far the logarithm of the ratio may be from an order.
_CLEAR = 0.2
#: Condition number from which a sequence's own equations are singular at the event: undecided, too. (Without
#: damping a slide may last a whole natural period, and its start then moves its end to second order only.)
_SINGULAR = 1e9
#: Inequalities violated by less than this share of the largest number in them are undecided: the
#: sequence is tried.
_UNDECIDED = 1e-4


@dataclass(frozen=True, eq=False)
class Relation:
    """The linear relation of one form.

    Attributes
    ----------
    rows : ndarray, shape (m + k, 2 m + 1 + k)
        On (u, u', lambda, q).
    margins : ndarray, shape (g, 2 m + 1 + k)
        What must not be negative, on the same.
    signed : ndarray, shape (k,)
        Whether each q has a sign.
    units : ndarray, shape (m,)
        What joints are measured in where numbers are compared: rows and margins are in those of the model.
    """

    rows: FloatArray
    margins: FloatArray
    signed: FloatArray
    units: FloatArray


@dataclass(frozen=True)
class Parted:
    """A rest that a slide of no length parts: its segment without the slide, and the limit that it passes.

    A hold is parted where it could be left: no surface tells that.
    """

    segment: int
    surface: str | None


def relation_of(form: Form, active: int, least: float) -> Relation | None:
    """Return the relation of a form; None where its orders are not clear.

    Parameters
    ----------
    active : index of the parameter that varies
    least : margins below it vanish
    """
    form, parted = _without_slides(form)
    orbit = form.orbit
    system, m = orbit.system, orbit.joints.shape[1]
    a, b, c, close = jacobian_blocks(system, orbit.joints, orbit.vector, (active,))
    inner, outer = _columns(a, b, c[:, :, 0], close)
    own = joint_units(orbit)
    units = np.tile(own, orbit.system.segments - 1)  # of the inner joints
    inner *= units
    equations = np.abs(np.hstack([inner, outer[:, :-1] * np.tile(own, 2)])).max(axis=1)
    inner, outer = inner / equations[:, None], outer / equations[:, None]
    left, size, right = np.linalg.svd(inner)
    rank = int(np.sum(size > _NULL * (size[0] if size.size else 1.0)))
    free = right[rank:] * units
    rest = left[:, rank:].T
    moves = -(units[:, None] * right[:rank].T / size[:rank]) @ left[:, :rank].T @ outer
    margins, signed = [], np.zeros(len(free))
    for gradient, slope in _gradients(orbit, active, least, parted):
        on_inner = gradient[1:-1].ravel()
        along = free @ on_inner
        largest = np.abs(gradient * own).max()
        bent = np.flatnonzero(np.abs(along) > _NULL * largest)
        if bent.size:  # it is of the order of a freedom, which it gives its sign
            for k in map(int, bent):
                free[k] *= np.copysign(1.0, along[k]) if not signed[k] else 1.0
                signed[k] = 1.0
            continue
        row, direct = on_inner @ moves, np.zeros(2 * m + 1)
        direct[:m] = gradient[0]
        direct[m : 2 * m] += gradient[-1] @ close
        direct[2 * m] = slope + gradient[-1] @ closing(orbit, active)
        terms = np.abs(on_inner) @ np.abs(moves) + np.abs(direct)
        row += direct
        scale = np.concatenate([own, own, [abs(orbit.vector[active]) or 1.0]])
        if np.abs(row * scale).max() <= _NULL * (terms * scale).max():
            continue  # it is zero all along: what is left of it is rounding
        margins.append(np.concatenate([row, np.zeros(len(free))]))
    effects = []
    for k, direction in enumerate(free):
        effect = _effect(orbit, direction.reshape(-1, m), rest / equations)
        if effect is None:
            return None
        effects.append(effect[0])
        signed[k] = max(signed[k], float(effect[1] % 2 == 0))
    rows = np.hstack([rest @ outer, *(effect[:, None] for effect in effects)])
    found = np.array(margins).reshape(len(margins), 2 * m + 1 + len(free))
    return Relation(rows, found, signed, own)


def _columns(
    a: FloatArray, b: FloatArray, c: FloatArray, close: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the columns on the inner joints, and those on (u, u', lambda)."""
    count, m = len(a), a.shape[1]
    inner, outer = np.zeros((count * m, (count - 1) * m)), np.zeros((count * m, 2 * m + 1))
    for i in range(count):
        rows = slice(i * m, (i + 1) * m)
        if i > 0:
            inner[rows, (i - 1) * m : i * m] = a[i]
        if i + 1 < count:
            inner[rows, i * m : (i + 1) * m] = b[i]
        outer[rows, 2 * m] = c[i]
    outer[:m, :m] = a[0]
    outer[-m:, m : 2 * m] = b[-1] @ close
    return inner, outer


def _effect(orbit: Orbit, direction: FloatArray, rest: FloatArray) -> tuple[FloatArray, int] | None:
    """Return what a null direction does to the remaining equations, and its order; None if that is not clear.

    A direction is scaled so that its largest component is the size of what it moves.
    """
    direction = direction / np.abs(direction / joint_units(orbit)).max()
    sizes = []
    found = []
    for step in (_STEP, 0.5 * _STEP):
        moved = orbit.joints.copy()
        moved[1:] += step * direction
        found.append(rest @ (_residual(orbit, moved) - _residual(orbit, orbit.joints)))
        sizes.append(float(np.linalg.norm(found[-1])))
    if min(sizes) <= 0.0:
        return None
    order = np.log2(sizes[0] / sizes[1])
    nearest = min(_ORDERS, key=lambda k: abs(k - order))
    if abs(nearest - order) > _CLEAR:
        return None
    return found[0] / sizes[0], nearest


def _residual(orbit: Orbit, joints: FloatArray) -> FloatArray:
    """Return the residuals of all equations, shape (N m,)."""
    return -linearised(orbit.system, joints, orbit.vector)[4]


# ---------------------------------------------------------------------- the margins that vanish


def _gradients(
    orbit: Orbit, active: int, least: float, parted: tuple[Parted, ...]
) -> list[tuple[FloatArray, float]]:
    """Return the gradients of the vanishing margins on the joints, shape (N + 1, m), and on the parameter.

    What parts a rest counts with the other sign: it is left there.
    """
    whole, count = orbit.as_whole(), orbit.system.segments
    found = []
    for location, _ in vanishing(whole, least):
        held = location.margin is Margin.HELD
        own = Parted(location.segment, None if held else location.surface)
        inside = location.margin in (Margin.HELD, Margin.INTERIOR)
        if location.segment >= count or (inside and own in parted):
            continue
        gradient = gradient_of(whole, location, count, active)
        if gradient is not None:
            found.append(gradient)
    for left in parted:
        margin = Margin.HELD if left.surface is None else Margin.INTERIOR
        parting = EventFunction(margin, left.segment, left.surface or "")
        gradient = gradient_of(whole, parting, count, active)
        if gradient is not None:
            found.append((-gradient[0], -gradient[1]))
    return found


def _without_slides(form: Form) -> tuple[Form, tuple[Parted, ...]]:
    """Return a form without slides of no length inside of a rest, and the rests that they part.

    Such a slide is between two holds, or, where nothing jumps, between two rests of one mode.
    """
    gone: set[int] = set()
    parted: list[Parted] = []
    itinerary, count = list(form.itinerary), len(form.itinerary)
    unit, model = time_unit(form.orbit), form.orbit.model
    for h in range(count - 3, -1, -1):
        (mode, first), _, (then, last) = itinerary[h : h + 3]
        if abs(form.joints[h + 2, 0] - form.joints[h + 1, 0]) >= NEARLY_NO_LENGTH * unit:
            continue
        held = is_hold(first) and last == TOUCH
        if not held:
            rests = mode == then and not (is_hold(first) or is_hold(last))
            if not (rests and ends_rest(model, mode, first) and nothing_jumps(form.orbit)):
                continue
            itinerary[h] = mode, last
        # what parts the rest after the slide parts this one now; a hold is parted once
        own = Parted(h, None if held else first)
        others = [replace(p, segment=h) if p.segment == h + 2 else p for p in parted]
        parted = [own, *(p for p in others if p != own)]
        gone |= {h + 1, h + 2}
    if not gone:
        return form, ()
    kept = [i for i in range(count) if i not in gone]
    without = replace(
        form,
        itinerary=tuple(itinerary[i] for i in kept),
        joints=form.joints[kept],
        away=form.away[kept],
    )
    return without, tuple(replace(p, segment=kept.index(p.segment)) for p in parted)


# --------------------------------------------------------------------------------- sequences


def possible(
    relations: list[Relation], sequences: list[tuple[int, ...]]
) -> list[tuple[bool, bool]]:
    """Return, for each sequence of one length, whether it can exist below and above the event.

    Parameters
    ----------
    relations : of the forms
    sequences : tuples of indices of forms, all of one length
    """
    if not sequences:
        return []
    most = max(len(r.signed) for r in relations)
    limits = max(len(r.margins) for r in relations)
    padded = (_padded(r, most, limits) for r in relations)
    rows, margins, signed = (np.array(part) for part in zip(*padded, strict=True))
    chosen = np.array(sequences)
    count, length = chosen.shape
    m = (rows.shape[2] - 1 - most) // 2
    width = m + most
    full = np.zeros((count, length * width, length * width))
    right = np.zeros((count, length * width))
    for j in range(length):
        block = rows[chosen[:, j]]
        at = slice(j * width, (j + 1) * width)
        ahead = ((j + 1) % length) * width
        full[:, at, j * width : j * width + m] += block[:, :, :m]
        full[:, at, ahead : ahead + m] += block[:, :, m : 2 * m]
        full[:, at, j * width + m : (j + 1) * width] += block[:, :, 2 * m + 1 :]
        right[:, at] = -block[:, :, 2 * m]
    units = np.tile(np.concatenate([relations[0].units, np.ones(most)]), length)
    full *= units
    singular = np.linalg.cond(full) > _SINGULAR
    full[singular] = np.eye(length * width)
    measured = np.linalg.solve(full, right[:, :, None])[:, :, 0]
    solved = (units * measured).reshape(count, length, width)
    joints = solved[:, :, :m]
    ahead_joints = np.roll(joints, -1, axis=1)
    lam = np.ones((count, length, 1))
    local = np.concatenate([joints, ahead_joints, lam, solved[:, :, m:]], axis=2)
    picked = margins[chosen]
    values = np.einsum("sjgk,sjk->sjg", picked, local)
    scale = np.einsum("sjgk,sjk->sjg", np.abs(picked), np.abs(local)) * _UNDECIDED
    q = solved[:, :, m:] * signed[chosen]
    slack = _UNDECIDED * np.abs(measured).max(axis=1)[:, None, None]
    fine = ~singular
    above = np.all(values >= -scale, axis=(1, 2)) & np.all(q >= -slack, axis=(1, 2))
    below = np.all(values <= scale, axis=(1, 2)) & np.all(q <= slack, axis=(1, 2))
    return [
        (bool(b or not f), bool(a or not f)) for a, b, f in zip(above, below, fine, strict=True)
    ]


def _padded(
    relation: Relation, most: int, limits: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return a relation with as many freedoms and margins as others have; those that come in are zero."""
    m2 = relation.rows.shape[1] - len(relation.signed)
    more = most - len(relation.signed)
    rows = np.zeros((relation.rows.shape[0] + more, m2 + most))
    rows[: len(relation.rows), : relation.rows.shape[1]] = relation.rows
    for k in range(more):
        rows[len(relation.rows) + k, relation.rows.shape[1] + k] = 1.0
    margins = np.zeros((limits, m2 + most))
    margins[: len(relation.margins), : relation.rows.shape[1]] = relation.margins
    return rows, margins, np.concatenate([relation.signed, np.zeros(more)])
