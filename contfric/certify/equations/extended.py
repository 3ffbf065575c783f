r"""Events as regular zeros of extended systems, with one parameter p free.

The unknowns are the joints z of the chain ``F(z, p) = 0``, p, and what the event needs in addition:

* an observable g on a surface, or a rate that vanishes, at a joint: ``g(z_k, p) = 0``;
* a segment without duration: ``t_{i+1} = t_i``;
* a touch inside of a segment, a time tau after its start: ``q(tau) = 0, q'(tau) = 0``;
* a multiplier 1 (SN) or -1 of a turn (PD; BP of the half of a symmetric orbit), with its disturbance phi:
  ``F_z phi = 0, c phi = 1``, the closure of phi with the sign of the multiplier (G. Moore and A. Spence,
  SIAM J. Numer. Anal. 17 (1980) 567-576; B. Werner and A. Spence, SIAM J. Numer. Anal. 21 (1984)
  388-399).

* a complex pair ``c + i s`` of multipliers on the unit circle (NS), with its disturbance ``a + i b``: the
equations
  above in their real and imaginary parts, the closure of the disturbance multiplied by ``c + i s``, and
  ``c^2 + s^2 = 1``.

That the Jacobian of the extended system is regular is what makes the event a simple one: a fold is quadratic
and passed with a speed that does not vanish, a multiplier -1 is simple and passes with speed, a margin
changes its sign with speed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from flint import arb, arb_mat

from contfric.base.arrays import FloatArray
from contfric.certify.enclosures.krawczyk import Equations
from contfric.certify.equations.chain import Chain, Segments
from contfric.models.balls.build import ball_model
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector, column, dot, numbers
from contfric.orbit.orbit import Orbit

#: Returns the model at a value of the free parameter.
Builder = Callable[[arb], BallModel]


@dataclass(frozen=True)
class EventCondition:
    """What vanishes at an event in addition to the chain.

    Attributes
    ----------
    segment : the segment that it belongs to
    surface : the surface whose observable is meant
    rate : whether the rate of the observable along the segment is meant, at its end
    within : whether it is touched inside of the segment; else it is met at its end
    before : exit of the segment before, if the duration of the segment is meant: two contacts change at once;
        empty for others
    departs : mode along which the rate of the observable is meant in the place of it: the acceleration with
        which a hold would be left, or the rate of the load where rest begins; empty for the observable
    """

    segment: int
    surface: str
    rate: bool = False
    within: bool = False
    departs: str = ""
    before: str = ""


def rows_of(
    model: BallModel, segments: Segments, condition: EventCondition, order: int
) -> tuple[arb_mat, arb_mat]:
    """Return the row of a condition's observable or of its derivative, and its slope by the parameter."""
    assert model.slopes is not None
    row, slope = model.surfaces[condition.surface], model.slopes.surfaces[condition.surface]
    modes = [segments.modes[condition.segment]] * order
    for mode in [condition.departs, *modes] if condition.departs else modes:
        slope = slope * model.fields[mode] + row * model.slopes.fields[mode]
        row = row * model.fields[mode]
    return row, slope


def at_joint(segments: Segments, build: Builder, condition: EventCondition) -> Equations:
    """Return the equations for the unknowns (z, p) of an event at a joint."""

    def equations(x: Vector) -> tuple[Vector, arb_mat]:
        model = build(x[-1])
        chain = Chain(segments, model)
        residual, rows = chain.linearised(x[:-1])
        joints = chain.joints(x[:-1])
        if condition.before:
            value, last = _duration(chain, joints, condition.segment)
            return [*residual, value], arb_mat([*rows, last])
        row, slope = rows_of(model, segments, condition, int(condition.rate))
        value, last = chain.observed(joints, condition.segment + 1, row, slope)
        return [*residual, value], arb_mat([*rows, last])

    return equations


def _duration(chain: Chain, joints: list[Vector], i: int) -> tuple[arb, Vector]:
    """Return the duration of a segment, and its derivatives by the unknowns and the parameter."""
    found = []
    for k in range(chain.size + 1):
        unit = [arb(int(j == k)) for j in range(chain.size + 1)]
        found.append(chain.times_by(i + 1, unit) - chain.times_by(i, unit))
    return chain.duration(i, joints), found


def touched_within(segments: Segments, build: Builder, condition: EventCondition) -> Equations:
    """Return the equations for the unknowns (z, tau, p) of a touch inside of a segment."""

    def equations(x: Vector) -> tuple[Vector, arb_mat]:
        model, tau = build(x[-1]), x[-2]
        chain = Chain(segments, model)
        residual, rows = chain.linearised(x[:-2])
        matrix = [[*row[:-1], arb(0), row[-1]] for row in rows]
        joints = chain.joints(x[:-2])
        for order in (0, 1):
            observable = rows_of(model, segments, condition, order)
            value, row, by_tau = chain.observed_within(joints, condition.segment, tau, *observable)
            residual.append(value)
            matrix.append([*row[:-1], by_tau, row[-1]])
        return residual, arb_mat(matrix)

    return equations


