"""Quantities measured: of one orbit, of every point of a branch, and with derivatives in given directions."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from contfric.errors import ContfricError, ParameterError, shown
from contfric.models.definition import FloatArray
from contfric.models.grammar import Scope
from contfric.models.quantity_texts import Parsed, read
from contfric.quantities.duals import Dual, Kinks, constant
from contfric.quantities.extreme import integrated, moved_peak, peak_of
from contfric.quantities.functionals import Asked, Measuring, Totals
from contfric.quantities.inside import inside_of
from contfric.quantities.motion import Directions, OrbitMotion
from contfric.quantities.registry import NAMED, Quantity
from contfric.quantities.special import impact_velocity, multiplier, sticking

if TYPE_CHECKING:
    from contfric.continuation.branch import Branch
    from contfric.orbit.orbit import Orbit


@dataclass(frozen=True, eq=False)
class NumberWithGradient:
    """A number with its derivatives in D directions.

    Attributes
    ----------
    value : the number
    ahead, behind : derivatives following each direction, and those seen from the other side, shape (D,)
    kinks : why they differ; empty if they do not
    """

    value: float
    ahead: FloatArray
    behind: FloatArray
    kinks: tuple[str, ...] = ()


def of_orbit(quantity: Quantity, orbit: Orbit) -> Any:
    """Return a quantity of an orbit: a number, or an array of the stops.

    Raises
    ------
    ParameterError
        If a function returns no number.
    """
    if quantity.function is not None:
        return _number(quantity, _called(quantity, orbit))
    if quantity.attribute:
        return getattr(orbit, quantity.attribute)
    return differentiated(quantity, orbit, None).value


def of_branch(quantity: Quantity, branch: Branch) -> FloatArray:
    """Return a quantity at every point of a branch, shape (k,), or (k, stops) of the stops."""
    if quantity.attribute:
        return np.asarray(getattr(branch, quantity.attribute), dtype=np.float64)
    if quantity.name == "multiplier" and (mu := branch.multipliers) is not None:
        return np.asarray(np.max(np.abs(mu), axis=1, initial=0.0))
    return of_orbits(quantity, branch)


def of_orbits(quantity: Quantity, orbits: Iterable[Orbit]) -> FloatArray:
    """Return a quantity of some orbits, shape (k,)."""
    return np.array([of_orbit(quantity, orbit) for orbit in orbits], dtype=np.float64)


def differentiated(
    quantity: Quantity,
    orbit: Orbit,
    directions: Directions | None,
    known: Mapping[Asked, Totals] | None = None,
) -> NumberWithGradient:
    """Return a quantity of an orbit with its derivatives in some directions.

    Parameters
    ----------
    known : integrals that were computed together (:mod:`contfric.quantities.at_once`)

    Raises
    ------
    ParameterError
        If it is a function or a list of numbers, which have no derivatives here.
    """
    if quantity.parsed is None:
        raise ParameterError(
            f"'{quantity.name}' has no derivatives: give a quantity by its name, or as an expression"
        )
    functional = integrated(quantity)
    if functional is not None:
        measuring = Measuring(
            OrbitMotion(orbit, directions), inside_of(orbit.model), known=known or {}
        )
        with np.errstate(all="ignore"):
            value, slopes = measuring.smooth(functional)
        return NumberWithGradient(value, slopes, slopes)
    found = None if directions is None else _extreme(quantity, orbit, directions)
    return found or _measured(quantity.parsed, orbit, directions, known or {})


def _extreme(quantity: Quantity, orbit: Orbit, directions: Directions) -> NumberWithGradient | None:
    """Return the extremum of an observable by compiled code; None if it is no such, or is reached twice."""
    peak = peak_of(quantity)
    found = None if peak is None else moved_peak(peak, orbit, directions)
    return None if found is None else NumberWithGradient(found[0], found[1], found[1])


def _measured(
    parsed: Parsed, orbit: Orbit, directions: Directions | None, known: Mapping[Asked, Totals]
) -> NumberWithGradient:
    """Return an expression of an orbit, its functionals resolved."""
    measuring = Measuring(OrbitMotion(orbit, directions), inside_of(orbit.model), known=known)
    with np.errstate(all="ignore"):
        found = _value(parsed, measuring)
    ahead, behind = found.slopes
    return NumberWithGradient(
        float(found.values[0]), ahead, behind, tuple(dict.fromkeys(measuring.kinks))
    )


def _value(parsed: Parsed, measuring: Measuring) -> Dual:
    """Return the value of an expression of functionals, parameters and quantities."""
    motion, model = measuring.motion, measuring.motion.orbit.model
    own = dict(model.quantities)
    values: dict[str, Any] = {
        name: measuring.functional(functional) for name, functional in parsed.functionals.items()
    }
    for name in parsed.names:
        if name in own:
            values[name] = _value(read(own[name]), measuring)
        elif name in NAMED:
            values[name] = _named(name, measuring)
        elif name in model.parameter_names:
            k = model.index_of(name)
            values[name] = measuring.number(float(motion.orbit.vector[k]), motion.d_vector[k])
    kinks = Kinks()
    found = Scope(kinks.algebra(), values, {}).evaluate(parsed.tree)
    if any(np.any(k.values == 0.0) and np.any(k.slopes != 0.0) for k in kinks.arguments):
        measuring.kinks.append(f"{ast.unparse(parsed.tree)} has a kink or jump at this value")
    like = measuring.number(0.0, np.zeros(motion.count))
    return found if isinstance(found, Dual) else constant(found, like)


def _named(name: str, measuring: Measuring) -> Dual:
    text = NAMED[name].text
    if text:
        return _value(read(text.replace("%s", measuring.motion.orbit.model.states[0])), measuring)
    if name == "period":
        return measuring.period()
    special = {"multiplier": multiplier, "sticking": sticking, "impact_velocity": impact_velocity}
    return special[name](measuring)


def _called(quantity: Quantity, orbit: Orbit) -> object:
    """Call a user's function; what it raises is told with its name."""
    assert quantity.function is not None
    try:
        return quantity.function(orbit)
    except ContfricError:
        raise
    except Exception as error:  # the user's own code: any kind of failure
        raise ParameterError(
            f"the function {quantity.name} of an orbit raised {type(error).__name__}: {error}"
        ) from error


def _number(quantity: Quantity, found: object) -> float:
    try:
        number = float(found)  # type: ignore[arg-type] # whatever the user's function returns
    except (TypeError, ValueError):
        number = math.nan
        if not isinstance(found, (float, np.floating)):
            raise ParameterError(
                f"the function {quantity.name} of an orbit must return a number, got {shown(found)}"
            ) from None
    return number
