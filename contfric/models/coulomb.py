"""Dry friction oscillator with a static limit above the kinetic one.

``x'' + 2 zeta x' + x = f(t) - S sgn(x')``, ``f(t) = cos(Omega t) + h cos(3 Omega t)``; at rest the
mass is held while the load ``u = x - f(t)`` obeys ``|u| <= S0``, ``S0 >= S`` (eqs. (1), (2) and (6)
of the reference; its zeta is 0). All quantities are nondimensional: ``x = z k / F_0`` and
``t = tau sqrt(k / m)``.

The seven domains are those of Table 1 of the reference.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.models.definition import Domain, Model, Surface
from contfric.models.parts import Constraint, Departure, Mode, Observable, Parameter, Symmetry

if TYPE_CHECKING:
    from contfric.flow.interface import CompiledFlow
    from contfric.models.balls.model import BallModel

#: Signs of (u - S0) and (u + S0) for the three positions of the load in Table 1.
_LOAD = {"+": (1, 1), "0": (-1, 1), "-": (-1, -1)}


def _slide(load: str, direction: str) -> Domain:
    above, below = _LOAD[load]
    sign = 1 if direction == "+" else -1
    return Domain(
        name=f"x{load}v{direction}",
        mode=f"slide{direction}",
        signs={"F+": above, "F-": below, "v": sign},
        label=f"$x^{load}v^{direction}$",
    )


def _flow() -> CompiledFlow:
    from contfric.flow.oscillator.flow import compiled_flow

    return compiled_flow()


def _balls(params: Mapping[str, Any], free: str | None) -> BallModel:
    from contfric.models.balls.coulomb import coulomb_balls

    return coulomb_balls(params, free)


def _spread(params: Mapping[str, float]) -> FloatArray:
    """Half-width of the region where orbits live: the response without friction, bounded."""
    omega, h = params["Omega"], params["h"]

    def response(w: float) -> float:
        # |1 / (1 - w^2 + 2 i zeta w)|, kept finite at resonance by the floor 1e-3
        return 1.0 / max(float(np.hypot(1 - w * w, 2 * params["zeta"] * w)), 1e-3)

    x = response(omega) + abs(h) * response(3 * omega) + params["S0"]
    v = omega * response(omega) + 3 * omega * abs(h) * response(3 * omega) + params["S0"]
    return np.array([x, v])


coulomb = Model(
    name="coulomb",
    title="dry friction oscillator, static limit S0 above the kinetic friction S",
    states=("x", "v"),
    parameters=(
        Parameter("Omega", 0.5, "excitation frequency, omega_0 sqrt(m/k)"),
        Parameter("S", 0.32, "kinetic friction, mu m g / F_0"),
        Parameter("S0", 0.4, "static friction limit, mu_0 m g / F_0"),
        Parameter("h", 0.0, "amplitude of the third harmonic of the excitation"),
        Parameter("zeta", 0.0, "viscous damping ratio"),
    ),
    constraints=(
        Constraint("Omega > 0", {"Omega": 1.0}, strict=True),
        Constraint("S >= 0", {"S": 1.0}),
        Constraint(
            "S0 >= S",
            {"S0": 1.0, "S": -1.0},
            meaning="The static limit cannot be below the kinetic friction.",
        ),
    ),
    observables=(Observable("u", "x - f(t)"), Observable("v", "x'")),
    surfaces=(
        Surface("F+", "u", "S0"),
        Surface("F-", "u", "-S0"),
        Surface("v", "v", "0", switching=True),
    ),
    modes=(Mode("slide+", rank=2), Mode("slide-", rank=2), Mode("stick", rank=1, sliding=True)),
    domains=(
        *(_slide(load, direction) for direction in "+-" for load in "+0-"),
        Domain("stick", "stick", {"F+": -1, "F-": 1, "v": 0}, label="stick"),
    ),
    departures=(
        Departure(where={"F+": 1}, leaves={"v": -1}),
        Departure(where={"F-": -1}, leaves={"v": 1}),
    ),
    symmetry=Symmetry(
        matrix=((-1.0, 0.0), (0.0, -1.0)),
        fraction=0.5,
        surfaces={"F+": "F-", "F-": "F+", "v": "v"},
    ),
    stop_surface="v",
    rounding=1e-15,  # of its closed form: a few units in the last place
    flow_factory=_flow,
    spread=_spread,
    quantities=(
        (
            "energy",
            "integral(S*abs(v) + 2*zeta*v**2)",
        ),  # dissipated in a period of the orbit, k/F_0^2
        ("power", "energy/period"),
    ),
    ball_factory=_balls,
    references=(
        "Asymmetric and chaotic responses of dry friction oscillators with different static and "
        "kinetic coefficients of friction, Meccanica (2021), doi:10.1007/s11012-021-01382-8",
    ),
)
