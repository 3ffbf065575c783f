"""Whether all that depends on time has the model's period, and fields go on where an angle begins again.

Phases are taken modulo the period: where the excitation has another one, a solution would meet another
excitation after each period than the file says.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from contfric.base.arrays import FloatArray
from contfric.models.check.probe import Place, Probe
from contfric.models.check.report import ModelReport, Topic
from contfric.models.definition import Domain

#: Rounding of a field, and of the phase after a period, relative to 1 + the values.
_SAME = 1e-8
#: A time after which anything that depends on it is another, without excitation.
_LATER = 0.7310585
#: Parts of a period that are tried: squares and moduli of a sine have halves, a carrier has many.
_PARTS = range(12, 1, -1)
#: States that are drawn for each mode, and at most asked: what is so at four random ones is so everywhere.
_DRAWN = (40, 4)
#: What to write for an angle, and for one with a wall: no solution turns past that.
_AS_ANGLE = "write 'angles: [{0}]': only then solutions that go round are periodic"
_AS_WALL = "write its walls as sin(({0} - wall)/2) = 0: only then they are met in each turn"


def changed_after_a_period(
    probe: Probe, modes: Sequence[str], t: float, y: FloatArray, share: float = 1.0
) -> str:
    """Return what differs a share of the period later at a state: a field, an observable, or nothing."""
    later = t + share * (probe.period or _LATER)
    for mode in modes:
        if not same(probe.field(mode, t, y), probe.field(mode, later, y)):
            return f"the field of '{mode}'"
    for name in (n for n in probe.model.observable_index if n != probe.model.phase):
        if not same(probe.flow.observe(name, t, y), probe.flow.observe(name, later, y)):
            return f"observable '{name}'"
    return ""


def _parts_of_the_period(probe: Probe) -> int:
    """Return in how many equal parts of the period all that depends on time is the same; 1 without any."""
    model = probe.model
    places = [
        (mode.name, *place) for mode in model.modes for place in probe.places(mode.name, *_DRAWN)
    ]
    met = [(r.surface, *place) for r in model.resets for place in probe.on(r.surface, _DRAWN[1])]

    def alike(share: float) -> bool:
        later = share * probe.period
        return not any(
            changed_after_a_period(probe, [m], t, y, share) for m, t, y in places
        ) and all(same(probe.reset(r, t, y), probe.reset(r, t + later, y)) for r, t, y in met)

    if probe.period <= 0.0 or not places or alike(_LATER):
        return 1
    return next((n for n in _PARTS if alike(1.0 / n)), 1)


def repeats_sooner(probe: Probe) -> str:
    """Return what to write where all that depends on time has a shorter period than the file says."""
    if (parts := _parts_of_the_period(probe)) == 1:
        return ""
    return (
        f"at these parameters all that depends on t is the same 1/{parts} of the period later: divide "
        f"'period' by {parts}. With this one, multipliers are to the power {parts}, period doublings may be "
        "called branch points, and branches have copies, later by a part of the period"
    )


def check_angles(report: ModelReport, probe: Probe) -> None:
    """Check that fields go on where an angle begins again, and look for angles that are not declared."""
    model = probe.model
    for state, text in undeclared_angles(probe).items():
        report.note(
            Topic.UNDECLARED,
            f"the fields are the same a turn (2 pi) of '{state}' later: if it is an angle, {text}",
        )
    for state, domain, after, (t, y), image in _turns(probe):
        report.count(Topic.PERIOD)
        here, there = probe.field(domain.own_mode, t, y), probe.field(after, t, image)
        if same(here, there):
            continue
        own, place = model.whole_mode(domain.own_mode), y[model.states.index(state)]
        other = (
            "is not the same"
            if (name := model.whole_mode(after)) == own
            else f"is not that of '{name}'"
        )
        report.error(
            Topic.PERIOD,
            f"the field of '{own}' at {state} = {place:.6g} {other} a turn of '{state}' later: that is no "
            f"angle. A saw-tooth is a surface '{state} = pi' with a reset '{state} - 2*pi'",
        )
        return


def _turns(probe: Probe) -> Iterator[tuple[str, Domain, str, Place, FloatArray]]:
    """Yield (angle, domain, mode after it, place, image) at states where an angle begins again.

    A solution is nowhere else than between these two places, so that the fields of modes that hold elsewhere
    need not be the same a turn later.
    """
    model = probe.model
    for reset in (r for r in model.resets if r.wraps):
        state = next(s for s in model.states if s in reset.changes)
        for domain in model.domains:
            targets = model.targets.get((domain.name, reset.surface), ())
            on = [name for name, side in domain.signs.items() if side == 0]
            for t, y in probe.on_all((reset.surface, *on), _DRAWN[0]) if targets else ():
                image, lies = (
                    probe.reset(reset.surface, t, y),
                    dict.fromkeys((reset.surface, *on), 0),
                )
                signs = probe.signs(t, y) | lies
                if not {**domain.signs, reset.surface: 0}.items() <= signs.items():
                    continue
                landed = probe.signs(t, image)
                after = [
                    d.own_mode
                    for d in map(model.domain_by_name.__getitem__, targets)
                    if all(landed[name] in (side, 0) for name, side in d.signs.items())
                ]
                if after:
                    own = domain.own_mode
                    yield state, domain, own if own in after else after[0], (t, y), image


def undeclared_angles(probe: Probe) -> dict[str, str]:
    """Return what to write for each state that may be an angle: a turn (2 pi) of it changes no field.

    A state that resets map begins again by these; and a wall that is met in each turn is between its turns.
    """
    model = probe.model
    if not model.definition:
        return {}
    known = _mapped(probe)
    walls = [model.surface_by_name[reset.surface].observable for reset in model.resets]
    places = [
        (mode.name, *place) for mode in model.modes for place in probe.places(mode.name, *_DRAWN)
    ]
    found = {}
    for state in (s for s in model.states if s not in known):
        step = np.array([float(s == state) for s in model.states])
        here, turned, nearby = (
            [probe.field(mode, t, y + turn * step) for mode, t, y in places]
            for turn in (0.0, 2.0 * np.pi, 1.0)
        )
        if not all(map(same, here, turned)) or all(map(same, here, nearby)):
            continue
        met = [
            [abs(probe.flow.observe(wall, t, y + turn * step)) for _, t, y in places]
            for wall in walls
            for turn in (0.0, 2.0 * np.pi, 1.0)
        ]
        kinds = [
            (same(now, then), same(now, aside))
            for now, then, aside in zip(met[::3], met[1::3], met[2::3], strict=True)
        ]
        if (True, False) in kinds:
            continue
        found[state] = _AS_WALL if (False, False) in kinds else _AS_ANGLE
    return {state: text.format(state) for state, text in found.items()}


def _mapped(probe: Probe) -> set[str]:
    """Return the states that resets map, at a few places on their surfaces."""
    return {
        state
        for reset in probe.model.resets
        for t, y in probe.on(reset.surface, _DRAWN[1])
        for state, old, new in zip(
            probe.model.states, y, probe.reset(reset.surface, t, y), strict=True
        )
        if not same(old, new)
    }


def same(now: ArrayLike, then: ArrayLike) -> bool:
    """Tell whether values agree to rounding; those that are not finite say nothing."""
    with np.errstate(invalid="ignore"):
        return not np.any(np.abs(np.subtract(then, now)) > _SAME * (1.0 + np.abs(now)))


def not_periodic(what: str, period: float, where: str) -> str:
    """Return what to say of something that is another one period later, at some parameters."""
    if period <= 0.0:
        return f"{what} depends on time, but the model is autonomous: give its 'period'"
    return (
        f"{what} is not the same one period ({period:.9g} at {where}) later: 'period' must be a "
        "common period of everything that depends on t"
    )
