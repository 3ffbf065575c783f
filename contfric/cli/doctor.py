"""``contfric doctor``: what is compiled, for which processor, and where it lies; and Python's bytecode."""

from __future__ import annotations

import argparse
import platform

from contfric.cli.bytecode import stale_bytecode, write_bytecode
from contfric.cli.exits import Exit
from contfric.cli.progress import ProgressLine


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
