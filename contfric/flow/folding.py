"""Whole periods before a time: the phase is folded into one period before any cosine."""

from __future__ import annotations

import math

from contfric.compiled import helper


@helper
def folded(t0, period):  # type: ignore[no-untyped-def]
    """Return the number of whole periods before a time, 0 without excitation."""
    return math.floor(t0 / period) if period > 0.0 else 0.0
