"""Python's own compiled files: where they are missing, every process compiles a thousand modules again (2 s).

``pip install`` writes them. Other installers leave it to the first run, and a Python that may not write any
(``PYTHONDONTWRITEBYTECODE``) never does. What is loaded here is what a run with figures loads.
"""

from __future__ import annotations

import py_compile
import sys
from contextlib import suppress
from importlib import import_module
from importlib.util import cache_from_source
from pathlib import Path

from contfric.base.sources import package_files

#: What runs and their figures begin with, each loading what it needs.
_LOADED = (
    "contfric.study.run",
    "contfric.study.drawings",
    "contfric.plot.diagram",
    "contfric.plot.orbit",
)


def stale_bytecode() -> tuple[list[Path], int]:
    """Return what a run loads, and all of this package, that has no valid bytecode; and the number of all.

    Bytecode is valid that is not older than its source.
    """
    for name in _LOADED:
        import_module(name)
    files = set(package_files())
    for module in list(sys.modules.values()):
        source = getattr(getattr(module, "__spec__", None), "origin", None) or ""
        if source.endswith(".py"):
            files.add(Path(source))
    return sorted(file for file in files if _is_stale(file)), len(files)


def _is_stale(file: Path) -> bool:
    try:
        return Path(cache_from_source(str(file))).stat().st_mtime < file.stat().st_mtime
    except OSError:
        return True


def write_bytecode(files: list[Path]) -> None:
    """Write what is missing; where that cannot be done nothing is said, as nothing is lost but time."""
    for file in files:
        with suppress(OSError, py_compile.PyCompileError):
            py_compile.compile(str(file), doraise=True)
