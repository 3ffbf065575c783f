"""Tells a path from a name, for models, signatures and studies.

Apart from the modules that read files, since these import far more.
"""

from __future__ import annotations

import os
from pathlib import Path

from contfric.errors import did_you_mean

SUFFIXES = (".yaml", ".yml")


def is_path(name: str | Path) -> bool:
    """Return whether this is the path of a file, not a name: of a text, if it has the suffix, or a folder."""
    return isinstance(name, Path) or name.endswith(SUFFIXES) or "/" in name or "\\" in name


def not_a_file(name: str) -> str:
    """Return what is said of an unknown name: how the path of a YAML file is told from a name.

    Examples
    --------
    >>> not_a_file("mine"), not_a_file("mine.txt")
    ('A file needs its suffix: mine.yaml', 'A file needs the suffix .yaml or .yml')
    """
    if os.path.isdir(name):  # False for a text that is no path at all
        return f"{name} is a folder: give the YAML file in it"
    if Path(name).suffix:
        return f"A file needs the suffix {' or '.join(SUFFIXES)}"
    return f"A file needs its suffix: {name}{SUFFIXES[0]}"


def no_file(path: Path, what: str) -> str:
    """Return why a path is not that of a YAML file that can be read; empty if it is.

    Examples
    --------
    >>> no_file(Path("."), "a model")
    '. is a folder; give the YAML file of a model'
    """
    if path.is_file():
        return ""
    if path.is_dir():
        return f"{path} is a folder; give the YAML file of {what}"
    near = [p.name for p in path.parent.glob("*.y*ml")] if path.parent.is_dir() else []
    return f"there is no file {path}{did_you_mean(path.name, sorted(near)) if near else ''}"


def relative_name(name: str, file: Path) -> str | Path:
    """Return a name as it is, and the path of a file as seen from another file's folder.

    Examples
    --------
    >>> relative_name("coulomb", Path("studies/a.yaml"))
    'coulomb'
    """
    return file.parent / name if is_path(name) else name
