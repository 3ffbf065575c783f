"""Sweeps, return maps and basins to a header and arrays, and back."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contfric.models.definition import Model
from contfric.response.sweep import Sweep, SweepRun
from contfric.results.pack import Arrays, Header

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
