"""Quantities that are the extremum of one observable over the orbit, which compiled code differentiates."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING, NamedTuple

from contfric.base.arrays import FloatArray
from contfric.models.definition import Model
from contfric.models.language.quantity_texts import WORK, Functional, Parsed, read
from contfric.quantities.registry import NAMED, Quantity

if TYPE_CHECKING:
    from contfric.orbit.orbit import Orbit
    from contfric.quantities.motion import Directions


def integrated(quantity: Quantity) -> Functional | None:
    """Return the functional that a quantity is, if that is made of integrals over all modes alike."""
    functional = only_functional(quantity.parsed, quantity.model)
    extreme = functional is None or functional.kind in ("max", "min", WORK)
    return None if extreme else functional


def is_compiled(functional: Functional, model: Model) -> bool:
    """Tell whether compiled code integrates a functional: one expression in all modes, of a plain motion."""
    extreme = functional.kind in ("max", "min", WORK)
    return not (extreme or functional.contacts or model.chatter_by_mode)


class Peak(NamedTuple):
    """The extremum of an observable.

    Attributes
    ----------
    observable : which; -1 for the first state where its extrema are at joints
    inside : whether it may be extreme inside of segments
    sign : 1 for the largest value, -1 for the least
    """

    observable: int
    inside: int
    sign: float


def peak_of(quantity: Quantity) -> Peak | None:
    """Return a quantity as an extremum; None if it is anything else."""
    model = quantity.model
    functional = only_functional(quantity.parsed, model)
    return None if functional is None else peak_in(functional, model)


def peak_in(functional: Functional, model: Model) -> Peak | None:
    """Return a functional as an extremum; None if it is anything else."""
    if functional.kind not in ("max", "min") or functional.contacts:
        return None
    name, sign = functional.text, 1.0 if functional.kind == "max" else -1.0
    if name == model.states[0]:
        if not model.displacement:
            return Peak(-1, 0, sign) if model.stops_at_joints else None
        name = model.displacement
    c = model.observable_index.get(name)
    return None if c is None else Peak(c, 1, sign)


def moved_peak(peak: Peak, orbit: Orbit, directions: Directions) -> tuple[float, FloatArray] | None:
    """Return an extremum with its derivatives, shape (D,), by compiled code; None if it is reached twice."""
    found = orbit.extreme(*peak)
    if found is None:
        return None
    value, on_joints, on_parameters = found
    slopes = on_joints.ravel() @ directions.joints.reshape(on_joints.size, -1)
    return value, slopes + on_parameters @ directions.vector


def in_rows(quantity: Quantity) -> bool:
    """Tell whether compiled code knows the derivatives of a quantity by all joints and parameters at once."""
    return quantity.parsed is not None and _in_rows(quantity.parsed, quantity.model)


def _in_rows(parsed: Parsed, model: Model) -> bool:
    own = dict(model.quantities)
    # an extremum may be reached at both ends of a stick, which move alike along orbits, and nowhere else
    if not all(is_compiled(functional, model) for functional in parsed.functionals.values()):
        return False
    for name in parsed.names - set(model.parameter_names):
        text = own.get(name) or (NAMED[name].text if name in NAMED else "")
        if text and not _in_rows(read(text.replace("%s", model.states[0])), model):
            return False
        if name in ("multiplier", "impact_velocity"):
            return False
    return True


def only_functional(parsed: Parsed | None, model: Model) -> Functional | None:
    """Return the functional that an expression is, through names of quantities; None if it is more."""
    if parsed is None or not isinstance(parsed.tree, ast.Name):
        return None
    name = parsed.tree.id
    if name in parsed.functionals:
        return parsed.functionals[name]
    own = dict(model.quantities)
    if name in own:
        return only_functional(read(own[name]), model)
    text = NAMED[name].text if name in NAMED else ""
    return only_functional(read(text.replace("%s", model.states[0])), model) if text else None
