"""Old names of attributes, which work for one version more."""

from __future__ import annotations

import warnings
from typing import Any


def renamed(old: str, new: str) -> property:
    """Return a property that gives what has a new name, with a warning that says so.

    Examples
    --------
    >>> import warnings
    >>> Named = type("Named", (), {"itinerary": ("stick",), "word": renamed("word", "itinerary")})
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("ignore")
    ...     Named().word
    ('stick',)
    """

    def value(self: Any) -> Any:
        warnings.warn(f"'{old}' is now '{new}'", DeprecationWarning, stacklevel=2)
        return getattr(self, new)

    return property(value, doc=f"Old name of ``{new}``.")
