r"""Curves of extrema: orbits at which a quantity is stationary in some parameters, while one more varies.

With the parameters :math:`p_1, \dots, p_q` the conditions are

.. math:: \frac{dQ}{dp_k} = 0, \qquad k = 1, \dots, q - 1 ,

the total derivatives along the family of orbits (:mod:`contfric.orbit.gradient`). With q = 2 it is the
location of a resonance peak as the last parameter varies, with q = 3 the location where that peak is
stationary in a second parameter.

Values are exact. Of an extremum over the orbit all of it is compiled
(:mod:`contfric.curves.equations.lagrangian`). Of any other quantity the slopes of the conditions are central
differences at the start, and from then on secants (C. G. Broyden, Math. Comp. 19 (1965) 577-593): a point is
as accurate as its gradient, and only the speed of Newton's method depends on the slopes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.continuation.extrema import Extremum
from contfric.continuation.points import MOST_POINTS, Point
from contfric.continuation.trace import continue_orbit
from contfric.curves.of_quantities.curve import QuantityCurve
from contfric.curves.of_quantities.step import Defects, Held
from contfric.curves.of_quantities.trace import both_sides, check_orbit
from contfric.curves.ranges import Ranges, ranges_of
from contfric.curves.trace import Progress, checked_options, largest_step
from contfric.errors import (
    ConvergenceError,
    ParameterError,
    items_of,
    shown,
)
from contfric.orbit.canonical.sections import canonical
from contfric.orbit.gradient import by_parameters
from contfric.orbit.orbit import Orbit
from contfric.quantities.measure import differentiated, of_orbit, of_orbits
from contfric.quantities.registry import Quantity, QuantityLike, number_quantity

#: Calls for one point after which secants are given up for differences: three or four are enough.
_SECANTS = 6
#: Derivatives this small (per width) are those of a point that is found: the next one begins.
_FOUND = 1e-9


@dataclass(frozen=True, eq=False, repr=False)
class ExtremumCurve(QuantityCurve):
    """Orbits at which a quantity is stationary in all parameters that vary but the last one.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("jenkins", {"muN": 1.4, "W": 1.3})
    >>> ranges = {"W": (1.0, 2.0), "muN": (1.2, 1.8)}
    >>> peaks = cf.continue_extremum(orbit, "x_max", ("W", "muN"), ranges)
    >>> bool(abs(peaks[3].gradient("x_max")["W"]) < 1e-10)  # each point is an orbit
    True
    """

    #: The quantity at every point, where it is a user's function: a file does not keep that.
    of_function: FloatArray | None = None

    @property
    def extrema(self) -> FloatArray:
        """The quantity at every point, shape (k,)."""
        return self.measured(self.quantity) if self.of_function is None else self.of_function

    def _at_points(self) -> FloatArray | float:
        return self.extrema

    @property
    def label(self) -> str:
        """What is extreme, for a legend."""
        return f"{self.quantity} extreme in {', '.join(self.parameters[:-1])}"


@dataclass
class _Secants:
    """Rows of the conditions' Jacobian, as the last points have them."""

    x: FloatArray | None = None
    values: FloatArray | None = None
    rows: FloatArray | None = None
    calls: int = 0


@dataclass(frozen=True, eq=False)
class Stationary(Held):
    """The conditions of a curve of extrema, in place of a quantity that is held."""

    secants: _Secants = field(default_factory=_Secants)

    @property
    def title(self) -> str:
        """What the orbits of the curve have in common."""
        return f"{self.quantity.name if self.quantity else ''} extreme"

    @property
    def kind(self) -> int:
        """What is asked of an extremum."""
        from contfric.curves.equations.held_conditions import STATIONARY

        return STATIONARY

    def solve(self, guess: Point) -> Point | None:
        """Solve for a point; where secants fail, from differences."""
        found = super().solve(guess)
        if found is None and self.secants.rows is not None:
            self.secants.rows = None
            found = super().solve(guess)
        return found

    def slopes(self, orbit: Orbit) -> FloatArray:
        """Return the derivatives of the quantity by all parameters that vary but the last, per width."""
        assert self.quantity is not None
        found = differentiated(self.quantity, orbit, by_parameters(orbit)).ahead
        return np.asarray(found[self.which[:-1]] * self.box.widths[:-1])

    def defects(self, orbit: Orbit) -> Defects:
        """Return these derivatives, with their rows by secants."""
        x, values, known = self.scaled(orbit), self.slopes(orbit), self.secants
        if self._blurred and known.rows is not None and np.max(np.abs(values)) < _FOUND:
            return Defects(np.zeros_like(values), known.rows)  # what is left is their error
        known.calls += 1
        if known.rows is None or known.calls > _SECANTS:
            known.rows, known.calls = self.differences(orbit, self.slopes), 0
        elif known.x is not None and known.values is not None and np.any(x != known.x):
            step = x - known.x
            missed = values - known.values - known.rows @ step
            known.rows = known.rows + np.outer(missed, step) / (step @ step)
        if np.max(np.abs(values)) < _FOUND:
            known.calls = 0
        known.x, known.values = x, values
        return Defects(values, known.rows)

    @property
    def _blurred(self) -> bool:
        """Whether the slopes are differences, of a user's function: good to 1e-10, and not to rounding."""
        return self.quantity is not None and self.quantity.function is not None


