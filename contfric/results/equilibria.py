"""Branches of equilibria to a header and arrays, and back."""

from __future__ import annotations

from typing import Any

import numpy as np

from contfric.equilibria.boundary import Unfolding
from contfric.equilibria.branch import BranchEnd, EquilibriumBranch
from contfric.equilibria.events import (
    BoundaryPoint,
    EquilibriumEvent,
    EquilibriumKind,
    HopfPoint,
)
from contfric.equilibria.explore import EquilibriumDiagram
from contfric.equilibria.find import equilibrium_at
from contfric.equilibria.hopf import Centre
from contfric.equilibria.regions import Region, regions_of
from contfric.equilibria.result import EquilibriumSet
from contfric.models.definition import FloatArray, Model
from contfric.results.pack import Arrays, Header
from contfric.results.response import expect

_BRANCH = ("values", "states", "eigenvalues", "admissible")
_SET = ("vector", "state", "directions", "states", "eigenvalues")


def pack_equilibria(found: EquilibriumDiagram, arrays: Arrays) -> Header:
    """Return the header of a diagram of equilibria; its arrays are added as they are."""
    arrays["vector"] = found.vector
    regions = regions_of(found.model)
    return {
        "parameter": found.parameter,
        "bounds": list(found.bounds),
        "complete": found.complete,
        "branches": [_branch(b, f"b{k}", arrays, regions) for k, b in enumerate(found.branches)],
        "sets": [_set(s, f"s{k}", arrays, regions) for k, s in enumerate(found.sets)],
    }


def pack_equilibrium_branch(found: EquilibriumBranch, arrays: Arrays) -> Header:
    """Return the header of one branch of equilibria."""
    arrays["vector"] = found.vector
    branch = _branch(found, "b", arrays, regions_of(found.model))
    return {"parameter": found.parameter, "branch": branch}


def _branch(
    found: EquilibriumBranch, name: str, arrays: Arrays, regions: tuple[Region, ...]
) -> Header:
    for field in _BRANCH:
        arrays[f"{name}_{field}"] = getattr(found, field)
    arrays[f"{name}_regions"] = np.array([regions.index(r) for r in found.regions], dtype=np.int64)
    events = [_event(e, f"{name}_e{k}", arrays, regions) for k, e in enumerate(found.events)]
    return {"ends": [end.name for end in found.ends], "events": events}


def _event(
    event: EquilibriumEvent, name: str, arrays: Arrays, regions: tuple[Region, ...]
) -> Header:
    at = event.equilibrium
    arrays[f"{name}_vector"], arrays[f"{name}_state"] = at.vector, at.state
    header: Header = {
        "kind": event.kind.name,
        "region": regions.index(at.region),
        "stable": [event.stable_before, event.stable_after],
    }
    if isinstance(event, HopfPoint):
        centre = event.centre
        numbers = np.array([centre.frequency, centre.lyapunov, centre.rate])
        arrays[f"{name}_numbers"], arrays[f"{name}_centre"] = numbers, centre.vector
        arrays[f"{name}_drift"] = centre.drift
    if isinstance(event, BoundaryPoint):
        arrays[f"{name}_numbers"] = np.array([event.product])
        header |= {"surface": event.surface, "partner": event.partner}
        header |= {"unfolding": event.unfolding.name}
    return header


def _set(found: EquilibriumSet, name: str, arrays: Arrays, regions: tuple[Region, ...]) -> Header:
    for field in _SET:
        arrays[f"{name}_{field}"] = getattr(found, field)
    for k, (_, state) in enumerate(found.ends):
        arrays[f"{name}_end{k}"] = state
    return {"region": regions.index(found.region), "ends": [s for s, _ in found.ends]}


def unpack_equilibria(model: Model, header: Header, arrays: Arrays) -> EquilibriumDiagram:
    """Return the diagram of a header.

    Raises
    ------
    ValueError, KeyError
        If arrays are missing or do not fit each other.
    """
    parameter, vector = str(header["parameter"]), arrays["vector"]
    expect(vector.shape == (len(model.parameters),))
    low, high = map(float, header["bounds"])
    branches = [
        _branch_of(model, parameter, vector, entry, f"b{k}", arrays)
        for k, entry in enumerate(header["branches"])
    ]
    sets = [_set_of(model, entry, f"s{k}", arrays) for k, entry in enumerate(header["sets"])]
    complete = bool(header["complete"])
    return EquilibriumDiagram(
        model, parameter, vector, (low, high), tuple(branches), tuple(sets), complete
    )


def unpack_equilibrium_branch(model: Model, header: Header, arrays: Arrays) -> EquilibriumBranch:
    """Return the branch of a header; errors as for a diagram."""
    return _branch_of(
        model, str(header["parameter"]), arrays["vector"], header["branch"], "b", arrays
    )


def _branch_of(
    model: Model, parameter: str, vector: FloatArray, header: Header, name: str, arrays: Arrays
) -> EquilibriumBranch:
    model.index_of(parameter)
    regions = regions_of(model)
    values, states, own, admissible = (arrays[f"{name}_{field}"] for field in _BRANCH)
    numbers, n = arrays[f"{name}_regions"], len(model.states)
    expect(states.shape == own.shape == (len(values), n))
    expect(numbers.shape == values.shape == admissible.shape)
    expect(vector.shape == (len(model.parameters),))
    events = [
        _event_of(parameter, entry, f"{name}_e{k}", arrays, regions)
        for k, entry in enumerate(header["events"])
    ]
    first, last = (BranchEnd[end] for end in header["ends"])
    visited = tuple(regions[k] for k in numbers.tolist())
    return EquilibriumBranch(
        model,
        parameter,
        vector,
        values,
        states,
        own,
        visited,
        admissible,
        tuple(events),
        (first, last),
    )


def _event_of(
    parameter: str, header: Header, name: str, arrays: Arrays, regions: tuple[Region, ...]
) -> EquilibriumEvent:
    at = equilibrium_at(
        regions[header["region"]], arrays[f"{name}_state"], arrays[f"{name}_vector"]
    )
    kind, (before, after) = EquilibriumKind[header["kind"]], header["stable"]
    common: dict[str, Any] = {
        "kind": kind,
        "parameter": parameter,
        "equilibrium": at,
        "stable_before": before,
        "stable_after": after,
    }
    if kind is EquilibriumKind.H:
        omega, lyapunov, rate = arrays[f"{name}_numbers"].tolist()
        drift = arrays[f"{name}_drift"]
        centre = Centre(omega, arrays[f"{name}_centre"], lyapunov, rate, drift)
        return HopfPoint(**common, centre=centre)
    if kind is EquilibriumKind.BE:
        [product] = arrays[f"{name}_numbers"].tolist()
        told = Unfolding[header["unfolding"]]
        return BoundaryPoint(
            **common,
            surface=header["surface"],
            unfolding=told,
            partner=header["partner"],
            product=product,
        )
    return EquilibriumEvent(**common)


def _set_of(model: Model, header: Header, name: str, arrays: Arrays) -> EquilibriumSet:
    vector, state, directions, states, own = (arrays[f"{name}_{field}"] for field in _SET)
    ends = tuple((str(s), arrays[f"{name}_end{k}"]) for k, s in enumerate(header["ends"]))
    region = regions_of(model)[header["region"]]
    return EquilibriumSet(region, vector, state, directions, states, ends, own)
