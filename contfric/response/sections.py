"""Sections by name: stops, releases, a phase of the excitation, a surface."""

from __future__ import annotations

from numbers import Real
from typing import TypeAlias

import numpy as np

from contfric.base.arrays import IntArray
from contfric.errors import ParameterError, did_you_mean, real_number, shown
from contfric.models.definition import Model
from contfric.models.shorthand.clocks import TICK
from contfric.response.cuts import Cut
from contfric.simulation.tables import MAPPED, tables

#: "stops", "releases", the name of a surface (or kink), or a phase as a share of the period.
SectionLike: TypeAlias = str | float

STOPS, RELEASES = "stops", "releases"
_SENSES = {"either": 0, "rising": 1, "falling": -1}


def usual_section(model: Model) -> SectionLike:
    """Return the section to take where none is named: the stops, else a phase, the tick or the first surface.

    A structure has as many velocities that vanish as it has contacts, and no stops. A model with a clock has
    no other time, and its tick is what a phase is of others.
    """
    if model.stop_surface:
        return STOPS
    if not model.autonomous:
        return 0.0
    names = [surface.name for surface in model.surfaces]
    return TICK if TICK in names else names[0] if names else STOPS


def section_of(model: Model, section: object, sense: object = "either") -> Cut:
    """Return a section as the kernel takes it.

    Raises
    ------
    ParameterError
        If the model has no such section.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> section_of(load_model("coulomb"), 0.25).phase
    0.25
    """
    if not (isinstance(sense, str) and sense in _SENSES):
        raise ParameterError(f"sense is one of {', '.join(_SENSES)}, got {shown(sense)}")
    if model.composed:
        tables(model)  # refused, with the reason
    if isinstance(section, str):
        cut = _on_surface(model, section, _SENSES[sense])
    elif isinstance(section, bool) or not isinstance(section, Real):
        raise ParameterError(f"a section is {_choices(model)}; got {shown(section)}")
    else:
        cut = _at_phase(model, section)
    if _SENSES[sense] and not (isinstance(section, str) and section not in (STOPS, RELEASES)):
        raise ParameterError(f"sense = '{sense}' needs a surface as section, got {shown(section)}")
    return cut


def _none(model: Model) -> tuple[IntArray, IntArray]:
    modes, surfaces = len(model.modes), len(model.surfaces)
    return np.zeros((modes, surfaces), dtype=np.int64), np.zeros(modes, dtype=np.int64)


def _at_phase(model: Model, section: Real) -> Cut:
    if model.autonomous:
        raise ParameterError(
            f"model '{model.name}' has no period of excitation, and no phase: a section is {_choices(model)}"
        )
    phase = real_number("the phase of a section", section, least=0.0)
    if not phase < 1.0:
        raise ParameterError(
            f"the phase of a section is a share of the period, 0 <= phase < 1, got {phase:g}"
        )
    return Cut(*_none(model), 0, -1, phase, 0)


def _on_surface(model: Model, section: str, sense: int) -> Cut:
    joints, inside = _none(model)
    surfaces = [s.name for s in model.surfaces]
    if section == RELEASES:
        joints[[k for k, m in enumerate(model.modes) if m.sliding]] = 1
        if not joints.any():
            raise ParameterError(
                f"model '{model.name}' never rests: a section is {_choices(model)}"
            )
        return Cut(joints, inside, 0, -1, -1.0, 0)
    name = model.stop_surface if section == STOPS else section
    if section == STOPS and model.resets:
        joints[tables(model).bounds == MAPPED] = 1
    if name in surfaces:
        k = model.surface_index[name]
        joints[:, k] = 1
        bounds = tables(model).bounds[:, k]
        inside[:] = [
            b == 0 and not _lies_on(model, m.name, name)
            for b, m in zip(bounds, model.modes, strict=True)
        ]
        return Cut(
            joints, inside, model.observable_index[model.surfaces[k].observable], k, -1.0, sense
        )
    if name in model.kinks:
        inside[:] = 1
        return Cut(joints, inside, model.observable_index[name], -1, -1.0, sense)
    if section == STOPS:
        raise ParameterError(
            f"model '{model.name}' has no surface on which it stops: a section is {_choices(model)}"
        )
    valid = f"{did_you_mean(section, _named(model))}{_or_phase(model)}"
    raise ParameterError(f"no section '{section}'{valid}")


def _lies_on(model: Model, mode: str, surface: str) -> bool:
    return {d.signs.get(surface) for d in model.domains if d.mode == mode} == {0}


def _choices(model: Model) -> str:
    names = ", ".join(f"'{name}'" for name in _named(model))
    return f"one of {names}{_or_phase(model)}"


def _or_phase(model: Model) -> str:
    return "" if model.autonomous else ", or a phase of the excitation from 0 to 1"


def _named(model: Model) -> list[str]:
    """Return the sections of a model that have names."""
    stops = [STOPS] if model.stop_surface else []
    releases = [RELEASES] if any(mode.sliding for mode in model.modes) else []
    return [*stops, *releases, *(s.name for s in model.surfaces), *model.kinks]