def continue_extremum(
    start: Orbit | Extremum,
    quantity: QuantityLike,
    parameters: tuple[str, ...],
    ranges: Mapping[str, tuple[float, float]],
    *,
    max_step: float | None = None,
    max_points: int = MOST_POINTS,
    progress: Progress | None = None,
) -> ExtremumCurve:
    """Continue the orbits at which a quantity is extreme, as one more parameter varies.

    With two parameters the quantity is stationary in the first, such as the peak of a resonance; with three
    in the first two, such as the smallest peak that a damper can make.

    Parameters
    ----------
    start : Orbit or Extremum
        Where to start: an extremum of a branch, or any orbit. From an orbit the branch in the first
        parameter is followed to its nearest extremum, then that extremum in the second parameter.
    quantity : str or callable
        A quantity by its name or as an expression, such as ``"x_max"``, or a function of an orbit.
    parameters : (str, ...)
        The parameters that vary; in all but the last one the quantity is stationary.
    ranges : dict
        Where each of them may go.
    max_step : float, optional
        Largest step, as for :func:`contfric.continue_bifurcation`.
    max_points : int
        Most points of each side.
    progress : callable, optional
        Called with one line of text now and then.

    Returns
    -------
    ExtremumCurve
        With k points: the parameters and the value of the quantity at each, and two ``ends``.

    Raises
    ------
    ParameterError
        If the quantity, the parameters or the ranges are not valid.
    ConvergenceError
        If no extremum is found.

    Notes
    -----
    The curve ends where the signature of its orbits does, with the reason MEETS. Where a maximum over the
    orbit passes from one instant to another the gradient jumps, and the curve ends as well.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("jenkins", {"muN": 1.4, "W": 1.3})
    >>> ranges = {"W": (1.0, 2.0), "muN": (1.2, 1.8)}
    >>> peaks = cf.continue_extremum(orbit, "x_max", ("W", "muN"), ranges)
    >>> bool(abs(peaks[3].gradient("x_max")["W"]) < 1e-10)
    True
    """
    orbit = start.orbit if isinstance(start, Extremum) else start
    if not isinstance(orbit, Orbit):
        raise ParameterError(
            f"a curve of extrema starts from an Orbit or an Extremum, got {type(start).__name__}"
        )
    measured = number_quantity(quantity, orbit.model, "a curve")
    names = tuple(items_of(parameters))
    if len(names) < 2:
        raise ParameterError(
            f"a curve of extrema needs two parameters or more, such as {orbit.model.parameter_names[:2]}, "
            f"got {shown(parameters)}"
        )
    box = ranges_of(orbit.model, names, ranges)
    largest = checked_options(orbit.model, max_step, max_points, progress)
    held, first = _start(orbit, measured, box, progress)
    found = both_sides(held, first, largest, max_points, progress)
    values: dict[str, Any] = {f.name: getattr(found, f.name) for f in fields(found)}
    values["value"] = float(of_orbit(measured, held.orbit_of(first)))
    of_function = None if measured.function is None else of_orbits(measured, found)
    return ExtremumCurve(**values, of_function=of_function)


def _start(
    orbit: Orbit, quantity: Quantity, box: Ranges, progress: Progress | None
) -> tuple[Stationary, Point]:
    """Return the problem and its first point: near the orbit, else by fewer parameters first."""
    check_orbit(orbit, box)
    near = _nearer(orbit, quantity, box, progress)
    held = Stationary(canonical(near).as_half(), quantity, 0.0, box)
    first = held.first()
    if first is None:
        raise ConvergenceError(
            f"no orbit near the start at which {quantity.name} is extreme in "
            f"{', '.join(box.names[:-1])} was found",
            near,
        )
    return held, first


def _nearer(orbit: Orbit, quantity: Quantity, box: Ranges, progress: Progress | None) -> Orbit:
    """Return an orbit next to a point at which the quantity is stationary in all but the last parameter."""
    names, last = box.names[:-1], box.names[-2]
    if len(names) == 1:
        bounds = float(box.low[0]), float(box.high[0])
        branch = continue_orbit(orbit, last, bounds, stability=False, progress=progress)
        found = [e for e in branch.extrema(quantity.asked) if not e.kink]
        if not found:
            raise ConvergenceError(
                f"{quantity.name} has no extremum along {last} in {bounds}", orbit
            )
        start = orbit.params[last]
        return min(found, key=lambda e: abs(e.params[last] - start)).orbit
    inner = Ranges(names, box.low[:-1], box.high[:-1])
    held, first = _start(orbit, quantity, inner, progress)
    largest = largest_step(None, orbit.model)
    curve = both_sides(held, first, largest, MOST_POINTS, progress)
    values = curve.measured(quantity.asked)
    turns = np.flatnonzero(np.diff(values[1:]) * np.diff(values[:-1]) <= 0.0) + 1
    if not len(turns):
        raise ConvergenceError(
            f"{quantity.name}, extreme in {', '.join(names[:-1])}, has no extremum along {last}: it "
            f"goes from {values[0]:.6g} to {values[-1]:.6g}",
            held.orbit_of(first),
        )
    start = orbit.params[last]
    return curve[int(min(turns, key=lambda k: abs(curve.params[last][k] - start)))]
