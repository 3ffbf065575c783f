"""A Lyapunov map to a header and arrays, and back."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from contfric.chaos.map import LyapunovMap
from contfric.chaos.tiles import TileRows, empty_tile
from contfric.models.definition import Model
from contfric.results.pack import Arrays, Header


def pack_map(lmap: LyapunovMap, arrays: Arrays) -> Header:
    """Return the header of a map; its arrays are added as they are."""
    for k, values in enumerate(lmap.axes.values()):
        arrays[f"axis{k}"] = values
    arrays["vector"] = lmap.vector
    for field in fields(TileRows):
        arrays[f"rows_{field.name}"] = getattr(lmap.rows, field.name)
    return {"axes": list(lmap.axes)}


def unpack_map(model: Model, header: Header, arrays: Arrays) -> LyapunovMap:
    """Return the map of a header.

    Raises
    ------
    ValueError, KeyError
        If arrays are missing or do not fit each other.
    """
    names = [str(name) for name in header["axes"]]
    axes = {name: arrays[f"axis{k}"] for k, name in enumerate(names)}
    rows = TileRows(**{field.name: arrays[f"rows_{field.name}"] for field in fields(TileRows)})
    shape = (*(len(values) for values in axes.values()), rows.motions.shape[2])
    like = empty_tile((shape[0], shape[1], shape[2]), len(model.states))
    for field in fields(TileRows):
        found, wanted = getattr(rows, field.name), getattr(like, field.name)
        if found.shape != wanted.shape or found.dtype != wanted.dtype:
            raise ValueError("arrays do not fit each other")
    if arrays["vector"].shape != (len(model.parameters),) or len(names) != 2:
        raise ValueError("arrays do not fit each other")
    if any(values.dtype != np.float64 for values in axes.values()):
        raise ValueError("axes are no numbers")
    for name in names:
        model.index_of(name)
    return LyapunovMap(model, axes, arrays["vector"], rows)
