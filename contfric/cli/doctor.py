"""``contfric doctor``: what is compiled, for which processor, and where it lies."""

from __future__ import annotations

import argparse
import platform
from pathlib import Path

from contfric.cli.exits import Exit
from contfric.cli.progress import ProgressLine


def doctor(options: argparse.Namespace) -> int:
    """Report the state of the kernels; throw away damaged ones, and compile what is missing if asked to."""
    import llvmlite
    import numba

    from contfric import __file__ as package
    from contfric import __version__
    from contfric.ahead import compile_missing, every_kernel, missing, writable
    from contfric.compiled import cache_folder, processor

    absent = missing()
    count = len(every_kernel())
    if options.compile and absent:
        with ProgressLine() as show:
            show(f"compiling the engine, once: {len(absent)} of {count} kernels")
            compile_missing(options.workers, show)
        absent = missing()
    lines = {
        "contfric": f"{__version__}, Python {platform.python_version()}, numba {numba.__version__}, "
        f"llvmlite {llvmlite.__version__}",
        "processor": f"{processor()} ({platform.machine()})",
        "cache": str(cache_folder(Path(package))),
        "kernels": f"{count - len(absent)} of {count} compiled",
    }
    for name, text in lines.items():
        print(f"{name:10} {text}")
    if absent:
        hint = (
            "contfric doctor --compile compiles them now, else who needs one waits for it"
            if writable()
            else "the cache cannot be written: kernels are compiled in every process, slower"
        )
        print(f"{'':10} {hint}")
    return Exit.FAILED if options.compile and absent and writable() else Exit.DONE
