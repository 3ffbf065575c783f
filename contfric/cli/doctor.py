"""``contfric doctor``: what is compiled, for which processor, and where it lies."""

from __future__ import annotations

import argparse
import platform

from contfric.cli.exits import Exit
from contfric.cli.progress import ProgressLine


def doctor(options: argparse.Namespace) -> int:
    """Report the state of the kernels; compile what is missing or damaged if asked to."""
    import llvmlite
    import numba

    from contfric import __version__
    from contfric.ahead import can_keep, compile_missing, every_kernel, missing, waiting
    from contfric.shipped import describe
    from contfric.sources import kernels_folder
    from contfric.targets import target

    absent = missing()
    count = len(every_kernel())
    if options.compile and absent:
        with ProgressLine() as show:
            show(waiting(absent, len(absent), options.workers))
            compile_missing(options.workers, show)
        absent = missing()
    lines = {
        "contfric": f"{__version__}, Python {platform.python_version()}, numba {numba.__version__}, "
        f"llvmlite {llvmlite.__version__}",
        "processor": f"{target().processor} ({platform.machine()})",
        "wheel": describe(),
        "cache": str(kernels_folder()),
        "kernels": f"{count - len(absent)} of {count} compiled",
    }
    for name, text in lines.items():
        print(f"{name:10} {text}")
    if absent:
        hint = (
            "contfric doctor --compile compiles them now, else who needs one waits for it"
            if can_keep()
            else "the cache cannot be written: kernels are compiled in every process, slower"
        )
        print(f"{'':10} {hint}")
    return Exit.FAILED if options.compile and absent and can_keep() else Exit.DONE
