"""Extrema over orbits in compiled code: against the general way, which shares only the orbit with it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

import contfric as cf
from contfric.curves.of_quantities import step as quantity_step
from contfric.curves.of_quantities.step import Defects, Held
from contfric.orbit.gradient import by_parameters
from contfric.quantities.measure import differentiated
from contfric.quantities.registry import number_quantity

FIG5 = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
#: Symmetric and not, with extrema at joints, inside of segments, in the second half, at impacts, autonomous.
ORBITS: Mapping[str, tuple[str, str | None, Mapping[str, float]]] = {
    "half": ("coulomb", "2s", {**FIG5, "S": 0.36}),
    "whole": ("coulomb", "1a", FIG5),
    "inside": ("jenkins", None, {"muN": 1.4, "W": 1.3}),
    "impact": ("impact", None, {}),
    "autonomous": ("belt", None, {}),
    "structure": ("blade-damper", None, {}),
}


@pytest.fixture(scope="module", params=ORBITS)
def orbit(request: pytest.FixtureRequest) -> cf.Orbit:
    name, signature, params = ORBITS[request.param]
    model = cf.load_model(name)
    if signature is not None:
        return cf.solve_orbit(model, signature, params).as_half()
    return cf.find_orbit(model, {**model.defaults, **params}).as_half()


def names_of(orbit: cf.Orbit) -> list[str]:
    seen = [orbit.model.states[0], *(o.name for o in orbit.model.observables)]
    return [f"{kind}({name})" for name in dict.fromkeys(seen) for kind in ("max", "min")]


def test_values_and_derivatives_are_those_of_the_general_way(orbit: cf.Orbit) -> None:
    """One times an extremum is no extremum to the compiled code, and the same number."""
    compared = 0
    for name in names_of(orbit):
        try:
            quick = differentiated(
                number_quantity(name, orbit.model, "a test"), orbit, by_parameters(orbit)
            )
        except cf.ContfricError:
            continue  # an observable that is no name of an expression
        plain = number_quantity(f"1*{name}", orbit.model, "a test")
        slow = differentiated(plain, orbit, by_parameters(orbit))
        size = 1.0 + np.max(np.abs(slow.ahead))
        assert abs(quick.value - slow.value) < 1e-12 * (1.0 + abs(slow.value)), name
        assert quick.kinks == slow.kinks
        np.testing.assert_allclose(quick.ahead, slow.ahead, atol=1e-9 * size, err_msg=name)
        compared += 1
    assert compared >= 2


def test_the_smallest_peak_is_stationary_by_the_general_way() -> None:
    start = cf.find_orbit("jenkins", {"muN": 1.4, "W": 1.3})
    ranges = {"W": (1.0, 2.0), "muN": (0.6, 2.4), "kt": (1.5, 2.5)}
    curve = cf.continue_extremum(start, "x_max", ("W", "muN", "kt"), ranges)
    assert [end.reason.name for end in curve.ends] == ["RANGE", "RANGE"] and len(curve) > 10
    assert curve.values[[0, -1], 2] == pytest.approx([1.5, 2.5], abs=1e-12)
    for k in range(0, len(curve), 7):
        slopes = curve[k].gradient("1*x_max")
        assert max(abs(slopes["W"]), abs(slopes["muN"])) < 1e-10
        assert slopes.value == pytest.approx(float(curve.extrema[k]), abs=1e-13)


@pytest.mark.parametrize(("which", "quantity"), [("half", "x_max"), ("impact", "x_min")])
def test_a_level_is_the_same_curve_by_the_general_way(which: str, quantity: str) -> None:
    """A point of the one, held by the other, does not move."""
    name, signature, params = ORBITS[which]
    model = cf.load_model(name)
    params = {**model.defaults, **params}
    orbit = cf.solve_orbit(model, signature, params) if signature else cf.find_orbit(model, params)
    one, other = model.parameter_names[:2]
    ranges = {n: (params[n] - 0.03, params[n] + 0.03) for n in (one, other)}
    curve = cf.continue_quantity(orbit, quantity, orbit.quantity(quantity), (one, other), ranges)
    assert len(curve) > 5
    for k in (1, len(curve) // 2, len(curve) - 2):
        again = cf.continue_quantity(
            curve[k], f"1*{quantity}", orbit.quantity(quantity), (one, other), ranges, max_points=2
        )
        gap = np.min(np.linalg.norm(again.values - curve.values[k], axis=1))
        assert gap < 1e-11


@pytest.mark.parametrize("raised", [KeyboardInterrupt, ZeroDivisionError])
def test_what_a_called_condition_raises_is_not_lost(
    monkeypatch: pytest.MonkeyPatch, raised: type[BaseException]
) -> None:
    """Ctrl-C within it ends the curve where it is; anything else is raised as it is."""
    orbit = cf.solve_orbit("coulomb", "1a", FIG5)
    ranges = {"Omega": (0.45, 0.56), "S": (0.2, 0.39)}
    calls, plain = [0], Held.defects

    def defects(self: Held, here: cf.Orbit) -> Defects:
        calls[0] += 1
        if calls[0] > 12:
            raise raised
        return plain(self, here)

    monkeypatch.setattr(quantity_step.Held, "defects", defects)

    def curve() -> object:
        energy = orbit.quantity("energy")
        return cf.continue_quantity(orbit, "energy", energy, ("Omega", "S"), ranges)

    if raised is KeyboardInterrupt:
        assert "INTERRUPTED" in repr(curve())
    else:
        with pytest.raises(raised):
            curve()
