"""A cache on disk of what is derived from a model's declaration, such as its domains.

It lies next to the cached kernels, or came with the wheel: in a folder named by a digest of the whole
package, in files named by one of what was derived from.
"""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from contfric.base.checked import read_checked, write_checked
from contfric.base.resources import SHIPPED_KERNELS, user_cache
from contfric.base.sources import package_digest
from contfric.errors import ResultFileError

T = TypeVar("T")


def derived(kind: str, source: str, derive: Callable[[], T]) -> T:
    """Return what is derived from a text: read if it was derived before, else derived now, and written.

    Parameters
    ----------
    kind : what it is, in a word
    """
    name = f"{hashlib.sha256(source.encode()).hexdigest()[:32]}.{kind}"
    place = Path("models", package_digest(), name)
    for root in (SHIPPED_KERNELS, user_cache()):
        with suppress(Exception):  # missing, damaged, or what unpickling ends in
            return pickle.loads(read_checked(root / place))  # type: ignore[no-any-return]
    found, file = derive(), user_cache() / place
    with suppress(OSError, ResultFileError):  # nothing can be kept: it is derived in every process
        file.parent.mkdir(parents=True, exist_ok=True)
        write_checked(file, pickle.dumps(found))
    return found
