"""The time in which a model without excitation changes, where its unit of time is far too short.

A heated room in seconds turns once in a day: to wait for its events for a number of units of time, as for
periods of an excitation, is to see none. An observable of a surface changes by its own size, that of the
states' spread, within

    |grad h . spread| / |h'|

at sampled states; the model's time is that of the observable that changes slowest of those.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.models.definition import Model
from contfric.models.shorthand.clocks import CLOCK, TICK

#: States that are sampled, and the unit of time that is a matter of taste: nothing is changed below it.
_STATES, _LONG = 12, 100.0


@lru_cache(maxsize=64)
def time_scale(model: Model) -> float:
    """Return the time in which an autonomous model changes at its defaults if that is long, else 1.

    Examples
    --------
    >>> import contfric as cf
    >>> time_scale(cf.load_model("thermostat"))
    1.0
    """
    if not model.autonomous or model.composed:
        return 1.0
    view = model.view(model.vector({}))
    widths = model.spread(model.defaults)
    rng, times = np.random.default_rng(1), []
    low, high = model.region(model.vector({}))
    states = 0.5 * (low + high) + rng.uniform(-1.0, 1.0, (_STATES, len(widths))) * widths
    for name in {surface.observable for surface in model.surfaces}:
        fastest = 0.0
        for y in states:
            size = float(np.abs(view.gradient(name, 0.0, y)[1 : 1 + len(y)]) @ widths)
            rates = [abs(view.rate(mode.name, name, 0.0, y)) for mode in model.modes]
            known = [rate / size for rate in rates if np.isfinite(rate) and size > 0.0]
            fastest = max([fastest, *known])
        if fastest > 0.0:
            times.append(1.0 / fastest)
    slowest = max(times, default=1.0)
    return slowest if _LONG < slowest < np.inf else 1.0


def clock_period(model: Model, vector: FloatArray) -> float:
    """Return the time from tick to tick of a model with a clock, 1 of all others.

    Such a model is autonomous to the engine; what its user calls a period is that of ``mod(t, T)``.

    Examples
    --------
    >>> import contfric as cf
    >>> buck = cf.load_model("buck")  # 400 microseconds, in units of 100
    >>> round(clock_period(buck, buck.vector({})), 12)
    4.0
    """
    return ticks_of(model, vector) or 1.0


def has_clock(model: Model) -> bool:
    """Return whether a model has a clock, whose periods are what its user calls so."""
    return CLOCK in model.states and any(reset.surface == TICK for reset in model.resets)


def ticks_of(model: Model, vector: FloatArray) -> float:
    """Return the time from tick to tick of a model's clock; 0 without one."""
    return model.view(vector).level(TICK) if has_clock(model) else 0.0
