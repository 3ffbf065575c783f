"""A branch: the points of one reduced itinerary along a parameter, its bifurcations and its ends."""

from __future__ import annotations

import operator
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray, IntArray, with_entries
from contfric.base.attributes import altered
from contfric.base.extras import need_flint
from contfric.base.shown import Shown
from contfric.base.tabled import as_table
from contfric.bvp.linear import of_two_halves
from contfric.bvp.system import System, build_system
from contfric.continuation.nodes import Nodes, between, nodes_of
from contfric.errors import ParameterError
from contfric.events.bifurcation import Bifurcation, End
from contfric.models.definition import Model
from contfric.orbit.itinerary.itineraries import mirror_pairs, mirrored_labels
from contfric.orbit.itinerary.read_signature import read_signature
from contfric.orbit.measured.stops import reach_of, reaches_at_joints, stopping_segments
from contfric.orbit.orbit import Orbit

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from contfric.certify.branch import BranchCertificate
    from contfric.continuation.extrema import Extremum
    from contfric.quantities.registry import QuantityLike

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Branch(Shown):
    """A family of orbits of one reduced itinerary, from one end to the other.

    Attributes
    ----------
    system : System
        The boundary-value problem that all points solve.
    parameter : str
        The parameter that varies.
    vector : ndarray, shape (parameters,)
        The other parameters.
    values : ndarray, shape (k,)
        The parameter at each point.
    joints : ndarray, shape (k, N, 1 + n)
        Joints of one turn at each point.
    arc : ndarray, shape (k,)
        Arclength, in units in which the parameter's range counts 1.
    labels : ndarray, shape (k, labels)
        Codes of the transparent surfaces crossed; they change at T.
    turn_multipliers : ndarray or None, shape (k, n)
        Multipliers of one turn, of an autonomous model without the trivial 1, shape (k, n - 1); None if
        stability was not asked for.
    bifurcations : tuple of Bifurcation
        In the order of the branch.
    ends : (End, End)
        Why it ends at its first and at its last point.
    mirrored : bool
        Whether this is the mirror image of a computed branch.
    notes : tuple of str
        What was met on it that is no event: a test that changed sign with no multiplier on the unit circle.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> branch = cf.continue_orbit(orbit, "Omega", (0.45, 0.51))
    >>> branch.bifurcations[0].label, branch[0].name, branch.ends[1].reason.name
    ('SS_a', '1a', 'RANGE')
    """

    system: System
    parameter: str
    vector: FloatArray
    values: FloatArray
    joints: FloatArray
    arc: FloatArray
    labels: IntArray
    turn_multipliers: NDArray[np.complex128] | None
    bifurcations: tuple[Bifurcation, ...]
    ends: tuple[End, End]
    mirrored: bool = False
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.values)

    @overload
    def __getitem__(self, index: int) -> Orbit: ...

    @overload
    def __getitem__(self, index: slice) -> list[Orbit]: ...

    def __getitem__(self, index: int | slice) -> Orbit | list[Orbit]:
        """Return one point as an orbit; a slice is a list of orbits."""
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        index = operator.index(index)
        vector = with_entries(self.vector, self.model.index_of(self.parameter), self.values[index])
        return Orbit(self.system, self.joints[index], vector, 0.0)

    @cached_property
    def nodes(self) -> Nodes:
        """Points, and the folds and branch points between them."""
        return nodes_of(self)

    def between(self, arc: float) -> Orbit:
        """Return what lies at an arclength by interpolation: an orbit that is not solved."""
        return between(self, arc)

    def __iter__(self) -> Iterator[Orbit]:
        return (self[i] for i in range(len(self)))

    @property
    def model(self) -> Model:
        """The model that moves."""
        return self.system.model

    @property
    def params(self) -> dict[str, FloatArray]:
        """Every parameter at every point, shape (k,) each."""
        return self.model.columns(self.vector, {self.parameter: self.values})

    @property
    def period(self) -> FloatArray:
        """Duration of the orbit at each point, shape (k,)."""
        return self.turns_at(slice(None)) * (2.0 if self.system.half else 1.0)

    def turns_at(self, points: slice | Sequence[int]) -> FloatArray:
        """Return the duration of one turn (half of a symmetric orbit) at some points."""
        if self.model.autonomous:
            return -self.joints[points, 0, 0]
        periods = self.model.periods_along(self.vector, self.parameter, self.values[points])
        return self.system.layout.turn * periods

    @cached_property
    def name(self) -> str:
        """Name such as ``2s``: that of the longest part between tangencies (T)."""
        changes = np.flatnonzero(np.any(np.diff(self.labels, axis=0) != 0, axis=1)) + 1
        edges = np.concatenate([[0], changes, [len(self)]])
        spans = self.arc[edges[1:] - 1] - self.arc[edges[:-1]]
        longest = int(np.argmax(spans))
        middle = int(edges[longest] + edges[longest + 1]) // 2
        return str(read_signature(self[middle], self.labels[middle]).name)

    @property
    def symmetric(self) -> bool:
        """Whether the orbits are their own mirror images."""
        return self.system.half

    @property
    def bridge(self) -> bool:
        """Whether the orbits have holds: the branch bridges a jump of the flow."""
        return bool(self.system.holds)

    @property
    def multipliers(self) -> NDArray[np.complex128] | None:
        """Floquet multipliers of the whole orbit at each point, shape (k, n)."""
        if self.turn_multipliers is None:
            return None
        mu = self.turn_multipliers
        return of_two_halves(mu) if self.system.half else mu

    @cached_property
    def stable(self) -> BoolArray | None:
        """Whether each point is stable, shape (k,); None if stability was not asked for.

        An orbit of a bridge never is: the least disturbance ends a hold.
        """
        if self.bridge:
            return np.zeros(len(self), dtype=bool)
        mu = self.turn_multipliers
        return None if mu is None else np.asarray(np.all(np.abs(mu) < 1.0, axis=1))

    @cached_property
    def margins(self) -> FloatArray:
        """Margins of the inequalities at each point, shape (k, margins); evaluated when asked for."""
        return np.array([orbit.margins for orbit in self])

    @cached_property
    def stops(self) -> FloatArray:
        """Displacements at the stops and impacts, shape (k, stops); filled up with nan where fewer."""
        if not self.model.stops_at_joints:
            return _padded([orbit.stops for orbit in self])
        x = self.joints[:, :, 1]
        closed = self.joints[:, 0, 1:] @ self.system.layout.closure.T
        ends = np.concatenate([x[:, 1:], closed[:, :1]], axis=1)
        at = stopping_segments(self.model, self.system.itinerary)
        if not self.system.half:
            return ends[:, at]
        mirrored = (self.joints[:, :, 1:] @ self.system.layout.closure.T)[:, :, 0]
        second = np.concatenate([mirrored[:, 1:], x[:, :1]], axis=1)
        return np.concatenate([ends[:, at], second[:, at]], axis=1)

    @cached_property
    def _reach(self) -> FloatArray:
        """Least and largest displacement at each point, shape (2, k)."""
        if not reaches_at_joints(self.model):
            return np.array([reach_of(orbit) for orbit in self]).reshape(-1, 2).T
        count = self.system.segments
        x = [self.joints[:, i, 1] for i in range(count)]
        if self.system.half:
            x += [self.joints[:, i, 1:] @ self.system.layout.closure[0] for i in range(count)]
        low, high = x[0].copy(), x[0].copy()
        for column in x[1:]:  # one after the other: numpy is slow where an axis is short
            np.minimum(low, column, out=low)
            np.maximum(high, column, out=high)
        return np.array([low, high])

    @property
    def x_max(self) -> FloatArray:
        """Largest displacement at each point, shape (k,)."""
        return np.asarray(self._reach[1])

    @property
    def x_min(self) -> FloatArray:
        """Smallest displacement at each point, shape (k,)."""
        return np.asarray(self._reach[0])

    @property
    def asymmetry(self) -> FloatArray:
        """Asymmetry psi (eq. (4) of the reference) at each point, shape (k,)."""
        return np.asarray(np.abs(self.x_max + self.x_min) / np.abs(self.x_max - self.x_min))

    def mirror(self) -> Branch:
        """Return the mirror image of the branch, with mirrored bifurcations."""
        symmetry = self.model.symmetry
        if symmetry is None:
            raise ParameterError(
                f"model '{self.model.name}' has no symmetry: a branch has no mirror image"
            )
        itinerary = mirror_pairs(self.model, self.system.itinerary)
        system = build_system(self.model, itinerary, self.system.periods, self.system.half)
        joints = self.joints.copy()
        joints[:, :, 1:] = joints[:, :, 1:] @ symmetry.array().T
        if not self.model.autonomous:
            joints[:, :, 0] += (symmetry.fraction * self.period / self.system.periods)[:, None]
        images = {id(b): b.mirror() for b in self._all_bifurcations()}
        return altered(
            self,
            system=system,
            joints=joints,
            labels=mirrored_labels(self.labels, self.model),
            bifurcations=tuple(images[id(b)] for b in self.bifurcations),
            ends=(_mirror_end(self.ends[0], images), _mirror_end(self.ends[1], images)),
            mirrored=not self.mirrored,
        )

    def _all_bifurcations(self) -> list[Bifurcation]:
        return [*self.bifurcations, *(b for end in self.ends if (b := end.bifurcation) is not None)]

    def quantity(self, name: QuantityLike) -> FloatArray:
        """Return a quantity at every point, shape (k,); nan-padded (k, stops) for ``"stops"``.

        Parameters
        ----------
        name : str or callable
            As for :meth:`contfric.Orbit.quantity`.

        Raises
        ------
        ParameterError
            If there is no such quantity.

        Examples
        --------
        >>> import contfric as cf
        >>> orbit = cf.solve_orbit("coulomb", "1a", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
        >>> branch = cf.continue_orbit(orbit, "Omega", (0.49, 0.51))
        >>> branch.quantity("energy").shape == branch.values.shape
        True
        """
        from contfric.quantities.measure import of_branch
        from contfric.quantities.registry import quantity_of

        return of_branch(quantity_of(name, self.model), self)

    def extrema(self, name: QuantityLike) -> tuple[Extremum, ...]:
        """Return the local extrema of a quantity along the branch, located, in its order.

        Parameters
        ----------
        name : str or callable
            A quantity by its name or as an expression, or a function of an orbit.

        Raises
        ------
        ParameterError
            If there is no such quantity, or it has no derivatives.

        Examples
        --------
        >>> import contfric as cf
        >>> orbit = cf.solve_orbit("coulomb", "1a", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
        >>> branch = cf.continue_orbit(orbit, "Omega", (0.4, 0.6))
        >>> [(peak.largest, round(peak.value, 6)) for peak in branch.extrema("energy")]
        [(True, 1.806073)]
        """
        from contfric.continuation.extrema import extrema_of

        return extrema_of(self, name)

    def certify(self, *, time_limit: float | None = None) -> BranchCertificate:
        """Prove the branch: one curve of admissible orbits in a tube of boxes, without events but the listed.

        Parameters
        ----------
        time_limit : seconds (a structure may take minutes) after which what is left is listed as such

        Raises
        ------
        ParameterError
            If proofs are not offered for the model, or the limit is no number above 0.
        """
        need_flint()
        from contfric.certify.branch import certify_branch
        from contfric.certify.limit import latest

        return certify_branch(self, latest(time_limit))

    def to_dataframe(self, quantities: Sequence[QuantityLike] = ()) -> pd.DataFrame:
        """Return the points as a table: parameters, x_max, x_min, psi, stops, stability (pandas).

        Parameters
        ----------
        quantities : sequence of str or callable
            More columns: quantities by name, as expressions, or as functions of an orbit.
        """
        from contfric.quantities.registry import columns_asked

        period = {"period": self.period} if self.model.autonomous else {}
        columns: dict[str, Any] = {**self.params, **period}
        columns |= {"x_max": self.x_max, "x_min": self.x_min, "psi": self.asymmetry}
        columns |= {f"stop_{k + 1}": x for k, x in enumerate(self.stops.T)}
        columns |= {q.name: self.quantity(q.asked) for q in columns_asked(quantities, self.model)}
        if self.stable is not None:
            columns["stable"] = self.stable
        return as_table(columns, self.model.origins)

    def plot(self, ax: Axes | None = None, row: QuantityLike = "x_max") -> Axes:
        """Draw one quantity of the branch against its parameter."""
        from contfric.plot.diagrams.diagram import plot_branches

        return plot_branches([self], row, ax=ax)

    def __repr__(self) -> str:
        low, high = float(self.values.min()), float(self.values.max())
        return (
            f"<Branch {self.name}: {len(self)} points, {self.parameter} in [{low:.6g}, {high:.6g}], "
            f"ends {self.ends[0].reason.name} and {self.ends[1].reason.name}>"
        )


def _padded(rows: list[FloatArray]) -> FloatArray:
    """Return rows of different lengths as one array, filled up with nan."""
    found = np.full((len(rows), max(map(len, rows), default=0)), np.nan)
    for row, values in zip(found, rows, strict=True):
        row[: len(values)] = values
    return found


def _mirror_end(end: End, images: dict[int, Bifurcation]) -> End:
    if end.bifurcation is None:
        return end
    return altered(end, bifurcation=images[id(end.bifurcation)])
