"""Warnings of orbits that are found: far from 1 in size, or on both sides of an event at once.

And what to say where none is found, and the numbers are far from 1.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from contfric.errors import ConvergenceError
from contfric.models.check.probe import Probe
from contfric.models.check.scales import forced_sizes
from contfric.orbit.orbit import Orbit
from contfric.simulation.simulate import Trajectory

_log = logging.getLogger(__name__)
#: What is short or near is decided at thousandths of 1: events are missed from a hundredth on.
_FAR = 100.0
#: Samples of an orbit whose states vanish at its joints: a tenth of its size is enough to know.
_SAMPLES = 40
#: Segments shorter than this, relative to the orbit, have no duration.
_AT_ONCE = 1e-11


def warn_of_sizes(orbit: Orbit) -> None:
    """Log a warning where the largest state of an orbit, or all of its segments, are far from 1."""
    states = np.abs(np.concatenate([orbit.begins[:, 1:], orbit.ends[:, 1:]]))
    lasting = orbit.durations[orbit.durations > 0.0]
    if states.size and states.max() <= 1.0 / _FAR:  # all joints may lie where the states vanish
        states = np.abs(orbit.trajectory(_SAMPLES)[1])
    far = []
    if states.size and not 1.0 / _FAR < states.max() < _FAR:
        far.append(f"its largest state is {states.max():.1g}")
    if lasting.size and (lasting.max() < 1.0 / _FAR or lasting.min() > _FAR):
        far.append(f"its segments last {lasting.min():.1g} to {lasting.max():.1g}")
    if far:
        _log.warning(
            "the orbit of '%s' is far from 1 in size: %s. Events may be missed: write 'units: auto' into "
            "the model",
            orbit.model.name,
            " and ".join(far),
        )


@contextmanager
def sizes_told() -> Iterator[None]:
    """Say of a simulation that came to no orbit that its numbers are far from 1: that may be why.

    It starts displaced by the ``spread`` of its states, which is 1 where the model does not say, and a metre
    is far beyond the gap of a wall.
    """
    try:
        yield
    except ConvergenceError as error:
        found = error.result
        if not isinstance(found, Trajectory) or found.model.units or not (far := _far(found)):
            raise
        raise type(error)(
            f"{error}. The reason may be that numbers are far from 1 ({' and '.join(far)}): write "
            "'units: auto' into the model (units=\"auto\" in Python) first",
            found,
        ) from None


def _far(trajectory: Trajectory) -> list[str]:
    """Return what is far from 1: what the excitation moves states by, else what they end at; the period."""
    model, probe = trajectory.model, Probe(trajectory.model, trajectory.params)
    late = np.abs(trajectory.states[len(trajectory) // 2 :])
    size, far = max(forced_sizes(probe).values(), default=0.0), []
    if size == 0.0 and late.size:
        size = float(late.max())
    if size > 0.0 and not 1.0 / _FAR < size < _FAR:
        far.append(f"states of {size:.1g}")
    period = model.view(model.vector(trajectory.params)).period / math.tau
    if period > 0.0 and not 1.0 / _FAR < period < _FAR:
        far.append(f"a period of {math.tau * period:.1g}")
    return far


def warn_of_hits_together(orbit: Orbit) -> None:
    """Log a warning where an orbit meets two surfaces at once: its multipliers are those of one order.

    That is so at any parameters of a locked loop, whose detector sees both edges at the same time: solutions
    near it meet them in one order or in the other.
    """
    model, itinerary = orbit.model, orbit.itinerary
    resting = {own.mode for own in model.chatters}
    for k, (mode, surface) in enumerate(itinerary):
        if mode in resting or orbit.durations[k] > _AT_ONCE * orbit.period:
            continue
        _log.warning(
            "the orbit of '%s' meets '%s' and '%s' at once: its segment in '%s' has no duration. Its "
            "multipliers and its branch are those of solutions that meet them in this order; others may be "
            "stable or not by other multipliers",
            model.name,
            itinerary[k - 1][1],
            surface,
            mode,
        )
