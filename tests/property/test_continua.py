"""Continua of orbits are recognised: no events on them, and no difference between starts.

At Omega = 1/2 without damping a slide lasts a whole natural period whatever its amplitude: orbits without
sticks leave their amplitude free.
"""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.completeness.verification import differences
from contfric.continuation.families.continuum import in_continuum, is_continuum

#: Scenes with no sticks: a large excitation against friction, drawn at random.
SEEDS = range(6)


def free(seed: int) -> dict[str, float]:
    """Parameters at which the symmetric orbit does not stick: friction is small against the excitation."""
    rng = np.random.default_rng([20, seed])
    S = float(rng.uniform(0.02, 0.1))
    return {
        "Omega": 0.5,
        "S": S,
        "S0": S * float(rng.uniform(1.0, 1.5)) + 0.01,
        "h": float(rng.uniform(-0.1, 0.1)),
        "zeta": 0.0,
    }


def symmetric_orbit(params: dict[str, float]) -> cf.Orbit:
    return cf.solve_orbit("coulomb", "0s", params)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_branch_through_continua_has_no_branch_points(seed: int) -> None:
    params = free(seed)
    branch = cf.continue_orbit(symmetric_orbit(params), "S", (params["S"] * 0.8, params["S"] * 1.1))
    mu = branch.multipliers
    assert mu is not None and len(branch) > 5
    assert np.max(np.min(np.abs(mu - 1.0), axis=1)) < 1e-7
    assert not [b for b in branch.bifurcations if b.kind is cf.Kind.BP]
    assert any("a continuum of orbits at each S between" in note for note in branch.notes)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_continuum_at_one_value_is_one_branch_to_its_end(seed: int) -> None:
    """Along the damping: a branch at zeta = 0 leaves the symmetric orbit, and ends at an event of its own."""
    params = free(seed)
    diagram = cf.explore(
        symmetric_orbit(params), "zeta", (-0.004, 0.004), max_branches=12, max_periods=1
    )
    vertical = [b for b in diagram.branches if is_continuum(b) and not b.mirrored]
    assert len(vertical) == 1
    (branch,) = vertical
    assert np.max(np.abs(branch.values)) < 1e-12
    assert branch.arc[-1] > 0.01
    assert {end.reason.name for end in branch.ends} & {"CS", "SS", "AS", "GS"}
    assert any("a continuum of orbits at zeta = " in note for note in branch.notes)
    # every orbit of it returns, and none has the amplitude of another
    for orbit in branch[1 : len(branch) - 1 : 5]:
        run = cf.simulate(
            orbit.model, orbit.params, state=orbit.cycle[0, 1:], time=orbit.cycle[0, 0], periods=1
        )
        assert np.max(np.abs(run.last[2] - orbit.cycle[0, 1:])) < 1e-10
    assert np.ptp([orbit.x_max for orbit in branch]) > 1e-3


def test_an_orbit_of_a_continuum_is_told_from_a_branch_point() -> None:
    params = free(0)
    diagram = cf.explore(symmetric_orbit(params), "zeta", (-0.004, 0.004), max_branches=12)
    (branch,) = (b for b in diagram.branches if is_continuum(b) and not b.mirrored)
    inside = branch[len(branch) // 2]
    assert in_continuum(inside, inside.model.index_of("S"))  # along S each is one of a family
    assert not in_continuum(
        inside, inside.model.index_of("zeta")
    )  # along zeta the family is the branch
    (point,) = (
        b
        for b in cf.explore(
            cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4}), "Omega", (0.4, 0.6)
        ).bifurcations
        if b.kind is cf.Kind.BP
    )
    orbit = point.orbit.as_whole()
    assert not in_continuum(orbit, orbit.model.index_of("Omega"))


