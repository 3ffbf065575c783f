"""Which modes move in closed form, and which are integrated, and why."""

from __future__ import annotations

from contfric.models.check.report import ModelReport, Topic
from contfric.models.definition import Model


def check_motion(report: ModelReport, model: Model) -> None:
    """Note the modes that are integrated, with the reasons; the others are in closed form."""
    if not model.definition:
        return  # a flow that is written by hand
    for mode, reason in model.integrated.items():
        report.note(Topic.MOTION, f"mode '{mode}' is integrated: {reason}")
    closed = [mode.name for mode in model.modes if mode.name not in model.integrated]
    report.counts[Topic.MOTION] += len(closed)
    if closed:
        report.note(Topic.MOTION, f"in closed form: {', '.join(closed)}")
