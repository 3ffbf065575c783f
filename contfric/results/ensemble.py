"""Ensembles, as header and arrays."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from contfric.ensembles.ensemble import Ensemble
from contfric.ensembles.rows import Drawn, Rows
from contfric.models.definition import Model
from contfric.results.pack import Arrays, Header
from contfric.results.response import expect


def pack_ensemble(found: Ensemble, arrays: Arrays) -> Header:
    """Return the header of an ensemble; its arrays are added as they are."""
    arrays |= {"vector": found.vector, "values": found.values, "samples": found.samples}
    arrays["range"] = np.array(found.range)
    for field in fields(Rows):
        arrays[f"rows_{field.name}"] = getattr(found.rows, field.name)
    return {
        "parameter": found.parameter,
        "row": found.row,
        "distributions": found.distributions,
        "seed": found.seed,
    }


def unpack_ensemble(model: Model, header: Header, arrays: Arrays) -> Ensemble:
    """Return the ensemble of a header.

    Raises
    ------
    ValueError, KeyError
        If arrays are missing or do not fit each other.
    """
    distributions = {str(name): str(text) for name, text in header["distributions"].items()}
    for name in (header["parameter"], *distributions):
        model.index_of(name)
    samples, values = arrays["samples"], arrays["values"]
    expect(samples.ndim == 2 and samples.shape[1] == len(distributions))
    expect(values.ndim == 1 and arrays["vector"].shape == (len(model.parameters),))
    found = {field.name: arrays[f"rows_{field.name}"] for field in fields(Rows)}
    rows = Rows.checked(found, len(samples))
    expect(rows is not None)
    assert rows is not None
    expect(int(rows.outcomes.max(initial=0)) < len(Drawn))
    expect(int(rows.orbit_index.max(initial=-1)) < len(values))
    low, high = arrays["range"].tolist()
    return Ensemble(
        model,
        str(header["parameter"]),
        (low, high),
        arrays["vector"],
        str(header["row"]),
        values,
        distributions,
        int(header["seed"]),
        samples,
        rows,
    )
