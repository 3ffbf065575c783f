"""Kernels that come with the wheel: compiled when it is built, and what they fit.

``python -m contfric.shipping.shipped`` compiles them into the cache, which the wheel carries as
``contfric/_data/kernels`` (:mod:`contfric.shipping.build_hook`). With them goes a file that says what they
were compiled by and for. It is for people: which code fits is decided by the names of the files.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from fnmatch import fnmatch
from typing import Any

from contfric.base.resources import SHIPPED_KERNELS, user_cache
from contfric.base.sources import kernels_digest
from contfric.compiling.announced import forget_times
from contfric.compiling.targets import shipped_target, target
from contfric.shipping.ahead import compile_missing, every_kernel, models_kernels

_FACTS = "target.json"


def make(patterns: Sequence[str] = ("*",)) -> int:
    """Compile kernels into the cache, and write what they fit next to them; return their number.

    Parameters
    ----------
    patterns : of their names
    """
    every = {**every_kernel(), **models_kernels()}
    names = [name for name in every if any(fnmatch(name, pattern) for pattern in patterns)]
    if not names:
        raise SystemExit(
            f"no kernel is called {' or '.join(patterns)}: names are such as {min(every)}, "
            "with * for any part"
        )
    compile_missing(names=names)
    absent = [name for name in names if every[name].kept() is None]
    if absent:
        raise SystemExit(f"not compiled: {', '.join(absent)}")
    facts = {**asdict(target()), "sources": kernels_digest(), "kernels": len(names)}
    (user_cache() / _FACTS).write_text(json.dumps(facts, indent=1), encoding="utf-8")
    forget_times()
    return len(names)


def describe() -> str:
    """Return what came with the wheel, and whether it is used here; if not, why."""
    facts: dict[str, Any] = {}
    with suppress(OSError, ValueError):
        facts = json.loads((SHIPPED_KERNELS / _FACTS).read_text(encoding="utf-8"))
    if not facts:
        return "no kernels came with this installation"
    why = _why_not(facts)
    text = f"{facts.get('kernels')} kernels for {facts.get('processor')}"
    return f"{text}, not used: {why}" if why else f"{text}, used"


def _why_not(facts: Mapping[str, Any]) -> str:
    """Return why shipped kernels do not fit; nothing if they do."""
    here = shipped_target()
    if here is None:
        return "this processor lacks one of its features, or numba was told of another one"
    found = {**asdict(here), "sources": kernels_digest()}
    wrong = [key for key, value in found.items() if facts.get(key) != value]
    return "; ".join(f"{key} is {found[key]}, not {facts.get(key)}" for key in wrong)


if __name__ == "__main__":
    print(make(sys.argv[1:] or ("*",)))
