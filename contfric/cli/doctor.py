"""``contfric doctor``: what is compiled, for which processor, and where it lies; and Python's bytecode."""

from __future__ import annotations

import argparse
import platform
import py_compile
import sys
from contextlib import suppress
from importlib import import_module
from importlib.util import cache_from_source
from pathlib import Path

from contfric.base.sources import package_files
from contfric.cli.exits import Exit
from contfric.cli.progress import ProgressLine

#: What runs and their figures begin with, each loading what it needs.
_LOADED = (
    "contfric.study.run",
    "contfric.study.drawings",
    "contfric.plot.diagrams.diagram",
    "contfric.plot.orbits.orbit",
)


def doctor(options: argparse.Namespace) -> int:
    """Report the state of kernels and bytecode; compile what is missing or damaged if asked to."""
    import llvmlite
    import numba

    from contfric import __version__
    from contfric.base.resources import SHIPPED_KERNELS
    from contfric.base.sources import kernels_folder
    from contfric.compiling.targets import target
    from contfric.shipping.ahead import (
        can_keep,
        compile_missing,
        duration,
        every_kernel,
        missing,
        waiting,
    )
    from contfric.shipping.shipped import describe

    absent = missing()
    count = len(every_kernel())
    if options.compile and absent:
        with ProgressLine() as show:
            show(waiting(absent, len(absent), options.workers))
            compile_missing(options.workers, show)
        absent = missing()
    stale, modules = stale_bytecode()
    if options.compile and stale:
        write_bytecode(stale)
        stale, modules = stale_bytecode()
    kept = [kernel.kept() for kernel in every_kernel().values()]
    shipped = sum(file is not None and SHIPPED_KERNELS in file.parents for file in kept)
    lines = {
        "contfric": f"{__version__}, Python {platform.python_version()}, numba {numba.__version__}, "
        f"llvmlite {llvmlite.__version__}",
        "processor": f"{target().processor} ({platform.machine()})",
        "wheel": describe(),
        "cache": str(kernels_folder()),
        "kernels": f"{count - len(absent)} of {count} compiled, {shipped} of them with the wheel",
        "bytecode": f"{modules - len(stale)} of {modules} modules",
    }
    for name, text in lines.items():
        print(f"{name:10} {text}")
    if absent:
        hint = (
            f"contfric doctor --compile compiles them now ({duration(absent, options.workers)}), "
            "else who needs one waits for it"
            if can_keep()
            else "the cache cannot be written: kernels are compiled in every process, slower"
        )
        print(f"{'':10} {hint}")
    if stale:
        hint = "contfric doctor --compile writes it, else each process compiles these modules again"
        print(f"{'':10} {hint}")
    return Exit.FAILED if options.compile and absent and can_keep() else Exit.DONE


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
