"""A folder of finished tiles, from which a map that was killed goes on.

The folder's ``map.json`` says which map it belongs to. A tile is written whole or not at all, and read only
if it fits; one that does not is computed again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from contfric.base.files import made_folder, replacing
from contfric.errors import ResultFileError
from contfric.models.definition import Model

_RECORD = "map.json"


@dataclass(frozen=True)
class TileFolder:
    """Finished tiles of one map."""

    path: Path

    def read(self, number: int) -> dict[str, np.ndarray[Any, Any]] | None:
        """Return the arrays of a finished tile, or None if it has not been finished."""
        path = self._file(number)
        if not path.is_file():
            return None
        try:
            with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
                return {name: archive[name] for name in archive.files}
        except Exception:  # the readers of zip and npy raise a dozen kinds on damaged bytes
            return None

    def write(self, number: int, arrays: Mapping[str, np.ndarray[Any, Any]]) -> None:
        """Keep a finished tile.

        Raises
        ------
        ResultFileError
            If it cannot be written.
        """
        with replacing(self._file(number)) as temporary, temporary.open("wb") as file:
            np.savez(file, **dict[str, Any](arrays))

    def _file(self, number: int) -> Path:
        return self.path / f"tile-{number:06d}.npz"


def open_tiles(folder: str | Path, record: dict[str, Any]) -> TileFolder:
    """Open a folder for the tiles of the map that ``record`` describes.

    Raises
    ------
    ResultFileError
        If it is no path, holds those of another map, or cannot be written.
    """
    path = made_folder("the folder of finished tiles", folder)
    file = path / _RECORD
    if file.is_file():
        _check_same(file, record)
    elif any(path.glob("tile-*.npz")):
        raise ResultFileError(f"{path} holds tiles without their {_RECORD}: use another folder")
    else:
        with replacing(file) as temporary:
            temporary.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    return TileFolder(path)


def _check_same(file: Path, record: dict[str, Any]) -> None:
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
        other = [key for key in record if found.get(key) != record[key]]
    except (OSError, ValueError, AttributeError) as error:
        raise ResultFileError(f"cannot read {file} ({error}): use another folder") from None
    if other:
        raise ResultFileError(
            f"{file.parent} holds the tiles of another map: its {', '.join(other)} "
            f"{'differs' if len(other) == 1 else 'differ'}. Use another folder"
        )


def digest(*arrays: np.ndarray[Any, Any] | None) -> str:
    """Return a fingerprint of some arrays, to the last bit."""
    content = hashlib.sha256()
    for array in arrays:
        if array is not None:
            content.update(repr((array.shape, array.dtype.str)).encode())
            content.update(np.ascontiguousarray(array).tobytes())
    return content.hexdigest()[:16]


def versions(model: Model) -> dict[str, Any]:
    """Return what the last digits of a tile depend on, beyond its numbers: the program and the model."""
    from importlib.metadata import version

    from contfric.base.sources import kernels_digest

    return {
        "contfric": version("contfric"),
        "kernels": kernels_digest(),
        "model": model.name,
        **({"definition": model.definition} if model.definition else {}),
    }
