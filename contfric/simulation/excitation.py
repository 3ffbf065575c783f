"""Refuses to simulate with an excitation whose period is not that of the model."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.errors import ParameterError
from contfric.models.check.period import changed_after_a_period, not_periodic
from contfric.models.check.probe import Probe
from contfric.models.definition import Model

#: States in which each mode is looked at: one could be where the excitation has no part in it.
_STATES = 2
#: Modes of a structure with contacts, and of any other model, that are looked at: a load is in all of them.
_COMPOSED, _MOST = 4, 64


def check_excitation(model: Model, vector: FloatArray) -> None:
    """Check that fields and observables are the same one period later.

    Raises
    ------
    ParameterError
        If one is not, with its name.
    """
    what = _changed(model, vector.tobytes())
    if what:
        where = ", ".join(f"{name} = {value:g}" for name, value in model.mapping(vector).items())
        period = model.view(vector).period
        raise ParameterError(not_periodic(f"{what} of '{model.name}'", period, where))


@lru_cache(maxsize=256)
def _changed(model: Model, values: bytes) -> str:
    """Return what is another one period later; nothing if all is the same."""
    if not model.definition:  # the bundled one, whose formulas are fixed
        return ""
    probe = Probe(model, model.mapping(np.frombuffer(values)))
    modes = [mode.name for mode in model.modes[: _COMPOSED if model.composed else _MOST]]
    found = (changed_after_a_period(probe, modes, *place) for place in probe.states(_STATES))
    return next((what for what in found if what), "")
