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

from dataclasses import dataclass

import numpy as np

from contfric.models.definition import FloatArray, Model
from contfric.models.view import FlowView
from contfric.orbit.linear import jacobian_blocks
from contfric.orbit.orbit import Orbit
from contfric.orbit.system import System, inside_sign

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


def _turn_sign(orbit: Orbit, times: int, sign: float) -> int | None:
    system, m = orbit.system, orbit.joints.shape[1]
    a, b, _, close = jacobian_blocks(system, orbit.joints, orbit.vector, parameters=False)
    pins = _pins(system, a, b)
    holds = len(pins)
    moved: FloatArray = np.eye(m, m + holds * times)
    rows = np.zeros((holds * times, m + holds * times))
    for turn in range(times):
        for i in range(system.segments):
            before, right = moved, -a[i] @ moved
            if i in pins:
                right[-1, m + turn * holds + pins[i].number] += 1.0
            try:
                moved = np.asarray(np.linalg.solve(b[i], right), dtype=np.float64)
            except np.linalg.LinAlgError:  # an exit is tangential
                return None
            for pin in pins.values():
                if pin.segment == i:
                    rows[turn * holds + pin.number] = pin.on_start @ before + pin.on_end @ moved
        moved = np.asarray(np.linalg.solve(close, moved), dtype=np.float64)
    left = np.eye(m) - sign * moved[:, :m]
    return _sign(np.block([[left, sign * moved[:, m:]], [rows[:, :m], -rows[:, m:]]]))


@dataclass(frozen=True, eq=False)
class _Pin:
    """The pin of one hold: a row on the start and the end of a segment, growing from "leaves" to "held"."""

    number: int
    segment: int
    on_start: FloatArray
    on_end: FloatArray


def _pins(system: System, a: FloatArray, b: FloatArray) -> dict[int, _Pin]:
    """Return the pins by the segments of their holds; in the blocks each hold gets its length as last row.

    After a touch the exit of the segment before the hold and the pin change places: the touch is where the
    rate vanishes, and the pin is the distance from the surface there.
    """
    model, pins = system.model, {}
    for number, hold in enumerate(system.holds):
        h, mode = hold.segment, system.itinerary[hold.segment][0]
        nothing = np.zeros(a.shape[1])
        if hold.pin is not None:
            sign = inside_sign(model, mode, hold.pin)
            pins[h] = _Pin(number, h, sign * a[h, -1], nothing)
        else:
            before, exit_ = system.itinerary[h - 1]
            sign = inside_sign(model, before, exit_) * (1 if hold.after_rest else -1)
            pins[h] = _Pin(number, h - 1, sign * a[h - 1, -1], sign * b[h - 1, -1])
            a[h - 1, -1], b[h - 1, -1] = nothing, a[h, -1]
        a[h, -1], b[h, -1] = nothing, nothing
        a[h, -1, 0], b[h, -1, 0] = -1.0, 1.0
    return pins


def _sign(matrix: FloatArray) -> int | None:
    """Return the sign of a determinant; None if rounding decides it."""
    if not np.all(np.isfinite(matrix)):
        return None
    size = np.linalg.norm(matrix, axis=1)
    if np.any(size == 0.0):
        return None
    sign, logarithm = np.linalg.slogdet(matrix / size[:, None])
    return int(sign) if logarithm > np.log(_NO_SIGN) else None


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
    return None if linear is None else _sign(np.eye(len(linear)) - linear)


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
