"""A curve: the points of one bifurcation in the plane of two parameters."""

from __future__ import annotations

import itertools
import operator
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray, IntArray, with_entries
from contfric.base.named import Named
from contfric.base.shown import Shown
from contfric.base.tabled import as_table
from contfric.bvp.system import EventFunction, System
from contfric.curves.special import CurveEnd, SpecialPoint
from contfric.errors import either
from contfric.events.bifurcation import Kind, meaning_of
from contfric.models.definition import Model
from contfric.orbit.orbit import Orbit

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from contfric.curves.problem import Problem

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class CurvePart:
    """The points of a curve that share a reduced itinerary and a kind.

    Attributes
    ----------
    kind : Kind
        What happens there: a CS becomes an SS where the load at its stop stands still.
    problem : Problem or None
        What its points solve; None for a curve that was read from a file.
    system : System
        The boundary-value problem of the orbits.
    test : Test or None
        The margin that vanishes; None for SN, BP and PD.
    values : ndarray, shape (k, 2)
        Both parameters.
    joints : ndarray, shape (k, N, 1 + n)
    arc : ndarray, shape (k,)
        Arclength from the first point of the curve, each range counting 1.
    labels : ndarray, shape (k, labels)
    turn_multipliers : ndarray, shape (k, n)
    """

    kind: Kind
    problem: Problem | None
    system: System
    test: EventFunction | None
    values: FloatArray
    joints: FloatArray
    arc: FloatArray
    labels: IntArray
    turn_multipliers: NDArray[np.complex128]

    def __len__(self) -> int:
        return len(self.values)

    @cached_property
    def stable(self) -> BoolArray:
        """Whether the orbits are stable, shape (k,); of SN, BP and PD but for the multiplier that passes."""
        mu = self.turn_multipliers
        if self.test is not None:
            return np.asarray(np.all(np.abs(mu) < 1.0, axis=1))
        others = np.abs(mu)
        if self.kind is Kind.NS:  # two pass: the nearest to the circle, and its conjugate
            critical = np.argsort(np.abs(others - 1.0), axis=1)[:, :2]
            np.put_along_axis(others, critical, 0.0, axis=1)
            return np.asarray(np.all(others < 1.0, axis=1))
        sign = 1.0 if self.kind is Kind.SN else -1.0
        critical = np.argmin(np.abs(mu - sign), axis=1)
        others[np.arange(len(mu)), critical] = 0.0
        return np.asarray(np.all(others < 1.0, axis=1))

    @property
    def meaning(self) -> str:
        """What happens at its points, in words."""
        surfaces = set() if self.test is None else {self.test.surface}
        return meaning_of(self.kind, self.system.model, surfaces)


