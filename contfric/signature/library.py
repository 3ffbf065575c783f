"""The library of signatures: files that ship with contfric or with installed packages.

A package adds a folder of signature files by the entry point group ``contfric.signatures``; the
entry is the path of the folder, or a function that returns it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from types import MappingProxyType

from contfric.base.resources import bundled_dir
from contfric.base.yaml_lines import read_yaml
from contfric.errors import NotationError, ParameterError, did_you_mean, shown
from contfric.models import Model
from contfric.models.paths import SUFFIXES

ENTRY_POINTS = "contfric.signatures"


def signature_names(model: str | Model | None = None) -> list[str]:
    """Return the names (stems of the files) of the library, sorted.

    Parameters
    ----------
    model : str or Model, optional
        Keep those of this model only.

    Examples
    --------
    >>> signature_names("coulomb")[:3]
    ['0s', '1a', '1a-9seg']
    """
    given: object = model  # whatever the user gave
    if given is not None and not isinstance(given, (str, Model)):
        raise ParameterError(f"model is a name or a Model, got {shown(given)}")
    wanted = _model_name(model)
    kept = (path for path in _files() if wanted in (None, _entry(path, "model")))
    return sorted({path.stem for path in kept})


def signature_path(name: str, model: str | Model | None = None) -> Path:
    """Return the file of a signature, by its stem (``2a-14seg``) or its name (``2a, 14seg``).

    Parameters
    ----------
    model : str or Model, optional
        Prefer a signature of this model where several have the name.

    Raises
    ------
    NotationError
        If there is no such signature.

    Examples
    --------
    >>> signature_path("2a, 14seg").name
    '2a-14seg.yaml'
    """
    wanted = _model_name(model)
    other_model: Path | None = None
    unreadable: list[str] = []
    for path in _files():
        known = _entry(path, "name")
        if known is None:
            unreadable.append(str(path))
        if name in (path.stem, known):
            if wanted in (None, _entry(path, "model")):
                return path
            other_model = other_model or path
    if other_model is not None:
        return other_model
    broken = f". Unreadable: {', '.join(unreadable)}" if unreadable else ""
    hint = did_you_mean(name, signature_names())
    raise NotationError(f"unknown signature '{name}'{hint}{broken}")


def _model_name(model: str | Model | None) -> str | None:
    return model.name if isinstance(model, Model) else model


def _entry(path: Path, key: str) -> str | None:
    """Return one entry of a file, or None: a broken file must not hide the others."""
    try:
        found = path.stat()
    except OSError:
        return None
    value = _content(path, found.st_mtime_ns, found.st_size).get(key)
    return value if isinstance(value, str) else None


@cache
def _content(path: Path, _written: int, _size: int) -> Mapping[str, object]:
    """Return what stands in a file of the library, empty if it is broken; read again when it changes."""
    try:
        return MappingProxyType(dict(read_yaml(path).data))
    except NotationError:
        return MappingProxyType({})


def _files() -> Iterator[Path]:
    """Yield all files of the library; bundled ones first, so that a plugin cannot replace one."""
    for folder in _folders():
        yield from sorted(path for path in folder.iterdir() if path.suffix in SUFFIXES)


def _folders() -> Iterator[Path]:
    from importlib.metadata import entry_points  # takes long to load, and a run seldom asks

    yield bundled_dir("signatures")
    for entry in entry_points(group=ENTRY_POINTS):
        loaded = entry.load()
        folder = loaded() if callable(loaded) else loaded
        if not isinstance(folder, (str, Path)) or not Path(folder).is_dir():
            raise NotationError(
                f"entry point '{entry.name}' of {ENTRY_POINTS} gives no folder: {folder!r}"
            )
        yield Path(folder)
