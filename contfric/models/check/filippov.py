"""Sliding modes compared with Filippov's: the field that follows from those on both sides of the surface."""

from __future__ import annotations

import numpy as np

from contfric.models.check.probe import Probe
from contfric.models.check.report import ModelReport, Topic
from contfric.models.definition import Domain
from contfric.models.parts import Mode

#: States in a sliding mode that are asked.
_STATES = 200
#: Rounding of fields that should be the same, relative to 1 + their size.
_SAME = 1e-8


def check_filippov(report: ModelReport, probe: Probe) -> None:
    """Compare each sliding mode with the convex combination of the fields on its two sides.

    One that differs is legal, and said; so is one that holds where motion would leave.
    """
    for mode in probe.model.modes:
        domain = next(d for d in probe.model.domains if d.own_mode == mode.name)
        on = [name for name, side in domain.signs.items() if side == 0]
        on_each_side = (
            [_mode_on_side(probe, domain, on[0], side) for side in (1, -1)] if len(on) == 1 else []
        )
        if len(on_each_side) == 2 and all(on_each_side):
            _compare(report, probe, mode, on[0], str(on_each_side[0]), str(on_each_side[1]))


def _mode_on_side(probe: Probe, domain: Domain, surface: str, side: int) -> str | None:
    """Return the mode on one side of a domain that slides; None unless there is exactly one."""
    signs = {**domain.signs, surface: side}
    modes = {d.own_mode for d in probe.model.domains if d.signs == signs}
    return modes.pop() if len(modes) == 1 else None


def _compare(
    report: ModelReport, probe: Probe, mode: Mode, surface: str, above: str, below: str
) -> None:
    held = 0
    for place in probe.places(mode.name, _STATES):
        up, down = (probe.rate(m, surface, *place) for m in (above, below))
        if not up < 0.0 < down:
            held += 1
            continue
        report.count(Topic.SLIDING)
        fields = (probe.field(m, *place) for m in (above, below))
        a, b = fields
        derived = (down * a - up * b) / (down - up)
        if not np.allclose(probe.field(mode.name, *place), derived, rtol=_SAME, atol=_SAME):
            report.note(
                Topic.SLIDING,
                f"the field of '{mode.name}' is not the one that follows from both sides of '{surface}' "
                f"(Filippov's): {derived.tolist()} at states such as {place[1].tolist()}. That is legal; "
                "write 'sliding: filippov' to the surface for the other",
            )
            return
    if held:
        report.note(
            Topic.SLIDING,
            f"'{mode.name}' keeps solutions on '{surface}' where the fields on both sides lead away, too: a "
            "static limit above the kinetic one",
        )
