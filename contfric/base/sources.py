"""Digests of the sources that something cached was made from, and the folders that are named by them.

This module does not import numba, which takes longer than reading all sources.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from contfric.base.resources import user_cache

#: Text of a file whose code may be part of a kernel.
_MARK = b"contfric.compiled"
_ROOT = Path(__file__).parent.parent
#: What came with a wheel next to the package: generated modules in it are not its own.
_DATA = _ROOT / "_data"


def package_files() -> list[Path]:
    """Return the modules of the package."""
    return [_ROOT / name for name in _package()]


@cache
def _package() -> dict[str, bytes]:
    """Return the sources of the package by their names; paths as objects would take twice as long."""
    found, data = {}, str(_DATA)
    for folder, below, files in os.walk(_ROOT):
        below[:] = [name for name in below if os.path.join(folder, name) != data]
        inside = folder[len(str(_ROOT)) :].replace(os.sep, "/").lstrip("/")
        for name in files:
            if name.endswith(".py"):
                with open(os.path.join(folder, name), "rb", buffering=0) as source:
                    found[f"{inside}/{name}" if inside else name] = source.read()
    return dict(sorted(found.items()))


def _digest(contents: Mapping[str, bytes]) -> str:
    found = hashlib.sha256()
    for name, content in contents.items():
        found.update(f"{name} {len(content)} ".encode() + content)
    return found.hexdigest()[:16]


@cache
def package_digest() -> str:
    """Return the digest of the whole package."""
    return _digest(_package())


@cache
def kernels_digest(folder: Path = _ROOT) -> str:
    """Return the digest of the sources that a kernel in ``folder`` may have been compiled from.

    A kernel may use any helper of the package, and those of its own folder.
    """
    every = dict(_package())
    if folder != _ROOT:
        if _ROOT in folder.parents and _DATA not in folder.parents:
            return kernels_digest()
        every |= {f"./{file.name}": file.read_bytes() for file in sorted(folder.glob("*.py"))}
    return _digest({name: text for name, text in every.items() if _MARK in text})


def kernels_folder() -> Path:
    """Return the folder of the cache for what is compiled, or generated, from these sources."""
    return user_cache() / kernels_digest()