def test_a_start_in_a_continuum_gives_the_diagram_of_its_symmetric_orbit() -> None:
    params = free(1)
    whole = cf.explore(symmetric_orbit(params), "zeta", (-0.004, 0.004), max_branches=12)
    (branch,) = (b for b in whole.branches if is_continuum(b) and not b.mirrored)
    inside, bounds = branch[len(branch) // 2], (params["S"] * 0.9, params["S"] * 1.1)
    with pytest.raises(cf.ConvergenceError, match="one of a continuum of orbits, at each S"):
        cf.continue_orbit(inside, "S", bounds)
    again = cf.explore(inside, "S", bounds, max_branches=5)
    expected = cf.explore(symmetric_orbit(params), "S", bounds, max_branches=5)
    assert any("one of a continuum" in note for note in again.notes)
    assert [b.name for b in again.branches] == [b.name for b in expected.branches]
    assert again.branches[0].symmetric


@pytest.mark.parametrize("vary", ["h", "zeta"])
def test_restarts_and_balance_beside_continua(vary: str) -> None:
    """Scenes that had 14 branch points, and lost what is joined by a continuum."""
    params, bounds = {
        "h": (
            {
                "Omega": 0.5,
                "S": 0.623759904101981,
                "S0": 0.6493617005464996,
                "h": -0.18308591398394913,
                "zeta": 0.0,
            },
            (-0.2523545591681014, -0.1467877389808054),
        ),
        "zeta": (
            {
                "Omega": 0.5,
                "S": 0.07062711215202844,
                "S0": 0.12821311695833731,
                "h": -0.34844048394087945,
                "zeta": 0.00010347941046324963,
            },
            (-0.0356405326707711, 0.023320740741916226),
        ),
    }[vary]
    diagram = cf.explore(cf.find_orbit("coulomb", params), vary, bounds)
    assert not diagram.loose_ends
    found = diagram.verify(restarts=3)
    assert found.passed, str(found)


def test_rest_for_ever_counts_in_the_sum() -> None:
    """Ten AS within 2e-6 of the S0 from which the mass stays at rest: each start gave other branches."""
    params = {
        "Omega": 1.3973232787357226,
        "S": 0.9465961527647008,
        "S0": 0.9550050414877783,
        "h": -0.4153369126128026,
        "zeta": 1.3790106837785455e-12,
    }
    diagram = cf.explore(
        cf.find_orbit("coulomb", params), "S0", (0.9465961527647008, 1.0391460439806128)
    )
    assert "REST" in {end.reason.name for branch in diagram.branches for end in branch.ends}
    found = diagram.verify()
    assert found.passed, str(found)
    assert not found.missing


#: Scenes with a family of orbits at Omega = 1/2 that is met by one branch twice, by two, and is short.
AT_ONE_HALF = [
    {"Omega": 0.5, "S": 0.22, "S0": 0.3},
    {"Omega": 0.49, "S": 0.32, "S0": 0.33},
    {"Omega": 0.55, "S": 0.32, "S0": 0.325},
]


@pytest.mark.parametrize("params", AT_ONE_HALF)
def test_a_family_at_one_value_is_one_branch_from_whatever_side(params: dict[str, float]) -> None:
    """Along Omega the equations are singular at every orbit of it, and the sign of the slope is rounding."""
    diagram = cf.explore(cf.find_orbit("coulomb", params), "Omega", (0.48, 0.55))
    (family,) = (b for b in diagram.branches if is_continuum(b) and not b.mirrored)
    assert diagram.loose_ends == ()
    assert abs(family.values[0] - 0.5) < 1e-12
    assert {end.bifurcation.kind.name for end in family.ends if end.bifurcation} == {"CS", "BP"}
    # x returns to itself whatever the amplitude, and without sticks only the limit S0 ends it
    (end,) = (
        e.bifurcation for e in family.ends if e.bifurcation and e.bifurcation.kind.name == "CS"
    )
    loads = [abs(x - np.cos(0.5 * t)) for t, x in end.orbit.cycle[:, :2]]
    assert abs(min(loads) - params["S0"]) < 1e-12
    symmetric = next(b for b in diagram.branches if b.name == "0s")
    again = cf.explore(symmetric[len(symmetric) // 2], "Omega", (0.48, 0.55), max_step=0.0031)
    (other,) = (b for b in again.branches if is_continuum(b) and not b.mirrored)
    assert abs(other.values[0] - 0.5) < 1e-12
    assert {b.name for b in again.branches} == {b.name for b in diagram.branches}


@pytest.mark.parametrize("seed", range(3))
def test_last_digits_of_the_parameters_change_nothing(seed: int) -> None:
    """Fig. 7: its triple point and its family at Omega = 1/2, with parameters moved by a few units."""
    rng = np.random.default_rng([7, seed])
    params = {"Omega": 0.5, "S": 0.22, "S0": 0.3}
    whole = cf.explore(cf.find_orbit("coulomb", params), "Omega", (0.3, 0.7))
    moved = {name: value * (1.0 + 1e-15 * rng.uniform(-1.0, 1.0)) for name, value in params.items()}
    again = cf.explore(cf.find_orbit("coulomb", moved), "Omega", (0.3, 0.7))
    assert not again.loose_ends
    assert [*differences(whole, again), *differences(again, whole)] == []


CENTRE = """
name: centre
states: [x, v]
parameters: {{k: {k}, a: {a}, b: {b}, c: 0.0}}
autonomous: true
field: {{x: v, v: -k*x - a*x**2 - b*x**3 - c*v}}
"""


@pytest.mark.parametrize("seed", range(4))
def test_cycles_around_a_centre(tmp_path, seed: int) -> None:
    """A cycle of each size at each stiffness: no continuation in it; along the damping those without any."""
    rng = np.random.default_rng([21, seed])
    k, a, b = rng.uniform(0.5, 2.0), rng.uniform(-0.3, 0.3), rng.uniform(0.2, 1.0)
    (tmp_path / "centre.yaml").write_text(CENTRE.format(k=k, a=a, b=b))
    orbit = cf.find_orbit(cf.load_model(tmp_path / "centre.yaml"), state=rng.uniform(0.3, 1.0, 2))
    with pytest.raises(cf.ConvergenceError, match="as around a centre"):
        cf.continue_orbit(orbit, "k", (0.3, 3.0))
    branch = cf.continue_orbit(orbit, "c", (-0.1, 0.1), max_points=60)
    assert np.max(np.abs(branch.values)) < 1e-9
    assert branch.arc[-1] > 0.1
    energy = [
        v**2 / 2 + k * x**2 / 2 + a * x**3 / 3 + b * x**4 / 4 for x, v in branch.joints[:, 0, 1:]
    ]
    assert np.ptp(energy) > 0.1 * np.median(energy)


@pytest.mark.parametrize(
    ("params", "bounds"),
    [
        (
            {
                "Omega": 0.08522782883656335,
                "S": 0.040571679038123705,
                "S0": 0.04057323566406074,
                "h": -0.37243437908184646,
                "zeta": 0.0,
            },
            (0.07500048937617575, 0.09545516829695096),
        ),
        (
            {
                "Omega": 0.14409300575820697,
                "S": 0.14582794342466832,
                "S0": 0.14583149445942145,
                "h": -0.2200274355109686,
                "zeta": 0.01,
            },
            (0.12680184506722214, 0.1613841664491918),
        ),
    ],
)
def test_symmetric_orbits_next_to_a_family_are_solved_on_their_half(
    params: dict[str, float], bounds: tuple[float, float]
) -> None:
    """Whichever of the two equal lengths of a segment rounding makes the shorter one."""
    found = cf.explore(cf.find_orbit("coulomb", params, longest=1000), "Omega", bounds)
    assert all(restart.complete for restart in found.verify(3).restarts)
