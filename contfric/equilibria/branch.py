"""A branch of equilibria as a result: its points, through every mode that it visits, and its events."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray, with_entries
from contfric.base.named import Named
from contfric.base.tabled import Columns, Tabled
from contfric.equilibria.events import EquilibriumEvent
from contfric.equilibria.find import equilibrium_at
from contfric.equilibria.regions import ModeRegion
from contfric.equilibria.result import Equilibrium
from contfric.errors import ParameterError, did_you_mean
from contfric.models.definition import Model

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class BranchEnd(str, Enum):
    """Why a branch of equilibria ends; the text is the reason."""

    RANGE = "the end of the range"
    LIMIT = "a limit of the model"
    BOUNDARY = "the boundary of its region, where no other equilibrium goes on"
    CLOSED = "it closes: its first point is its last"
    LOST = "Newton's method found no further point"
    POINTS = "the number of points asked for (max_points)"
    AWAY = "it leaves to infinity"


@dataclass(frozen=True, eq=False)
class EquilibriumBranch(Tabled):
    """Equilibria along a parameter; the result of :func:`contfric.continue_equilibrium`.

    Attributes
    ----------
    parameter : name of the parameter
    vector : ndarray, shape (parameters,)
        All parameters at the start; that of the branch varies.
    values : ndarray, shape (k,)
        The parameter at each point.
    states : ndarray, shape (k, n)
    eigenvalues : ndarray, shape (k, n)
        nan after those within the surfaces of a mode.
    regions : tuple of ModeRegion
        Region of each point.
    admissible : ndarray of bool, shape (k,)
    events : tuple of EquilibriumEvent
        In the order of the points.
    ends : (BranchEnd, BranchEnd)
        Why it ends, at its first and at its last point.

    Examples
    --------
    >>> import contfric as cf
    >>> branch = cf.continue_equilibrium(cf.find_equilibria("belt")[0], "vb", (0.1, 1.0))
    >>> bool(branch.stable.any()), branch.events
    (False, ())
    """

    model: Model
    parameter: str
    vector: FloatArray
    values: FloatArray
    states: FloatArray
    eigenvalues: NDArray[np.complex128]
    regions: tuple[ModeRegion, ...]
    admissible: NDArray[np.bool_]
    events: tuple[EquilibriumEvent, ...]
    ends: tuple[BranchEnd, BranchEnd]

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, index: int) -> Equilibrium:
        vector = with_entries(self.vector, self.model.index_of(self.parameter), self.values[index])
        own = self.eigenvalues[index]
        known = own[~np.isnan(own.real)]
        return equilibrium_at(self.regions[index], self.states[index], vector, known)

    @property
    def modes(self) -> list[str]:
        """Name of the mode at each point."""
        return [region.mode for region in self.regions]

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Whether each point attracts what is near; False where eigenvalues do not tell, shape (k,)."""
        return np.array([self[k].stable is True for k in range(len(self))], dtype=bool)

    @property
    def params(self) -> dict[str, FloatArray | float]:
        """All parameters by name: an array of that which varies, numbers of the others."""
        found = Named[FloatArray | float](self.model.mapping(self.vector))
        found[self.parameter] = self.values
        return found

    def state(self, name: str | None = None) -> FloatArray:
        """Return one state along the branch, the first of the model by default, shape (k,).

        Raises
        ------
        ParameterError
            If there is no such name.
        """
        names = self.model.states
        if name is not None and name not in names:
            raise ParameterError(f"no state '{name}'{did_you_mean(name, names)}")
        return np.asarray(self.states[:, 0 if name is None else names.index(name)])

    def of_kind(self, kind: str) -> list[EquilibriumEvent]:
        """Return the events of one kind: "SN", "BP", "H" or "BE"."""
        return [event for event in self.events if event.kind.value == kind]

    def columns(self) -> Columns:
        """Return one row for each point: parameter, mode, state, stable, admissible."""
        states = dict(zip(self.model.states, self.states.T, strict=True))
        looks = {"stable": self.stable, "admissible": self.admissible}
        return {self.parameter: self.values, "mode": np.array(self.modes), **states, **looks}

    def plot(self, ax: Axes | None = None, state: str | None = None) -> Axes:
        """Draw one state along the parameter: stable solid, unstable dashed, events marked.

        Parameters
        ----------
        ax : Axes, optional
            Where to draw, such as a row of a diagram; new axes by default.
        state : str, optional
            Name of the state; the first by default.
        """
        from contfric.plot.equilibria import plot_equilibria

        return plot_equilibria(self, ax=ax, state=state)

    def __repr__(self) -> str:
        low, high = float(np.min(self.values)), float(np.max(self.values))
        events = ", ".join(e.label for e in self.events) or "no events"
        modes = ", ".join(dict.fromkeys(self.modes))
        return (
            f"<EquilibriumBranch of {modes}: {len(self)} points, {self.parameter} from {low:.6g} to "
            f"{high:.6g}; {events}>"
        )
