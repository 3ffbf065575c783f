"""Two-folds: where both fields are tangent to their surface, and what follows may not be unique."""

from __future__ import annotations

from contfric.models.check.probe import Probe
from contfric.models.check.report import ModelReport, Topic

#: Starts on each surface: a check takes a moment, and a set of two-folds is hit by most of them.
_STARTS = 40


def check_two_folds(report: ModelReport, probe: Probe) -> None:
    """Name the two-folds of a model that is declared by formulas."""
    model = probe.model
    if not model.definition or len(model.states) + int(not model.autonomous) < 3:
        return
    from contfric.models.two_folds import find_two_folds

    report.count(Topic.TWO_FOLDS)
    for fold in find_two_folds(model, probe.params, starts=_STARTS):
        where = ", ".join(
            f"{name} = {value:.6g}" for name, value in zip(model.states, fold.state, strict=True)
        )
        when = "" if model.autonomous else f", t = {fold.time:.6g}"
        wide = f" (one of a set of dimension {fold.dimension})" if fold.dimension else ""
        report.note(
            Topic.TWO_FOLDS,
            f"two-fold on '{fold.surface}' between '{fold.above}' and '{fold.below}', {fold.kind.value}, "
            f"at {where}{when}{wide}: motion that comes through it need not be unique",
        )
