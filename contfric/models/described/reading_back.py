"""The description that a definition is the text of, and that of plain data.

The schema stands above this package, and is loaded where a model is read that was not read before.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from contfric.errors import ModelError
from contfric.models.described.description import Description
from contfric.remember.derived import derived


@lru_cache(maxsize=16)
def from_text(text: str) -> Description:
    """Read a description that :attr:`Description.text` wrote; one that was read before, from disk.

    Raises
    ------
    ModelError
        If it is no description.
    """
    return derived("description", text, lambda: _from_text(text))


def _from_text(text: str) -> Description:
    try:
        data = json.loads(text)
    except ValueError as error:
        raise ModelError(f"the definition of the model is damaged: {error}") from None
    if not isinstance(data, dict):
        raise ModelError("the definition of the model is damaged: it is no mapping")
    return described(data)


def described(data: Mapping[str, Any]) -> Description:
    """Read and check data in the schema of the YAML files (:mod:`contfric.models.reading.schema`).

    Raises
    ------
    EntryError
        For the first mistake, with the address of its entry.
    """
    from contfric.models.reading.describe import describe

    return describe(data)
