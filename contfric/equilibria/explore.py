"""All branches of equilibria over a range of a parameter."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.shown import AtParameters
from contfric.base.tabled import stacked
from contfric.equilibria.branch import EquilibriumBranch
from contfric.equilibria.events import EquilibriumEvent, HopfPoint
from contfric.equilibria.find import find_equilibria
from contfric.equilibria.newton import Zeros
from contfric.equilibria.regions import scale_of
from contfric.equilibria.result import Equilibrium, EquilibriumSet
from contfric.equilibria.trace import continue_equilibrium
from contfric.errors import checked_range, function_of, number_and, whole_number
from contfric.models import ModelSource, Parameters
from contfric.models.definition import Model
from contfric.models.tied import tied

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

#: Two events, or an equilibrium and a branch, nearer than this in natural sizes are one.
_SAME = 1e-6


@dataclass(frozen=True, eq=False)
class EquilibriumDiagram(AtParameters):
    """Branches of equilibria over a range; the result of :func:`contfric.explore_equilibria`.

    Attributes
    ----------
    branches : tuple of EquilibriumBranch
    sets : tuple of EquilibriumSet
        Whole sets of equilibria, at the values of the parameter at which equilibria were looked for.
    bounds : (low, high)
    complete : bool
        False after an interrupt. Branches between those values, and equilibria that Newton's method did not
        find, may be missing even so.

    Examples
    --------
    >>> import contfric as cf
    >>> found = cf.explore_equilibria("popp", "a2", (0.3, 0.8), {"F": 0.0}, values=1)
    >>> [event.kind.value for event in found.events]
    ['H']
    """

    model: Model
    parameter: str
    vector: FloatArray
    bounds: tuple[float, float]
    branches: tuple[EquilibriumBranch, ...]
    sets: tuple[EquilibriumSet, ...] = ()
    complete: bool = True

    def __iter__(self) -> Iterator[EquilibriumBranch]:
        return iter(self.branches)

    def __len__(self) -> int:
        return len(self.branches)

    @property
    def events(self) -> tuple[EquilibriumEvent, ...]:
        """The events of all branches by the parameter; what two of them share once."""
        found: list[EquilibriumEvent] = []
        for event in sorted((e for b in self.branches for e in b.events), key=lambda e: e.value):
            if not any(_one(event, other) for other in found):
                found.append(event)
        return tuple(found)

    def of_kind(self, kind: str) -> list[EquilibriumEvent]:
        """Return the events of one kind: "SN", "BP", "H" or "BE"."""
        return [event for event in self.events if event.kind.value == kind]

    def to_dataframe(self) -> pd.DataFrame:
        """Return one row for each point of each branch (needs pandas)."""
        return stacked(({}, b.to_dataframe().assign(branch=k)) for k, b in enumerate(self.branches))

    def plot(self, ax: Axes | None = None, state: str | None = None) -> Axes:
        """Draw one state of all branches along the parameter, on axes of a diagram if these are given."""
        from contfric.plot.equilibria import plot_equilibrium_diagram

        return plot_equilibrium_diagram(self, ax=ax, state=state)

    def __repr__(self) -> str:
        events = ", ".join(e.label for e in self.events) or "no events"
        low, high = self.bounds
        return (
            f"<EquilibriumDiagram of {self.model.name}: {number_and(len(self), 'branch', 'branches')}, "
            f"{self.parameter} in [{low:g}, {high:g}]; {events}>"
        )


def _one(a: EquilibriumEvent, b: EquilibriumEvent) -> bool:
    scale = scale_of(a.equilibrium.model, a.equilibrium.vector)
    apart = np.max(np.abs((a.equilibrium.state - b.equilibrium.state) / scale))
    near = abs(a.value - b.value) <= _SAME * (1.0 + abs(a.value))
    if isinstance(a, HopfPoint) and isinstance(b, HopfPoint):  # several pairs may cross together
        near = near and abs(a.frequency - b.frequency) <= _SAME * a.frequency
    return a.kind is b.kind and near and bool(apart <= _SAME)


def explore_equilibria(
    model: ModelSource,
    parameter: str,
    bounds: tuple[float, float],
    params: Parameters | None = None,
    *,
    values: int = 5,
    starts: int = 200,
    seed: int = 0,
    max_step: float | None = None,
    max_points: int = 5000,
    progress: Callable[[str], None] | None = None,
) -> EquilibriumDiagram:
    """Find equilibria at several values of a parameter and follow each that lies on no known branch.

    Parameters
    ----------
    parameter, bounds : the parameter that varies and its range
    params : mapping, optional
        The other parameters; defaults fill in.
    values : int
        Values of the parameter, evenly spaced inside of the range, at which equilibria are looked for.
    starts, seed : as for :func:`contfric.find_equilibria`
    max_step, max_points : as for :func:`contfric.continue_equilibrium`
    progress : callable, optional
        Called with a line of text for each branch.

    Returns
    -------
    EquilibriumDiagram
        All branches that were found, with their events.

    Examples
    --------
    >>> import contfric as cf
    >>> cf.explore_equilibria("popp", "a2", (0.3, 0.8), {"F": 0.0})
    <EquilibriumDiagram of popp: 1 branch, a2 in [0.3, 0.8]; H->
    """
    model, params = tied(model, params)
    active = model.index_of(parameter)
    low, high = checked_range(parameter, bounds)
    values = whole_number("values", values, least=1)
    function_of("progress", progress)
    given = model.check_params(params)
    least, most, _, _ = model.limits(parameter, given)
    edges = np.linspace(max(low, least), min(high, most), values + 2)[1:-1]
    options: dict[str, Any] = {"max_step": max_step, "max_points": max_points}
    branches: list[EquilibriumBranch] = []
    sets: list[EquilibriumSet] = []
    complete = True
    try:
        for value in edges.tolist():
            found = find_equilibria(model, {**given, parameter: value}, starts=starts, seed=seed)
            sets += found.sets
            for equilibrium in found:
                if any(_passes(branch, equilibrium, active) for branch in branches):
                    continue
                branches.append(
                    continue_equilibrium(equilibrium, parameter, (low, high), **options)
                )
                if progress is not None:
                    progress(repr(branches[-1]))
    except KeyboardInterrupt:
        complete = False
    vector = model.vector(given)
    return EquilibriumDiagram(
        model, parameter, vector, (low, high), tuple(branches), tuple(sets), complete
    )


def _passes(branch: EquilibriumBranch, equilibrium: Equilibrium, active: int) -> bool:
    """Tell whether a branch has an equilibrium: interpolated at its parameter and corrected."""
    value, region = float(equilibrium.vector[active]), equilibrium.region
    zeros = Zeros(region, equilibrium.vector, scale_of(equilibrium.model, equilibrium.vector))
    before, after = branch.values[:-1] - value, branch.values[1:] - value
    for k in np.flatnonzero(before * after <= 0.0).tolist():
        if branch.regions[k] is not region and branch.regions[k + 1] is not region:
            continue
        share = before[k] / (before[k] - after[k]) if before[k] != after[k] else 0.0
        guess = branch.states[k] + share * (branch.states[k + 1] - branch.states[k])
        there = zeros.newton(guess)
        if there is not None and np.max(np.abs((there - equilibrium.state) / zeros.scale)) < _SAME:
            return True
    return False
