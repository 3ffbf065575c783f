"""One scene in a fresh process, step by step: ``python scene_probe.py STUDY FOLDER`` prints JSON.

What a run imports is imported in the order in which it would be, each part on the clock; kernels are timed
as they are compiled or loaded. The rest is the command line as it is.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any

from scale_memory import peak

#: Modules whose presence at the end tells what was loaded.
WATCHED = (
    "numba",
    "scipy",
    "scipy.linalg",
    "matplotlib",
    "matplotlib.pyplot",
    "mpl_toolkits.mplot3d",
    "networkx",
    "pandas",
    "pydantic",
    "yaml",
)


def timed(seconds: dict[str, float], name: str, call: Callable[[], Any]) -> Any:
    """Call, and add the time to a part."""
    start = time.perf_counter()
    try:
        return call()
    finally:
        seconds[name] = seconds.get(name, 0.0) + time.perf_counter() - start


def watch_kernels(seconds: dict[str, float]) -> None:
    """Time each kernel that is compiled or loaded; its helpers count for the first that calls them."""
    from contfric.compiled import Kernel

    load = Kernel.dispatcher.func

    def named(self: Any) -> Any:
        function = self.__wrapped__
        name = f"{function.__module__.rsplit('.', 1)[1]}.{function.__name__}"
        return timed(seconds, name, lambda: load(self))

    watched = cached_property(named)
    watched.__set_name__(Kernel, "dispatcher")
    Kernel.dispatcher = watched  # type: ignore[method-assign, assignment]


def watch_calls(calls: dict[str, int]) -> None:
    """Count the calls of each kernel from Python."""
    from contfric.compiled import Kernel

    find = Kernel.entry.func

    def counted(self: Any) -> Any:
        entry, name = find(self), self.__wrapped__.__name__

        def call(*arguments: Any) -> Any:
            calls[name] = calls.get(name, 0) + 1
            return entry(*arguments)

        return call

    watched = cached_property(counted)
    watched.__set_name__(Kernel, "entry")
    Kernel.entry = watched  # type: ignore[method-assign, assignment]


def imported(study: str) -> dict[str, float]:
    """Import what the scene needs, part by part; return the seconds of each."""
    seconds: dict[str, float] = {}

    def load(part: str, *names: str) -> None:
        timed(seconds, part, lambda: [import_module(name) for name in names])

    load("contfric", "contfric")
    load("numpy", "numpy")
    load("pydantic, yaml", "yaml", "pydantic")
    load("study, results, orbit", "contfric.study.run")
    from contfric.study import read_study

    if timed(seconds, "reading the study", lambda: read_study(study)).drawings:
        load("matplotlib", "matplotlib.figure")
    load("numba", "numba")
    return seconds


def main(study: str, folder: str) -> dict[str, Any]:
    """Run a scene, and report."""
    began, start = time.time(), time.perf_counter()
    imports = imported(study)
    kernels: dict[str, float] = {}
    calls: dict[str, int] = {}
    watch_kernels(kernels)
    watch_calls(calls)
    from contfric.cli import main as command_line

    if failed := command_line(["run", study, "--out", folder, "--force", "--quiet"]):
        raise SystemExit(failed)  # run.json may be there, from a run before
    inside = time.perf_counter() - start
    record = json.loads((Path(folder) / "run.json").read_text(encoding="utf-8"))
    return {
        **{key: record[key] for key in ("timings", "counts", "skipped")},
        **{"began": began, "inside": inside, "ended": time.time()},
        **{"imports": imports, "kernels": kernels, "calls": calls},
        "modules": {name: name in sys.modules for name in WATCHED},
        "module_count": len(sys.modules),
        "peak": peak(),
    }


if __name__ == "__main__":
    print(json.dumps(main(sys.argv[1], sys.argv[2])))
