"""A folder of finished tiles, from which a map that was killed goes on.

The folder's ``map.json`` says which map it belongs to. A tile is written whole or not at all, and read only
if it fits; one that does not is computed again.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from contfric.chaos.tiles import Tile, TileRows, empty_tile
from contfric.errors import ResultFileError
from contfric.files import replacing, unwritable

_RECORD = "map.json"


@dataclass(frozen=True)
class TileFolder:
    """Finished tiles of one map."""

    path: Path

    def read(self, number: int, tile: Tile) -> TileRows | None:
        """Return a finished tile, or None if it has not been finished."""
        path = self._file(number)
        if not path.is_file():
            return None
        like = empty_tile(tile.shape, len(tile.model.states))
        try:
            with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
                found = {field.name: archive[field.name] for field in fields(TileRows)}
        except Exception:  # the readers of zip and npy raise a dozen kinds on damaged bytes
            return None
        for name, array in found.items():
            wanted = getattr(like, name)
            if array.shape != wanted.shape or array.dtype != wanted.dtype:
                return None
        return TileRows(**found)

    def write(self, number: int, rows: TileRows) -> None:
        """Keep a finished tile.

        Raises
        ------
        ResultFileError
            If it cannot be written.
        """
        with replacing(self._file(number)) as temporary, temporary.open("wb") as file:
            np.savez(file, **{field.name: getattr(rows, field.name) for field in fields(rows)})

    def _file(self, number: int) -> Path:
        return self.path / f"tile-{number:06d}.npz"


def open_tiles(path: Path, record: dict[str, Any]) -> TileFolder:
    """Open a folder for the tiles of the map that ``record`` describes.

    Raises
    ------
    ResultFileError
        If it holds those of another map, or cannot be written.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ResultFileError(unwritable(path, error)) from error
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
