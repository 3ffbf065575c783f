"""THROW-AWAY: a minimal integrator until the real one is merged."""

from __future__ import annotations

import numpy as np

from contfric.compiled import allocating_helper

STEP = 0.01


@allocating_helper
def rk4(field, mode, t, h, y, p, which, k, none):  # type: ignore[no-untyped-def]
    n = y.shape[0]
    w = np.empty(n)
    field(mode, t, y, p, which, k[0], none)
    for i in range(n):
        w[i] = y[i] + 0.5 * h * k[0, i]
    field(mode, t + 0.5 * h, w, p, which, k[1], none)
    for i in range(n):
        w[i] = y[i] + 0.5 * h * k[1, i]
    field(mode, t + 0.5 * h, w, p, which, k[2], none)
    for i in range(n):
        w[i] = y[i] + h * k[2, i]
    field(mode, t + h, w, p, which, k[3], none)
    for i in range(n):
        y[i] += h / 6.0 * (k[0, i] + 2.0 * k[1, i] + 2.0 * k[2, i] + k[3, i])


@allocating_helper
def advance(field, mode, t0, y0, dt, p, which, y1, jac):  # type: ignore[no-untyped-def]
    n, m = y0.shape[0], which.shape[0]
    wanted = jac.shape[0] > 0
    c = 1 + n + m if wanted else 0
    steps = int(abs(dt) / STEP) + 1
    h = dt / steps
    y = y0.copy()
    v = np.zeros((n, 1 + n + m))
    for i in range(n):
        v[i, 1 + i] = 1.0
    k = np.zeros((4, n))
    kv = np.zeros((4, n, 1 + n + m))
    jacs = np.zeros((n, 1 + n + m))
    none = np.empty((0, 0))
    w = np.empty(n)
    wv = np.empty((n, 1 + n + m))
    coefficients = (0.0, 0.5, 0.5, 1.0)
    for s in range(steps):
        t = t0 + s * h
        if c == 0:
            rk4(field, mode, t, h, y, p, which, k, none)
            continue
        for a in range(4):
            f = coefficients[a]
            for i in range(n):
                w[i] = y[i] + (f * h * k[a - 1, i] if a > 0 else 0.0)
                for j in range(c):
                    wv[i, j] = v[i, j] + (f * h * kv[a - 1, i, j] if a > 0 else 0.0)
            field(mode, t + f * h, w, p, which, k[a], jacs)
            for i in range(n):
                for j in range(c):
                    x = 0.0
                    if j == 0:
                        x += jacs[i, 0]
                    elif j > n:
                        x += jacs[i, j]
                    for q in range(n):
                        x += jacs[i, 1 + q] * wv[q, j]
                    kv[a, i, j] = x
        for i in range(n):
            y[i] += h / 6.0 * (k[0, i] + 2.0 * k[1, i] + 2.0 * k[2, i] + k[3, i])
            for j in range(c):
                v[i, j] += h / 6.0 * (kv[0, i, j] + 2.0 * kv[1, i, j] + 2.0 * kv[2, i, j] + kv[3, i, j])
    for i in range(n):
        y1[i] = y[i]
    if wanted:
        field(mode, t0 + dt, y, p, which, k[0], none)
        for i in range(n):
            for j in range(c):
                jac[i, j if j <= n else j + 1] = v[i, j]
            jac[i, 1 + n] = k[0, i]


@allocating_helper
def first_hit(field, observe, rate, mode, c, target, on, t0, y0, dt_max, p, y1):  # type: ignore[no-untyped-def]
    which, grad, none = np.empty(0, dtype=np.int64), np.empty(0), np.empty((0, 0))
    k = np.zeros((4, y0.shape[0]))
    y = y0.copy()
    done = 0.0
    before = observe(c, t0, y, p, which, grad) - target
    if on:
        before = 0.0
    first = True
    while done < dt_max:
        h = min(STEP, dt_max - done)
        last = y.copy()
        rk4(field, mode, t0 + done, h, y, p, which, k, none)
        after = observe(c, t0 + done + h, y, p, which, grad) - target
        if not (first and on) and before * after <= 0.0:
            low, high = 0.0, h
            for _ in range(60):
                mid = 0.5 * (low + high)
                w = last.copy()
                rk4(field, mode, t0 + done, mid, w, p, which, k, none)
                value = observe(c, t0 + done + mid, w, p, which, grad) - target
                if before * value <= 0.0:
                    high = mid
                else:
                    low = mid
            rk4(field, mode, t0 + done, high, last, p, which, k, none)
            for i in range(y.shape[0]):
                y1[i] = last[i]
            return done + high
        before = after
        done += h
        first = False
    return -1.0


@allocating_helper
def stationary(field, observe, rate, mode, c, t0, y0, dt, p, times, values):  # type: ignore[no-untyped-def]
    which, grad, none = np.empty(0, dtype=np.int64), np.empty(0), np.empty((0, 0))
    k = np.zeros((4, y0.shape[0]))
    y = y0.copy()
    done, found = 0.0, 0
    before = rate(mode, c, t0, y, p, which, grad)
    while done < dt:
        h = min(STEP, dt - done)
        last = y.copy()
        rk4(field, mode, t0 + done, h, y, p, which, k, none)
        after = rate(mode, c, t0 + done + h, y, p, which, grad)
        if before * after < 0.0:
            low, high = 0.0, h
            for _ in range(60):
                mid = 0.5 * (low + high)
                w = last.copy()
                rk4(field, mode, t0 + done, mid, w, p, which, k, none)
                if before * rate(mode, c, t0 + done + mid, w, p, which, grad) <= 0.0:
                    high = mid
                else:
                    low = mid
            rk4(field, mode, t0 + done, high, last, p, which, k, none)
            if found >= times.shape[0]:
                return -1
            times[found] = done + high
            values[found] = observe(c, t0 + done + high, last, p, which, grad)
            found += 1
        before = after
        done += h
    return found
