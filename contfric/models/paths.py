"""What names a model, a signature or a study: the path of a file, or a name.

Reading a file takes far more to import.
"""

from __future__ import annotations

from pathlib import Path

SUFFIXES = (".yaml", ".yml")


def is_path(name: str | Path) -> bool:
    """Return whether this is the path of a file, not a name: of a text, if it has the suffix, or a folder."""
    return isinstance(name, Path) or name.endswith(SUFFIXES) or "/" in name or "\\" in name


def relative_name(name: str, file: Path) -> str | Path:
    """Return a name as it is, and the path of a file as seen from another file's folder.

    Examples
    --------
    >>> relative_name("coulomb", Path("studies/a.yaml"))
    'coulomb'
    """
    return file.parent / name if is_path(name) else name
