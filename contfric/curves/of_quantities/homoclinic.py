"""Curves of homoclinic ends: a branch whose period grows without bound, at a long period that is fixed.

Where an orbit of an autonomous model comes to a saddle its period T grows as ``-log(distance) / lambda``,
with the distance of the parameter and the modulus lambda of the eigenvalue of the saddle that is nearer to
0: the unstable one if the saddle attracts its cycle, else the stable one. So the curve of one long period
lies within a constant times ``exp(-lambda T)`` of the curve of homoclinic orbits.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np

from contfric.continuation.branch import Branch
from contfric.continuation.extrema import points_of, settings_of
from contfric.continuation.hermite import zero_between
from contfric.continuation.points import MOST_POINTS, Point
from contfric.curves.of_quantities.curve import QuantityCurve
from contfric.curves.of_quantities.trace import continue_quantity
from contfric.curves.trace import Progress
from contfric.errors import ConvergenceError, ParameterError, real_number
from contfric.events.bifurcation import EndReason
from contfric.orbit.orbit import Orbit


@dataclass(frozen=True, eq=False, repr=False)
class HomoclinicCurve(QuantityCurve):
    """Orbits of one long period near a homoclinic end, in the plane of two parameters.

    Examples
    --------
    >>> import contfric as cf
    >>> branch = cf.continue_orbit(cf.find_orbit("rimless-wheel"), "slope", (0.001, 0.25))
    >>> ranges = {"slope": (0.001, 0.25), "alpha": (0.25, 0.35)}
    >>> curve = cf.continue_homoclinic(branch, ("slope", "alpha"), ranges, period=12.0)
    >>> round(curve[0].period, 9)
    12.0
    """

    @property
    def label(self) -> str:
        """Name with the bound on the period, such as ``HOM (period 12)``."""
        return f"HOM (period {self.value:g})"


def continue_homoclinic(
    branch: Branch,
    parameters: tuple[str, str],
    ranges: Mapping[str, tuple[float, float]],
    *,
    period: float,
    max_step: float | None = None,
    max_points: int = MOST_POINTS,
    progress: Progress | None = None,
) -> HomoclinicCurve:
    """Continue the end of a branch whose period grows without bound, at a fixed long period.

    Parameters
    ----------
    branch : Branch
        A branch of an autonomous model with an end PERIOD.
    parameters : (str, str)
        The two parameters that vary.
    ranges : dict
        Where each of them may go.
    period : float
        The bound: the period at which the curve is followed, in units of the model's time.
    max_step, max_points, progress
        As for :func:`contfric.continue_bifurcation`.

    Returns
    -------
    HomoclinicCurve
        The curve of orbits of one long period, which approximates the homoclinic end.

    Raises
    ------
    ParameterError
        If no end of the branch is of that kind, or none of its orbits has that period.
    ConvergenceError
        If the curve has no unique direction at the start.

    Examples
    --------
    >>> import contfric as cf
    >>> branch = cf.continue_orbit(cf.find_orbit("rimless-wheel"), "slope", (0.001, 0.25))
    >>> ranges = {"slope": (0.001, 0.25), "alpha": (0.25, 0.35)}
    >>> cf.continue_homoclinic(branch, ("slope", "alpha"), ranges, period=12.0).label
    'HOM (period 12)'
    """
    if not isinstance(branch, Branch):
        raise ParameterError(f"a homoclinic end is one of a Branch, got {type(branch).__name__}")
    bound = real_number("period", period)
    periods = np.asarray(branch.period)
    starts = [
        side
        for side, end in zip((0, len(branch) - 1), branch.ends, strict=True)
        if end.reason is EndReason.PERIOD
    ]
    if not starts:
        reasons = " and ".join(end.reason.name for end in branch.ends)
        raise ParameterError(f"no end of this branch is homoclinic (PERIOD): it ends {reasons}")
    if not np.min(periods) < bound < max(periods[side] for side in starts):
        raise ParameterError(
            f"period = {bound:g} is not one of the branch: they go from {np.min(periods):.6g} "
            f"to {np.max(periods):.6g}"
        )
    side = next(side for side in starts if periods[side] > bound)
    orbit = _of_period(branch, bound, from_end=side > 0)
    found = continue_quantity(
        *(orbit, "period", bound, parameters, ranges),
        max_step=max_step,
        max_points=max_points,
        progress=progress,
    )
    return HomoclinicCurve(**{f.name: getattr(found, f.name) for f in fields(found)})


def _of_period(branch: Branch, period: float, *, from_end: bool) -> Orbit:
    """Return the orbit of a branch with a period, the one nearest to an end.

    Between two points of the branch, along its tangents: at its own value of the parameter a long orbit is
    not found, as the period changes by ``1/(lambda d)`` of what the parameter does at a distance d.
    """
    settings = settings_of(branch)
    active = branch.model.index_of(branch.parameter)

    def longer(point: Point) -> float:
        return point.orbit(branch, active).period - period

    points = [point for _, point in points_of(branch, settings)]
    steps = [(a, b) for a, b in pairwise(points) if longer(a) * longer(b) <= 0.0]
    if steps:
        found = zero_between(branch[0], *steps[-1 if from_end else 0], settings, longer)
        if found is not None:
            return found.orbit(branch, active)
    raise ConvergenceError(
        f"no orbit of the period {period:g} is found between the points of the branch"
    )