def with_multiplier(
    segments: Segments, build: Builder, sigma: int, functional: Vector
) -> Equations:
    """Return the equations for the unknowns (z, phi, p) of a multiplier sigma, 1 or -1."""

    def equations(x: Vector) -> tuple[Vector, arb_mat]:
        model = build(x[-1])
        chain = Chain(segments, model)
        size = chain.size
        z, phi = x[:size], x[size : 2 * size]
        residual, rows = chain.linearised(z)
        turned = rows if sigma == 1 else chain.linearised(z, sigma)[1]
        bent = chain.bent(z, phi, sigma)
        nothing = [arb(0)] * size
        residual = list(residual)
        for row in turned:
            residual.append(dot(row[:size], phi))
        residual.append(dot(functional, phi) - 1)
        matrix = [[*row[:size], *nothing, row[-1]] for row in rows]
        matrix += [
            [*curved[:size], *row[:size], curved[-1]]
            for curved, row in zip(bent, turned, strict=True)
        ]
        matrix.append([*nothing, *functional, arb(0)])
        return residual, arb_mat(matrix)

    return equations


def with_pair(segments: Segments, build: Builder, functional: Vector) -> Equations:
    """Return the equations for the unknowns (z, a, b, c, s, p) of a pair of multipliers ``c +- i s``."""

    def equations(x: Vector) -> tuple[Vector, arb_mat]:
        model = build(x[-1])
        chain = Chain(segments, model)
        size, m = chain.size, chain.m
        z, a, b = (x[k * size : (k + 1) * size] for k in range(3))
        c, s = x[-3], x[-2]
        residual, rows = chain.linearised(z)
        minus = chain.linearised(z, -1)[1]
        plus, other = (arb_mat([row[:size] for row in found]) for found in (rows, minus))
        own, closing = (plus + other) / 2, (plus - other) / 2
        first, second = closing * column(a), closing * column(b)
        last, image = chain.closed_change(a[:m]), chain.closed_change(b[:m])
        parts = (
            (
                own * column(a) + first * c - second * s,
                a,
                [c * u - s * v for u, v in zip(last, image, strict=True)],
            ),
            (
                own * column(b) + first * s + second * c,
                b,
                [s * u + c * v for u, v in zip(last, image, strict=True)],
            ),
        )
        same, turned = own + closing * c, closing * s
        blocks = ((same, turned * -1, first, second * -1), (turned, same, second, first))
        nothing = [arb(0)] * size
        matrix = [[*row[:size], *nothing, *nothing, arb(0), arb(0), row[-1]] for row in rows]
        residual = list(residual)
        for (value, phi, end), (by_a, by_b, by_c, by_s) in zip(parts, blocks, strict=True):
            residual += numbers(value)
            bent = chain.bent(z, phi, 1, end)
            tables = zip(
                bent, by_a.tolist(), by_b.tolist(), numbers(by_c), numbers(by_s), strict=True
            )
            matrix += [[*row[:size], *u, *v, at, on, row[-1]] for row, u, v, at, on in tables]
        for phi, wanted in ((a, 1), (b, 0)):
            residual.append(dot(functional, phi) - wanted)
        matrix.append([*nothing, *functional, *nothing, arb(0), arb(0), arb(0)])
        matrix.append([*nothing, *nothing, *functional, arb(0), arb(0), arb(0)])
        residual.append(c * c + s * s - 1)
        matrix.append([*nothing, *nothing, *nothing, 2 * c, 2 * s, arb(0)])
        return residual, arb_mat(matrix)

    return equations


def null_vector(orbit: Orbit, segments: Segments, sigma: int) -> Vector:
    """Return the unit vector that the linearised chain at the printed orbit maps nearest to zero."""
    return [arb(float(x)) for x in np.linalg.svd(_linearised(orbit, segments, sigma))[2][-1]]


def pair_of(orbit: Orbit, segments: Segments) -> tuple[Vector, Vector]:
    """Return about (a, b, c, s) of a pair of multipliers ``c +- i s`` near the circle, and a functional.

    The disturbance ``a + i b`` is turned so that a and b are orthogonal; the functional is 1 of a, 0 of b.
    """
    plus, minus = (_linearised(orbit, segments, sigma) for sigma in (1, -1))
    mu = orbit.turn_multipliers
    upper = mu[mu.imag > 0]
    near = complex(upper[np.argmin(np.abs(np.abs(upper) - 1.0))]) if len(upper) else 1j
    near /= abs(near)
    vector = np.linalg.svd((plus + minus) / 2 + near * (plus - minus) / 2)[2][-1].conj()
    vector = vector * np.exp(-0.5j * np.angle(np.sum(vector * vector)))
    a, b = vector.real, vector.imag
    length = float(np.linalg.norm(a))
    start = [*(a / length), *(b / length), near.real, near.imag]
    return [arb(float(x)) for x in start], [arb(float(x)) for x in a / length]


def _linearised(orbit: Orbit, segments: Segments, sigma: int) -> FloatArray:
    model = ball_model(orbit.model, orbit.params)
    printed = [arb(float(x)) for x in orbit.joints.ravel()]
    _, rows = Chain(segments, model).linearised(printed, sigma)
    return np.array([[float(x.mid()) for x in row] for row in rows])
