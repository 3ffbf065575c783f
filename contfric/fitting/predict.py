r"""Predictions of a model for each measurement, with derivatives by every parameter.

At a fixed time t a signal g moves by its change at a fixed share of the segment, less its rate times the
solution of that share's time: :math:`\delta g|_t = \delta g|_s - \dot g\,\delta t|_s`.
"""

from __future__ import annotations

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.errors import ContfricError, ConvergenceError
from contfric.fitting.data import Measured, Series
from contfric.models.language.quantity_texts import Functional, read
from contfric.orbit.gradient import by_parameters
from contfric.orbit.orbit import Orbit
from contfric.quantities.duals import Kinks
from contfric.quantities.inside import Inside, inside_of
from contfric.quantities.measure import differentiated
from contfric.quantities.motion import OrbitMotion
from contfric.quantities.registry import number_quantity


def signal_of(text: str, orbit_inside: Inside) -> Functional:
    """Return a signal that was read and checked.

    Raises
    ------
    ContfricError
        If it is no expression of the model.
    """
    parsed = read(f"mean({text})")  # any functional of it: what stands inside is the signal
    found = list(parsed.functionals.values())
    if len(found) != 1 or parsed.names:
        raise ContfricError(f"'{text}' is no signal: an expression of states and time, such as x")
    orbit_inside.check(found[0])
    return found[0]


def predicted(data: Measured | Series, orbit: Orbit) -> tuple[FloatArray, FloatArray]:
    """Return values, shape (k,), and derivatives by every parameter, shape (k, parameters).

    Raises
    ------
    ConvergenceError
        If one is not finite.
    """
    if isinstance(data, Series):
        return _series(data, orbit)
    quantity = number_quantity(data.quantity, orbit.model, "a measurement")
    found = differentiated(quantity, orbit, by_parameters(orbit))
    if not (np.isfinite(found.value) and np.all(np.isfinite(found.ahead))):
        why = "; ".join(found.kinks) or "it cannot be fitted there"
        raise ConvergenceError(
            f"{quantity.name} or one of its derivatives is not finite: {why}", orbit
        )
    return np.array([found.value]), found.ahead[None, :]


def _series(data: Series, orbit: Orbit) -> tuple[FloatArray, FloatArray]:
    """Return a signal at the times of a series, folded into the period of the orbit.

    The period moves with the parameters, so that a time that is folded moves against the orbit's.
    """
    motion = OrbitMotion(orbit, by_parameters(orbit))
    inside = inside_of(orbit.model)
    function = inside.function(signal_of(data.signal, inside))
    times = np.asarray(data.times)
    begin = motion.segments[0].start
    turns = np.floor((times - begin) / orbit.period)
    folded = times - turns * orbit.period
    values, slopes = np.empty(len(times)), np.empty((len(times), len(orbit.vector)))
    starts = np.array([segment.start for segment in motion.segments])
    which = np.clip(np.searchsorted(starts, folded, side="right") - 1, 0, len(starts) - 1)
    for i in np.unique(which):
        segment, rows = motion.segments[i], np.flatnonzero(which == i)
        rows = rows[np.argsort(folded[rows])]
        shares = np.clip((folded[rows] - segment.start) / max(segment.lasts, 1e-300), 0.0, 1.0)
        time, _ = segment.at(shares)
        found = function(segment, shares, Kinks())
        values[rows] = found.values
        moved = time.slopes[:, :-1] + turns[rows, None] * motion.d_period
        slopes[rows] = found.slopes[:, :-1] - found.slopes[:, -1:] * moved
    return values, slopes
