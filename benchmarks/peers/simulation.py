"""A simulation with any integrator that finds the stop of a slide."""

from __future__ import annotations

import math

from peers.oscillator import Counter, Integrator, Params, first_release


def simulate(
    x: float, periods: int, params: Params, how: Integrator
) -> tuple[list[tuple[int, float]], str]:
    """Events (completed periods, phase) from rest at (0, x); each stop decides which slide follows it."""
    omega, _, S0 = params
    period, counter = 2 * math.pi / omega, Counter()
    t, cycle, events, held = 0.0, 0, [], False
    while True:
        load = x - math.cos(omega * t)
        held = not held and abs(load) <= S0  # a stick is never followed by another
        if held:
            t = first_release(t, x, params)
        else:
            t, z = how.slide(t, x, -1 if load > 0 else 1, params, counter)
            x = float(z[0])
        extra = math.floor(t / period)
        cycle, t = cycle + extra, t - extra * period
        if cycle >= periods:
            return events, f"{counter.calls} {how.unit}"
        events.append((cycle, t))
