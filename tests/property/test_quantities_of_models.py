"""Quantities of the bundled models: gradients of their orbits are differences of solved neighbours."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import contfric as cf
from contfric.orbit.solve import refine

#: Smooth cycles, impacts, resets, clocks, sliding, stiff friction, no excitation; the stiff ones take long.
MODELS = ("bang-bang", "belt", "dead-band", "gear-pair", "impact", "integrate-and-fire", "jenkins")
MORE = ("lugre", "normal-force", "popp", "relay-sliding", "rocking-block", "stribeck", "thermostat")


def slope_of(orbit: cf.Orbit, name: str, quantity: str) -> tuple[float, float]:
    """Return the derivative by differences, and how well it is known."""
    k = orbit.model.index_of(name)
    step = 1e-4 * max(abs(float(orbit.vector[k])), 0.1)
    values = []
    for by in (1, -1, 2, -2):
        vector = orbit.vector.copy()
        vector[k] += by * step
        beside = refine(replace(orbit, vector=vector), damped=False)
        assert beside.converged
        values.append(beside.quantity(quantity))
    one, two = (values[0] - values[1]) / (2 * step), (values[2] - values[3]) / (4 * step)
    return (4 * one - two) / 3, abs(one - two)


@pytest.mark.parametrize(
    "name", [*MODELS, *(pytest.param(name, marks=pytest.mark.slow) for name in MORE)]
)
def test_gradients_are_differences_of_orbits(name: str) -> None:
    orbit = cf.find_orbit(name)
    first, last = orbit.model.states[0], orbit.model.states[-1]
    quantities = [
        *("x_max", "period", "sticking", "impact_velocity"),
        *(f"mean({first})", f"rms({last})", f"max(abs({last}))", f"integral(abs({first} - 0.1))"),
    ]
    if not orbit.model.autonomous:
        quantities.append(f"amplitude({first}, 1)")
    for quantity in quantities:
        gradient = orbit.gradient(quantity)
        assert gradient.value == pytest.approx(orbit.quantity(quantity), rel=1e-9, abs=1e-11)
        for parameter in orbit.model.parameter_names[:3]:
            slope, error = slope_of(orbit, parameter, quantity)
            close = pytest.approx(slope, rel=1e-6, abs=1e-6 + 0.05 * error)
            assert gradient[parameter] == close, (quantity, parameter)


@pytest.mark.parametrize("name", ["popp", "belt", "impact"])
def test_what_comes_back_has_no_integral(name: str) -> None:
    """Whatever the model, the mean of the rate of a state that no reset changes is zero."""
    orbit = cf.find_orbit(name)
    assert orbit.model.states[0] == "x"
    assert orbit.quantity("integral(v)") == pytest.approx(0.0, abs=1e-10)
    assert np.isfinite(orbit.quantity("phase(x, 1)"))


@pytest.mark.parametrize("seed", range(3))
def test_a_curve_of_what_does_not_move_is_refused(seed: int) -> None:
    """What is constant along all orbits has no curve, whatever it is written with; what moves has one."""
    rng = np.random.default_rng(seed)
    a, b = (10.0 ** rng.uniform(-6.0, 6.0, 2)).tolist()
    damped, forced = cf.find_orbit("blade-damper"), cf.find_orbit("impact")
    constant = [
        (damped, f"{a!r}*mean(q1)"),  # zero by symmetry
        (damped, f"{a!r}*(max(v2) + min(v2))"),
        (damped, "amplitude(q2, 2)"),
        (damped, f"{a!r}*period*W + {b!r}"),
        (forced, f"where(x_max > 0, {a!r}*x_max, 0)"),  # the wall
        (forced, f"{a!r}*mean(v)"),
    ]
    moving = [(damped, f"{a!r}*rms(q1)"), (damped, f"{b!r}*max(v2)"), (forced, f"{a!r}*mean(x)")]
    for orbit, quantity in [*constant, *moving]:
        names = orbit.model.parameter_names[:2]
        ranges = {n: (0.9 * orbit.params[n], 1.1 * orbit.params[n]) for n in names}
        value = float(orbit.quantity(quantity))

        def curve(start=orbit, what=quantity, at=value, of=names, box=ranges) -> cf.QuantityCurve:
            return cf.continue_quantity(start, what, at, of, box, max_points=8)

        if (orbit, quantity) in moving:
            assert len(curve()) > 4, quantity
            continue
        with pytest.raises(cf.ConvergenceError, match="no unique direction"):
            curve()
