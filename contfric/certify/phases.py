r"""Time measured in phases of the excitation, ``theta = 2 pi t / T``.

Along a branch in a frequency all times of an orbit change with it, and the phases hardly do. In a box the
product of the two balls of a frequency and of a time would be wide; with phases the harmonics are ``cos
n_k theta``, n_k whole numbers, and the period is 2 pi at every value of the parameter. The fields of the
states are multiplied by ``T / (2 pi)``, a positive number: signs of rates, and so all inequalities, stay
what they are.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from flint import arb, arb_mat

from contfric.models.balls.model import BallModel


def in_phases(model: BallModel) -> BallModel:
    """Return a model with the phase for its time; one without excitation as it is."""
    if model.period.is_zero():
        return model
    two_pi = 2 * arb.pi()
    scale, slopes = model.period / two_pi, None
    if model.slopes is not None:
        slopes = _slopes(model, model.slopes, scale, model.slopes.period / two_pi)
    turns = [arb(n) for n in model.turns]
    fields = {name: _scaled(model, field, scale) for name, field in model.fields.items()}
    return BallModel(
        model.states,
        turns,
        fields,
        model.surfaces,
        two_pi,
        model.turns,
        model.resets,
        slopes,
        model.alike,
        model.fields,
    )


def _slopes(model: BallModel, slopes: BallModel, scale: arb, change: arb) -> BallModel:
    """Return the derivatives of a model in phases, and the second ones where they are known."""
    fields = {
        name: _sum(model.states, [(slopes.fields[name], scale), (field, change)])
        for name, field in model.fields.items()
    }
    still = [arb(0)] * len(model.turns)
    second = slopes.slopes
    bend = None
    if second is not None:
        twice = second.period / (2 * arb.pi())
        bends = {
            name: _sum(
                model.states,
                [(second.fields[name], scale), (slopes.fields[name], 2 * change), (field, twice)],
            )
            for name, field in model.fields.items()
        }
        bend = replace(second, frequencies=still, fields=bends, period=arb(0))
    return replace(slopes, frequencies=still, fields=fields, period=arb(0), slopes=bend)


@cache
def _only_states(states: int, size: int) -> arb_mat:
    """Return the matrix that keeps the rows of the states."""
    return arb_mat([[int(a == b < states) for b in range(size)] for a in range(size)])


@cache
def _harmonics(states: int, turns: tuple[int, ...]) -> arb_mat:
    """Return the rows of the harmonics by phase: whole numbers."""
    found = arb_mat(*[states + 1 + 2 * len(turns)] * 2)
    for k, n in enumerate(turns):
        at = states + 1 + 2 * k
        found[at, at + 1], found[at + 1, at] = arb(-n), arb(n)
    return found


def _scaled(model: BallModel, field: arb_mat, scale: arb) -> arb_mat:
    """Return the field by phase: its rows of the states scaled, those of the harmonics whole numbers."""
    own = _only_states(model.states, model.size) * field * scale
    return own + _harmonics(model.states, tuple(model.turns))


def _sum(states: int, parts: list[tuple[arb_mat, arb]]) -> arb_mat:
    """Return a sum of fields times factors, its rows of the states only."""
    total = arb_mat(parts[0][0].nrows(), parts[0][0].nrows())
    for matrix, factor in parts:
        total += matrix * factor
    return _only_states(states, total.nrows()) * total
