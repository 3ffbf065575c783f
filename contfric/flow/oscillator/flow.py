"""Closed-form flow of the forced oscillator with a constant friction force on each side.

Slide in direction s: ``x'' + 2 zeta x' + x = f(t) - s S`` with ``f(t) = cos(Omega t) + h cos(3 Omega t)``.
After a duration d from ``(t0, x0, v0)``, with G, C, R of :func:`contfric.flow.oscillator.response.free` and
the responses X, V of :func:`contfric.flow.oscillator.response.forced`::

    x = x0 + v0 G - (x0 + s S) R + X(Omega) + h X(3 Omega)
    v = v0 C      - (x0 + s S) G + V(Omega) + h V(3 Omega)

At rest x is held and v = 0. The load on the contact is ``u = x - f(t)``.

Modes: 0 slides with v > 0, 1 slides with v < 0, 2 sticks. Observables: 0 is u, 1 is v. Surfaces: 0 is
``u = S0``, 1 is ``u = -S0``, 2 is ``v = 0``. Parameters: Omega, S, S0, h, zeta.
"""

from __future__ import annotations

import math

from contfric.compiled import (
    allocating_helper,
    flow_signature,
    helper,
    hit_signature,
    kernel,
    level_signature,
    observe_signature,
    period_signature,
    rate_signature,
    stationary_signature,
)
from contfric.flow.interface import CompiledFlow
from contfric.flow.oscillator.damping import damping_response
from contfric.flow.oscillator.motion import (
    OMEGA,
    S0,
    SPEED,
    STICK,
    ZETA,
    H,
    S,
    direction,
    excitation,
    phases,
    point,
)
from contfric.flow.oscillator.response import forced, free
from contfric.flow.oscillator.rest import rest_hit, rest_stationary
from contfric.flow.oscillator.roots import interior_of, roots_along
from contfric.flow.oscillator.second import second
from contfric.flow.oscillator.together import together

#: A load this far from a level is not there by rounding: its next hit is one of the closed form's.
AWAY = 1e-6


@allocating_helper
def damping_slope(s, p, t0, x0, v0, d, own, one, three):  # type: ignore[no-untyped-def]
    """Return d(x, v)/dzeta, from the responses to both harmonics: those of phase 0 are turned back."""
    theta = p[OMEGA] * t0
    first, third = complex(math.cos(theta), math.sin(theta)), complex(0.0, 0.0)
    p1, p3 = first.conjugate() * complex(one[0], -one[2]), third
    if p[H] != 0.0:
        turn = complex(math.cos(3 * theta), math.sin(3 * theta))
        third, p3 = p[H] * turn, turn.conjugate() * complex(three[0], -three[2])
    known = own[0], p1, p3
    return damping_response(p, x0 + s * p[S], v0, first, third, d, known)


@allocating_helper
def parameter_slope(index, s, p, t0, x0, v0, d, own, one, three):  # type: ignore[no-untyped-def]
    """Return d(x, v) by one parameter after a slide: from (G, C, R) and the responses to both harmonics."""
    h = p[H]
    if index == OMEGA:
        x = t0 * one[2] + one[4]
        v = t0 * one[3] + one[5]
        if h != 0.0:
            x += 3 * h * (t0 * three[2] + three[4])
            v += 3 * h * (t0 * three[3] + three[5])
        return x, v
    if index == S:
        return -s * own[2], -s * own[0]
    if index == H:
        if h == 0.0:
            three = forced(p[ZETA], 3 * p[OMEGA], 3 * p[OMEGA] * t0, d)
        return three[0], three[1]
    if index == ZETA:
        return damping_slope(s, p, t0, x0, v0, d, own, one, three)
    return 0.0, 0.0


