"""A slide by CVODE of SUNDIALS (package scikit-sundae): Adams' methods, root finding at the stop."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from sksundae.cvode import CVODE

from peers.oscillator import Counter, Failure, Params, Tangent, checked, until

#: More steps than any slide takes at the smallest tolerance; the default, 500, is near that.
MOST_STEPS = 100_000


def _rate(t, z, out, data):
    omega, force, _ = data
    values = z.tolist()
    out[0] = values[1]
    out[1] = math.cos(omega * t) - force - values[0]
    if len(values) > 2:
        out[2], out[3] = values[3], -values[2]
    if len(values) > 4:
        out[4], out[5] = values[5], -t * math.sin(omega * t) - values[4]


def _velocity(t, z, out, data):
    out[0] = data[2] * z[1]


_velocity.terminal = [True]  # type: ignore[attr-defined]
_velocity.direction = [-1]  # type: ignore[attr-defined]


@dataclass(frozen=True)
class Cvode:
    """Relative (and absolute) tolerance."""

    rtol: float
    unit: str = "evaluations"

    def slide(
        self,
        t: float,
        x: float,
        sign: int,
        params: Params,
        counter: Counter,
        tangents: Sequence[Tangent] = (),
    ) -> tuple[float, np.ndarray]:
        """See :class:`peers.oscillator.Integrator`.

        The solver is a new one for each slide (a twelfth of the time): one that is used again keeps the
        events of all its earlier calls.
        """
        solver = CVODE(
            _rate,
            method="Adams",
            rtol=self.rtol,
            atol=self.rtol,
            eventsfn=_velocity,
            num_events=1,
            userdata=(params[0], sign * params[1], sign),
            max_num_steps=MOST_STEPS,
        )
        start = [x, 0.0, *(v for tangent in tangents for v in tangent)]
        found = solver.solve([t, until(t, params)], start)
        counter.calls += found.nfev
        if not found.success or found.t_events is None:
            raise Failure("a slide without a stop")
        return checked(t, float(found.t_events[-1])), found.y_events[-1]
