"""The Coulomb oscillator as a flow by numerical integration: from its functions."""

from __future__ import annotations

import math

from contfric.compiled import (
    field_signature,
    helper,
    kernel,
    level_signature,
    observe_signature,
    period_signature,
    rate_signature,
    scale_signature,
)
from contfric.flow.integrated import Functions
from contfric.flow.interface import CompiledFlow

OMEGA, S, S0, H, ZETA = range(5)
LOAD, SPEED = range(2)
STICK = 2


@helper
def force_of(t, p):
    w, h = p[OMEGA], p[H]
    c, c3, d, d3 = math.cos(w * t), math.cos(3 * w * t), math.sin(w * t), math.sin(3 * w * t)
    return (
        c + h * c3,
        -w * (d + 3 * h * d3),
        -w * w * (c + 9 * h * c3),
        -t * (d + 3 * h * d3),
        c3,
    )


@helper
def slope_of_rate(t, p):
    """d(f')/dOmega and d(f')/dh."""
    w, h = p[OMEGA], p[H]
    d, d3 = math.sin(w * t), math.sin(3 * w * t)
    by_omega = -(d + 3 * h * d3) - w * t * (math.cos(w * t) + 9 * h * math.cos(3 * w * t))
    return by_omega, -3 * w * d3


@kernel(field_signature)
def field(mode, t, y, p, which, out, jac):
    if mode == STICK:
        out[0] = 0.0
        out[1] = 0.0
        for i in range(jac.shape[0]):
            for j in range(jac.shape[1]):
                jac[i, j] = 0.0
        return
    sign = 1.0 if mode == 0 else -1.0
    out[0] = y[1]
    if jac.shape[0] == 0:
        f = math.cos(p[OMEGA] * t) + p[H] * math.cos(3 * p[OMEGA] * t)
        out[1] = f - sign * p[S] - 2 * p[ZETA] * y[1] - y[0]
        return
    f, f1, _, f_omega, f_h = force_of(t, p)
    out[1] = f - sign * p[S] - 2 * p[ZETA] * y[1] - y[0]
    jac[0, 0] = 0.0
    jac[0, 1] = 0.0
    jac[0, 2] = 1.0
    jac[1, 0] = f1
    jac[1, 1] = -1.0
    jac[1, 2] = -2 * p[ZETA]
    for k in range(which.shape[0]):
        j = which[k]
        jac[0, 3 + k] = 0.0
        jac[1, 3 + k] = 0.0
        if j == OMEGA:
            jac[1, 3 + k] = f_omega
        elif j == S:
            jac[1, 3 + k] = -sign
        elif j == H:
            jac[1, 3 + k] = f_h
        elif j == ZETA:
            jac[1, 3 + k] = -2 * y[1]


@kernel(observe_signature)
def value_of(c, t, y, p, which, grad):
    f, f1, _, f_omega, f_h = force_of(t, p)
    for k in range(grad.shape[0]):
        grad[k] = 0.0
    if c == SPEED:
        if grad.shape[0] > 0:
            grad[2] = 1.0
        return y[1]
    if grad.shape[0] > 0:
        grad[0] = -f1
        grad[1] = 1.0
        for k in range(which.shape[0]):
            grad[3 + k] = -f_omega if which[k] == OMEGA else (-f_h if which[k] == H else 0.0)
    return y[0] - f


@kernel(rate_signature)
def rate_of(mode, c, t, y, p, which, grad):
    f, f1, f2, f_omega, f_h = force_of(t, p)
    slides = 0.0 if mode == STICK else 1.0
    sign = 1.0 if mode == 0 else -1.0
    for k in range(grad.shape[0]):
        grad[k] = 0.0
    if c != SPEED:
        if grad.shape[0] > 0:
            grad[0] = -f2
            grad[2] = slides
            by_omega, by_h = slope_of_rate(t, p)
            for k in range(which.shape[0]):
                j = which[k]
                grad[3 + k] = -by_omega if j == OMEGA else (-by_h if j == H else 0.0)
        return slides * y[1] - f1
    if grad.shape[0] > 0:
        grad[0], grad[1], grad[2] = slides * f1, -slides, -slides * 2 * p[ZETA]
        for k in range(which.shape[0]):
            j = which[k]
            value = 0.0
            if j == OMEGA:
                value = f_omega
            elif j == S:
                value = -sign
            elif j == H:
                value = f_h
            elif j == ZETA:
                value = -2 * y[1]
            grad[3 + k] = slides * value
    return slides * (f - sign * p[S] - 2 * p[ZETA] * y[1] - y[0])


@kernel(period_signature)
def period_of(p, which, grad):
    value = 2.0 * math.pi / p[OMEGA]
    for k in range(grad.shape[0]):
        grad[k] = -value / p[OMEGA] if which[k] == OMEGA else 0.0
    return value


@kernel(scale_signature)
def scale_of(i, p):
    return 1.0


@kernel(field_signature)
def at_rest(mode, t, y, p, which, y1, jac):
    """It rests, whatever came before."""
    y1[0], y1[1] = y[0], 0.0
    for i in range(jac.shape[0]):
        for j in range(jac.shape[1]):
            jac[i, j] = 1.0 if i == 0 and j == 1 else 0.0


@kernel(level_signature)
def level(k, p, which, grad):
    sign = 1.0 if k == 0 else (-1.0 if k == 1 else 0.0)
    for j in range(grad.shape[0]):
        grad[j] = sign if which[j] == S0 else 0.0
    return sign * p[S0]


FUNCTIONS = Functions(
    field=field,
    observe=value_of,
    rate=rate_of,
    period=period_of,
    scale=scale_of,
    modes=3,
    observables=2,
    sides={(0, SPEED): 1, (1, SPEED): -1},
    slides=(STICK,),
    onto=at_rest,
)


def compiled_flow() -> CompiledFlow:
    return FUNCTIONS.flow(level)


FLOW = compiled_flow()
flow, hit, stationary, observe, rate = FLOW.flow, FLOW.hit, FLOW.stationary, value_of, rate_of
