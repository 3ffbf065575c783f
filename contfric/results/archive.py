"""One file per result: an uncompressed npz of plain arrays, with a JSON header among them.

Nothing in it is executed when it is read (no pickle). A list of digests of all arrays and of the header is
among them: what is not as it was written is refused. The header says what the file holds, the
version of the format, and the name of the model, from which the equations are rebuilt; of a user's model
it has the definition, too. The result itself is in ``content`` and, what is large, in arrays that have the
names of its fields (:mod:`contfric.results.codec`).
"""

from __future__ import annotations

import hashlib
import json
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from contfric.base.files import replacing
from contfric.errors import ModelError, ParameterError, ResultFileError, path_of
from contfric.models import load_model
from contfric.models.definition import Model
from contfric.remember.stored import UnstorableError
from contfric.results.codec import Arrays, ResultReader, ResultWriter

if TYPE_CHECKING:
    from contfric.atlas.diagram import Diagram
    from contfric.atlas.plane.plane import Plane
    from contfric.chaos.map import LyapunovMap
    from contfric.continuation.branch import Branch
    from contfric.curves.curve import Curve
    from contfric.curves.of_quantities.curve import QuantityCurve
    from contfric.ensembles.ensemble import Ensemble
    from contfric.equilibria.branch import EquilibriumBranch
    from contfric.equilibria.explore import EquilibriumDiagram
    from contfric.fitting.result import Fit
    from contfric.orbit.orbit import Orbit
    from contfric.response.basins import Basins
    from contfric.response.returns import ReleaseMap, Returns
    from contfric.response.stable_set import StableSet
    from contfric.response.sweep import Sweep
    from contfric.simulation.simulate import Trajectory

#: By name: to write one kind of result, those of the others are not loaded.
Saveable: TypeAlias = (
    "Orbit | Branch | Diagram | Curve | QuantityCurve | Plane | Trajectory | LyapunovMap | Sweep | Returns "
    "| ReleaseMap | Basins | StableSet | EquilibriumBranch | EquilibriumDiagram | Ensemble | Fit"
)
_KINDS = tuple(str(Saveable).split(" | "))

#: Version of the format; it grows when this contfric cannot read what an earlier one has written.
FORMAT = 3

_MARK = "contfric result"
#: What :func:`contfric.export` writes: a result in a file of that name could not be read as one.
_TABLES = (".csv", ".mat")
_HEADER, _CONTENT, _DIGESTS = "header", "content", "digests"
#: Bytes of a digest: damage by chance is missed once in 2**128 times.
_SIZE = 16
#: Arrays that a message names.
_NAMED = 3
#: What reading a header that is not ours ends in.
_DAMAGE = (ValueError, LookupError, TypeError, AttributeError)


def save(x: Saveable, path: str | Path) -> None:
    """Write a result (an orbit, a diagram, a Lyapunov map, a sweep, ...) to a file, which is replaced.

    Raises
    ------
    ResultFileError
        If the file cannot be written, or the object cannot be saved.
    ParameterError
        If the file has the suffix of another format.

    Examples
    --------
    >>> import contfric as cf
    >>> from tempfile import mkdtemp
    >>> file = Path(mkdtemp()) / "1a.npz"
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> cf.save(orbit, file)
    >>> bool((cf.load(file).joints == orbit.joints).all())
    True
    """
    if not _is_result(x):
        raise ResultFileError(
            f"only results can be saved ({', '.join(_KINDS)}), got {type(x).__name__}"
        )
    place = path_of("the file of a result", path)
    if place.suffix in _TABLES:
        raise ParameterError(f"cf.save writes .npz files, got {place}: for a table call cf.export")
    writer = ResultWriter(x.model)
    try:
        content = writer.bytes_of(x)
    except UnstorableError as error:
        raise ResultFileError(f"this {type(x).__name__} cannot be saved: {error}") from None
    header = {
        "mark": _MARK,
        "format": FORMAT,
        "kind": type(x).__name__,
        "definition": x.model.definition,
        **_told_apart(x.model),
    }
    arrays = {_HEADER: _as_array(header), _CONTENT: np.frombuffer(content, dtype=np.uint8)}
    arrays |= writer.large
    arrays[_DIGESTS] = _as_array(_digests(arrays))
    with replacing(place) as temporary:
        _write(temporary, arrays)


def _is_result(x: object) -> bool:
    ours = (kind for kind in type(x).__mro__ if kind.__module__.startswith("contfric."))
    return any(kind.__name__ in _KINDS for kind in ours)


def _write(path: Path, arrays: Arrays) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        for name, array in arrays.items():
            # without the time: the same result is the same file
            entry = zipfile.ZipInfo(f"{name}.npy")
            with archive.open(entry, "w", force_zip64=True) as file:
                np.lib.format.write_array(file, array, allow_pickle=False)


def _as_array(data: Any) -> NDArray[np.uint8]:
    return np.frombuffer(json.dumps(data).encode(), dtype=np.uint8)


def _digests(arrays: Arrays) -> dict[str, str]:
    """Return a digest of each array: of its type, its shape and its bytes."""
    found = {}
    for name, array in arrays.items():
        content = hashlib.sha256(f"{array.dtype.str}{array.shape}".encode())
        if array.size:
            content.update(np.ascontiguousarray(array).data)
        found[name] = content.hexdigest()[: 2 * _SIZE]
    return found


