"""All kernels of the package: which are compiled, and the compilation of the others ahead of their use.

A kernel is compiled when it is first needed, or here: ``contfric doctor --compile``, which ``make setup``
calls. What belongs to one model is compiled with that model.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from fnmatch import fnmatch
from functools import cache
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path

from contfric.base.sources import kernels_folder, package_files
from contfric.compiled import Kernel
from contfric.compiling.announced import about, expected
from contfric.compiling.kept import writable

Progress = Callable[[str], None]

#: Text of a module that has kernels.
_MARK = "@kernel("
#: Kernels that share most of their helpers are compiled in one process, where a helper is typed once; the
#: groups that take longest first.
GROUPS = (
    ("bvp", "simulation", "orbit", "continuation", "curves"),
    ("flow.general.*-plain",),
    ("flow.general.*-stiff",),
    ("chaos",),
    ("flow.coded",),
    ("contfric_model_",),
)


@cache
def every_kernel() -> dict[str, Kernel]:
    """Return the kernels of the package by the names of their folders in the cache."""
    from contfric.flow.chattering import KERNELS as CHATTERING
    from contfric.flow.coded.kernels import KERNELS as CODED
    from contfric.flow.general import FlowKind, kernels_of
    from contfric.models.generated.unit import callers
    from contfric.orbit.functionals.integral_states import KERNELS as CARRYING

    found = [kernel for kind in FlowKind for kernel in kernels_of(kind)]
    found += [*CODED.values(), *CHATTERING.values(), *CARRYING.values(), *callers()]
    root = Path(__file__).parent.parent
    for file in package_files():
        if _MARK not in file.read_text(encoding="utf-8"):
            continue
        name = ".".join((root.name, *file.relative_to(root).with_suffix("").parts))
        members = vars(import_module(name)).values()
        found += [k for k in members if isinstance(k, Kernel) and k.__wrapped__.__module__ == name]
    return {kernel.name: kernel for kernel in found}


@cache
def models_kernels() -> dict[str, Kernel]:
    """Return the kernels of the bundled models by their names; models whose formulas are tables have none."""
    from contfric.models import load_model
    from contfric.models.generated.build import GeneratedFlow, kernels_of
    from contfric.models.library import bundled

    flows = [load_model(name).flow_factory for name in bundled()]
    found = [k for flow in flows if isinstance(flow, GeneratedFlow) for k in kernels_of(flow)]
    return {kernel.name: kernel for kernel in found}


def _kernels(names: Sequence[str] | None) -> dict[str, Kernel]:
    """Return kernels of the package, and of models, by their names; those of the package if None."""
    if names is None:
        return every_kernel()
    every = dict(every_kernel())
    if not every.keys() >= set(names):
        every |= models_kernels()
    return {name: every[name] for name in names}


def missing(names: Sequence[str] | None = None) -> list[str]:
    """Return the names of the kernels that have to be compiled; damaged ones have to be."""
    return [name for name, kernel in _kernels(names).items() if kernel.kept() is None]


def can_keep() -> bool:
    """Tell whether what is compiled can be kept."""
    return writable(kernels_folder())


def compile_missing(
    workers: int | None = None,
    progress: Progress | None = None,
    names: Sequence[str] | None = None,
) -> list[str]:
    """Compile what is neither in the wheel nor in the cache, in several processes; return the names.

    Nothing where the cache cannot be written: what other processes compile would be lost.

    Parameters
    ----------
    workers : number of processes; that of the processor's cores if None
    progress : called with what was done
    names : of the kernels that are wanted; those of the package if None
    """
    if not can_keep():
        return []
    absent = missing(names)
    groups: dict[int, list[str]] = {}
    for name in absent:
        groups.setdefault(_group(name), []).append(name)
    if not groups:
        return []
    # fresh processes: a fork would take over the compiler in whatever state it is
    workers = workers or os.cpu_count() or 1
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"))
    with pool:
        jobs = {pool.submit(_compile, groups[k]): groups[k] for k in sorted(groups)}
        left = list(absent)
        for job in as_completed(jobs):
            job.result()
            left = [name for name in left if name not in jobs[job]]
            if progress is not None and left:
                progress(waiting(left, len(absent), workers))
    return absent


def waiting(left: Sequence[str], count: int, workers: int | None = None) -> str:
    """Return what is said while kernels are compiled: how many are left, and for how long."""
    return f"compiling the engine, once: {len(left)} of {count} kernels left, {duration(left, workers)}"


def duration(names: Sequence[str], workers: int | None = None) -> str:
    """Return how long some kernels will take to compile."""
    return about(expected(names) / (workers or os.cpu_count() or 1))


def _group(name: str) -> int:
    short = name.removeprefix("contfric.")
    for k, patterns in enumerate(GROUPS):
        if any(fnmatch(short, f"{pattern}*") for pattern in patterns):
            return k
    return len(GROUPS)


def _compile(names: list[str]) -> None:
    kernels = _kernels(names)
    for name in names:
        kernels[name].dispatcher  # noqa: B018
