"""A segment may cross a surface at which nothing changes more often than a label has digits for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from typed import typed

import contfric as cf

_WALLS = (Path(__file__).parents[1] / "models" / "walls.yaml").read_text()
_PARAMETERS = {"w": 0.05, "F": 1.0, "zeta": 0.1, "k3": 0.3, "d": 50.0}


def _reversals(orbit: cf.Orbit, harmonic: int) -> int:
    """Return how often v changes its sign in a period, by an integration of its own."""
    p = orbit.params
    fast, slow = harmonic * p["w"], p["w"]

    def field(t: float, y: np.ndarray) -> list[float]:
        force = p["F"] * np.cos(slow * t) + p["a"] * np.cos(fast * t + p["phase"])
        return [y[1], force - 2 * p["zeta"] * y[1] - y[0] - p["k3"] * y[0] ** 3]

    start = orbit.cycle[0]
    times = start[0] + np.linspace(0.0, orbit.period, 200 * harmonic)[:-1] + 1e-3
    found = solve_ivp(field, (start[0], times[-1]), start[1:], t_eval=times, rtol=1e-10, atol=1e-12)
    signs = np.sign(found.y[1])
    return int(np.sum(signs != np.roll(signs, 1)))


@pytest.mark.parametrize("harmonic", [3, 13, 29, 33, 41, 61, 101])
def test_every_crossing_is_in_the_signature(harmonic: int, tmp_path: Path) -> None:
    orbit = cf.find_orbit(
        typed(tmp_path, _WALLS.replace("cos(3*w*t", f"cos({harmonic}*w*t")),
        {**_PARAMETERS, "a": 3.0},
    )
    assert len(orbit.signature.segments) == _reversals(orbit, harmonic)
    branch = cf.continue_orbit(orbit, "a", (2.9, 3.1))
    assert np.array_equal(
        branch.mirror()[0].signature.segments, branch[0].mirror().signature.segments
    )


def test_the_first_point_of_a_branch_has_labels_of_its_own() -> None:
    """At a branch point Newton's method with the parameter held goes anywhere: one went to 31 crossings."""
    rng, asked = np.random.default_rng(3), 0
    params = {"S": 0.3398199767848029, "S0": 0.4009918259785634, "zeta": 0.004369670900430496}
    scenes = [params] + [
        {"S": s, "S0": s + 0.06, "zeta": 0.005 * z}
        for s, z in rng.uniform((0.3, 0), (0.34, 1), (9, 2))
    ]
    for scene in scenes:
        diagram = cf.explore(cf.find_orbit("coulomb", {"Omega": 0.5, **scene}), "Omega", (0.4, 0.6))
        for branch in diagram.branches:
            if branch.ends[0].reason is cf.EndReason.BP:
                asked += 1
                assert any(np.array_equal(branch.labels[0], branch[k].labels) for k in (0, 1))
    assert asked > 5


def test_tangencies_of_many_crossings_are_where_they_are() -> None:
    """Labels longer than 53 bits were compared as numbers with 53: each T was there twice, at ends of steps.

    The force of the model jumps at a time at which the velocity is zero: solved by an integration of its own.
    """
    orbit = cf.find_orbit("bang-bang", {"om": 0.0404})
    branch = cf.continue_orbit(orbit, "om", (0.035, 0.042))
    events = [b for b in branch.bifurcations if b.kind.name == "T"]
    assert (
        len(events) == 3
    )  # one for each turn of the free oscillation, of 4.07, that comes into half a period
    for event in events:
        p, start = event.params, event.orbit.begins[0]
        push = np.sign(np.sin(p["om"] * (start[0] + 1e-6)))

        def field(_: float, y: np.ndarray, push: float = push, p: dict = p) -> list[float]:
            return [y[1], push * p["A"] - p["la"] * y[1] - p["al"] * y[0] - p["ep"] * y[0] ** 3]

        half = np.pi / p["om"]
        end = solve_ivp(field, (0.0, half), start[1:], method="DOP853", rtol=1e-12, atol=1e-13)
        assert abs(end.y[1, -1]) < 1e-11
