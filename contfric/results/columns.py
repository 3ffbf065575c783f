"""Results as columns: points and events, each column with its unit, for files that other programs read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from contfric.atlas.diagram import Diagram
from contfric.atlas.plane.plane import Plane
from contfric.base.arrays import FloatArray
from contfric.base.tabled import Tabled
from contfric.chaos.map import LyapunovMap
from contfric.continuation.branch import Branch
from contfric.curves.curve import Curve
from contfric.curves.of_quantities.curve import QuantityCurve
from contfric.ensembles.ensemble import Ensemble
from contfric.ensembles.tables import events_table, samples_table
from contfric.equilibria.branch import EquilibriumBranch
from contfric.equilibria.events import EquilibriumEvent
from contfric.equilibria.explore import EquilibriumDiagram
from contfric.events.bifurcation import Bifurcation
from contfric.fitting.result import Fit
from contfric.models.definition import Model
from contfric.orbit.orbit import Orbit
from contfric.response.basins import Basins
from contfric.response.returns import ReleaseMap, Returns
from contfric.response.stable_set import StableSet
from contfric.response.sweep import Sweep
from contfric.simulation.simulate import Trajectory

#: Results that are one table.
OneTable: TypeAlias = (
    Sweep | Returns | ReleaseMap | Basins | StableSet | LyapunovMap | QuantityCurve | Fit
)
#: Results of which each branch is a table, with its events.
Equilibria: TypeAlias = EquilibriumBranch | EquilibriumDiagram
Exported: TypeAlias = (
    Orbit | Branch | Diagram | Curve | Plane | Trajectory | Ensemble | Equilibria | OneTable
)


@dataclass
class Columns:
    """A table.

    Attributes
    ----------
    values : columns by name, all of one length
    units : units of those that have one: what 1 in the column is, in units of the model's file
    """

    values: dict[str, NDArray[Any]] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(next(iter(self.values.values()), ()))


def stacked(tables: Sequence[Columns]) -> Columns:
    """Return tables below each other; what one lacks is nan, or empty where it is text."""
    found = Columns()
    for name in dict.fromkeys(name for table in tables for name in table.values):
        like = next(t.values[name] for t in tables if name in t.values)
        empty: Any = "" if like.dtype.kind == "U" else np.nan
        parts = [t.values.get(name, np.full(len(t), empty)) for t in tables]
        found.values[name] = np.concatenate(parts)
        found.units[name] = next(t.units[name] for t in tables if name in t.units)
    return found


def points_of(x: Exported) -> Columns:
    """Return the points of a result: one period of an orbit; else one row an orbit."""
    return _from_origins(_points(x), x.model)


def _points(x: Exported) -> Columns:
    if isinstance(x, Orbit):
        return _motion(x)
    if isinstance(x, Branch):
        return _branch(x, 1)
    if isinstance(x, Curve):
        return _curve(x, 1)
    if isinstance(x, Plane):
        return stacked([_curve(curve, k) for k, curve in enumerate(x.curves, start=1)])
    if isinstance(x, Ensemble):
        return _table(samples_table(x), x.model)
    if isinstance(x, Trajectory):
        return _table(x.columns(), x.model)
    if isinstance(x, Equilibria):
        parts = [x] if isinstance(x, EquilibriumBranch) else x.branches
        return stacked([_equilibria(branch, k) for k, branch in enumerate(parts, start=1)])
    if isinstance(x, Tabled):
        return _table(x.columns(), x.model, x.length_columns, x.time_columns)
    return stacked([_branch(branch, k) for k, branch in enumerate(x.branches, start=1)])


def events_of(x: Exported) -> Columns | None:
    """Return the events of a branch, a diagram or an ensemble, or the special points of curves; else None."""
    table = _events(x)
    return None if table is None else _from_origins(table, x.model)


def _events(x: Exported) -> Columns | None:
    if isinstance(x, Equilibria):
        return stacked([_event_at_rest(event) for event in x.events])
    if isinstance(x, Orbit | Tabled | Trajectory):
        return None
    if isinstance(x, Ensemble):
        return _table(events_table(x), x.model)
    if isinstance(x, Branch):
        return stacked([_event(b, ("1",), (x.name,)) for b in x.bifurcations])
    if isinstance(x, Diagram):
        names = [branch.name for branch in x.branches]
        return stacked(
            [
                _event(
                    node.bifurcation,
                    [str(k + 1) for k in node.branches],
                    [names[k] for k in node.branches],
                )
                for node in x.events
            ]
        )
    columns = {"label": np.array([point.name for point in x.special], dtype=np.str_)}
    columns |= {name: np.array([p.params[name] for p in x.special]) for name in x.parameters}
    return _table(columns, x.model)


def _from_origins(table: Columns, model: Model) -> Columns:
    """Add to the units of states, and of their extrema and stops, what they are measured from if not 0."""
    origins = dict(model.origins)
    for name in table.units if origins else ():
        of_first = name in ("x_max", "x_min") or name.startswith("stop_")
        origin = origins.get(model.states[0] if of_first else name)
        if origin is not None:
            table.units[name] += f" from {origin}"
    return table


def _table(
    columns: Mapping[str, Any],
    model: Model,
    lengths: Sequence[str] = (),
    times: Sequence[str] = (),
) -> Columns:
    """Return the table of a result, with the units that the names of its columns tell."""
    table, units = Columns(), dict(model.units)
    length, time = units.get(model.states[0], 1.0), units.get("t", 1.0)
    units |= {"t": time, **dict.fromkeys(lengths, length), **dict.fromkeys(times, time)}
    for name, values in columns.items():
        column = np.asarray(values)
        table.values[name] = column.astype(np.str_) if column.dtype.kind == "O" else column
        is_text = table.values[name].dtype.kind == "U"
        table.units[name] = "" if is_text else f"{units.get(name, 1.0):g}"
    return table


def _of_orbits(columns: Mapping[str, Any], model: Model) -> Columns:
    """Return the table of orbits: their extrema and stops are lengths, their periods are times."""
    stops = (name for name in columns if name.startswith("stop_"))
    return _table(columns, model, ("x_max", "x_min", *stops), ("period",))


def _multipliers(values: Any) -> dict[str, FloatArray]:
    """Return real and imaginary parts of multipliers, shape (rows, n)."""
    return {
        f"multiplier_{k}_{part}": column.real if part == "re" else column.imag
        for k, column in enumerate(np.asarray(values, dtype=np.complex128).T, start=1)
        for part in ("re", "im")
    }


def _stability(event: Bifurcation | EquilibriumEvent) -> dict[str, list[float]]:
    sides = {"stable_before": event.stable_before, "stable_after": event.stable_after}
    return {name: [np.nan if side is None else float(side)] for name, side in sides.items()}


def _motion(orbit: Orbit) -> Columns:
    times, states, names = orbit.trajectory()
    own = dict(zip(orbit.model.states, states.T, strict=True))
    return _table({"t": times, **own, "domain": np.array(names, dtype=np.str_)}, orbit.model)


def _branch(branch: Branch, number: int) -> Columns:
    count = len(branch)
    columns: dict[str, Any] = {"branch": np.full(count, number), "signature": [branch.name] * count}
    columns |= {**branch.params, "period": branch.period}
    columns |= {"x_max": branch.x_max, "x_min": branch.x_min, "psi": branch.asymmetry}
    columns |= {f"stop_{k}": stops for k, stops in enumerate(branch.stops.T, start=1)}
    if branch.stable is not None:
        columns["stable"] = branch.stable.astype(np.float64)
    if branch.multipliers is not None:
        columns |= _multipliers(branch.multipliers)
    return _of_orbits(columns, branch.model)


def _event(event: Bifurcation, branches: Sequence[str], names: Sequence[str]) -> Columns:
    orbit = event.orbit
    columns: dict[str, Any] = {"label": [event.label], "kind": [event.kind.value]}
    columns |= {"branches": [" ".join(branches)], "signatures": ["; ".join(names)]}
    columns |= {name: [value] for name, value in event.params.items()}
    columns |= {"period": [orbit.period], "x_max": [orbit.x_max], **_stability(event)}
    if not orbit.system.holds:
        columns |= _multipliers(orbit.multipliers[None, :])
    return _of_orbits(columns, orbit.model)


def _equilibria(branch: EquilibriumBranch, number: int) -> Columns:
    count = len(branch)
    fixed = {name: np.broadcast_to(value, count) for name, value in branch.params.items()}
    return _table({"branch": np.full(count, number), **fixed, **branch.columns()}, branch.model)


def _event_at_rest(event: EquilibriumEvent) -> Columns:
    model, rest = event.equilibrium.model, event.equilibrium
    columns: dict[str, Any] = {"label": [event.label], "kind": [event.kind.value]}
    columns |= {name: [value] for name, value in event.params.items()}
    columns |= {name: [value] for name, value in zip(model.states, rest.state, strict=True)}
    return _table(columns | _stability(event), model)


def _curve(curve: Curve, number: int) -> Columns:
    count, orbits = len(curve), list(curve)
    columns: dict[str, Any] = {"curve": np.full(count, number), "label": [curve.label] * count}
    columns |= {"kind": [kind.value for kind in curve.kinds], **curve.params}
    columns |= {name: [getattr(o, name) for o in orbits] for name in ("period", "x_max", "x_min")}
    columns["stable"] = curve.stable.astype(np.float64)
    if not any(orbit.system.holds for orbit in orbits):
        columns |= _multipliers(np.array([orbit.multipliers for orbit in orbits]))
    return _of_orbits(columns, curve.model)
