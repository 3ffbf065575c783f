"""The stationary points of an observable along one segment of an orbit, compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.after_reset import apply_reset
from contfric.compiled import allocating_helper, helper

#: Most interior stationary points of one observable in one segment; beyond it the orbit is reported
#: as not finite. A stick of 30 excitation periods has 180 of them with a third harmonic.
_MOST_TURNINGS = 256


class StationaryPoints(NamedTuple):
    """Stationary points of one observable along one segment: times after its start, and values."""

    times: FloatArray
    values: FloatArray


@allocating_helper
def stationary_workspace():  # type: ignore[no-untyped-def]
    """Return the workspace for the stationary points of one segment."""
    return StationaryPoints(np.empty(_MOST_TURNINGS), np.empty(_MOST_TURNINGS))


@helper
def find_stationary(functions, layout, i, c, z, p, last, stationary):  # type: ignore[no-untyped-def]
    """Fill the stationary points of observable c in segment i; return their number, -1 if too many."""
    after = z[i + 1] if i + 1 < z.shape[0] else last
    duration = after[0] - z[i, 0]
    if duration <= 0.0:
        return 0
    return functions.stationary(
        layout.modes[i], c, z[i, 0], z[i, 1:], duration, p, stationary.times, stationary.values
    )


@helper
def find_after_reset(functions, layout, i, c, z, p, workspace, stationary):  # type: ignore[no-untyped-def]
    """Do the same for a segment after a reset; chatter of no duration still tells whether it is pressed."""
    after, n = z[i + 1] if i + 1 < z.shape[0] else workspace.last, z.shape[1] - 1
    duration = after[0] - z[i, 0]
    apply_reset(functions, layout, i, z[i], p, workspace.none, workspace)
    begin = workspace.after_reset[n, :n]
    return functions.stationary(
        layout.modes[i], c, z[i, 0], begin, duration, p, stationary.times, stationary.values
    )
