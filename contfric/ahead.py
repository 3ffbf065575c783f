"""All kernels of the package: which are compiled, and compiling those that are not, before anybody waits.

A kernel is compiled when it is first needed, or here: ``contfric doctor --compile``, which ``make setup``
calls. What belongs to one model is compiled with that model.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from fnmatch import fnmatch
from functools import cache
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path

from contfric.compiled import Kernel, cache_folder

Progress = Callable[[str], None]

#: Text of a module that has kernels.
_MARK = "@kernel("
#: Kernels that share most of their helpers are compiled in one process, where a helper is typed once; the
#: groups that take longest first.
_GROUPS = (
    ("orbit", "continuation", "curves"),
    ("flow.general.*-plain",),
    ("flow.general.*-stiff",),
    ("chaos",),
    ("flow.coded",),
)


@cache
def every_kernel() -> dict[str, Kernel]:
    """Return the kernels of the package by the names of their folders in the cache."""
    from contfric.flow.coded.kernels import KERNELS
    from contfric.flow.general import Kind, kernels_of

    found = [*(kernel for kind in Kind for kernel in kernels_of(kind)), *KERNELS.values()]
    root = Path(__file__).parent
    for file in sorted(root.rglob("*.py")):
        if _MARK not in file.read_text(encoding="utf-8"):
            continue
        name = ".".join((root.name, *file.relative_to(root).with_suffix("").parts))
        members = vars(import_module(name)).values()
        found += [k for k in members if isinstance(k, Kernel) and k.__wrapped__.__module__ == name]
    return {kernel.name: kernel for kernel in found}


def missing() -> list[str]:
    """Return the names of the kernels that are not in the cache; damaged ones are thrown away."""
    return [name for name, kernel in every_kernel().items() if not kernel.cached()]


def writable() -> bool:
    """Tell whether what is compiled can be kept."""
    folder = cache_folder(Path(__file__))
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


def compile_missing(workers: int | None = None, progress: Progress | None = None) -> list[str]:
    """Compile what is not in the cache, in several processes; return the names.

    Nothing where the cache cannot be written: what other processes compile would be lost.

    Parameters
    ----------
    workers : number of processes; that of the processor's cores if None
    progress : called with what was done
    """
    if not writable():
        return []
    names = missing()
    groups: dict[int, list[str]] = {}
    for name in names:
        groups.setdefault(_group(name), []).append(name)
    if not groups:
        return []
    # fresh processes: a fork would take over the compiler in whatever state it is
    pool = ProcessPoolExecutor(workers or os.cpu_count(), mp_context=get_context("spawn"))
    with pool:
        jobs = [pool.submit(_compile, groups[k]) for k in sorted(groups)]
        done = 0
        for job in as_completed(jobs):
            done += job.result()
            if progress is not None:
                progress(f"compiling the engine, once: {done} of {len(names)} kernels")
    return names


def _group(name: str) -> int:
    short = name.removeprefix("contfric.")
    for k, patterns in enumerate(_GROUPS):
        if any(fnmatch(short, f"{pattern}*") for pattern in patterns):
            return k
    return len(_GROUPS)


def _compile(names: list[str]) -> int:
    for name in names:
        every_kernel()[name].dispatcher  # noqa: B018
    return len(names)