@kernel(flow_signature, counts=False)
def flow(mode, t0, y0, dt, p, which, y1, jac):  # type: ignore[no-untyped-def]
    """Advance a state by ``dt`` in one mode, with derivatives where ``jac`` has space for them."""
    if mode == STICK:
        y1[0] = y0[0]
        y1[1] = 0.0
        if jac.shape[0] > 0:
            jac[:, :] = 0.0
            jac[0, 1] = 1.0
        return
    s = direction(mode)
    x0, v0 = y0[0], y0[1]
    if jac.shape[0] == 0:
        moved = point(mode, p, phases(p, t0), t0, x0, v0, dt)
        y1[0], y1[1] = moved[0], moved[1]
        return
    w, h, zeta = p[OMEGA], p[H], p[ZETA]
    own = free(zeta, dt)
    g, c, r = own
    load = x0 + s * p[S]
    one = forced(zeta, w, w * t0, dt)
    x = x0 + v0 * g - load * r + one[0]
    v = v0 * c - load * g + one[1]
    jac[0, 0] = w * one[2]
    jac[1, 0] = w * one[3]
    three = one
    if h != 0.0:
        three = forced(zeta, 3 * w, 3 * w * t0, dt)
        x += h * three[0]
        v += h * three[1]
        jac[0, 0] += 3 * w * h * three[2]
        jac[1, 0] += 3 * w * h * three[3]
    y1[0], y1[1] = x, v
    jac[0, 1] = 1.0 - r
    jac[0, 2] = g
    jac[1, 1] = -g
    jac[1, 2] = c
    jac[0, 3] = v
    jac[1, 3] = excitation(p, t0 + dt)[0] - 2 * zeta * v - x - s * p[S]
    for k in range(which.shape[0]):
        jac[0, 4 + k], jac[1, 4 + k] = parameter_slope(
            which[k], s, p, t0, x0, v0, dt, own, one, three
        )


@kernel(observe_signature, counts=False)
def observe(c, t, y, p, which, grad):  # type: ignore[no-untyped-def]
    """Return the load u or the velocity v, with the gradient where there is space for it."""
    if grad.shape[0] > 0:
        grad[:] = 0.0
    if c == SPEED:
        if grad.shape[0] > 0:
            grad[2] = 1.0
        return y[1]
    if grad.shape[0] == 0:
        f = math.cos(p[OMEGA] * t)
        if p[H] != 0.0:
            f += p[H] * math.cos(3 * p[OMEGA] * t)
        return y[0] - f
    f, f1, _ = excitation(p, t)
    if grad.shape[0] > 0:
        grad[0] = -f1
        grad[1] = 1.0
        for k in range(which.shape[0]):
            if which[k] == OMEGA:
                grad[3 + k] = -f1 * t / p[OMEGA]
            elif which[k] == H:
                grad[3 + k] = -math.cos(3 * p[OMEGA] * t)
    return y[0] - f


@kernel(level_signature, counts=False)
def level(k, p, which, grad):  # type: ignore[no-untyped-def]
    """Return the level of a surface: S0, -S0 or 0."""
    sign = 1.0 if k == 0 else (-1.0 if k == 1 else 0.0)
    if grad.shape[0] > 0:
        for j in range(which.shape[0]):
            grad[j] = sign if which[j] == S0 else 0.0
    return sign * p[S0]


@kernel(period_signature, counts=False)
def period(p, which, grad):  # type: ignore[no-untyped-def]
    """Return the period of the excitation, 2 pi / Omega."""
    value = 2.0 * math.pi / p[OMEGA]
    if grad.shape[0] > 0:
        for j in range(which.shape[0]):
            grad[j] = -value / p[OMEGA] if which[j] == OMEGA else 0.0
    return value


