"""The fixed-point index of orbits, regular and held: what must balance at every event, and in the whole.

The return map of an oscillator with S0 > S jumps. Its image at a jump is filled with the arc of all
outcomes, from "leaves at once" to "held until the regular release". The filled map is upper semicontinuous
with acyclic values, so the fixed-point index is defined for it, is additive, and does not change with the
parameter while no fixed point passes the boundary (L. Gorniewicz, Topological Fixed Point Theory of
Multivalued Mappings, Springer 2006, chapters 8 and 9).

* A regular orbit has the index ``sign det(I - M)``, M the derivative of its return map.
* An orbit with k holds: let the hold times be steep functions ``tau_i = kappa g_i`` of the pins, g_i
  increasing from "leaves" to "held". That map is continuous, and its index for kappa to infinity is

      sign det [[I - R_z, R_tau], [g_z, -g_tau]],

  R(z, tau) the return with hold times tau, g(z, tau) the pins (g_tau is strictly lower triangular: a pin
  depends on earlier holds only). It follows from ``det [[I - R_z, -R_tau], [-kappa g_z, I - kappa g_tau]]``,
  whose leading power of kappa it is. There is no further sign for k > 1.

So at an event, for every number of periods, the sum over the families below it equals the sum over those
above it; and where the motion at large amplitudes is linear, ``y' = A y + bounded``, the sum over all orbits
of one period is ``sign det(I - exp(A T))``, as I - P is I - exp(A T) up to something bounded.

With ``I + M`` in the place of ``I - M`` the determinant changes sign where a disturbance that changes sign
after a turn solves the equations: the branch point of a symmetric orbit solved on its half, a period doubling
of others (:func:`opening_sign`). Other than a multiplier it is defined with holds, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.linear import jacobian_blocks
from contfric.bvp.system import System
from contfric.models.definition import Model
from contfric.models.mode_domains import inside_sign
from contfric.models.view import FlowView
from contfric.orbit.orbit import Orbit

#: A determinant this small against the product of its rows' lengths has no sign that rounding leaves alone.
_NO_SIGN = 1e-13
#: Derivatives that agree to this (relative) are those of one linear field.
_LINEAR = 1e-9
#: Share of a period after which derivatives of fields that are not linear differ by far more than that.
_SOON = 1e-3


def index_of(orbit: Orbit, times: int = 1) -> int | None:
    """Return the fixed-point index of an orbit run through some times; None without a sign, or excitation.

    Parameters
    ----------
    times : int
        It is the index under the return map of ``times * orbit.periods`` periods.

    Examples
    --------
    >>> import contfric as cf
    >>> params = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
    >>> index_of(cf.find_orbit("coulomb", params)), index_of(cf.solve_orbit("coulomb", "2s", params))
    (1, -1)
    """
    return None if orbit.model.autonomous else _turn_sign(orbit.as_whole(), times, 1.0)


def opening_sign(orbit: Orbit) -> int | None:
    """Return what changes sign where a disturbance that changes sign after one turn solves the equations."""
    return None if orbit.model.autonomous else _turn_sign(orbit, 1, -1.0)


def opening_signs(orbits: Sequence[Orbit]) -> list[int | None]:
    """Return the same for many orbits of one itinerary: all of them at once.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> opening_signs([orbit, orbit]) == [opening_sign(orbit)] * 2
    True
    """
    if not orbits or orbits[0].model.autonomous:
        return [None for _ in orbits]
    system = orbits[0].system
    every = [jacobian_blocks(system, o.joints, o.vector) for o in orbits]
    a, b, close = (np.array([blocks[k] for blocks in every]) for k in (0, 1, 3))
    matrices = _matrix_of_turn(system, a, b, close, 1, -1.0)
    if matrices is None:  # an exit of one of them is tangential
        return [opening_sign(orbit) for orbit in orbits]
    return _signs(matrices)


def _turn_sign(orbit: Orbit, times: int, sign: float) -> int | None:
    system = orbit.system
    a, b, _, close = jacobian_blocks(system, orbit.joints, orbit.vector)
    matrix = _matrix_of_turn(system, a[None], b[None], close[None], times, sign)
    return None if matrix is None else _signs(matrix)[0]


def _matrix_of_turn(
    system: System, a: FloatArray, b: FloatArray, close: FloatArray, times: int, sign: float
) -> FloatArray | None:
    """Return the matrices whose determinants count, of orbits with these blocks; None if one is singular.

    Parameters
    ----------
    a, b, close : blocks and closures of the orbits, shapes (k, N, m, m) and (k, m, m); the first two are
        changed in place
    """
    (count, segments, m), pins = a.shape[:3], _pins(system, a, b)
    holds = len(pins)
    size = m + holds * times
    last = np.zeros((count, segments, m, 1))
    last[:, :, -1] = 1.0
    try:  # joints from those before them, and from the lengths of holds
        steps = np.linalg.solve(b, np.concatenate([-a, last], axis=3))
    except np.linalg.LinAlgError:  # an exit is tangential
        return None
    moved: FloatArray = np.zeros((count, m, size))
    moved[:, range(m), range(m)] = 1.0
    found = np.zeros((count, size, size))
    rows = found[:, m:]
    for turn in range(times):
        for i in range(segments):
            before, moved = moved, steps[:, i, :, :m] @ moved
            if i in pins:
                moved[:, :, m + turn * holds + pins[i].number] += steps[:, i, :, m]
            for pin in pins.values():
                if pin.segment == i:
                    row = pin.on_start @ before + pin.on_end @ moved
                    rows[:, turn * holds + pin.number] = row[:, 0]
        moved = np.asarray(np.linalg.solve(close, moved), dtype=np.float64)
    found[:, :m] = sign * moved
    found[:, :m, :m] = np.eye(m) - found[:, :m, :m]
    rows[:, :, m:] *= -1.0
    return found


@dataclass(frozen=True, eq=False)
class _Pin:
    """The pin of one hold: rows on the start and the end of a segment, growing from "leaves" to "held".

    Those of several orbits, shape (k, 1, m).
    """

    number: int
    segment: int
    on_start: FloatArray
    on_end: FloatArray


def _pins(system: System, a: FloatArray, b: FloatArray) -> dict[int, _Pin]:
    """Return the pins by the segments of their holds; in the blocks each hold gets its length as last row.

    After a touch the exit of the segment before the hold and the pin change places: the touch is where the
    rate vanishes, and the pin is the distance from the surface there. A hold in several modes has one pin, of
    its first part, and one length, of its last; the others end at the surfaces that other contacts meet.
    """
    model, pins = system.model, {}
    for number, (hold, last) in enumerate(system.ends_of_holds):
        h, mode, end = hold.segment, system.itinerary[hold.segment][0], last.segment
        if hold.pin is not None:
            sign = inside_sign(model, mode, hold.pin)
            pins[end] = _Pin(number, h, sign * a[:, h, -1:], np.zeros_like(a[:, h, -1:]))
        else:
            before, exit_ = system.itinerary[h - 1]
            sign = inside_sign(model, before, exit_) * (1 if hold.after_rest else -1)
            pins[end] = _Pin(number, h - 1, sign * a[:, h - 1, -1:], sign * b[:, h - 1, -1:])
            a[:, h - 1, -1], b[:, h - 1, -1] = 0.0, a[:, h, -1]
        for k in range(h, end):
            a[:, k, -1], b[:, k, -1] = 0.0, a[:, k + 1, -1]
        a[:, end, -1], b[:, end, -1] = 0.0, 0.0
        a[:, end, -1, 0], b[:, end, -1, 0] = -1.0, 1.0
    return pins


def _signs(matrices: FloatArray) -> list[int | None]:
    """Return the signs of determinants; None where rounding decides."""
    size = np.linalg.norm(matrices, axis=2)
    decided = np.isfinite(matrices).all(axis=(1, 2)) & (size > 0.0).all(axis=1)
    scaled = np.where(decided[:, None, None], matrices, np.eye(matrices.shape[1]))
    signs, logarithms = np.linalg.slogdet(
        scaled / np.where(decided[:, None], size, 1.0)[:, :, None]
    )
    decided &= logarithms > np.log(_NO_SIGN)
    return [int(sign) if known else None for sign, known in zip(signs, decided, strict=True)]


def index_at_infinity(model: Model, vector: FloatArray) -> int | None:
    """Return the sum of the indices of all orbits of one period, by the solution at large amplitudes.

    None where that is not linear (the modes in motion have different derivatives, or they depend on the
    state), has a multiplier 1, or there is no excitation, or a state is reset.
    """
    if model.autonomous or model.resets:
        return None
    flow = model.view(vector)
    if _linear_part(flow, _SOON * flow.period) is None:  # which is seen at little cost
        return None
    linear = _linear_part(flow, flow.period)
    return None if linear is None else _signs((np.eye(len(linear)) - linear)[None])[0]


def _linear_part(flow: FlowView, lasts: float) -> FloatArray | None:
    """Return the derivative of the state after some time, if it is the same in all modes and everywhere."""
    n = len(flow.model.states)
    moving = [mode.name for mode in flow.model.modes if not mode.sliding]
    starts = [size * np.cos(np.arange(1.0, n + 1.0)) for size in (1.0, 17.0)]
    found = (
        flow.jacobian(mode, 0.0, start, lasts)[:, 1 : 1 + n] for mode in moving for start in starts
    )
    first = next(found, None)
    if first is None:  # nothing moves
        return None
    most = _LINEAR * (1.0 + float(np.max(np.abs(first))))
    return first if all(np.max(np.abs(other - first)) <= most for other in found) else None
