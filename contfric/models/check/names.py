"""Checks of formulas that need no solution: unused names, defaults, unmarked kinks, two-folds."""

from __future__ import annotations

from contfric.models.check.probe import Probe
from contfric.models.check.report import ModelReport, Topic
from contfric.models.check.structure import arrivals
from contfric.models.definition import Model
from contfric.models.deriving.growing_model import ComposedModel
from contfric.models.language.grammar import parse

#: Starts on each surface: a check takes a moment, and a set of two-folds is hit by most of them.
_STARTS = 40

#: What formulas with kinks are of numbers.
_KINKED = {
    "Where": lambda d, a, b: a if d > 0.0 else b,
    "Sign": lambda x: (x > 0.0) - (x < 0.0),
    "Abs": abs,
}


def check_constraints(report: ModelReport, model: Model) -> bool:
    """Check that the defaults obey the model's own constraints; return whether they do."""
    for constraint in model.constraints:
        report.count(Topic.CONSTRAINTS)
        left = constraint.value(model.defaults)
        if left < 0.0 or (constraint.strict and left == 0.0):
            shown = ", ".join(f"{n} = {model.defaults[n]!r}" for n in constraint.coefficients)
            report.error(
                Topic.CONSTRAINTS,
                f"the defaults violate {constraint.text} ({shown}): change one of them, or the constraint",
            )
    return not any(f.topic is Topic.CONSTRAINTS for f in report.findings)


def check_names(report: ModelReport, model: Model) -> None:
    """Check that every parameter changes something, and that every state is moved."""
    if not model.definition:
        return
    description = model.description
    names, used = description.names, set[str]()
    modes = list(description.modes)
    if isinstance(model, ComposedModel):  # which lists the mode in which no contact acts
        modes += map(model.composition.text, model.composition.samples()[1:])
    dynamics = [rate for mode in modes for rate in mode.field]
    events = [o.formula for o in description.observables] + [s.level for s in description.surfaces]
    resets = [text for texts in description.resets.values() for text in texts.values()]
    for text in (*dynamics, *events, *resets, description.period or "0"):
        used |= names.leaves(parse(text), ())
    for name in names.parameters:
        report.count(Topic.NAMES)
        if name not in used:
            report.warn(Topic.NAMES, f"parameter '{name}' is used nowhere: leave it out")
    for text, tree in description.define:
        report.count(Topic.NAMES)
        if not _mentions(description.data(), text):
            report.warn(Topic.NAMES, f"'{text}: {tree}' of 'define' is used nowhere: leave it out")
    for index, state in enumerate(names.states):
        report.count(Topic.NAMES)
        rates = [mode.field[index].strip() for mode in modes]
        moved = any(rate not in ("0", "0.0") for rate in rates)
        if not moved and not any(state in texts for texts in description.resets.values()):
            report.warn(
                Topic.NAMES,
                f"state '{state}' never changes (its rate is 0 in every mode): make it a parameter",
            )
        elif state not in used:
            report.warn(Topic.NAMES, f"nothing depends on state '{state}': leave it out")


def _mentions(data: object, name: str) -> bool:
    """Return whether any expression of a description, other than its own, has a name in it."""
    from contfric.errors import ModelError
    from contfric.models.language.grammar import names_in

    if isinstance(data, dict):
        return any(_mentions(v, name) for k, v in data.items() if k not in ("title", "references"))
    if isinstance(data, list):
        return any(_mentions(v, name) for v in data)
    if not isinstance(data, str):
        return False
    try:
        return name in names_in(parse(data))
    except ModelError:
        return False


def check_kinks(report: ModelReport, model: Model) -> None:
    """Check that what the sides of each mode leave of abs, sign, min, max and where is nothing."""
    if not model.definition:
        return
    from sympy import Symbol

    from contfric.models.generated.symbols import Formulas
    from contfric.models.language.formulas import kinks_in

    formulas = Formulas(model.description)
    symbols = (*formulas.y, *formulas.p)
    names = dict(zip(symbols, (*model.states, *model.parameter_names), strict=True))
    modes = [mode for mode in model.modes for _ in formulas.pieces]
    said = set[tuple[str, ...]]()  # the parts of a mode that a section divides have one field
    for mode, field in zip(modes, formulas.fields, strict=True):
        for state, rate in zip(model.states, field, strict=True):
            report.count(Topic.KINKS)
            for kink in kinks_in(rate, formulas.moving):
                text = kink.subs({s: Symbol(name) for s, name in names.items()})
                key = model.whole_mode(mode.name), state, str(text)
                if key in said:
                    continue
                said.add(key)
                report.warn(
                    Topic.KINKS,
                    f"the rate of '{state}' in mode '{mode.name}' has a kink where {text} = 0, which no "
                    "side of the mode decides: add a surface there and a mode on each side; without "
                    "it the kink costs accuracy",
                )


def check_reset_kinks(report: ModelReport, probe: Probe) -> None:
    """Warn of kinks of resets between states that meet their surface in one mode: no event tells of them."""
    model = probe.model
    formulas = probe.formulas if model.resets else None
    if formulas is None:
        return
    from sympy import Symbol, lambdify

    from contfric.models.language.formulas import branches_of, kinks_in

    symbols = (*formulas.moving, *formulas.p)
    names = dict(zip(symbols, ("t", *model.states, *model.parameter_names), strict=True))
    order = [surface.name for surface in formulas.description.surfaces]
    for reset in model.resets:
        image = formulas.resets()[order.index(reset.surface)]
        kinks = {k for value in image for k in kinks_in(value, formulas.moving)}
        met = list(arrivals(probe, reset)) if kinks else []
        for kink in sorted(kinks, key=str):
            report.count(Topic.KINKS)
            value, signs = lambdify(symbols, kink, [_KINKED, "math"]), set()
            for domain, t, y in met:
                signs.add((domain.own_mode, float(value(t, *y, *probe.vector)) > 0.0))
            if len({name for name, _ in signs}) == len(signs):
                continue
            parts = {
                part.subs({s: Symbol(n) for s, n in names.items()}) for part in branches_of(kink)
            }
            moving = {"t", *model.states}
            text = " = 0 or ".join(
                sorted(str(p) for p in parts if moving & set(map(str, p.free_symbols)))
            )
            report.warn(
                Topic.KINKS,
                f"the reset at '{reset.surface}' has a kink where {text} = 0: multipliers jump there, and no "
                "event says so, nor what branches off. Add a surface there, and a mode on each side",
            )


def check_two_folds(report: ModelReport, probe: Probe) -> None:
    """Name the two-folds of a model that is declared by formulas."""
    model = probe.model
    if not model.definition or len(model.states) + int(not model.autonomous) < 3:
        return
    from contfric.models.two_folds import find_two_folds

    report.count(Topic.TWO_FOLDS)
    for fold in find_two_folds(model, probe.params, starts=_STARTS):
        wide = f" (one of a set of dimension {fold.dimension})" if fold.dimension else ""
        report.note(
            Topic.TWO_FOLDS,
            f"two-fold on '{fold.surface}' between '{fold.above}' and '{fold.below}', {fold.kind.value}, "
            f"at {probe.shown(fold.time, fold.state)}{wide}: a solution that comes through it need not be "
            "unique",
        )
