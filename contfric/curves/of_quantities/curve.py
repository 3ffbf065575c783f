"""A curve in two parameters on which a quantity of the orbits has one value."""

from __future__ import annotations

import operator
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray, with_entries
from contfric.base.tabled import Columns, Tabled
from contfric.bvp.system import System
from contfric.curves.special import CurveEnd
from contfric.models.definition import Model
from contfric.orbit.orbit import Orbit
from contfric.quantities.measure import of_orbits
from contfric.quantities.registry import quantity_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from contfric.quantities.registry import QuantityLike


@dataclass(frozen=True, eq=False)
class QuantityCurve(Tabled):
    """Orbits of one signature on which a quantity has one value, in the plane of two parameters.

    Attributes
    ----------
    quantity, value : str, float
        What is held, and at what.
    parameters : (str, str)
        The two that vary.
    system : System
        The boundary-value problem of the orbits.
    vector : ndarray, shape (parameters,)
        The other parameters.
    values : ndarray, shape (k, 2)
        Both parameters at each point.
    joints : ndarray, shape (k, N, 1 + n)
    arc : ndarray, shape (k,)
        Arclength, each range counting 1.
    stable : ndarray of bool, shape (k,)
    ends : (CurveEnd, CurveEnd)
        Why it ends at its first and at its last point.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.solve_orbit("coulomb", "1a", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> ranges = {"Omega": (0.48, 0.55), "S": (0.25, 0.35)}
    >>> curve = cf.continue_quantity(orbit, "x_max", 1.43, ("Omega", "S"), ranges)
    >>> curve.quantity, curve.value
    ('x_max', 1.43)
    """

    length_columns: ClassVar = ("x_max", "x_min")
    time_columns: ClassVar = ("period",)

    quantity: str
    value: float
    parameters: tuple[str, ...]
    system: System
    vector: FloatArray
    values: FloatArray
    joints: FloatArray
    arc: FloatArray
    stable: NDArray[np.bool_]
    ends: tuple[CurveEnd, CurveEnd]

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, index: int) -> Orbit:
        """Return the orbit at one point."""
        index = operator.index(index)
        vector = with_entries(
            self.vector, [self.model.index_of(name) for name in self.parameters], self.values[index]
        )
        return Orbit(self.system, self.joints[index], vector, 0.0)

    def __iter__(self) -> Iterator[Orbit]:
        return (self[k] for k in range(len(self)))

    @property
    def label(self) -> str:
        """What is held, for a legend."""
        return f"{self.quantity} = {self.value:g}"

    @property
    def model(self) -> Model:
        """The model that moves."""
        return self.system.model

    @property
    def params(self) -> dict[str, FloatArray]:
        """Every parameter at every point, shape (k,) each."""
        return self.model.columns(
            self.vector, dict(zip(self.parameters, self.values.T, strict=True))
        )

    def measured(self, name: QuantityLike) -> FloatArray:
        """Return another quantity at every point, shape (k,)."""
        return of_orbits(quantity_of(name, self.model), self)

    def columns(self) -> Columns:
        """Return one row for each point: parameters, the quantity, stability."""
        measured = np.broadcast_to(self._at_points(), len(self))
        return {**self.params, self.quantity: measured, "stable": self.stable}

    def _at_points(self) -> FloatArray | float:
        """Return the quantity at the points."""
        return self.value

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the curve in the plane of the first two parameters, dashed where orbits are unstable."""
        from contfric.plot.plane import plot_quantity_curve

        return plot_quantity_curve(self, ax=ax)

    def __repr__(self) -> str:
        ends = " and ".join(end.reason.name for end in self.ends)
        return f"<{type(self).__name__} {self.label}: {len(self)} points, ends {ends}>"
