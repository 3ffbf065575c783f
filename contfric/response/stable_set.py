r"""The stable set of an unstable orbit in the plane of two states: where basins of attraction meet.

The section map f takes the state at a phase of the excitation to that one period of the orbit later. An
unstable orbit is a saddle :math:`p_0` of f. With the left unstable eigenvector l,
:math:`u = l^T (f^n(q) - p_0)` grows by the unstable multiplier m with each return near the saddle, and
:math:`u / m^n` does not depend on n there (a negative m turns the sign of u with each return). The stable set
is where it vanishes; so it separates starts that leave the saddle along one direction from those that
leave along the other.

It is followed without the inverse of f, as a stick has none (J. P. England, B. Krauskopf, H. M. Osinga, SIAM
J. Appl. Dyn. Syst. 3 (2004) 161-190). The next point lies on an arc around the last one, where u changes its
sign. Where no start on the arc comes to the saddle f is discontinuous, and the set has a break. It is looked
for on the other side, and ends where it is not found within a fiftieth of the ranges.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from contfric.base.arrays import FloatArray, IntArray
from contfric.base.tabled import Columns, Tabled
from contfric.chaos.running import Progress
from contfric.errors import ParameterError, function_of, real_number, shown, whole_number
from contfric.models.definition import Model
from contfric.orbit.orbit import Orbit
from contfric.remember.folder import kept_in
from contfric.response.section_map import SectionMap
from contfric.response.stable_half import Half, StableEnd

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: First distance from the saddle, in sizes of the orbit: its set is straight there to its square.
_FIRST = 1e-3


@dataclass(frozen=True, eq=False)
class StableSet(Tabled):
    """The stable set of an unstable orbit; the result of :func:`contfric.stable_set`.

    Attributes
    ----------
    orbit : Orbit
    phase : float
        The phase of the section, as a share of the period of the excitation.
    states : tuple of ndarray, shape (k, 2) each
        Both halves, each from the orbit on.
    breaks : tuple of ndarray of int
        Of both halves, the points that a break leads to: the set has a gap before them.
    ends : (StableEnd, StableEnd)

    Examples
    --------
    >>> import contfric as cf
    >>> saddle = cf.solve_orbit("coulomb", "2s", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> found = cf.stable_set(saddle, {"x": (-2, 2), "v": (-1, 1)}, max_step=0.1)
    >>> found.points.shape[1]
    2
    """

    orbit: Orbit
    phase: float
    states: tuple[FloatArray, FloatArray]
    breaks: tuple[IntArray, IntArray]
    ends: tuple[StableEnd, StableEnd]

    @property
    def model(self) -> Model:
        """The model that moves."""
        return self.orbit.model

    @property
    def complete(self) -> bool:
        """Whether it was followed to its ends; False after an interrupt."""
        return StableEnd.INTERRUPTED not in self.ends

    @property
    def points(self) -> FloatArray:
        """All points in their order along the set, shape (k, 2)."""
        one, other = self.states
        return np.concatenate([one[:0:-1], other])

    def columns(self) -> Columns:
        """Return one row for each point: both states, and the half."""
        names = self.orbit.model.states
        half = np.repeat([0, 1], [len(self.states[0]) - 1, len(self.states[1])])
        return {**dict(zip(names, self.points.T, strict=True)), "half": half}

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the set in the plane of the two states, as over basins, with the orbit on it."""
        from contfric.plot.basins import plot_stable_set

        return plot_stable_set(self, ax=ax)

    def __repr__(self) -> str:
        ends = " and ".join(end.name for end in self.ends)
        return f"<StableSet of {self.orbit.name}: {len(self.points)} points, ends {ends}>"


def stable_set(
    orbit: Orbit,
    ranges: Mapping[str, tuple[float, float]],
    *,
    phase: float = 0.0,
    max_step: float | None = None,
    max_points: int = 2000,
    max_returns: int = 400_000,
    folder: str | Path | None = None,
    progress: Progress | None = None,
) -> StableSet:
    """Follow the stable set of an unstable orbit in the plane of the two states.

    Parameters
    ----------
    orbit : Orbit
        An unstable orbit with one multiplier outside of the unit circle, of a model of two states with
        excitation.
    ranges : mapping
        Where each of the two states may go.
    phase : float
        Phase of the section, as a share of the period of the excitation; that of the starts of basins.
    max_step : float, optional
        Longest step along the set; by default a hundredth of the ranges.
    max_points : int
        Most points of each half.
    max_returns : int
        Most returns of the section map for each half, about half a minute of processor time. A set that
        folds without end (as at the boundary of basins with holes) needs any number of them.
    folder : path, optional
        Where finished stretches are kept; the same call goes on from them.
    progress : callable, optional
        Called with one line of text now and then.

    Returns
    -------
    StableSet
        ``states``, both halves of the set as arrays of shape (k, 2), and why each ends.

    Raises
    ------
    ParameterError
        If the orbit is no saddle of that kind, or an argument is not valid.
    ResultFileError
        If the folder cannot be written, or another version of contfric has written to it.

    Examples
    --------
    >>> import contfric as cf
    >>> saddle = cf.solve_orbit("coulomb", "2s", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> found = cf.stable_set(saddle, {"x": (-2, 2), "v": (-1, 1)}, max_step=0.1)
    >>> len(found.points) > 20
    True
    """
    if not isinstance(orbit, Orbit):
        raise ParameterError(f"a stable set is one of an Orbit, got {shown(orbit)}")
    low, high = check_ranges(orbit.model, ranges)
    section = SectionMap(_checked(orbit), real_number("phase", phase))
    function_of("progress", progress)
    longest = (
        0.01 * float(np.hypot(*(high - low)))
        if max_step is None
        else real_number("max_step", max_step, least=1e-9)
    )
    whole_number("max_points", max_points, least=2)
    whole_number("max_returns", max_returns, least=1)
    halves, ends, breaks = [], [], []
    with kept_in(folder):
        for sign in (1.0, -1.0):
            half = Half(section, [section.saddle], sign * section.stable, low, high)
            first = min(_FIRST * section.size, longest)
            stopped = StableEnd.INTERRUPTED in ends
            ends.append(
                StableEnd.INTERRUPTED
                if stopped
                else half.trace(first, longest, (max_points, max_returns), progress)
            )
            halves.append(np.array(half.points))
            breaks.append(np.array(half.breaks, dtype=np.int64))
    return StableSet(
        orbit, section.phase, (halves[0], halves[1]), (breaks[0], breaks[1]), (ends[0], ends[1])
    )


def _checked(orbit: Orbit) -> Orbit:
    outside = [m for m in orbit.multipliers if abs(m) > 1.0]
    if orbit.system.holds or len(outside) != 1:
        raise ParameterError(
            f"{orbit!r} has no stable set that separates: one multiplier has to be outside of the "
            f"unit circle, and there are {len(outside)}"
        )
    return orbit


def check_ranges(model: Model, ranges: object) -> tuple[FloatArray, FloatArray]:
    """Return the corners of the ranges that a user gave.

    Raises
    ------
    ParameterError
        If the model has no stable sets that are curves, or they are no ranges of its states.
    """
    if model.autonomous or len(model.states) != 2:
        raise ParameterError(
            "a stable set is a curve in the section of a model with excitation and two states; "
            f"'{model.name}' has {len(model.states)} states and {'no' if model.autonomous else 'an'} "
            "excitation"
        )
    wanted = (
        f"ranges are {{'{model.states[0]}': (lower, upper), '{model.states[1]}': (lower, upper)}}"
    )
    if not isinstance(ranges, Mapping) or set(ranges) != set(model.states):
        raise ParameterError(f"{wanted}, got {shown(ranges)}")
    try:
        found = np.array([ranges[name] for name in model.states], dtype=np.float64)
    except (TypeError, ValueError):
        found = np.empty(0)
    if (
        found.shape != (2, 2)
        or not np.all(np.isfinite(found))
        or not np.all(found[:, 0] < found[:, 1])
    ):
        raise ParameterError(f"{wanted}, got {shown(ranges)}")
    return found[:, 0], found[:, 1]
