"""Kinks of fields that no abs or sign shows, such as that of ``acos(cos(w*t))``: by the slopes of fields."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

from contfric.base.arrays import FloatArray
from contfric.models.check.continuity import Line, jump_along, lines_in
from contfric.models.check.probe import Probe
from contfric.models.check.report import ModelReport, Topic

#: This share next to a kink ``acos(cos(t))`` still has six digits of its slope, whose parts cancel; and the
#: share of a jump by which slopes may change so near it.
_NEAR, _FLAT = 1e-6, 1e-2


def check_hidden_kinks(report: ModelReport, probe: Probe) -> None:
    """Warn of kinks of fields that no abs or sign shows, such as that of ``acos(cos(w*t))``.

    Only functions whose slopes end, or jump, at some argument have such kinks: all others are left out.
    """
    for mode in _with_hidden_kinks(probe):
        for name, line, low, high in lines_in(probe, mode):
            report.count(Topic.KINKS)
            slopes = partial(_slopes_on, probe, mode, line)
            found = jump_along(slopes, low, high)
            if found is None or not _jumps_at(slopes, found[0], found[1], _NEAR * (high - low)):
                continue
            ends = [line(found[1] + s * _NEAR * (high - low)) for s in (-1.0, 1.0)]
            if any(
                math.prod(probe.flow.observe(k, *e) for e in ends) <= 0.0 for k in probe.model.kinks
            ):
                continue  # a kink that is declared
            state = probe.model.states[found[0] // (1 + len(probe.model.states))]
            report.warn(
                Topic.KINKS,
                f"the rate of '{state}' in mode '{mode}' has a kink along {name}, at "
                f"{probe.shown(*line(found[1]))}, which no side of the mode decides: add a surface there "
                "and a mode on each side; without it the kink costs accuracy",
            )
            return


def _with_hidden_kinks(probe: Probe) -> list[str]:
    """Return the modes whose fields have inverse functions or roots of what moves; none of structures."""
    formulas = None if probe.model.composed else probe.formulas
    if formulas is None:
        return []
    from contfric.models.language.formulas import may_have_kinks

    modes = [mode.name for mode in probe.model.modes for _ in formulas.pieces]
    found = (
        mode
        for mode, field in zip(modes, formulas.fields, strict=True)
        if any(may_have_kinks(rate, formulas.moving) for rate in field)
    )
    return list(dict.fromkeys(found))


def _jumps_at(values: Callable[[float], FloatArray | None], k: int, at: float, step: float) -> bool:
    """Tell whether a value jumps at a place, and has no pole there: it hardly changes on either side."""
    around = [values(at + s * step) for s in (-2.0, -1.0, 1.0, 2.0)]
    known = [float(v[k]) for v in around if v is not None]
    if len(known) < len(around):
        return False
    jump = abs(known[2] - known[1])
    return jump > 0.0 and max(abs(known[1] - known[0]), abs(known[3] - known[2])) < _FLAT * jump


def _slopes_on(probe: Probe, mode: str, line: Line, place: float) -> FloatArray | None:
    """Return the derivatives of a field by time and states at a place of a line; None outside of the mode."""
    t, y = line(place)
    if not probe.is_in(mode, probe.signs(t, y)):
        return None
    return probe.slopes(mode, t, y).ravel()
