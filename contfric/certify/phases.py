r"""Time measured in phases of the excitation, ``theta = 2 pi t / T``.

Along a branch in a frequency all times of an orbit change with it, and the phases hardly do. In a box the
product of the two balls of a frequency and of a time would be wide; with phases the harmonics are ``cos
n_k theta``, n_k whole numbers, and the period is 2 pi at every value of the parameter. The fields of the
states are multiplied by ``T / (2 pi)``, a positive number: signs of rates, and so all inequalities, stay
what they are.
"""

from __future__ import annotations

from flint import arb, arb_mat

from contfric.models.balls.model import BallModel


def in_phases(model: BallModel) -> BallModel:
    """Return a model with the phase for its time; one without excitation as it is."""
    if model.period.is_zero():
        return model
    two_pi = 2 * arb.pi()
    scale, slopes = model.period / two_pi, None
    if model.slopes is not None:
        slope = model.slopes.period / two_pi
        fields = {
            name: _mixed(model, field, model.slopes.fields[name], scale, slope)
            for name, field in model.fields.items()
        }
        still = [arb(0)] * len(model.turns)
        slopes = BallModel(
            model.states,
            still,
            fields,
            model.slopes.surfaces,
            arb(0),
            model.turns,
            model.slopes.resets,
        )
    turns = [arb(n) for n in model.turns]
    fields = {name: _scaled(model, field, scale) for name, field in model.fields.items()}
    return BallModel(
        model.states, turns, fields, model.surfaces, two_pi, model.turns, model.resets, slopes
    )


def _scaled(model: BallModel, field: arb_mat, scale: arb) -> arb_mat:
    """Return the field by phase: its rows of the states scaled, those of the harmonics whole numbers."""
    found = arb_mat(model.size, model.size)
    for a in range(model.states):
        for b in range(model.size):
            found[a, b] = field[a, b] * scale
    for k, n in enumerate(model.turns):
        at = model.states + 1 + 2 * k
        found[at, at + 1], found[at + 1, at] = arb(-n), arb(n)
    return found


def _mixed(model: BallModel, field: arb_mat, slope: arb_mat, scale: arb, change: arb) -> arb_mat:
    """Return the derivative of a scaled field by the parameter."""
    found = arb_mat(model.size, model.size)
    for a in range(model.states):
        for b in range(model.size):
            found[a, b] = slope[a, b] * scale + field[a, b] * change
    return found
