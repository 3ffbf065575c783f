"""Quantities of random orbits: balances that hold whatever the orbit, and derivatives against differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, reject, settings
from hypothesis import strategies as st

import contfric as cf
from contfric.bvp.linear import jacobian_blocks, stacked
from contfric.errors import ContfricError
from contfric.orbit.gradient import by_parameters, joint_sensitivities
from contfric.orbit.solve import refine
from contfric.quantities import functionals
from contfric.quantities.motion import OrbitMotion

PARAMS = st.fixed_dictionaries(
    {
        "Omega": st.floats(0.3, 1.6),
        "S": st.floats(0.02, 0.35),
        "S0": st.floats(0.36, 0.6),
        "h": st.floats(-0.2, 0.2),
        "zeta": st.floats(0.01, 0.2),
    }
)


def found(params: dict[str, float]) -> cf.Orbit:
    """Return the orbit of an example; one without an orbit is drawn anew."""
    try:
        return cf.find_orbit("coulomb", params, longest=1000)
    except ContfricError:
        reject()


@given(PARAMS)
@settings(max_examples=12)
def test_what_the_force_gives_is_dissipated(params: dict[str, float]) -> None:
    orbit = found(params)
    work = orbit.quantity("integral(v*(cos(Omega*t) + h*cos(3*Omega*t)))")
    assert work == pytest.approx(orbit.quantity("energy"), abs=1e-11)
    assert orbit.quantity("integral(v)") == pytest.approx(0.0, abs=1e-11)
    assert orbit.quantity("integral(x*v)") == pytest.approx(0.0, abs=1e-11)


@given(PARAMS)
@settings(max_examples=25)
def test_extrema_by_any_way_agree(params: dict[str, float]) -> None:
    orbit = found(params)
    assert orbit.quantity("max(x)") == pytest.approx(orbit.quantity("x_max"), abs=1e-13)
    assert orbit.quantity("min(x)") == pytest.approx(orbit.quantity("x_min"), abs=1e-13)
    # the same function, once as an observable (the flow's own search), once as an expression
    assert orbit.quantity("max(u)") == pytest.approx(orbit.quantity("max(1*u)"), abs=1e-12)
    assert orbit.quantity("min(v)") == pytest.approx(-orbit.quantity("max(-v)"), abs=1e-12)


@pytest.mark.slow
@given(PARAMS)
@settings(max_examples=10)
def test_harmonics_sum_to_the_mean_square(params: dict[str, float]) -> None:
    """Parseval; x has a continuous rate, so that what 40 harmonics leave out is of the order 40**-5."""
    orbit = found(params)
    assume(orbit.periods == 1)
    total = orbit.quantity("mean(x)") ** 2
    total += 0.5 * sum(orbit.quantity(f"amplitude(x, {k})") ** 2 for k in range(1, 40))
    assert total == pytest.approx(orbit.quantity("mean(x**2)"), abs=1e-7)


@given(PARAMS, st.sampled_from((2, 4, 6)), st.sampled_from(("x", "v", "x**3", "u + 0.1*v")))
@settings(max_examples=15)
def test_a_harmonic_that_vanishes_has_no_phase(
    params: dict[str, float], harmonic: int, odd: str
) -> None:
    """Half a period later a symmetric orbit is its own image: what is odd has odd harmonics only."""
    orbit = found(params)
    assume(orbit.symmetric)
    even = f"({odd})**2"
    for g, k in ((odd, harmonic), (even, harmonic - 1)):
        phase = f"phase({g}, {k})"
        assert np.isnan(orbit.quantity(phase))
        gradient = orbit.gradient(phase)
        assert "vanishes" in gradient.notes[0] and np.all(np.isnan(list(gradient.values())))
        assert orbit.quantity(f"amplitude({g}, {k})") < 1e-12 * orbit.quantity(f"rms({g})")
    for g, k in ((odd, 1), (even, harmonic)):
        gradient = orbit.gradient(f"phase({g}, {k})")
        assert not gradient.notes and np.all(np.isfinite([gradient.value, *gradient.values()]))


QUANTITIES = (
    "x_max",
    "energy",
    "rms(v)",
    "sticking",
    "amplitude(x, 1)",
    "max(u)",
    "mean(x**3)",
    "multiplier",
)


@given(PARAMS, st.sampled_from(QUANTITIES), st.sampled_from(("Omega", "S", "S0", "h", "zeta")))
@settings(max_examples=40)
def test_gradients_are_differences_of_orbits(params: dict[str, float], name: str, by: str) -> None:
    orbit = found(params)
    assume(np.min(np.abs(orbit.margins)) > 1e-2)  # else an event may lie between the neighbours
    values = []
    for k in (1, -1, 2, -2):
        vector = orbit.vector.copy()
        vector[orbit.model.index_of(by)] += 1e-4 * k
        beside = refine(replace(orbit, vector=vector), damped=False)
        assume(beside.converged and beside.admissible)
        values.append(beside.quantity(name))
    one, two = (values[0] - values[1]) / 2e-4, (values[2] - values[3]) / 4e-4
    slope, error = (4 * one - two) / 3, abs(one - two)
    gradient = orbit.gradient(name)
    assert gradient[by] == pytest.approx(slope, rel=1e-6, abs=1e-7 + error)
    assert gradient.value == pytest.approx(orbit.quantity(name), abs=1e-13)


def test_the_gradient_of_a_multiplier_next_to_another_one() -> None:
    """Two multipliers, 0.281 and 0.251: differences over a step that is too long were off by a hundredth."""
    params = {"Omega": 1.0, "S": 0.15625, "S0": 0.5, "zeta": 0.1875}
    orbit = cf.find_orbit("coulomb", params)
    ends = [
        cf.find_orbit("coulomb", params | {"Omega": 1.0 + by}).quantity("multiplier")
        for by in (1e-5, -1e-5)
    ]
    assert orbit.gradient("multiplier")["Omega"] == pytest.approx(
        (ends[0] - ends[1]) / 2e-5, rel=1e-5
    )


@pytest.mark.parametrize("model", ["jenkins", "popp", "impact"])
def test_joints_move_as_the_full_matrix_says(model: str) -> None:
    """One elimination, joint by joint, against a dense solve: excited, autonomous, and with impacts."""
    orbit = cf.find_orbit(model)
    a, b, c, close = jacobian_blocks(
        orbit.system, orbit.joints, orbit.vector, range(len(orbit.vector))
    )
    full = -np.linalg.solve(stacked(a, b, close), c.reshape(orbit.joints.size, -1))
    moved = joint_sensitivities(orbit).reshape(full.shape)
    assert np.allclose(moved, full, rtol=1e-9, atol=1e-9 * np.max(np.abs(full)))
    assert np.max(np.abs(full)) > 1e-3


@pytest.mark.parametrize("model", ["jenkins", "stribeck"])
def test_nodes_of_all_segments_are_those_of_each(model: str) -> None:
    """Also where motion is integrated from node to node, and a node lies before the last one."""
    orbit = cf.find_orbit(model)
    motion = OrbitMotion(orbit, by_parameters(orbit))
    shares = np.array([0.0, 0.4, 1.0, 0.3])
    count = len(motion.segments)
    where = np.repeat(np.arange(count), len(shares))
    time, states = motion.pieces.nodes(where).at(np.tile(shares, count))
    for k, segment in enumerate(motion.segments):
        own = slice(k * len(shares), (k + 1) * len(shares))
        alone, those = segment.at(shares)
        for one, other in zip((alone, *those), (time, *states), strict=True):
            assert np.array_equal(one.values, other[own].values)
            assert np.array_equal(one.slopes, other[own].slopes)
        assert np.array_equal(those[0].values[:1], segment.state[:1])
        ends = [orbit.cycle[(k + 1) % count, 1 + i] for i in range(len(those))]
        assert np.allclose([s.values[2] for s in those], ends, atol=1e-8)


@given(PARAMS)
@settings(max_examples=15)
def test_extrema_in_expressions_are_those_of_python(params: dict[str, float]) -> None:
    orbit = found(params)
    for text in ("psi", "max(v) - 2*min(u)", "max(x)*min(v)"):
        compiled = replace(orbit).gradient(text)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(functionals, "peak_in", lambda *_: None)
            by_python = replace(orbit).gradient(text)
        assert compiled.value == pytest.approx(by_python.value, rel=1e-12, abs=1e-12)
        assert bool(compiled.notes) == bool(by_python.notes)
        for name, slope in by_python.items():
            assert compiled[name] == pytest.approx(slope, rel=1e-8, abs=1e-9), (text, name)


TOGETHER = (
    *("x_max", "mean(v)", "rms(v)", "energy", "amplitude(x, 1)", "phase(x, 3)", "rms(x)/energy"),
    *("amplitude(v, 1)", "integral(abs(v))", "mean(abs(x))", "min(v)", "period"),
)


@given(PARAMS, st.sets(st.sampled_from(TOGETHER), min_size=2))
@settings(max_examples=15)
def test_gradients_at_once_are_those_of_each(params: dict[str, float], names: set[str]) -> None:
    orbit = found(params)
    together = orbit.gradients(sorted(names))
    assert list(together) == sorted(names)
    for name, gradient in together.items():
        alone = orbit.gradient(name)
        assert gradient.quantity == name
        assert gradient.value == pytest.approx(alone.value, rel=1e-12, abs=1e-13)
        assert dict(gradient.ahead) == pytest.approx(dict(alone.ahead), rel=1e-10, abs=1e-10)
        assert dict(gradient.behind) == pytest.approx(dict(alone.behind), rel=1e-10, abs=1e-10)
        assert gradient.notes == alone.notes


def test_gradients_say_what_they_take() -> None:
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    with pytest.raises(ContfricError, match=r"a list of quantities, such as \['energy'\]"):
        orbit.gradients("energy")
    with pytest.raises(ContfricError, match="enrgy"):
        orbit.gradients(["energy", "enrgy"])
    assert orbit.gradients([]) == {}


@pytest.mark.parametrize("seed", range(3))
def test_functions_of_an_orbit_are_used_as_expressions_are(seed: int) -> None:
    """In gradients, tables, values to stop at, extrema and curves: the same as what they are written with."""
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(0.5, 2.0, 2).tolist()

    def mixed(orbit: cf.Orbit) -> float:
        return a * orbit.x_max + b * float(orbit.quantity("rms(v)"))

    text = f"{a!r}*x_max + {b!r}*rms(v)"
    params = {"Omega": rng.uniform(0.49, 0.53), "S": rng.uniform(0.31, 0.33), "S0": 0.4}
    orbit = cf.find_orbit("coulomb", params)
    exact, found = orbit.gradient(text), orbit.gradients([mixed])["mixed"]
    assert found.value == pytest.approx(exact.value, rel=1e-14) and found.notes == ()
    for name in ("Omega", "S", "S0", "zeta"):
        assert found[name] == pytest.approx(exact[name], rel=1e-7, abs=1e-8)
    branch = cf.continue_orbit(orbit, "Omega", (0.45, 0.56))
    table = branch.to_dataframe([mixed, "stops"])
    np.testing.assert_allclose(table["mixed"], branch.quantity(text), rtol=1e-14)
    for one, other in zip(branch.extrema(mixed), branch.extrema(text), strict=True):
        assert one.largest == other.largest
        assert one.params["Omega"] == pytest.approx(other.params["Omega"], abs=1e-7)
    value = exact.value + 0.005 * exact["Omega"]
    by_function, by_text = (
        cf.continue_orbit(orbit, "Omega", (0.45, 0.56), stop_at={what: value})
        for what in (mixed, text)
    )
    assert by_function.values[[0, -1]] == pytest.approx(by_text.values[[0, -1]], abs=1e-10)
    ranges = {"Omega": (0.49, 0.53), "S": (0.3, 0.34)}
    curve = cf.continue_quantity(orbit, mixed, value, ("Omega", "S"), ranges, max_points=15)
    assert len(curve) > 5 and curve.quantity == "mixed"
    assert max(abs(mixed(each) - value) for each in curve) < 1e-11


def test_one_quantity_is_not_a_list_of_them() -> None:
    orbit = cf.solve_orbit("coulomb", "1a", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    branch = cf.continue_orbit(orbit, "Omega", (0.49, 0.51))
    with pytest.raises(
        cf.ParameterError, match=r"takes a list of quantities, such as \['energy'\]"
    ):
        branch.to_dataframe("energy")


@pytest.mark.parametrize("seed", range(4))
def test_jumps_and_poles_of_a_quantity_are_no_values_of_it(seed: int) -> None:
    """A branch stops where the quantity has the value, and not where it passes it by infinity or a jump."""
    rng = np.random.default_rng(seed)
    orbit = cf.solve_orbit("coulomb", "1a", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    plain = cf.continue_orbit(orbit, "Omega", (0.48, 0.53))
    low, high = float(plain.x_max.min()), float(plain.x_max.max())
    at, value = low + rng.uniform(0.2, 0.5) * (high - low), rng.uniform(0.5, 3.0)
    undefined = f"0*sqrt((x_max - {at!r})**2 - {(1e-4 * (high - low)) ** 2!r})"
    far = 5.0 * value / (high - low)  # taken beyond the pole, some steps away from it
    for text, wanted, taken in [
        (f"1/(x_max - {at!r})", 0.01 * value, False),
        (f"where(x_max > {at!r}, 2, 1)", 1.5, False),
        (f"sign(x_max - {at!r})", 0.3, False),
        (f"sign(x_max - {at!r}) + {undefined}", 0.3, False),
        (f"1/(x_max - {at!r})", far, True),
        (f"log(x_max - {at!r})", float(np.log(0.3 * (high - at))), True),
        (f"sqrt({low - 1.0!r} - x_max)", 1.0, False),
    ]:
        branch = cf.continue_orbit(orbit, "Omega", (0.48, 0.53), stop_at={text: wanted})
        stopped = [i for i, e in zip((0, -1), branch.ends, strict=True) if e.reason.name == "STOP"]
        assert bool(stopped) == taken, text
        for i in stopped:
            assert branch[i].quantity(text) == pytest.approx(wanted, rel=1e-8)
        assert all(np.isfinite(e.value) for e in plain.extrema(text))
        if not taken:
            ranges = {"Omega": (0.48, 0.53), "S": (0.315, 0.325)}
            with pytest.raises(cf.ConvergenceError, match="no orbit of this signature"):
                cf.continue_quantity(orbit, text, wanted, ("Omega", "S"), ranges)
