"""Trajectories, sweeps, return maps and basins to a header and arrays, and back."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contfric.models.definition import Model
from contfric.orbit.orbit import Orbit
from contfric.orbit.simulation import SimulationEnd, Trajectory
from contfric.response.basins import Basins
from contfric.response.outcome import Outcome
from contfric.response.returns import ReleaseMap, Returns
from contfric.response.stable_set import StableEnd, StableSet
from contfric.response.sweep import Sweep, SweepRun
from contfric.results.pack import Arrays, Header, Packer

_EVENTS = ("exits", "cycles", "times", "states")


def pack_trajectory(found: Trajectory, arrays: Arrays) -> Header:
    """Return the header of a trajectory; its arrays are added as they are, but modes, which are named."""
    names = [mode.name for mode in found.model.modes]
    visited = np.unique(found.modes)
    arrays |= {name: getattr(found, name) for name in _EVENTS}
    arrays["modes"] = np.searchsorted(visited, found.modes)
    arrays["vector"] = found.model.vector(found.params)
    cycle, phase, state, mode = found.last
    arrays["begin"] = np.array([found.begin[0], *found.begin[1]])
    arrays["last"] = np.array([phase, *state])
    named = [names[k] for k in visited]
    return {"end": found.end.name, "cycle": int(cycle), "mode": mode, "modes": named}


def unpack_trajectory(model: Model, header: Header, arrays: Arrays) -> Trajectory:
    """Return the trajectory of a header; errors as for a sweep."""
    check_points(model, [arrays[name] for name in ("cycles", "modes", "times", "states")])
    begin, last, exits = arrays["begin"], arrays["last"], arrays["exits"]
    expect(begin.shape == last.shape == (1 + len(model.states),))
    expect(
        arrays["vector"].shape == (len(model.parameters),) and len(exits) == len(arrays["times"])
    )
    expect(not len(exits) or 0 <= exits.min() <= exits.max() < len(model.surfaces))
    numbers = np.array([model.mode_index[name] for name in header["modes"]], dtype=np.int64)
    return Trajectory(
        model,
        model.mapping(arrays["vector"]),
        numbers[arrays["modes"]],
        **{name: arrays[name] for name in _EVENTS},
        end=SimulationEnd[header["end"]],
        last=(int(header["cycle"]), float(last[0]), last[1:], str(header["mode"])),
        begin=(float(begin[0]), begin[1:]),
    )


_POINTS = ("index", "cycles", "modes", "times", "states")


def pack_sweep(found: Sweep, arrays: Arrays) -> Header:
    """Return the header of a sweep; its arrays are added as they are."""
    arrays["values"], arrays["vector"] = found.values, found.vector
    for name, run in found.runs.items():
        for field, array in vars(run).items():
            arrays[f"{name}_{field}"] = array
    return {
        "parameter": found.parameter,
        "section": found.section,
        "directions": list(found.runs),
    }


def unpack_sweep(model: Model, header: Header, arrays: Arrays) -> Sweep:
    """Return the sweep of a header.

    Raises
    ------
    ValueError, KeyError
        If arrays are missing or do not fit each other.
    """
    values, vector = arrays["values"], arrays["vector"]
    model.index_of(header["parameter"])
    expect(values.ndim == 1 and vector.shape == (len(model.parameters),))
    runs = {}
    for name in header["directions"]:
        run = SweepRun(**{f: arrays[f"{name}_{f}"] for f in SweepRun.__dataclass_fields__})
        expect(run.outcomes.shape == run.periods.shape == values.shape)
        expect(run.outcomes.dtype == np.uint8)
        check_points(model, [getattr(run, field) for field in _POINTS])
        expect(not len(run) or int(run.index.max()) < len(values))
        runs[str(name)] = run
    section = header["section"]
    expect(isinstance(section, (str, float, int)) and bool(runs))
    return Sweep(model, header["parameter"], values, vector, section, runs)


_RETURNS = ("cycles", "modes", "times", "states")
_RELEASES = ("phases", "images", "returns", "branch", "states")


def pack_returns(found: Returns, arrays: Arrays) -> Header:
    """Return the header of the points of a solution; their arrays are added as they are."""
    arrays |= {"vector": found.vector, **{name: getattr(found, name) for name in _RETURNS}}
    return {"section": found.section, "outcome": found.outcome.name, "complete": found.complete}


def unpack_returns(model: Model, header: Header, arrays: Arrays) -> Returns:
    """Return the points of a header; errors as for a sweep."""
    check_points(model, [arrays[name] for name in _RETURNS])
    expect(arrays["vector"].shape == (len(model.parameters),))
    named = {name: arrays[name] for name in _RETURNS}
    what = Outcome[header["outcome"]], bool(header["complete"])
    return Returns(model, arrays["vector"], header["section"], what[0], **named, complete=what[1])


def pack_releases(found: ReleaseMap, arrays: Arrays) -> Header:
    """Return the header of a release map; its arrays are added as they are."""
    arrays |= {"vector": found.vector, **{name: getattr(found, name) for name in _RELEASES}}
    arrays["period"] = np.array([found.period])
    return {"mode": found.mode, "surface": found.surface, "complete": found.complete}


def unpack_releases(model: Model, header: Header, arrays: Arrays) -> ReleaseMap:
    """Return the release map of a header; errors as for a sweep."""
    check_points(model, [arrays[name] for name in _RELEASES])
    expect(arrays["vector"].shape == (len(model.parameters),) and arrays["period"].shape == (1,))
    return ReleaseMap(
        model,
        arrays["vector"],
        str(header["mode"]),
        str(header["surface"]),
        float(arrays["period"][0]),
        arrays["phases"],
        arrays["images"],
        arrays["returns"],
        arrays["branch"],
        arrays["states"],
        bool(header["complete"]),
    )


def pack_basins(found: Basins, packer: Packer) -> Header:
    """Return the header of basins; their arrays and orbits are added as they are."""
    for k, values in enumerate(found.axes.values()):
        packer.arrays[f"axis{k}"] = values
    packer.arrays |= {"vector": found.vector, "labels": found.labels, "motions": found.motions}
    packer.arrays["at"] = np.array(list(found.at.values()), dtype=np.float64)
    orbits = [packer.orbit(orbit) for orbit in found.orbits]
    return {"axes": list(found.axes), "at": list(found.at), "orbits": orbits}


def unpack_basins(model: Model, header: Header, arrays: Arrays, orbits: list[Orbit]) -> Basins:
    """Return the basins of a header; errors as for a sweep."""
    names = [str(name) for name in header["axes"]]
    axes = {name: arrays[f"axis{k}"] for k, name in enumerate(names)}
    labels, motions = arrays["labels"], arrays["motions"]
    expect(labels.shape == motions.shape == tuple(len(v) for v in axes.values()))
    expect(labels.dtype == np.int32 and motions.dtype == np.uint8)
    expect(set(names) <= set(model.states) and len(axes) == 2)
    chosen = tuple(orbits[k] for k in header["orbits"])
    expect(int(labels.max(initial=-1)) < len(chosen))
    at = dict(zip(header["at"], arrays["at"].tolist(), strict=True))
    return Basins(model, axes, arrays["vector"], at, chosen, labels, motions)


def pack_stable_set(found: StableSet, packer: Packer) -> Header:
    """Return the header of a stable set; its arrays are added as they are."""
    for k in range(2):
        packer.arrays[f"half{k}"] = found.states[k]
        packer.arrays[f"breaks{k}"] = found.breaks[k]
    packer.arrays["phase"] = np.array([found.phase])
    return {"orbit": packer.orbit(found.orbit), "ends": [end.name for end in found.ends]}


def unpack_stable_set(header: Header, arrays: Arrays, orbits: list[Orbit]) -> StableSet:
    """Return the stable set of a header; errors as for a sweep."""
    halves, breaks = (arrays["half0"], arrays["half1"]), (arrays["breaks0"], arrays["breaks1"])
    for half, gaps in zip(halves, breaks, strict=True):
        expect(half.ndim == 2 and half.shape[1] == 2 and len(half) > 0)
        expect(not len(gaps) or 0 < int(gaps.min()) <= int(gaps.max()) < len(half))
    one, other = (StableEnd[name] for name in header["ends"])
    phase = float(arrays["phase"][0])
    return StableSet(orbits[header["orbit"]], phase, halves, breaks, (one, other))


def check_points(model: Model, arrays: Iterable[NDArray[Any]]) -> None:
    """Check that arrays of points, the states last, have one row for each point."""
    *rest, states = arrays
    expect(states.ndim == 2 and states.shape[1] == len(model.states))
    for array in rest:
        expect(array.shape == (len(states),))


def expect(holds: bool) -> None:
    """Raise an error if something does not hold."""
    if not holds:
        raise ValueError("arrays do not fit each other")
