"""Tables of a run as CSV, every number to its last digit; and the table of points."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from contfric.study.wanted import Want

if TYPE_CHECKING:
    from contfric.continuation.branch import Branch
    from contfric.orbit.orbit import Orbit
    from contfric.study.read import Study


class Table(NamedTuple):
    """A table to write: its columns and its rows."""

    header: Sequence[str]
    rows: Iterable[Sequence[Any]]


#: Rows of an array that are made numbers at once.
_ROWS = 4096


def table_of(columns: Mapping[str, NDArray[Any]]) -> Table:
    """Return the table of columns of one length."""
    arrays = list(columns.values())
    parts = (
        [array[k : k + _ROWS].tolist() for array in arrays] for k in range(0, len(arrays[0]), _ROWS)
    )
    return Table(list(columns), (row for part in parts for row in zip(*part, strict=True)))


def points(study: Study, sources: Sequence[Branch | Orbit]) -> Table:
    """Return one row for each point: branch, signature, parameters, and what the study wants.

    Branches have different numbers of stops; the columns of those that a branch lacks stay empty.
    """
    tables = [_columns(study, source) for source in sources]
    names = list(dict.fromkeys(name for table in tables for name in table))
    # stop_3 of one branch comes after stop_2 of another, before what follows the stops
    stops = sorted((n for n in names if n.startswith("stop_")), key=lambda n: int(n[5:]))
    last = [n for n in names if n == "stable"]
    header = [n for n in names if n not in stops and n not in last] + stops + last
    rows = (
        (number, source.name, *row)
        for number, (source, table) in enumerate(zip(sources, tables, strict=True), start=1)
        for row in _rows(table, header)
    )
    return Table(["branch", "signature", *header], rows)


def _rows(table: dict[str, list[Any]], header: list[str]) -> Iterable[tuple[Any, ...]]:
    count = len(next(iter(table.values())))
    empty = [""] * count
    return zip(*(table.get(name, empty) for name in header), strict=True)


def _columns(study: Study, source: Branch | Orbit) -> dict[str, list[Any]]:
    """Return the columns of a branch, or of one orbit; what is not wanted is not computed."""
    params: dict[str, Any] = dict(source.params)
    columns = {name: np.atleast_1d(value).tolist() for name, value in params.items()}
    if study.wants(Want.EXTREMA):
        columns["x_max"] = np.atleast_1d(source.x_max).tolist()
        columns["x_min"] = np.atleast_1d(source.x_min).tolist()
    if study.wants(Want.ASYMMETRY):
        columns["psi"] = np.atleast_1d(source.asymmetry).tolist()
    for name in study.content.quantities:
        columns[name] = np.atleast_1d(np.asarray(source.quantity(name))).tolist()
    if study.wants(Want.STOPS):
        stops = np.atleast_2d(source.stops)
        columns |= {f"stop_{k}": x.tolist() for k, x in enumerate(stops.T, start=1)}
    if study.wants(Want.STABILITY):
        columns["stable"] = np.atleast_1d(np.asarray(source.stable)).tolist()
    return columns
