"""Warnings of orbits that are found: far from 1 in size, or on both sides of an event at once."""

from __future__ import annotations

import logging

import numpy as np

from contfric.orbit.orbit import Orbit

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
