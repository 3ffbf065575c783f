"""The ``coulomb`` model in balls, from its equation of motion.

``x'' + 2 zeta x' + x = f(t) - s S`` while it slides in direction s, with ``f = cos(Omega t) + h cos(3
Omega t)``; it rests while ``|x - f| <= S0`` (eqs. (1), (2) and (6) of the reference of
:mod:`contfric.models.coulomb`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

from flint import arb, arb_mat

from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector, zeros

#: Extended state: x, v, 1, and the cosine and sine of each frequency.
_X, _V, _ONE, _COS, _SIN, _COS3 = range(6)


def coulomb_balls(params: Mapping[str, arb], free: str | None = None) -> BallModel:
    """Return the model at given parameters; with slopes if one of them is free.

    The third harmonic is left out where it has no amplitude, and none is asked for.
    """
    harmonics = 1 if free != "h" and params["h"].is_zero() else 2
    omega, h = params["Omega"], params["h"]
    two_pi = 2 * arb.pi()
    slopes = None
    if free is not None:
        period = -two_pi / (omega * omega) if free == "Omega" else arb(0)
        names = tuple(params)
        # all is linear, but for the period
        second = replace(_derivative(names, "", harmonics), period=-2 * period / omega)
        slopes = replace(_derivative(names, free, harmonics), period=period, slopes=second)
    return _model(params, h, arb(1), harmonics, two_pi / omega, slopes)


@cache
def _derivative(names: tuple[str, ...], free: str, harmonics: int) -> BallModel:
    """Return the derivative of all matrices by a parameter, exact numbers; zero by none."""
    unit = {name: arb(int(name == free)) for name in names}
    return _model(unit, unit["h"], arb(0), harmonics, arb(0))


def _model(
    values: Mapping[str, arb],
    h: arb,
    one: arb,
    harmonics: int,
    period: arb,
    slopes: BallModel | None = None,
) -> BallModel:
    """Return matrices that are linear in the parameters; ``one`` is 0 for their derivatives."""
    frequencies = [(1 + 2 * k) * values["Omega"] for k in range(harmonics)]
    size = 3 + 2 * harmonics
    load = [arb(0)] * size
    load[_X], load[_COS] = one, -one
    if harmonics == 2:
        load[_COS3] = -h
    above, below = list(load), list(load)
    above[_ONE], below[_ONE] = -values["S0"], values["S0"]
    stop = [arb(0)] * size
    stop[_V] = one
    rest = _waves(size, frequencies)
    fields = {"stick": arb_mat(rest)}
    for name, sign in (("slide+", 1), ("slide-", -1)):
        rows = [list(row) for row in rest]
        rows[_X][_V] = one
        rows[_V] = [-c for c in load]
        rows[_V][_V] = -2 * values["zeta"]
        rows[_V][_ONE] = -sign * values["S"]
        fields[name] = arb_mat(rows)
    surfaces = {"F+": arb_mat([above]), "F-": arb_mat([below]), "v": arb_mat([stop])}
    turns = [1 + 2 * k for k in range(harmonics)]
    return BallModel(2, frequencies, fields, surfaces, period, turns, slopes=slopes)


def _waves(size: int, frequencies: Vector) -> list[Vector]:
    """Return the rows of a mode in which nothing moves but the harmonics."""
    rows = zeros(size, size)
    for k, w in enumerate(frequencies):
        at = 3 + 2 * k
        rows[at][at + 1], rows[at + 1][at] = -w, w
    return rows
