"""The two-orbit estimate of the largest exponent: a cross-check of the tangent map.

Two motions start a small distance d_0 apart, and the logarithm of their distance in state space is compared
at later instants, eq. (5) of the reference. As there, an instant at which either is at rest is passed over
for the next one. After each comparison the second motion is set back to the distance d_0 in the same
direction (G. Benettin, L. Galgani and J.-M. Strelcyn, Phys. Rev. A 14 (1976) 2338-2345); without that the
distance would soon be as large as the attractor and say nothing more.

It knows nothing of derivatives: it uses the simulation alone. Its systematic error is of the order of
d_0 (curvature; pairs that a jump of the return map takes apart) and of eps / d_0 (rounding).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from contfric.base.arrays import FloatArray
from contfric.errors import ContfricError
from contfric.models import ModelSource, Parameters
from contfric.models.definition import Model
from contfric.models.tied import tied
from contfric.simulation.simulate import SimulationEnd, run, simulate

#: Instants of comparison in a period of the excitation.
_INSTANTS = 8
#: Batches for the standard error, as in :mod:`contfric.chaos.averaging`.
_BATCHES = 20


@dataclass(frozen=True)
class TwoOrbitEstimate:
    """The mean rate at which two solutions separate, and its standard error from batch means."""

    value: float
    error: float


@dataclass(eq=False)
class _Rider:
    """A solution that is followed from instant to instant."""

    model: Model
    vector: FloatArray
    time: float
    y: FloatArray
    mode: str

    def ride(self, until: float, period: float) -> None:
        """Follow the solution to an instant."""
        mode = self.model.mode_index[self.mode]
        periods = (until - self.time) / period
        # from within a segment: it lies on no surface that it could leave
        found = run(self.model, self.vector, mode, 0, self.time, self.y, periods, 1_000_000)
        if found.end not in (SimulationEnd.TIME, SimulationEnd.HELD):
            raise ContfricError(f"the two-orbit estimate breaks off: {found.end.value}")
        _, _, self.y, self.mode = found.last
        self.time = until

    @property
    def moves(self) -> bool:
        """Whether it is not at rest."""
        return not self.model.mode_by_name[self.mode].sliding


def two_orbit_estimate(
    model: ModelSource,
    params: Parameters | None = None,
    *,
    state: ArrayLike | None = None,
    time: float = 0.0,
    periods: int = 600,
    transient: int = 100,
    distance: float = 1e-8,
) -> TwoOrbitEstimate:
    """Estimate the largest Lyapunov exponent from two solutions a small distance apart.

    Parameters
    ----------
    distance : the distance d_0; 1e-8, the square root of rounding, balances curvature and rounding

    Examples
    --------
    >>> params = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
    >>> round(two_orbit_estimate("coulomb", params, periods=50).value, 2)
    -0.03
    """
    model, params = tied(model, params)
    vector = model.vector(params)
    begun = simulate(model, params, state=state, time=time, periods=transient)
    period = model.view(vector).period
    start = time + transient * period
    first = _Rider(model, vector, start, begun.last[2], begun.last[3])
    steps = _rates(first, distance, period, periods)
    growth, lasted = np.array(steps).T
    batches = np.array_split(np.arange(len(steps)), _BATCHES)
    sums = np.array([growth[b].sum() for b in batches])
    spans = np.array([lasted[b].sum() for b in batches])
    value = growth.sum() / lasted.sum()
    scatter = float(np.sum((sums - value * spans) ** 2))
    error = math.sqrt(scatter / (_BATCHES * (_BATCHES - 1))) / float(spans.mean())
    return TwoOrbitEstimate(float(value), error)


def _rates(
    first: _Rider, distance: float, period: float, periods: int
) -> list[tuple[float, float]]:
    """Return (growth, duration) between instants at which both move."""
    count, start = len(first.y), first.time
    towards = np.full(count, 1.0 / math.sqrt(count))
    second: _Rider | None = None
    steps: list[tuple[float, float]] = []
    since = start
    for k in range(1, periods * _INSTANTS + 1):
        instant = start + k * period / _INSTANTS
        first.ride(instant, period)
        if second is not None:
            second.ride(instant, period)
        if not first.moves or (second is not None and not second.moves):
            continue
        if second is not None and second.mode == first.mode:
            apart = second.y - first.y
            size = float(np.linalg.norm(apart))
            if size > 0.0:
                steps.append((math.log(size / distance), instant - since))
                towards = apart / size
        second = _Rider(
            first.model, first.vector, instant, first.y + distance * towards, first.mode
        )
        since = instant
    return steps