@kernel(rate_signature, counts=False)
def rate(mode, c, t, y, p, which, grad):  # type: ignore[no-untyped-def]
    """Return ``u' = v - f'(t)`` or ``v' = f(t) - s S - 2 zeta v - x``, with the gradient."""
    f, f1, f2 = excitation(p, t)
    slides = 0.0 if mode == STICK else 1.0
    friction = direction(mode) * slides
    if grad.shape[0] > 0:
        grad[:] = 0.0
        if c == SPEED:
            grad[0], grad[1], grad[2] = slides * f1, -slides, -slides * 2.0 * p[ZETA]
        else:
            grad[0], grad[2] = -f2, slides
        for k in range(which.shape[0]):
            j = which[k]
            if c != SPEED and j == OMEGA:  # f' = Omega g(Omega t)
                grad[3 + k] = -(f1 + t * f2) / p[OMEGA]
            elif c != SPEED and j == H:
                grad[3 + k] = 3.0 * p[OMEGA] * math.sin(3.0 * p[OMEGA] * t)
            elif c == SPEED and j == OMEGA:
                grad[3 + k] = slides * f1 * t / p[OMEGA]
            elif c == SPEED and j == S:
                grad[3 + k] = -friction
            elif c == SPEED and j == H:
                grad[3 + k] = slides * math.cos(3.0 * p[OMEGA] * t)
            elif c == SPEED and j == ZETA:
                grad[3 + k] = -slides * 2.0 * y[1]
    if c != SPEED:
        return slides * y[1] - f1
    return slides * (f - friction * p[S] - 2.0 * p[ZETA] * y[1] - y[0])


@helper
def is_motion(t0, y0, dt, p):  # type: ignore[no-untyped-def]
    """Tell whether there is a solution to search: iterates of Newton's method may be anything."""
    return p[OMEGA] > 0.0 and math.isfinite(t0 + dt + y0[0] + y0[1] + p[S] + p[H] + p[ZETA])


@kernel(hit_signature, counts=False)
def hit(mode, c, target, on, t0, y0, dt_max, p, y1):  # type: ignore[no-untyped-def]
    """Return the first time at which observable c takes a value, with the state there, or -1.

    No numbers as the state where nothing can be found: what is given is no motion, or the search too long.
    """
    if mode == STICK and c == SPEED:
        return -1.0
    if not is_motion(t0, y0, dt_max, p):
        y1[0], y1[1] = math.nan, math.nan
        return 0.0
    sign = direction(mode) if on and c == SPEED else 0.0  # a slide leaves v = 0 to its own side
    phase = phases(p, t0)
    if mode == STICK and p[H] == 0.0 and abs(y0[0] - phase[1] - target) > AWAY:
        tau = rest_hit(y0[0], target, p[OMEGA], phase)
        y1[0], y1[1] = y0[0], 0.0
        return tau if tau <= dt_max else -1.0
    order = min(mode, 0)  # 0, but no literal: the search would be compiled once for each
    _, tau, x = roots_along(mode, c, order, target, on, sign, phase, t0, y0, dt_max, p, y0, y0)
    if tau < 0.0 or tau > dt_max:
        return -1.0
    if math.isnan(tau):
        y1[0], y1[1] = tau, tau
        return 0.0
    if c == SPEED and not math.isnan(x):
        y1[0], y1[1] = x, target
    else:
        moved = point(mode, p, phase, t0, y0[0], y0[1], tau)
        y1[0], y1[1] = moved[0], moved[1]
    return tau


@kernel(stationary_signature, counts=False)
def stationary(mode, c, t0, y0, dt, p, times, values):  # type: ignore[no-untyped-def]
    """Write the interior stationary points of observable c and return their number."""
    if dt <= 0.0 or (mode == STICK and c == SPEED):
        return 0
    if not is_motion(t0, y0, dt, p):
        return -1
    phase = phases(p, t0)
    if mode == STICK and p[H] == 0.0:
        first, last = interior_of(dt)
        return rest_stationary(y0[0], p[OMEGA], phase, first, last, times, values)
    order, on = max(1 - mode, 1), dt < 0.0  # 1 and False, but no literals
    return roots_along(mode, c, order, 0.0, on, 0.0, phase, t0, y0, dt, p, times, values)[0]


def compiled_flow() -> CompiledFlow:
    """Return the compiled functions of this flow."""
    functions = flow, observe, level, stationary, hit, period, rate
    return CompiledFlow(*functions, second=second, together=together)
