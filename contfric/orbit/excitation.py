"""Whether all that depends on time has the model's period.

Phases are taken modulo the period: where the excitation has another one, a solution would meet another
excitation after each period than the file says.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from contfric.errors import ParameterError
from contfric.models.check.probe import Probe
from contfric.models.definition import FloatArray, Model

#: States in which each mode is looked at: one could be where the excitation has no part in it.
_STATES = 2
#: Modes of a structure with contacts, and of any other model, that are looked at: a load is in all of them.
_COMPOSED, _MOST = 4, 64
#: Rounding of a field, and of the phase after a period, relative to 1 + the values.
_SAME = 1e-8
#: A time after which anything that depends on it is another, without excitation.
_LATER = 0.7310585


def check_excitation(model: Model, vector: FloatArray) -> None:
    """Check that fields and observables are the same one period later.

    Raises
    ------
    ParameterError
        If one is not, with its name.
    """
    what = _changed(model, vector.tobytes())
    if not what:
        return
    if model.autonomous:
        raise ParameterError(
            f"{what} of '{model.name}' depends on time, and the model is autonomous: give its 'period'"
        )
    values = ", ".join(f"{name} = {value:g}" for name, value in model.mapping(vector).items())
    raise ParameterError(
        f"{what} of '{model.name}' is not the same one period ({model.view(vector).period:.9g}) later at "
        f"{values}: 'period' must be a common period of everything that depends on t"
    )


@lru_cache(maxsize=256)
def _changed(model: Model, values: bytes) -> str:
    """Return what is another one period later; nothing if all is the same."""
    if not model.definition:  # the bundled one, whose formulas are fixed
        return ""
    probe = Probe(model, model.mapping(np.frombuffer(values)))
    later, modes = probe.period or _LATER, [m.name for m in model.modes[: _most(model)]]
    for t, y in probe.states(_STATES):
        now, then = (_values(probe, modes, at, y) for at in (t, t + later))
        with np.errstate(invalid="ignore"):  # what is not finite there says nothing
            other = np.abs(then - now) > _SAME * (1.0 + np.abs(now))
        if other.any():
            place = int(np.argmax(other))
            if place < len(modes) * len(y):
                return f"the field of '{modes[place // len(y)]}'"
            return f"observable '{list(model.observable_index)[place - len(modes) * len(y)]}'"
    return ""


def _most(model: Model) -> int:
    return _COMPOSED if model.composed else _MOST


def _values(probe: Probe, modes: list[str], t: float, y: FloatArray) -> FloatArray:
    """Return the rates of all modes, and all observables."""
    observables = [probe.flow.observe(name, t, y) for name in probe.model.observable_index]
    return np.concatenate([*(probe.field(mode, t, y) for mode in modes), observables])
