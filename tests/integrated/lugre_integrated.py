"""A mass with LuGre friction as a flow by numerical integration (equations 7 to 9 of the article)."""
from __future__ import annotations
import math
import os
from contfric.compiled import flow_signature, helper, kernel
from contfric.flow.integrated import integrated_flow, integrated_motion

OMEGA, S, S0, SIGMA0, SIGMA1, C, VS = range(7)


@helper
def field(mode, t, y, p, which, out, jac):
    sign = 1.0 if mode == 0 else -1.0
    x, v, z = y[0], y[1], y[2]
    w, s, s0, k, k1, c, vs = p[0], p[1], p[2], p[3], p[4], p[5], p[6]
    e = math.exp(-sign * v / vs)
    g = s + (s0 - s) * e
    m = sign * v / g
    dz = v - k * m * z
    out[0] = v
    out[1] = math.cos(w * t) - x - k * z - k1 * dz - c * v
    out[2] = dz
    if jac.shape[0] == 0:
        return
    dg = -sign / vs * (s0 - s) * e
    dm = sign / g - m * dg / g
    jac[0, 0] = 0.0
    jac[0, 1] = 0.0
    jac[0, 2] = 1.0
    jac[0, 3] = 0.0
    jac[2, 0] = 0.0
    jac[2, 1] = 0.0
    jac[2, 2] = 1.0 - k * dm * z
    jac[2, 3] = -k * m
    jac[1, 0] = -w * math.sin(w * t)
    jac[1, 1] = -1.0
    jac[1, 2] = -k1 * jac[2, 2] - c
    jac[1, 3] = -k - k1 * jac[2, 3]
    for q in range(which.shape[0]):
        j = which[q]
        a, b = 0.0, 0.0
        if j == OMEGA:
            a = -t * math.sin(w * t)
        elif j == S:
            b = k * m * z / g * (1.0 - e)
        elif j == S0:
            b = k * m * z / g * e
        elif j == SIGMA0:
            a, b = -z, -m * z
        elif j == SIGMA1:
            a = -dz
        elif j == C:
            a = -v
        elif j == VS:
            b = k * m * z / g * (s0 - s) * e * sign * v / (vs * vs)
        jac[0, 4 + q] = 0.0
        jac[1, 4 + q] = a - k1 * b
        jac[2, 4 + q] = b


@helper
def observe(c, t, y, p, which, grad):
    for k in range(grad.shape[0]):
        grad[k] = 0.0
    if grad.shape[0] > 0:
        grad[2] = 1.0
    return y[1]


@helper
def rate(mode, c, t, y, p, which, grad):
    return 0.0

@helper
def scale(i, p):
    return 1.0 / p[3] if i == 2 else 1.0

@helper
def period(p, which, grad):
    return 2 * math.pi / p[0]

MOTION = integrated_motion(field, observe, rate, period, scale, method=os.environ.get("METHOD","automatic"), relative=float(os.environ.get("TOL","1e-12")),absolute=float(os.environ.get("TOL","1e-12")))

@kernel(flow_signature)
def flow(mode, t0, y0, dt, p, which, y1, jac):
    integrated_flow(MOTION, mode, t0, y0, dt, p, which, y1, jac)


from contfric.compiled import i8, f8, vector, indices, types, allocating_helper
from contfric.flow.integrated import advance
from contfric.flow.dop853 import STAGES
from contfric.flow.variations import make_room
import numpy as np

@kernel(types.UniTuple(f8,4)(i8,f8,vector,f8,vector,indices))
def count(mode,t0,y0,dt,p,which):
    n=3
    columns = 1+n+which.shape[0] if which.shape[0]>0 else 0
    room = make_room(n, 0, columns, STAGES, MOTION.implicit)
    advance(MOTION, mode, t0, dt, y0, p, which, room)
    return room.control[4], room.control[3], room.control[0], room.control[9]
