"""Events in 50 digits: the equations of the orbit and those of the event, with the parameter unknown.

==========  =======================================================  ==========================
event       equations besides those of the orbit                     unknowns besides its joints
==========  =======================================================  ==========================
SN          ``J w = 0``, ``l w = 1``                                 the parameter, w
BP, PD      the same with the closure of w times -1                  the parameter, w
NS          ``det M = 1`` for the derivative M of one turn           the parameter
CS, SS      ``u = side S0`` at a stop                                the parameter
AS          ``u = side S0``, ``f' = 0`` at an instant of a stick     the parameter, the instant
GS          ``v = 0``, ``v' = 0`` at an instant of a slide           the parameter, the instant
T           ``u = side S0``, ``u' = 0`` at an instant of a slide     the parameter, the instant
AS, GS      at the exit: ``f' = 0``, or no acceleration              the parameter
==========  =======================================================  ==========================

The conditions of AS, GS and T at an instant hold at the extremum of what touches its limit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from chain import (
    NAMES,
    Chain,
    FloatArray,
    Joint,
    NoReference,
    acceleration,
    flat,
    force,
    joints_of,
    newton,
    paired,
    parameters,
    slide,
)
from condition import EPS
from mpmath import mp, mpf

import contfric as cf
from contfric.bvp.system import EventFunction, Margin

SIDE = {"F+": 1, "F-": -1}
#: Step of the central differences: their error, of its square, is beyond the digits of a Jacobian.
STEP = mpf(10) ** -30
#: Instants at which an extremum is looked for, and halvings of the interval that has it.
SAMPLES, HALVINGS = 160, 30
#: Joints of the longest orbit: differences cost the square of it, and a null vector doubles it.
MOST_JOINTS, MOST_WITH_VECTOR = 48, 24
#: A tangency further than this from what it should touch is another one than was located.
TOUCHES = 1e-5


class TooLong(NoReference):
    """The reference was not tried."""


Equations = Callable[[list[Joint], tuple[Any, ...], list[Any]], list[Any]]


@dataclass(frozen=True)
class Located:
    """An event in 50 digits.

    Attributes
    ----------
    value : the parameter
    allowed : error that rounding explains in it
    p : all parameters
    z : joints of the orbit
    """

    value: Any
    allowed: float
    p: tuple[Any, ...]
    z: list[Joint]


def locate(event: cf.Bifurcation, parameter: str) -> Located:
    """Return the event next to a located one.

    Raises
    ------
    NoReference
        If there is none, or it is too long for its equations.
    """
    chain, p, z = Chain.of(event.orbit), parameters(event.orbit), joints_of(event.orbit)
    active, n = NAMES.index(parameter), 2 * len(Chain.of(event.orbit))
    if len(z) > MOST_JOINTS:
        raise TooLong("too long for its equations")
    more, extra = _conditions(event, chain, p, z)

    def at(y: Sequence[Any]) -> tuple[list[Joint], tuple[Any, ...]]:
        return paired(y[:n]), (*p[:active], y[n], *p[active + 1 :])

    def residual(y: list[Any]) -> list[Any]:
        joints, values = at(y)
        own = [r for piece in chain.pieces(joints, values) for r in piece.residual]
        return [*own, *more(joints, values, y[n + 1 :])]

    y = newton(residual, lambda y: differences(residual, y), [*flat(z), p[active], *extra])
    joints, values = at(y)
    return Located(y[n], _allowed(differences(residual, y), y, n, values), values, joints)


def differences(residual: Callable[[list[Any]], list[Any]], y: list[Any]) -> FloatArray:
    """Return the Jacobian of a residual by central differences."""
    columns = []
    for k in range(len(y)):
        up, down = list(y), list(y)
        up[k] += STEP
        down[k] -= STEP
        pairs = zip(residual(up), residual(down), strict=True)
        columns.append([float((a - b) / (2 * STEP)) for a, b in pairs])
    return np.array(columns).T


def _allowed(jacobian: FloatArray, y: Sequence[Any], at: int, p: tuple[Any, ...]) -> float:
    """Return what rounding explains in unknown number ``at``.

    A unit in the last place of every unknown and every phase, in every equation; the response to the
    force grows with the duration of a slide (at resonance), which is less than the time here.
    """
    unknowns = np.abs([float(v) for v in y])
    w, _, S0, h, zeta = (abs(float(v)) for v in p)
    latest = float(np.max(unknowns[:at:2]))
    size = (1.0 + h) * (1.0 + (3.0 * w if h else w) * latest) * (1.0 + 2.0 * zeta) + S0
    rows = EPS * (np.abs(jacobian) @ unknowns + size * np.max(unknowns[1:at:2], initial=1.0))
    try:
        inverse = np.linalg.inv(jacobian)
    except np.linalg.LinAlgError:
        raise NoReference("the equations of the event are singular") from None
    return float(np.abs(inverse[at]) @ rows + EPS * unknowns[at])


def _conditions(
    event: cf.Bifurcation, chain: Chain, p: tuple[Any, ...], z: list[Joint]
) -> tuple[Equations, list[Any]]:
    """Return the equations of an event, and starts for its own unknowns."""
    if event.kind in ("SN", "BP", "PD"):
        return _null_vector(chain, p, z, critical(event))
    if event.kind == "NS":
        return lambda z, p, _: [chain.turn_map(chain.pieces(z, p))[1] - 1], []
    test = event.tests[0]
    if test.margin is Margin.JOINT:
        return _at_joint(chain, test), []
    if test.margin is Margin.EXIT:
        return _at_exit(chain, test), []
    return _tangency(event, chain, p, z, test)


def critical(event: cf.Bifurcation) -> float:
    """Return the multiplier of one turn, +1 or -1, that the event has.

    SN: +1; PD: -1, of the orbit that is not doubled. BP: -1 on half of a symmetric orbit.
    """
    if event.kind != "BP":
        return 1.0 if event.kind == "SN" else -1.0
    mu = event.orbit.turn_multipliers
    return min((-1.0, 1.0), key=lambda value: float(np.min(np.abs(mu - value))))


def _null_vector(
    chain: Chain, p: tuple[Any, ...], z: list[Joint], mu: float
) -> tuple[Equations, list[Any]]:
    if len(z) > MOST_WITH_VECTOR:
        raise TooLong("too long for its null vector")
    w = np.linalg.svd(chain.jacobian(chain.pieces(z, p), mu))[2][-1]

    def more(z: list[Joint], p: tuple[Any, ...], w_now: list[Any]) -> list[Any]:
        joints = paired(w_now)
        closed = [*joints, (mu * joints[0][0], mu * chain.sign * joints[0][1])]
        rows = []
        for k, piece in enumerate(chain.pieces(z, p)):
            for a, b in zip(piece.a, piece.b, strict=True):
                (t0, x0), (t1, x1) = closed[k], closed[k + 1]
                rows.append(a[0] * t0 + a[1] * x0 + b[0] * t1 + b[1] * x1)
        return [*rows, sum(mpf(a) * b for a, b in zip(w.tolist(), w_now, strict=True)) - 1]

    return more, [mpf(v) for v in w.tolist()]


def _at_joint(chain: Chain, test: EventFunction) -> Equations:
    side, i = SIDE[test.surface], test.segment + 1

    def more(z: list[Joint], p: tuple[Any, ...], _: list[Any]) -> list[Any]:
        t, x = chain.closed(z, p)[i]
        return [x - force(p, t)[0] - side * p[2]]

    return more


def _at_exit(chain: Chain, test: EventFunction) -> Equations:
    s, i = chain.modes[test.segment], test.segment + 1

    def more(z: list[Joint], p: tuple[Any, ...], _: list[Any]) -> list[Any]:
        joint = chain.closed(z, p)[i]
        return [force(p, joint[0])[1] if s == 0 else acceleration(p, s, joint)]

    return more


def touching(
    chain: Chain, kind: str, i: int, side: int
) -> Callable[[Sequence[Joint], tuple[Any, ...], Any], tuple[Any, Any]]:
    """Return (what touches zero, its rate) as a function of joints, parameters and an instant."""
    s = chain.modes[i]

    def value(z: Sequence[Joint], p: tuple[Any, ...], t: Any) -> tuple[Any, Any]:
        f, rate, _ = force(p, t)
        if s == 0:
            return chain.closed(z, p)[i][1] - f - side * p[2], -rate
        x, v, _ = slide(p, s, chain.closed(z, p)[i], t)
        if kind == "GS":
            return v, f - x - s * p[1] - 2 * p[4] * v
        return x - f - side * p[2], v - rate

    return value


def _tangency(
    event: cf.Bifurcation, chain: Chain, p: tuple[Any, ...], z: list[Joint], test: EventFunction
) -> tuple[Equations, list[Any]]:
    sides = (
        (SIDE[test.surface],) if test.surface in SIDE else (1, -1) if event.kind == "T" else (0,)
    )
    found = []
    for side in sides:
        value = touching(chain, event.kind, test.segment, side)
        found += [
            (abs(value(z, p, t)[0]), side, t) for t in extrema(chain, value, z, p, test.segment)
        ]
    gap, side, t = min(found, default=(mp.inf, 0, mpf(0)))
    if gap > TOUCHES and event.kind is not cf.Kind.T:  # it touches where it ends
        return _at_exit(chain, test), []
    if gap > TOUCHES:
        raise NoReference("nothing touches its limit inside the segment")
    value = touching(chain, event.kind, test.segment, side)
    return lambda z, p, more: list(value(z, p, more[0])), [t]


def extrema(chain: Chain, value: Any, z: Sequence[Joint], p: tuple[Any, ...], i: int) -> list[Any]:
    """Return the instants inside a segment at which a rate changes its sign."""
    closed = chain.closed(z, p)
    start, end = closed[i][0], closed[i + 1][0]
    # denser towards the ends: two extrema are born near a start with little acceleration
    shares = [(1 - mp.cospi(mpf(k) / SAMPLES)) / 2 for k in range(SAMPLES + 1)]
    times = [start + (end - start) * share for share in shares]
    rates = [value(z, p, t)[1] for t in times]
    found = []
    for k in range(SAMPLES):
        if rates[k] * rates[k + 1] < 0:
            low, high = times[k], times[k + 1]
            for _ in range(HALVINGS):
                middle = (low + high) / 2
                below = value(z, p, middle)[1] * rates[k] > 0
                low, high = (middle, high) if below else (low, middle)
            found.append((low + high) / 2)
    return found
