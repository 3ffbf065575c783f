"""Kinks of fields that no surface marks: the integrator would meet them unprepared."""

from __future__ import annotations

from contfric.models.check.report import ModelReport, Topic
from contfric.models.definition import Model
from contfric.models.describe import from_text


def check_kinks(report: ModelReport, model: Model) -> None:
    """Check that what the sides of each mode leave of abs, sign, min, max and where is nothing."""
    if not model.definition:
        return
    from contfric.models.formulas import kinks_in
    from contfric.models.symbols import Formulas

    formulas = Formulas(from_text(model.definition))
    symbols = (*formulas.y, *formulas.p)
    names = dict(zip(symbols, (*model.states, *model.parameter_names), strict=True))
    modes = [mode for mode in model.modes for _ in formulas.pieces]
    for mode, field in zip(modes, formulas.fields(), strict=True):
        for state, rate in zip(model.states, field, strict=True):
            report.count(Topic.KINKS)
            for kink in kinks_in(rate, (formulas.t, *formulas.y)):
                text = kink.subs({s: _named(name) for s, name in names.items()})
                report.warn(
                    Topic.KINKS,
                    f"the rate of '{state}' in mode '{mode.name}' has a kink where {text} = 0, which no "
                    "side of the mode decides: add a surface there and a mode on each side (a factor "
                    "is best written outside: abs(v)/vS in place of abs(v/vS)); without it the kink "
                    "costs accuracy",
                )


def _named(name: str) -> object:
    from sympy import Symbol

    return Symbol(name)
