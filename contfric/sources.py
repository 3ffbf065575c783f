"""Digests of the sources that something cached was made from, and the folders that are named by them.

This module does not import numba, which takes longer than reading all sources.
"""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

from contfric.resources import user_cache

#: Text of a file whose code may be part of a kernel.
_MARK = b"contfric.compiled"
_ROOT = Path(__file__).parent


def _digest(contents: list[bytes]) -> str:
    return hashlib.sha256(b"".join(contents)).hexdigest()[:16]


def package_files() -> list[Path]:
    """Return the modules of the package; generated ones that came with the wheel are data."""
    return sorted(file for file in _ROOT.rglob("*.py") if _ROOT / "_data" not in file.parents)


@cache
def _package() -> list[bytes]:
    return [file.read_bytes() for file in package_files()]


@cache
def package_digest() -> str:
    """Return the digest of the whole package."""
    return _digest(_package())


@cache
def kernels_digest(folder: Path = _ROOT) -> str:
    """Return the digest of the sources that a kernel in ``folder`` may have been compiled from.

    A kernel may use any helper of the package, and those of its own folder.
    """
    own = [] if folder == _ROOT or _ROOT in folder.parents else sorted(folder.glob("*.py"))
    every = _package() + [file.read_bytes() for file in own]
    return _digest([text for text in every if _MARK in text])


def kernels_folder() -> Path:
    """Return the folder of the cache for what is compiled, or generated, from these sources."""
    return user_cache() / kernels_digest()
