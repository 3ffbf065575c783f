"""Quantities measured: of one orbit, of every point of a branch, and with derivatives in given directions.

Some have code of their own: the share of the period at rest, speeds of impacts, multipliers.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.errors import ContfricError, ParameterError, shown
from contfric.models.language.grammar import Scope
from contfric.models.language.quantity_texts import Parsed, read
from contfric.quantities.duals import Dual, Kinks, constant, divide
from contfric.quantities.extreme import integrated
from contfric.quantities.functionals import Asked, Measuring, Totals
from contfric.quantities.inside import inside_of
from contfric.quantities.motion import Directions, OrbitMotion
from contfric.quantities.registry import NAMED, Quantity

if TYPE_CHECKING:
    from contfric.continuation.branch import Branch
    from contfric.orbit.orbit import Orbit
    from contfric.quantities.motion import Directions, IndexArray

#: Displacement of an orbit for the derivatives of multipliers and functions, relative to its size: its
#: fourth power, and rounding divided by it, are both about 1e-12.
_STEP = 1e-3
#: Shares of it tried where two steps differ by more than this, as they do near multipliers that meet.
_SHARES, _AGREE = (1.0, 0.1, 0.01), 1e-6
#: Derivatives of two steps that differ by more than this are those of no smooth function.
_UNSURE = 1e-2


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
        If it is a list of numbers, which has no derivatives.
    """
    if quantity.function is not None:
        return _of_function(quantity, orbit, directions)
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
        return NumberWithGradient(value, slopes, slopes, tuple(measuring.kinks))
    return _measured(quantity.parsed, orbit, directions, known or {})


def _of_function(
    quantity: Quantity, orbit: Orbit, directions: Directions | None
) -> NumberWithGradient:
    """Return a user's function of an orbit, with differences as its derivatives."""

    def measure(moved: Orbit) -> float:
        found = _number(quantity, _called(quantity, moved))
        if not math.isfinite(found):
            raise ParameterError(f"the function {quantity.name} of an orbit returned {found}")
        return found

    value = measure(orbit)
    if directions is None:
        return NumberWithGradient(value, np.empty(0), np.empty(0))
    slopes, unsure = _differences(measure, orbit, directions)
    kinks = (f"the function {quantity.name} may have a kink here",) if unsure else ()
    return NumberWithGradient(value, slopes, slopes, kinks)


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


def sticking(measuring: Measuring) -> Dual:
    """Return the share of the period in modes of sliding, where motion stays on a surface."""
    model, lasts, slopes = measuring.motion.orbit.model, 0.0, np.zeros(measuring.motion.count)
    for segment in measuring.motion.segments:
        if model.mode_by_name[segment.mode].sliding:
            lasts, slopes = lasts + segment.lasts, slopes + segment.d_lasts
    found = divide(measuring.number(lasts, slopes), measuring.period())
    assert isinstance(found, Dual)
    return found


def impact_velocity(measuring: Measuring) -> Dual:
    """Return the largest speed at which a surface is met that sends the solution back: a wall.

    The speed is the rate of the surface's observable before its reset.
    """
    orbit = measuring.motion.orbit
    met: list[tuple[int, float, FloatArray]] = []
    for i, joint in enumerate(orbit.itinerary):
        reset = orbit.model.reset_at(*joint)
        if reset is not None and reset.stays and not reset.wraps:
            rate, grad = _rate_at_end(orbit, i)
            met.append((i, abs(rate), np.sign(rate) * grad))
    if not met:
        return measuring.number(0.0, np.zeros(measuring.motion.count))

    def slopes(rows: IndexArray) -> FloatArray:
        return np.array([_speed_slopes(measuring, met[k][0], met[k][2]) for k in rows])

    return measuring.largest("the speed of impact", np.array([m[1] for m in met]), slopes)


def _rate_at_end(orbit: Orbit, i: int) -> tuple[float, FloatArray]:
    """Return the rate of the exit's observable at the end of a segment, and its gradient on (t, y, p)."""
    model, (mode, exit_), joint = orbit.model, orbit.itinerary[i], orbit.ends[i]
    m, c = model.mode_index[mode], model.observable_index[model.surface_by_name[exit_].observable]
    every = np.arange(len(orbit.vector))
    grad = np.empty(len(joint) + len(every))
    state = np.ascontiguousarray(joint[1:])
    return float(model.flow.rate(m, c, float(joint[0]), state, orbit.vector, every, grad)), grad


def _speed_slopes(measuring: Measuring, i: int, grad: FloatArray) -> FloatArray:
    """Return how a speed moves at the end of a segment, by its gradient on (t, y, p)."""
    time, states = measuring.motion.last_of(i).at(np.ones(1))
    moved = np.vstack([time.slopes, *(s.slopes for s in states)])[:, :-1]
    return np.asarray(grad[: len(moved)] @ moved + grad[len(moved) :] @ measuring.motion.d_vector)


def multiplier(measuring: Measuring) -> Dual:
    """Return the largest modulus of a Floquet multiplier.

    Its derivatives are differences: the Jacobian of the equations is exact wherever joints and parameters are
    displaced, on an orbit or near one, so that nothing is solved for. With Richardson's extrapolation.
    """
    motion = measuring.motion
    value = _largest_modulus(motion.orbit)
    if motion.directions is None:
        return measuring.number(value, np.empty(0))
    if not np.isfinite(value):
        raise ParameterError("the multipliers of an orbit with a hold are infinite: no derivatives")
    slopes, unsure = _differences(_largest_modulus, motion.orbit, motion.directions)
    if unsure:
        measuring.kinks.append("two multipliers of one modulus part here, or meet")
    return measuring.number(value, slopes)


def _largest_modulus(orbit: Orbit) -> float:
    return float(np.max(np.abs(orbit.multipliers), initial=0.0))


def _differences(
    measure: Callable[[Orbit], float], orbit: Orbit, directions: Directions
) -> tuple[FloatArray, bool]:
    """Return the derivatives of a number in all directions, and whether they may be those of a kink."""
    count = directions.vector.shape[1]
    pairs = np.array([_difference(measure, orbit, directions, k) for k in range(count)])
    slopes, apart = pairs.reshape(-1, 2).T
    return slopes.copy(), bool(np.any(apart > _UNSURE * (1.0 + np.abs(slopes))))


def _difference(
    measure: Callable[[Orbit], float], orbit: Orbit, directions: Directions, k: int
) -> tuple[float, float]:
    """Return the derivative of a number in one direction, and by how much two steps differ."""
    joints, vector = directions.joints[:, :, k], directions.vector[:, k]
    size = max(float(np.max(np.abs(joints))), float(np.max(np.abs(vector))))
    if size == 0.0:
        return 0.0, 0.0
    step = _STEP * (1.0 + float(np.max(np.abs(orbit.joints[:, 1:])))) / size

    def at(by: float) -> float:
        moved = replace(orbit, joints=orbit.joints + by * joints, vector=orbit.vector + by * vector)
        return measure(moved)

    best = 0.0, np.inf
    for share in _SHARES:
        h = share * step
        wide = (at(h) - at(-h)) / (2.0 * h)
        narrow = (at(0.5 * h) - at(-0.5 * h)) / h
        if abs(narrow - wide) < best[1]:
            best = (4.0 * narrow - wide) / 3.0, abs(narrow - wide)
        if best[1] <= _AGREE * (1.0 + abs(best[0])):
            break
    return best
