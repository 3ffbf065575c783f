"""Rates that have no slope at a surface, such as the root of a height that vanishes there.

Solutions come to the surface, and neither they nor their derivatives are followed from there: those of a
super-twisting controller ``-k*sqrt(abs(s))*sign(s)``, of a tank that runs dry.
"""

from __future__ import annotations

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.models.check.probe import Probe
from contfric.models.check.report import ModelReport, Topic

#: States on a surface that are tried.
_TRIED = 12
#: Distances from the surface: above the accuracy to which a state lies on it, and near it.
_NEAR, _FAR = 1e-9, 1e-5
#: How much more the slopes are at the near one: those of a root are a hundred times as large, those of a
#: root that is smooth over 1e-6 (which is solved) seven times, those of other functions nearly the same.
_GROWS = 20.0


def check_roots(report: ModelReport, probe: Probe) -> None:
    """Check that rates have slopes next to the surfaces at which a mode ends."""
    if not probe.model.definition:
        return
    for surface in (s.name for s in probe.model.surfaces if probe.model.cuts(s.name)):
        for t, y in probe.on(surface, _TRIED):
            for mode, side in _modes_around(probe, surface, t, y):
                if _grows(probe, mode, surface, side, t, y):
                    whole = probe.model.whole_mode(mode)
                    report.warn(
                        Topic.CONTINUITY,
                        f"the rates of mode '{whole}' have no slope on surface '{surface}' (as of a root): a "
                        "solution that meets it, or starts there, is said to diverge. Put something smooth "
                        "in the place of the root, such as x/sqrt(abs(x) + 1.0e-6) for sqrt(abs(x))*sign(x)",
                    )
                    return


def _modes_around(probe: Probe, surface: str, t: float, y: FloatArray) -> list[tuple[str, int]]:
    """Return the modes next to a place on a surface, with the sides on which they are."""
    signs = probe.signs(t, y)
    return [
        (mode.name, side)
        for mode in probe.model.modes
        for side in (1, -1)
        if probe.is_in(mode.name, {**signs, surface: side})
    ]


def _grows(probe: Probe, mode: str, surface: str, side: int, t: float, y: FloatArray) -> bool:
    """Tell whether the slopes of the rates grow without bound towards a surface."""
    gradient = probe.slope(surface, t, y)[1:]
    size = float(np.linalg.norm(gradient))
    if not 0.0 < size < np.inf:
        return False
    near, far = (
        float(np.abs(probe.slopes(mode, t, y + side * away * gradient / size)[:, 1:]).max())
        for away in (_NEAR, _FAR)
    )
    return bool(near > _GROWS * (1.0 + far))
