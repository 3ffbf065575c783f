"""Whether all that depends on time has the model's period.

Phases are taken modulo the period: where the excitation has another one, a solution would meet another
excitation after each period than the file says.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contfric.models.check.probe import Probe
from contfric.models.definition import FloatArray

#: Rounding of a field, and of the phase after a period, relative to 1 + the values.
_SAME = 1e-8
#: A time after which anything that depends on it is another, without excitation.
_LATER = 0.7310585


def changed_after_a_period(probe: Probe, modes: Sequence[str], t: float, y: FloatArray) -> str:
    """Return what differs one period later at a state: the field of a mode, an observable, or nothing."""
    later = t + (probe.period or _LATER)
    for mode in modes:
        if not _same(probe.field(mode, t, y), probe.field(mode, later, y)):
            return f"the field of '{mode}'"
    for name in probe.model.observable_index:
        if not _same(probe.flow.observe(name, t, y), probe.flow.observe(name, later, y)):
            return f"observable '{name}'"
    return ""


def _same(now: FloatArray | float, then: FloatArray | float) -> bool:
    """Tell whether values agree to rounding; those that are not finite say nothing."""
    with np.errstate(invalid="ignore"):
        return not np.any(np.abs(np.subtract(then, now)) > _SAME * (1.0 + np.abs(now)))


def not_periodic(what: str, period: float, where: str) -> str:
    """Return what to say of something that is another one period later, at some parameters."""
    if period <= 0.0:
        return f"{what} depends on time, but the model is autonomous: give its 'period'"
    return (
        f"{what} is not the same one period ({period:.9g} at {where}) later: 'period' must be a "
        "common period of everything that depends on t"
    )
