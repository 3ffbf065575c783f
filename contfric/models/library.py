"""The library of models: what ships with contfric, then what installed packages offer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from contfric.base.resources import bundled_dir
from contfric.errors import ContfricError, ModelError, ParameterError, did_you_mean
from contfric.models.definition import Model
from contfric.models.paths import SUFFIXES, is_path, not_a_file

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

ENTRY_POINTS = "contfric.models"


def names() -> list[str]:
    """Return all names: the closed form first, then bundled files, then those of packages."""
    found = ["coulomb", *bundled()]
    for entry in sorted(_entries(), key=lambda e: e.name):
        folder = _folder_of(entry)
        offered = [entry.name] if folder is None else sorted(_in_folder(folder))
        found.extend(name for name in offered if name not in found)
    return found


def bundled() -> list[str]:
    """Return the names of the models whose files ship with contfric."""
    return sorted(_in_folder(bundled_dir("models")))


def find(model: Any) -> Model:
    """Return the model of a name, a path, a class or an instance of one."""
    if isinstance(model, Path) or (isinstance(model, str) and is_path(model)):
        return _read(Path(model))
    if isinstance(model, str):
        return _named(model)
    return _from_object(model, f"{model!r}")


def _named(name: str) -> Model:
    if name == "coulomb":
        from contfric.models.coulomb import coulomb

        return coulomb
    bundled = _in_folder(bundled_dir("models")).get(name)
    if bundled is not None:
        return _read(bundled)
    entries = _entries()
    for entry in entries:
        if entry.name == name and _folder_of(entry) is None:
            return _from_object(_loaded(entry), f"entry point '{name}'")
    for entry in entries:
        folder = _folder_of(entry)
        if folder is not None and name in (files := _in_folder(folder)):
            return _read(files[name])
    raise ParameterError(
        f"unknown model '{name}'{did_you_mean(str(name), names())}. {not_a_file(name)}"
    )


def _entries() -> list[EntryPoint]:
    from importlib.metadata import entry_points

    return list(entry_points(group=ENTRY_POINTS))


def _read(path: Path) -> Model:
    """Build the model of a file; the closed form needs nothing of what reads one."""
    from contfric.models.reading.files import read_model

    return read_model(path)


def _in_folder(folder: Path) -> dict[str, Path]:
    """Return the models of a folder: the stems of its YAML files."""
    return {p.stem: p for p in sorted(folder.iterdir()) if p.suffix in SUFFIXES}


def _loaded(entry: EntryPoint) -> Any:
    """Load an entry point; a function is called for what it returns."""
    try:
        found = entry.load()
        return found() if callable(found) and not isinstance(found, type) else found
    except ContfricError:
        raise
    except Exception as error:  # the code of another package: any kind of failure is its own
        raise ModelError(
            f"the entry point '{entry.name}' of {ENTRY_POINTS} ({entry.value}) cannot be loaded: "
            f"{type(error).__name__}: {error}"
        ) from error


def _folder_of(entry: EntryPoint) -> Path | None:
    """Return the folder that an entry point gives; a broken entry must not hide the others."""
    try:
        found = _loaded(entry)
    except ContfricError:
        return None
    if isinstance(found, (str, Path)) and Path(found).is_dir():
        return Path(found)
    return None


def _from_object(found: Any, what: str) -> Model:
    from contfric.models.reading.oscillator import OscillatorModel, model_of_class

    if isinstance(found, Model):
        return found
    if isinstance(found, (str, Path)):
        return _read(Path(found))
    if isinstance(found, type) and issubclass(found, OscillatorModel):
        return model_of_class(found())
    if isinstance(found, OscillatorModel):
        return model_of_class(found)
    raise ModelError(
        f"{what} is no model: give a name, the path of a YAML file, a Model, or a class of "
        "contfric.OscillatorModel"
    )