@dataclass(frozen=True, eq=False)
class Curve(Shown):
    """A curve of bifurcations in two parameters, from one end to the other.

    Attributes
    ----------
    parameters : (str, str)
        The two that vary.
    vector : ndarray
        All parameters at the start; the two that vary are those of each point.
    parts : tuple of CurvePart
        Pieces of one signature and kind, in order.
    special : tuple of SpecialPoint
        Points of codimension two, in order.
    ends : (CurveEnd, CurveEnd)
        Why it ends at its first and at its last point.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> fold = cf.continue_orbit(orbit, "Omega", (0.5, 0.6)).bifurcations[0]
    >>> ranges = {"Omega": (0.53, 0.55), "S": (0.31, 0.33)}
    >>> curve = cf.continue_bifurcation(fold, ("Omega", "S"), ranges)
    >>> curve.label, str(curve.ends[1])
    ('SN_1a', 'end of the range asked for')
    """

    parameters: tuple[str, str]
    vector: FloatArray
    parts: tuple[CurvePart, ...]
    special: tuple[SpecialPoint, ...]
    ends: tuple[CurveEnd, CurveEnd]

    def __len__(self) -> int:
        return sum(len(part) for part in self.parts)

    @overload
    def __getitem__(self, index: int) -> Orbit: ...

    @overload
    def __getitem__(self, index: slice) -> list[Orbit]: ...

    def __getitem__(self, index: int | slice) -> Orbit | list[Orbit]:
        """Return the orbit at one point; a slice is a list of orbits."""
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        index = operator.index(index)
        if index < 0:
            index += len(self)
        for part in self.parts:
            if 0 <= index < len(part):
                vector = with_entries(
                    self.vector,
                    [self.model.index_of(n) for n in self.parameters],
                    part.values[index],
                )
                return Orbit(part.system, part.joints[index], vector, 0.0)
            index -= len(part)
        raise IndexError(f"a curve of {len(self)} points has no such point")

    def __iter__(self) -> Iterator[Orbit]:
        return (self[i] for i in range(len(self)))

    @property
    def model(self) -> Model:
        """The model that moves."""
        return self.parts[0].system.model

    @property
    def kind(self) -> Kind:
        """The bifurcation; of the longest part, if it changes."""
        return self._longest.kind

    @cached_property
    def _longest(self) -> CurvePart:
        return max(self.parts, key=lambda part: float(part.arc[-1] - part.arc[0]))

    @property
    def values(self) -> FloatArray:
        """Both parameters at every point, shape (k, 2)."""
        return np.concatenate([part.values for part in self.parts])

    @property
    def params(self) -> dict[str, FloatArray]:
        """Every parameter at every point, shape (k,) each."""
        return self.model.columns(
            self.vector, dict(zip(self.parameters, self.values.T, strict=True))
        )

    @property
    def arc(self) -> FloatArray:
        """Arclength at every point, shape (k,)."""
        return np.concatenate([part.arc for part in self.parts])

    @property
    def kinds(self) -> list[Kind]:
        """The bifurcation at every point."""
        return [part.kind for part in self.parts for _ in range(len(part))]

    @property
    def meanings(self) -> dict[str, str]:
        """What happens on the curve, in words, for each kind of its points."""
        found = Named[str]()
        for part in self.parts:
            found[part.kind.value] = either(found.get(part.kind.value, ""), part.meaning)
        return found

    @property
    def stable(self) -> BoolArray:
        """Whether stable orbits are bounded at each point: every other multiplier is inside the circle."""
        return np.concatenate([part.stable for part in self.parts])

    @cached_property
    def signatures(self) -> tuple[tuple[int, str], ...]:
        """Where the orbits' name changes: (index of the first point, name)."""
        found: list[tuple[int, str]] = []
        first = 0
        for part in self.parts:
            changes = np.flatnonzero(np.any(np.diff(part.labels, axis=0) != 0, axis=1)) + 1
            edges = [0, *changes.tolist(), len(part)]
            for start, stop in itertools.pairwise(edges):
                name = self[first + (start + stop) // 2].name
                if not found or found[-1][1] != name:
                    found.append((first + start, name))
            first += len(part)
        return tuple(found)

    @cached_property
    def name(self) -> str:
        """Name of the orbits, such as ``1a``: that of the longest piece."""
        starts = [start for start, _ in self.signatures]
        arc = self.arc
        stops = [*(s - 1 for s in starts[1:]), len(arc) - 1]
        spans = [arc[b] - arc[a] for a, b in zip(starts, stops, strict=True)]
        return self.signatures[int(np.argmax(spans))][1]

    @cached_property
    def symmetric(self) -> bool:
        """Whether the solution is its own mirror image."""
        part = self._longest
        if part.system.half:
            return True
        stops = Orbit(part.system, part.joints[len(part) // 2], self.vector, 0.0).stops
        if self.model.symmetry is None or len(stops) % 2:
            return False
        gap = np.max(np.abs(np.sort(stops) + np.sort(stops)[::-1]))
        return bool(gap < 1e-7)

    @cached_property
    def label(self) -> str:
        """Name in the manner of the reference: ``SN_1a``, ``CS_s``."""
        if self._longest.test is not None and self.kind is not Kind.T:
            return f"{self.kind.value}_{'s' if self.symmetric else 'a'}"
        return f"{self.kind.value}_{self.name}"

    def to_dataframe(self) -> pd.DataFrame:
        """Return the points as a table: parameters, kind, stability, x_max, x_min (needs pandas)."""
        columns: dict[str, Any] = dict(self.params)
        columns |= {"kind": [kind.value for kind in self.kinds], "stable": self.stable}
        orbits = list(self)
        columns["x_max"] = [orbit.x_max for orbit in orbits]
        columns["x_min"] = [orbit.x_min for orbit in orbits]
        return as_table(columns, self.model.origins)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the curve in its plane, dashed where no stable orbit is bounded."""
        from contfric.plot.plane import plot_curves

        return plot_curves([self], ax=ax)

    def __repr__(self) -> str:
        ends = " and ".join(
            end.special.name if end.special is not None else end.reason.name for end in self.ends
        )
        return f"<Curve {self.label}: {len(self)} points, {len(self.special)} special, ends {ends}>"
