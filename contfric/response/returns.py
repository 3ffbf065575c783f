"""Points of one solution on a section, and the maps from each to the next, whose chaos may be proved."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.base.extras import need_flint
from contfric.base.shown import AtParameters
from contfric.base.tabled import Columns, Tabled
from contfric.errors import ParameterError, number_and, shown, whole_number
from contfric.models.definition import Model
from contfric.response.outcome import Outcome

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from contfric.certify.horseshoe import Horseshoe

#: Releases of the long orbit that says where the window may be, and those that are left out before.
_ORBIT, _SETTLED = 3000, 200


@dataclass(frozen=True, eq=False)
class Returns(AtParameters, Tabled):
    """Points of a solution on a section, in order; the result of :func:`contfric.poincare`.

    Attributes
    ----------
    model : Model
    vector : ndarray, shape (parameters,)
    section : str or float
        What the points lie on.
    outcome : Outcome
        What the solution came to: PERIODIC if its last points repeat those before; all points are kept.
    cycles, modes : ndarray, shape (k,)
        Periods completed, and number of the mode that met the section.
    times : ndarray, shape (k,)
        Phase in the period (time without excitation).
    states : ndarray, shape (k, n)
    complete : bool
        False after an interrupt.

    Examples
    --------
    >>> import contfric as cf
    >>> found = cf.poincare("coulomb", {"Omega": 0.35, "S": 0.05}, section=0.0, periods=50)
    >>> found.states.shape
    (50, 2)
    """

    model: Model
    vector: FloatArray
    section: str | float
    outcome: Outcome
    cycles: NDArray[np.int64]
    modes: NDArray[np.int64]
    times: FloatArray
    states: FloatArray
    complete: bool = True

    def __len__(self) -> int:
        return len(self.times)

    def coordinate(self, name: str | None = None) -> FloatArray:
        """Return one coordinate of the points: a state by its name, or "t", the phase.

        Raises
        ------
        ParameterError
            If there is no such name.
        """
        if name == "t":
            return self.times
        name = self.model.states[0] if name is None else name
        if name not in self.model.states:
            raise ParameterError(
                f"a coordinate is one of t, {', '.join(self.model.states)}, got {shown(name)}"
            )
        return np.asarray(self.states[:, self.model.states.index(name)])

    def pairs(self, coordinate: str | None = None, step: int = 1) -> tuple[FloatArray, FloatArray]:
        """Return a coordinate of each point and that of the point ``step`` returns later."""
        values = self.coordinate(coordinate)
        step = whole_number("step", step, least=1)
        return values[:-step], values[step:]

    def columns(self) -> Columns:
        """Return one row for each point: period, phase, mode, state."""
        modes = np.array([mode.name for mode in self.model.modes])
        states = dict(zip(self.model.states, self.states.T, strict=True))
        return {"cycle": self.cycles, "t": self.times, "mode": modes[self.modes], **states}

    def plot(self, ax: Axes | None = None, coordinate: str | None = None, step: int = 1) -> Axes:
        """Draw the return map of one coordinate, the displacement by default."""
        from contfric.plot.returns import plot_returns

        return plot_returns(self, ax=ax, coordinate=coordinate, step=step)

    def __repr__(self) -> str:
        values = ", ".join(f"{k}={v:.6g}" for k, v in self.params.items())
        return (
            f"<Returns of {self.model.name}: {len(self)} points at {self.section}, {values}; "
            f"{self.outcome.name.lower()}>"
        )


@dataclass(frozen=True, eq=False)
class ReleaseMap(AtParameters, Tabled):
    """The map from the phase of one release to that of the next; the result of :func:`contfric.release_map`.

    Attributes
    ----------
    model : Model
    vector : ndarray, shape (parameters,)
    mode, surface : str
        The mode of rest, and the surface at which it is released.
    period : float
        Period of the phase: that of the excitation, or the part of it that the symmetry leaves.
    phases : ndarray, shape (k,)
        Phases of the releases that are possible, ascending.
    images : ndarray, shape (k,)
        Phase of the next release; nan without one.
    returns : ndarray, shape (k,)
        Time until then.
    branch : ndarray, shape (k,)
        Number of the branch: between two points of one branch the solution has the same segments.
    states : ndarray, shape (k, n)
        State at the release.
    complete : bool
        False after an interrupt.

    Examples
    --------
    >>> import contfric as cf
    >>> found = cf.release_map("coulomb", {"Omega": 0.35, "S": 0.05, "S0": 0.4}, count=200)
    >>> len(found) > 50
    True
    """

    time_columns: ClassVar = ("phase", "image", "time")

    model: Model
    vector: FloatArray
    mode: str
    surface: str
    period: float
    phases: FloatArray
    images: FloatArray
    returns: FloatArray
    branch: NDArray[np.int64]
    states: FloatArray
    complete: bool = True

    def __len__(self) -> int:
        return len(self.phases)

    @property
    def branches(self) -> list[tuple[FloatArray, FloatArray]]:
        """Phases and images of each branch, in the order of the phase."""
        numbers = [k for k in np.unique(self.branch).tolist() if k >= 0]
        return [(self.phases[self.branch == k], self.images[self.branch == k]) for k in numbers]

    def fixed_points(self) -> FloatArray:
        """Return phases that are their own image, by interpolation on each branch."""
        found = []
        for x, y in self.branches:
            apart = y - x
            for k in np.flatnonzero(apart[:-1] * apart[1:] < 0.0):
                share = apart[k] / (apart[k] - apart[k + 1])
                found.append(x[k] + share * (x[k + 1] - x[k]))
        return np.array(found)

    def cobweb(self, phase: float, count: int = 50) -> FloatArray:
        """Return the phases of a release and of those that follow it, by interpolation, shape (<= count,).

        It ends where a phase lies on no branch.
        """
        from contfric.errors import real_number

        x, found = real_number("phase", phase) % self.period, []
        for _ in range(whole_number("count", count, least=1)):
            found.append(x)
            on = [(a, b) for a, b in self.branches if a[0] <= x <= a[-1]]
            if not on:
                break
            x = float(np.interp(x, *on[0]))
        return np.array(found)

    def horseshoe(self, most: int = 6) -> Horseshoe:
        """Prove that the map is chaotic: positive topological entropy by covering relations (python-flint).

        Where intervals that cover each other are is sampled (2000 phases or more serve well); that they are
        such ones is proved.

        Parameters
        ----------
        most : most returns of the iterate whose intervals cover each other

        Raises
        ------
        ParameterError
            If proofs are not offered for the model.

        Examples
        --------
        >>> import contfric as cf
        >>> found = cf.release_map("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4}, count=400)
        >>> print(found.horseshoe(2))
        undecided: no horseshoe was seen
        """
        return horseshoe_of(self, whole_number("most", most, least=1))

    def columns(self) -> Columns:
        """Return one row for each release: phase, image, time between, branch, state."""
        found = {"phase": self.phases, "image": self.images, "time": self.returns}
        states = dict(zip(self.model.states, self.states.T, strict=True))
        return {**found, "branch": self.branch, **states}

    def plot(self, ax: Axes | None = None, start: float | None = None, count: int = 50) -> Axes:
        """Draw the map with its branches; from a start the cobweb of the releases that follow it."""
        from contfric.plot.returns import plot_release_map

        return plot_release_map(self, ax=ax, start=start, count=count)

    def __repr__(self) -> str:
        values = ", ".join(f"{k}={v:.6g}" for k, v in self.params.items())
        return (
            f"<ReleaseMap of {self.model.name}: {len(self)} releases at {self.surface}, "
            f"{number_and(len(self.branches), 'branch', 'branches')}, {values}>"
        )


def horseshoe_of(releases: ReleaseMap, most: int) -> Horseshoe:
    """Return what is proved of a release map; see :meth:`contfric.response.returns.ReleaseMap.horseshoe`."""
    need_flint()
    from contfric.certify.horseshoe import Sampled, find_horseshoe
    from contfric.certify.releases.returns import Release
    from contfric.response.ways_out_of_rest import release_of

    model = releases.model
    way = release_of(model, releases.surface)
    surfaces = [s.name for s in model.surfaces]
    release = Release(
        releases.mode,
        releases.surface,
        way.rests,
        way.following,
        way.on,
        surfaces[way.image[1]] if way.image else "",
    )
    longest = max(releases.branches, key=lambda pair: len(pair[0]), default=(np.zeros(1),) * 2)
    starts = longest[0][:: max(1, len(longest[0]) // 5)]
    orbits = [releases.cobweb(float(t), _ORBIT)[_SETTLED:] for t in starts]
    orbit = max(orbits, key=lambda x: len(np.unique(x.round(6))))
    if not len(orbit):
        orbit = releases.phases
    sampled = Sampled(releases.phases, releases.images, releases.branch, orbit, releases.period)
    return find_horseshoe(model, releases.vector, release, sampled, most)
