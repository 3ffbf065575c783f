"""Checks of a model: what would make its results wrong, in words that say what to do.

The checks look at sampled states (in twice the region that starts are drawn from, at the defaults), so that
they prove nothing; but a formula that is wrong is wrong almost everywhere.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from contfric.models.check.report import CheckFinding, ModelReport, Severity, Topic

if TYPE_CHECKING:
    from contfric.models import ModelSource

__all__ = ["CheckFinding", "ModelReport", "Severity", "Topic", "check_model"]


def check_model(model: ModelSource, params: dict[str, float] | None = None) -> ModelReport:
    """Verify a model: derivatives, surfaces, transitions, sliding modes, symmetry, period, constraints.

    Parameters
    ----------
    model : str, Path, Model or class
        As for :func:`contfric.load_model`.
    params : mapping, optional
        Parameters at which it is checked; defaults fill in.

    Returns
    -------
    ModelReport
        ``report.ok``, ``report.findings``; ``print(report)`` says it in words.

    Raises
    ------
    ModelError
        If the model cannot be loaded at all.

    Examples
    --------
    >>> check_model("belt").ok
    True
    """
    from contfric.models.check.continuity import (
        check_continuity,
        check_jumps_through,
        check_kinks_in_time,
        check_reset_jumps,
    )
    from contfric.models.check.derivatives import check_derivatives
    from contfric.models.check.filippov import check_filippov
    from contfric.models.check.hidden import check_hidden
    from contfric.models.check.hidden_kinks import check_hidden_kinks
    from contfric.models.check.names import (
        check_constraints,
        check_kinks,
        check_names,
        check_reset_kinks,
        check_two_folds,
    )
    from contfric.models.check.passages import check_passages, check_slides
    from contfric.models.check.period import check_angles
    from contfric.models.check.probe import Probe
    from contfric.models.check.reached import check_reached, check_resets_met
    from contfric.models.check.roots import check_roots
    from contfric.models.check.scales import check_scales
    from contfric.models.check.structure import (
        check_period,
        check_resets,
        check_sliding,
        check_surfaces,
        check_symmetry,
        check_transitions,
    )
    from contfric.models.check.translations import check_translations
    from contfric.models.deriving.growing_model import ComposedModel, composed_from
    from contfric.models.tied import tied

    loaded, given = tied(model, params)
    if isinstance(loaded, ComposedModel):  # as it is declared, whatever modes were visited
        loaded = composed_from(loaded.description)
    report = ModelReport(loaded.name, closed=loaded.closed_form, integrated=loaded.integrated)
    check_names(report, loaded)
    if params is None and not check_constraints(report, loaded):
        return report  # at such parameters nothing else means anything
    probe = Probe(loaded, given)
    check_derivatives(report, probe)
    check_surfaces(report, probe)
    check_transitions(report, probe)
    check_slides(report, probe)
    check_passages(report, probe)
    check_resets(report, probe)
    check_continuity(report, probe)
    check_jumps_through(report, probe)
    check_kinks_in_time(report, probe)
    check_reset_jumps(report, probe)
    check_roots(report, probe)
    check_kinks(report, loaded)
    check_hidden_kinks(report, probe)
    check_reset_kinks(report, probe)
    check_sliding(report, probe)
    check_filippov(report, probe)
    check_two_folds(report, probe)
    check_symmetry(report, probe)
    check_hidden(report, probe)
    check_period(report, probe)
    check_angles(report, probe)
    check_translations(report, probe)
    check_reached(report, probe)
    check_resets_met(report, probe)
    check_scales(report, probe)
    return report