def _changed(arrays: Arrays) -> str:
    """Take the digests from the arrays of a file, and say what does not fit to them; empty if all does."""
    listed = arrays.pop(_DIGESTS, None)
    if listed is None:
        return "it has no digests of its arrays"
    try:
        wanted = dict(json.loads(bytes(listed).decode()))
    except (ValueError, TypeError):
        return "its list of digests cannot be read"
    found = _digests(arrays)
    return "; ".join(
        f"{what}: {', '.join(names[:_NAMED])}{', ...' if len(names) > _NAMED else ''}"
        for what, names in (
            ("missing", [n for n in wanted if n not in found]),
            ("of another file", [n for n in found if n not in wanted]),
            ("not as it was written", [n for n in found if wanted.get(n, found[n]) != found[n]]),
        )
        if names
    )


def load(path: str | Path, model: Model | None = None) -> Saveable:
    """Read what :func:`save` wrote.

    Parameters
    ----------
    model : Model, optional
        The model of the file; needed for one that is not known by its name.

    Returns
    -------
    Orbit, Branch, Diagram or other result
        The same numbers as were saved, to the last bit.

    Raises
    ------
    ResultFileError
        If the file is missing, damaged, of another program, or of a newer contfric.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> import pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder) / "orbit.npz"
    ...     cf.save(orbit, file)
    ...     print(cf.load(file).name)
    1a
    """
    path = path_of("the file of a result", path)
    arrays = _read(path)
    listed = _DIGESTS in arrays
    changed = _changed(arrays)
    if listed and changed:
        raise ResultFileError(_damaged(path, changed))
    try:
        header = json.loads(bytes(arrays.pop(_HEADER)).decode())
        if header["mark"] != _MARK:
            raise ValueError("the header is not one of contfric")
    except _DAMAGE:
        raise ResultFileError(
            f"{path} was not written by contfric: give a file of cf.save"
        ) from None
    if header.get("format") != FORMAT:
        raise ResultFileError(
            f"{path} is in format {header.get('format')}, this contfric reads format {FORMAT}: "
            "read it with the version that wrote it, or run its study again"
        )
    if changed:
        raise ResultFileError(_damaged(path, changed))
    owner = _owner(path, header, model)
    try:
        found = ResultReader(bytes(arrays.pop(_CONTENT)), owner, arrays).value()
    except (UnstorableError, LookupError) as error:
        raise ResultFileError(_damaged(path, str(error))) from None
    if not _is_result(found):
        raise ResultFileError(_damaged(path, "it holds no result"))
    return cast("Saveable", found)


def _read(path: Path) -> Arrays:
    if path.exists() and not path.is_file() and not path.is_dir():
        raise ResultFileError(f"cannot read {path}: it is no ordinary file")
    try:
        # an npz is a zip; anything else np.load would try to read in other ways
        with path.open("rb") as file:
            if file.read(2) != b"PK":
                if path.suffix != ".npz":
                    raise ResultFileError(
                        f"{path} is no file of results: cf.load reads .npz files, which cf.save and "
                        "runs write; cf.load_model reads models, cf.run_study studies"
                    )
                raise zipfile.BadZipFile("it is no npz file")
            file.seek(0)
            with np.load(file, allow_pickle=False) as archive:
                return {name: archive[name] for name in archive.files}
    except ResultFileError:
        raise
    except OSError as error:
        raise ResultFileError(f"cannot read {path}: {error.strerror or error}") from None
    except Exception as error:  # the readers of zip and npy raise a dozen kinds on damaged bytes
        raise ResultFileError(_damaged(path, f"{type(error).__name__}: {error}")) from None


def _damaged(path: Path, what: str) -> str:
    text = " ".join(what.split())
    return f"{path} is damaged or incomplete ({text}): restore a copy, or run its study again"


def _model_of(header: dict[str, Any]) -> Model:
    """Return the model of a file: from its own definition if it has one, else by its name."""
    definition = header.get("definition")
    if not definition:
        return load_model(header["model"])
    from contfric.models.reading.files import model_of

    return model_of(definition)


def _owner(path: Path, header: dict[str, Any], model: Model | None) -> Model:
    name = header["model"]
    try:
        owner = _model_of(header) if model is None else model
    except ModelError as error:
        raise ResultFileError(
            f"{path} holds a definition of its model '{name}' that this contfric cannot read: {error}. "
            "Pass load(..., model=...), or run its study again"
        ) from None
    except ParameterError as error:
        raise ResultFileError(
            f"{path} holds results of the model '{name}', which is not installed ({error}): "
            "install the package that offers it, or pass load(..., model=...)"
        ) from None
    for key, value in _told_apart(owner).items():
        if header[key] != value:
            raise ResultFileError(
                f"{path} was written for {key} {header[key]}, not {value}: give its own model, or run its "
                "study again"
            )
    return owner


def _told_apart(model: Model) -> dict[str, Any]:
    """Return what a file says of its model."""
    return {
        "model": model.name,
        "parameters": list(model.parameter_names),
        "states": list(model.states),
    }
