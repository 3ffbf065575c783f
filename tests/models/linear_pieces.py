"""Models of linear pieces for the tests, with a flow in closed form.

Each mode is ``x'' + 2 zeta x' + x = b + f cos(Omega t)`` with a constant b of its own, or rest on a belt,
``x' = V``. Derivatives are by complex steps, exact to rounding. First roots are by a march of small steps
that looks at the sign of the function and, where its slope turns, at the extremum; good enough for tests.

Parameters: zeta, S, S0, V, f, Omega, wall, e, a. Observables: 0 is the load
``x + 2 zeta x' - f cos(Omega t)``, 1 is x', 2 is the distance to a wall above the mass, at
``wall + a cos(Omega t)``.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping

import numpy as np

from contfric.compiled import (
    flow_signature,
    helper,
    hit_signature,
    kernel,
    level_signature,
    observe_signature,
    period_signature,
    rate_signature,
    reset_signature,
    stationary_signature,
)
from contfric.flow.interface import CompiledFlow
from contfric.models.definition import (
    Constraint,
    Departure,
    Domain,
    FloatArray,
    Mode,
    Model,
    Observable,
    Parameter,
    Reset,
    Surface,
    Symmetry,
)

ZETA, S, S0, V, F, OMEGA, WALL, E, A = range(9)
#: Modes: x' below the belt's speed, above it, and at rest on it.
SLOWER, FASTER, STICK, FREE, STICK_BACK = range(5)
_STEP = 0.05
_TINY = 1e-40


@helper
def moved(mode, t0, x0, v0, d, zeta, s, v_belt, f, omega):
    """Return (x, x') after a duration, from complex numbers."""
    if mode == STICK:
        return x0 + v_belt * d, v_belt
    if mode == STICK_BACK:
        return x0 - v_belt * d, -v_belt
    b = 0.0 * s if mode == FREE else (s if mode == SLOWER else -s)
    w = cmath.sqrt(1.0 - zeta * zeta)
    grown = cmath.exp(-zeta * d)
    c, q = cmath.cos(w * d), cmath.sin(w * d) / w
    size = (1.0 - omega * omega) ** 2 + 4.0 * zeta * zeta * omega * omega
    p, r = f * (1.0 - omega * omega) / size, f * 2.0 * zeta * omega / size
    c0, s0 = cmath.cos(omega * t0), cmath.sin(omega * t0)
    c1, s1 = cmath.cos(omega * (t0 + d)), cmath.sin(omega * (t0 + d))
    x = x0 - b - p * c0 - r * s0
    v = v0 + omega * (p * s0 - r * c0)
    return (
        b + p * c1 + r * s1 + grown * ((c + zeta * q) * x + q * v),
        omega * (r * c1 - p * s1) + grown * ((c - zeta * q) * v - q * x),
    )


@helper
def at(mode, t0, y0, d, p):
    """Return (x, x') after a duration."""
    x, v = moved(
        mode,
        complex(t0, 0.0),
        complex(y0[0], 0.0),
        complex(y0[1], 0.0),
        complex(d, 0.0),
        complex(p[ZETA], 0.0),
        complex(p[S], 0.0),
        complex(p[V], 0.0),
        complex(p[F], 0.0),
        complex(p[OMEGA], 0.0),
    )
    return x.real, v.real


@kernel(flow_signature)
def flow(mode, t0, y0, dt, p, which, y1, jac):
    y1[0], y1[1] = at(mode, t0, y0, dt, p)
    if jac.shape[0] == 0:
        return
    for j in range(jac.shape[1]):
        k = -1 if j < 4 else which[j - 4]
        x, v = moved(
            mode,
            complex(t0, _TINY if j == 0 else 0.0),
            complex(y0[0], _TINY if j == 1 else 0.0),
            complex(y0[1], _TINY if j == 2 else 0.0),
            complex(dt, _TINY if j == 3 else 0.0),
            complex(p[ZETA], _TINY if k == ZETA else 0.0),
            complex(p[S], _TINY if k == S else 0.0),
            complex(p[V], _TINY if k == V else 0.0),
            complex(p[F], _TINY if k == F else 0.0),
            complex(p[OMEGA], _TINY if k == OMEGA else 0.0),
        )
        jac[0, j], jac[1, j] = x.imag / _TINY, v.imag / _TINY


@helper
def value(c, t, x, v, p):
    if c == 0:
        return x + 2.0 * p[ZETA] * v - p[F] * math.cos(p[OMEGA] * t)
    if c == 1:
        return v
    return p[WALL] + p[A] * math.cos(p[OMEGA] * t) - x


@helper
def slope(mode, c, t, x, v, p):
    acc = 0.0
    if mode != STICK and mode != STICK_BACK:
        b = 0.0 if mode == FREE else (p[S] if mode == SLOWER else -p[S])
        acc = b + p[F] * math.cos(p[OMEGA] * t) - 2.0 * p[ZETA] * v - x
    sine = math.sin(p[OMEGA] * t)
    if c == 0:
        return v + 2.0 * p[ZETA] * acc + p[F] * p[OMEGA] * sine
    return acc if c == 1 else -p[A] * p[OMEGA] * sine - v


@kernel(observe_signature)
def observe(c, t, y, p, which, grad):
    if grad.shape[0] > 0:
        cosine, sine = math.cos(p[OMEGA] * t), math.sin(p[OMEGA] * t)
        grad[:] = 0.0
        if c == 0:
            grad[0], grad[1], grad[2] = p[F] * p[OMEGA] * sine, 1.0, 2.0 * p[ZETA]
        elif c == 1:
            grad[2] = 1.0
        else:
            grad[0], grad[1] = -p[A] * p[OMEGA] * sine, -1.0
        for j in range(which.shape[0]):
            k = which[j]
            if c == 0 and k == ZETA:
                grad[3 + j] = 2.0 * y[1]
            elif c == 0 and k == F:
                grad[3 + j] = -cosine
            elif c == 0 and k == OMEGA:
                grad[3 + j] = p[F] * t * sine
            elif c == 2 and k == WALL:
                grad[3 + j] = 1.0
            elif c == 2 and k == A:
                grad[3 + j] = cosine
            elif c == 2 and k == OMEGA:
                grad[3 + j] = -p[A] * t * sine
    return value(c, t, y[0], y[1], p)


@kernel(rate_signature)
def rate(mode, c, t, y, p, which, grad):
    here = slope(mode, c, t, y[0], y[1], p)
    if grad.shape[0] > 0:  # central differences: the tests need no more of it
        for j in range(grad.shape[0]):
            h = 1e-6
            if j == 0:
                up = slope(mode, c, t + h, y[0], y[1], p)
                down = slope(mode, c, t - h, y[0], y[1], p)
            elif j < 3:
                dx, dv = (h, 0.0) if j == 1 else (0.0, h)
                up = slope(mode, c, t, y[0] + dx, y[1] + dv, p)
                down = slope(mode, c, t, y[0] - dx, y[1] - dv, p)
            else:
                k = which[j - 3]
                kept = p[k]
                p[k] = kept + h
                up = slope(mode, c, t, y[0], y[1], p)
                p[k] = kept - h
                down = slope(mode, c, t, y[0], y[1], p)
                p[k] = kept
            grad[j] = (up - down) / (2.0 * h)
    return here


@helper
def quantity(mode, c, order, target, t0, y0, d, p):
    x, v = at(mode, t0, y0, d, p)
    if order == 0:
        return value(c, t0 + d, x, v, p) - target
    return slope(mode, c, t0 + d, x, v, p)


@helper
def bisect(mode, c, order, target, t0, y0, a, b, p):
    qa = quantity(mode, c, order, target, t0, y0, a, p)
    for _ in range(200):
        m = 0.5 * (a + b)
        if m <= a or m >= b:
            break
        q = quantity(mode, c, order, target, t0, y0, m, p)
        if q * qa > 0.0:
            a, qa = m, q
        else:
            b = m
    return 0.5 * (a + b)


@kernel(hit_signature)
def hit(mode, c, target, on, t0, y0, dt_max, p, y1):
    a = 1e-13 if on else 0.0
    qa = quantity(mode, c, 0, target, t0, y0, a, p)
    ra = quantity(mode, c, 1, target, t0, y0, a, p)
    if on:  # it leaves the belt's speed to its own side, anything else to that of its rate
        on_belt = c == 1 and mode != STICK and p[V] > 0.0 and abs(target) == p[V]
        towards = (-1.0 if mode == SLOWER else 1.0) if on_belt else ra
        if on_belt and mode == FREE:
            towards = -target
        qa = math.copysign(max(abs(qa), 1e-300), towards)
    found = -1.0
    while a < dt_max:
        b = min(a + _STEP, dt_max)
        q = quantity(mode, c, 0, target, t0, y0, b, p)
        r = quantity(mode, c, 1, target, t0, y0, b, p)
        if qa * q <= 0.0:
            low = a
            if a < 1e-12 and ra * qa > 0.0:  # it first goes away from the root that it starts on
                low = bisect(mode, c, 1, target, t0, y0, a, b, p)
            found = bisect(mode, c, 0, target, t0, y0, low, b, p)
            break
        if ra * r < 0.0 and ra * qa < 0.0:
            m = bisect(mode, c, 1, target, t0, y0, a, b, p)
            if quantity(mode, c, 0, target, t0, y0, m, p) * qa <= 0.0:
                found = bisect(mode, c, 0, target, t0, y0, a, m, p)
                break
        a, qa, ra = b, q, r
    if found >= 0.0:
        y1[0], y1[1] = at(mode, t0, y0, found, p)
    return found


@kernel(stationary_signature)
def stationary(mode, c, t0, y0, dt, p, times, values):
    rests = mode in (STICK, STICK_BACK)
    if dt <= 0.0 or (rests and (c == 1 or (p[F] == 0.0 and c == 0))):
        return 0
    count, a, first = 0, 1e-9, 1e-9
    ra = quantity(mode, c, 1, 0.0, t0, y0, a, p)
    while a < dt:
        b = min(a + _STEP, dt)
        r = quantity(mode, c, 1, 0.0, t0, y0, b, p)
        if ra * r < 0.0:
            m = bisect(mode, c, 1, 0.0, t0, y0, a, b, p)
            if first < m < dt - first:
                if count == times.shape[0]:
                    return -1
                times[count] = m
                values[count] = quantity(mode, c, 0, 0.0, t0, y0, m, p)
                count += 1
        a, ra = b, r
    return count


@kernel(reset_signature)
def bounce(k, t, y, p, which, y1, jac):
    """Impact with restitution e on the wall: ``x' - wall'`` changes sign and loses a share of itself."""
    w = p[OMEGA]
    wall = -p[A] * w * math.sin(w * t)
    y1[0], y1[1] = y[0], wall - p[E] * (y[1] - wall)
    if jac.shape[0] == 0:
        return
    jac[:, :] = 0.0
    jac[0, 1] = 1.0
    jac[1, 0] = -(1.0 + p[E]) * p[A] * w * w * math.cos(w * t)
    jac[1, 2] = -p[E]
    for j in range(which.shape[0]):
        if which[j] == E:
            jac[1, 3 + j] = wall - y[1]
        elif which[j] == A:
            jac[1, 3 + j] = -(1.0 + p[E]) * w * math.sin(w * t)
        elif which[j] == OMEGA:
            jac[1, 3 + j] = -(1.0 + p[E]) * p[A] * (math.sin(w * t) + w * t * math.cos(w * t))


@kernel(period_signature)
def period(p, which, grad):
    value = 2.0 * math.pi / p[OMEGA]
    for j in range(grad.shape[0]):
        grad[j] = -value / p[OMEGA] if which[j] == OMEGA else 0.0
    return value


@kernel(period_signature)
def no_period(p, which, grad):
    for j in range(grad.shape[0]):
        grad[j] = 0.0
    return 0.0


@kernel(level_signature)
def belt_level(k, p, which, grad):
    """Levels of F+, F-, the belt's speed, and rest."""
    for j in range(grad.shape[0]):
        grad[j] = 0.0
        if which[j] == S0 and k < 2:
            grad[j] = 1.0 if k == 0 else -1.0
        elif which[j] == V and k == 2:
            grad[j] = 1.0
    if k == 0:
        return p[S0]
    return -p[S0] if k == 1 else (p[V] if k == 2 else 0.0)


@kernel(level_signature)
def zero_level(k, p, which, grad):
    """Levels of x' and of the wall."""
    for j in range(grad.shape[0]):
        grad[j] = 0.0
    return 0.0


@kernel(level_signature)
def dead_band_level(k, p, which, grad):
    """Levels of the load, S, 0 and -S, and of x', V, 0 and -V."""
    of = S if k < 3 else V
    sign = 1.0 - (k % 3)
    for j in range(grad.shape[0]):
        grad[j] = sign if which[j] == of else 0.0
    return sign * p[of]


PARAMETERS = (
    Parameter("zeta", 0.0, "damping ratio"),
    Parameter("S", 0.3, "kinetic friction"),
    Parameter("S0", 0.5, "static limit"),
    Parameter("V", 0.2, "speed of the belt"),
    Parameter("f", 0.0, "amplitude of the excitation"),
    Parameter("Omega", 0.5, "frequency of the excitation"),
    Parameter("wall", 1.0, "place of the wall"),
    Parameter("e", 0.8, "restitution"),
    Parameter("a", 0.0, "amplitude of the wall"),
)
OBSERVABLES = (Observable("u", "x + 2 zeta x' - f cos(Omega t)"), Observable("v", "x'"))


def _spread(params: Mapping[str, float]) -> FloatArray:
    return np.array([1.0, 1.0])


def _belt_domains() -> tuple[Domain, ...]:
    loads = {"+": (1, 1), "0": (-1, 1), "-": (-1, -1)}
    found = [
        Domain(f"u{u}{name}", mode, {"F+": up, "F-": low, "belt": belt, "rest": rest})
        for name, mode, belt, rest in (
            ("back", "slower", -1, -1),
            ("slow", "slower", -1, 1),
            ("fast", "faster", 1, 1),
        )
        for u, (up, low) in loads.items()
    ]
    return (*found, Domain("stick", "stick", {"F+": -1, "F-": 1, "belt": 0, "rest": 1}))


def _belt_flow() -> CompiledFlow:
    return CompiledFlow(flow, observe, belt_level, stationary, hit, no_period, rate)


def _impact_flow() -> CompiledFlow:
    return CompiledFlow(
        flow, _observe_wall, zero_level, _turning_wall, _hit_wall, period, _rate_wall, reset=bounce
    )


#: Block on a belt: autonomous, static limit S0 above the kinetic friction S.
belt = Model(
    name="belt-of-tests",
    title="block on a belt, constant friction",
    states=("x", "v"),
    parameters=PARAMETERS,
    constraints=(
        Constraint("V > 0", {"V": 1.0}, strict=True),
        Constraint("S >= 0", {"S": 1.0}),
        Constraint("S0 >= S", {"S0": 1.0, "S": -1.0}),
    ),
    observables=OBSERVABLES,
    surfaces=(
        Surface("F+", "u", "S0"),
        Surface("F-", "u", "-S0"),
        Surface("belt", "v", "V", switching=True),
        Surface("rest", "v", "0"),
    ),
    modes=(Mode("slower", 2), Mode("faster", 2), Mode("stick", 1, sliding=True)),
    domains=_belt_domains(),
    departures=(
        Departure({"F+": 1}, {"belt": -1}),
        Departure({"F-": -1}, {"belt": 1}),
    ),
    symmetry=None,
    stop_surface="rest",
    flow_factory=_belt_flow,
    spread=_spread,
    autonomous=True,
)


def _dead_band_domains() -> tuple[Domain, ...]:
    loads = {"3": (1, 1, 1), "2": (-1, 1, 1), "1": (-1, -1, 1), "0": (-1, -1, -1)}
    speeds = {
        "fast": ("fast", (1, 1, 1)),
        "rise": ("free", (-1, 1, 1)),
        "fall": ("free", (-1, -1, 1)),
        "slow": ("slow", (-1, -1, -1)),
    }
    names = ("U+", "U0", "U-", "V+", "V0", "V-")
    found = [
        Domain(f"{name}{u}", mode, dict(zip(names, (*load, *speed), strict=True)))
        for name, (mode, speed) in speeds.items()
        for u, load in loads.items()
    ]
    rests = (
        Domain("stick+", "stick+", dict(zip(names, (*loads["1"], 0, 1, 1), strict=True))),
        Domain("stick-", "stick-", dict(zip(names, (*loads["2"], -1, -1, 0), strict=True))),
    )
    return (*found, *rests)


def _dead_band_flow() -> CompiledFlow:
    return CompiledFlow(flow, observe, dead_band_level, stationary, hit, no_period, rate)


#: Self-excited oscillator with a dead band, ``x'' + 2 zeta x' + x = -S M(x'/V)``, zeta < 0.
dead_band = Model(
    name="dead-band-of-tests",
    title="self-excited oscillator with a dead band",
    states=("x", "v"),
    parameters=PARAMETERS,
    constraints=(Constraint("V > 0", {"V": 1.0}, strict=True),),
    observables=OBSERVABLES,
    surfaces=(
        Surface("U+", "u", "S"),
        Surface("U0", "u", "0"),
        Surface("U-", "u", "-S"),
        Surface("V+", "v", "V", switching=True),
        Surface("V0", "v", "0"),
        Surface("V-", "v", "-V", switching=True),
    ),
    modes=(
        Mode("slow", 2),
        Mode("fast", 2),
        Mode("stick+", 1, sliding=True),
        Mode("free", 2),
        Mode("stick-", 1, sliding=True),
    ),
    domains=_dead_band_domains(),
    departures=(
        Departure({"V+": 0, "U0": 1}, {"V+": -1}),
        Departure({"V+": 0, "U-": -1}, {"V+": 1}),
        Departure({"V-": 0, "U0": -1}, {"V-": 1}),
        Departure({"V-": 0, "U+": 1}, {"V-": -1}),
    ),
    symmetry=Symmetry(
        ((-1.0, 0.0), (0.0, -1.0)),
        0.5,
        {"U+": "U-", "U0": "U0", "U-": "U+", "V+": "V-", "V0": "V0", "V-": "V+"},
    ),
    stop_surface="V0",
    flow_factory=_dead_band_flow,
    spread=_spread,
    autonomous=True,
    filippov=True,
)


# The impact oscillator has x' as its first observable and the wall as its second.


@kernel(observe_signature)
def _observe_wall(c, t, y, p, which, grad):
    if grad.shape[0] > 0:
        cosine, sine = math.cos(p[OMEGA] * t), math.sin(p[OMEGA] * t)
        grad[:] = 0.0
        if c == 0:
            grad[2] = 1.0
        else:
            grad[0], grad[1] = -p[A] * p[OMEGA] * sine, -1.0
            for j in range(which.shape[0]):
                if which[j] == WALL:
                    grad[3 + j] = 1.0
                elif which[j] == A:
                    grad[3 + j] = cosine
                elif which[j] == OMEGA:
                    grad[3 + j] = -p[A] * t * sine
    return value(c + 1, t, y[0], y[1], p)


@kernel(rate_signature)
def _rate_wall(mode, c, t, y, p, which, grad):
    return rate_of(mode, c + 1, t, y, p, which, grad)


rate_of = helper(rate.__wrapped__)


@kernel(hit_signature)
def _hit_wall(mode, c, target, on, t0, y0, dt_max, p, y1):
    return hit_of(mode, c + 1, target, on, t0, y0, dt_max, p, y1)


@kernel(stationary_signature)
def _turning_wall(mode, c, t0, y0, dt, p, times, values):
    return stationary_of(mode, c + 1, t0, y0, dt, p, times, values)


hit_of = helper(hit.__wrapped__)
stationary_of = helper(stationary.__wrapped__)

#: Forced oscillator beside a wall; x' = 0 is the section. With S > 0 it has dry friction as well.
impact = Model(
    name="impact-of-tests",
    title="forced oscillator with a wall",
    states=("x", "v"),
    parameters=PARAMETERS,
    constraints=(Constraint("Omega > 0", {"Omega": 1.0}, strict=True),),
    observables=(Observable("v", "x'"), Observable("gap", "wall + a cos(Omega t) - x")),
    surfaces=(Surface("v", "v", "0", switching=True), Surface("wall", "gap", "0")),
    modes=(Mode("down", 2), Mode("up", 2)),
    domains=(
        Domain("down", "down", {"v": -1, "wall": 1}),
        Domain("up", "up", {"v": 1, "wall": 1}),
    ),
    departures=(),
    symmetry=None,
    stop_surface="v",
    flow_factory=_impact_flow,
    spread=_spread,
    resets=(Reset("wall", "x' -> wall' - e (x' - wall')", changes=("v",), lands={"wall": 1}),),
)

__all__ = ["belt", "dead_band", "impact"]
