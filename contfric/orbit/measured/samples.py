"""States along an orbit: inside one segment, and sampled over a period with their domains."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.errors import whole_number
from contfric.orbit.itinerary.read_signature import segment_domains
from contfric.simulation.starts import signs_at

if TYPE_CHECKING:
    from contfric.orbit.orbit import Orbit

#: Samples of one orbit: more are seen by nobody, and take minutes.
_MOST_SAMPLES = 10_000_000


def state_within(orbit: Orbit, i: int, duration: float) -> FloatArray:
    """Return the state in a segment of the whole orbit, a duration after its start, shape (n,)."""
    start = orbit.begins[i]
    return orbit.flow.state(orbit.itinerary[i][0], float(start[0]), start[1:], duration)


def stationary_within(orbit: Orbit, i: int, observable: str) -> tuple[FloatArray, FloatArray]:
    """Return durations from the start of a segment to an observable's stationary points, and its values."""
    start, mode = orbit.begins[i], orbit.itinerary[i][0]
    lasts = float(orbit.durations[i])
    return orbit.flow.stationary(mode, observable, float(start[0]), start[1:], lasts)


def samples(
    orbit: Orbit, labels: NDArray[np.int64], points: int
) -> tuple[FloatArray, FloatArray, list[str]]:
    """Return times (k,), states (k, n) and domains (k) along one period, joints included.

    Parameters
    ----------
    labels : passages through transparent surfaces, as for
    :func:`contfric.orbit.itinerary.read_signature.segment_domains`
    points : about how many samples; each segment has three at least
    """
    points = whole_number("points", points, least=1, most=_MOST_SAMPLES)
    times: list[float] = []
    states: list[FloatArray] = []
    names: list[str] = []
    paths = segment_domains(orbit, labels)
    for i, (start, end) in enumerate(zip(orbit.cycle[:, 0], orbit.ends[:, 0], strict=True)):
        count = max(3, int(np.ceil(points * (end - start) / orbit.period)))
        path = paths[i]
        for k, duration in enumerate(np.linspace(0.0, end - start, count)):
            times.append(float(start + duration))
            states.append(state_within(orbit, i, float(duration)))
            if k == count - 1:  # a segment begins and ends where its itinerary says
                path = path[-1:]
            elif k > 0:
                path = _rest_of(orbit, path, times[-1], states[-1])
            names.append(path[0])
    return np.array(times), np.array(states), names


def _rest_of(orbit: Orbit, path: list[str], time: float, state: FloatArray) -> list[str]:
    """Return the domains of a segment from that of one of its samples on.

    It is the first that the sample fits, on a surface either side of it: none is left for an earlier one.
    """
    signs = signs_at(orbit.model, time, state, orbit.vector)
    model = orbit.model
    clear = [s.name for s in model.surfaces if not s.switching or s.name in model.section_surfaces]
    for k, name in enumerate(path):
        own = orbit.model.domain_by_name[name].signs
        if all(own[s] * signs[s] >= 0 for s in clear):
            return path[k:]
    return path
