"""Bundle the helpers of a model's affine modes, as the closed form takes them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from contfric.flow.bundle import Bundle


def linear_motion(*, entries_count: int, waves_count: int, **helpers: Callable[..., Any]) -> Bundle:
    """Return the bundle.

    Parameters
    ----------
    entries_count, waves_count : most coefficients of a mode or an observable, and number of frequencies
    helpers : what :mod:`contfric.models.linear_code` writes, and the period
    """
    return Bundle(entries_count=int(entries_count), waves_count=int(waves_count), **helpers)
