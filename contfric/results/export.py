"""Results for other programs: MATLAB's files, and CSV with units."""

from __future__ import annotations

from itertools import chain
from pathlib import Path
from typing import Any, get_args

import numpy as np

from contfric.base.files import replacing, write_csv
from contfric.errors import ParameterError, path_of
from contfric.orbit.orbit import Orbit
from contfric.results.columns import Columns, Exported, events_of, points_of

_SUFFIXES = (".mat", ".csv")
#: Longest name of a field in a file of MATLAB that all its versions read.
_LONGEST = 31


def export(x: Exported, path: str | Path) -> tuple[Path, ...]:
    """Write any result for other programs: an orbit, a diagram, a sweep, basins, a fit; files are replaced.

    A file that ends with ``.mat`` has structures ``points`` and ``events`` of columns, ``units`` of both,
    ``model``, and of an orbit its parameters, signature, period, multipliers and joints. One that ends with
    ``.csv`` has the points: a row of names, a row of units (what 1 is, in units of the model's file, and
    what a shifted state is measured from; empty for text), then one row a point; ``NAME-events.csv`` next to
    it has the events. What contfric itself
    reads again is written by :func:`contfric.save`.

    Returns
    -------
    tuple of Path
        The files.

    Raises
    ------
    ParameterError
        If the object cannot be exported, or the file ends otherwise.
    ResultFileError
        If a file cannot be written.

    Examples
    --------
    >>> import contfric as cf
    >>> from tempfile import mkdtemp
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> [file.name for file in cf.export(orbit, Path(mkdtemp()) / "1a.mat")]
    ['1a.mat']
    """
    _check_kind(x)
    place = path_of("the file to export to", path)
    if place.suffix not in _SUFFIXES:
        raise ParameterError(f"files to export to end with {' or '.join(_SUFFIXES)}; got {place}")
    points, events = points_of(x), events_of(x)
    if place.suffix == ".mat":
        _write_mat(place, x, points, events)
        return (place,)
    _write_csv(place, points)
    if events is None:
        return (place,)
    other = place.with_name(f"{place.stem}-events.csv")
    _write_csv(other, events)
    return place, other


def _check_kind(x: object) -> None:
    kinds = get_args(Exported)
    if not isinstance(x, kinds):
        names = ", ".join(kind.__name__ for kind in kinds)
        raise ParameterError(f"what can be exported is one of {names}; got {type(x).__name__}")


def _write_csv(path: Path, table: Columns) -> None:
    rows = zip(*(values.tolist() for values in table.values.values()), strict=True)
    units = [table.units[name] for name in table.values]
    write_csv(path, chain([list(table.values), units], rows))


def _write_mat(path: Path, x: Exported, points: Columns, events: Columns | None) -> None:
    from scipy.io import savemat

    content: dict[str, Any] = {"model": x.model.name, "points": _struct(points.values)}
    units = dict(points.units)
    if events is not None:
        content["events"] = _struct(events.values)
        units |= events.units
    content["units"] = _struct(units)
    if isinstance(x, Orbit):
        content |= {
            "params": _struct(x.params),
            "signature": str(x.signature),
            "name": x.name,
            "period": x.period,
            "periods": x.periods,
            "multipliers": x.multipliers,
            "joints": x.joints,
        }
    with replacing(path) as temporary, temporary.open("wb") as file:
        savemat(file, content, oned_as="column", long_field_names=False)


def _struct(columns: dict[str, Any]) -> dict[str, Any]:
    """Return columns as MATLAB's structure has them: texts in cells, names that it can read."""
    return {_field(name): _cells(values) for name, values in columns.items()}


def _cells(values: Any) -> Any:
    texts = isinstance(values, np.ndarray) and values.dtype.kind == "U"
    return np.array(values, dtype=object) if texts else values


def _field(name: str) -> str:
    """Return the name of a field: letters, digits and underscores, a letter first."""
    text = "".join(c if c.isascii() and c.isalnum() else "_" for c in name)
    return (text if text[:1].isalpha() else f"p_{text}")[:_LONGEST]
