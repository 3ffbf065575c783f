"""Locations of files: those that ship with contfric, and the user's cache."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Literal, TypeAlias, get_args

from contfric.errors import ContfricError, did_you_mean

#: Kinds of files that ship with contfric.
Kind: TypeAlias = Literal["models", "signatures", "studies"]

_PACKAGE = Path(__file__).resolve().parent.parent
_PLACES: dict[str, tuple[Path, ...]] = {
    "models": (_PACKAGE / "models" / "bundled",),
    "signatures": (_PACKAGE / "_data" / "signatures", _PACKAGE.parent / "signatures"),
    "studies": (_PACKAGE / "_data" / "studies", _PACKAGE.parent / "docs" / "studies"),
}
#: Kernels that came with the wheel, if any: a folder like that of the user's cache.
SHIPPED_KERNELS = _PACKAGE / "_data" / "kernels"


def bundled_dir(kind: Kind) -> Path:
    """Return the folder of the bundled files of one kind.

    Parameters
    ----------
    kind : {"models", "signatures", "studies"}
        Which files.

    Raises
    ------
    ContfricError
        For an unknown kind, or if the installation has no such folder.

    Examples
    --------
    >>> (bundled_dir("signatures") / "1a.yaml").is_file()
    True
    """
    if kind not in _PLACES:
        raise ContfricError(f"no bundled '{kind}'{did_you_mean(str(kind), get_args(Kind))}")
    # the wheel's copy comes first: the parent of an installed package is site-packages
    for place in _PLACES[kind]:
        if place.is_dir():
            return place
    tried = " nor ".join(str(place) for place in _PLACES[kind])
    raise ContfricError(
        f"the bundled {kind} are missing (neither {tried} exists); reinstall contfric"
    )


def user_cache() -> Path:
    """Return the user's folder for what can be made again: kernels, and checkpoints of a census."""
    chosen = os.environ.get("CONTFRIC_CACHE_DIR") or os.environ.get("NUMBA_CACHE_DIR")
    if chosen:
        return Path(chosen)
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", str(Path.home())))
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME", str(Path.home() / ".cache")))
    return base / "contfric"
