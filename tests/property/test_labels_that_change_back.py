"""Tangencies T of which several lie within one step, and one undoes another: found from any step."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import contfric as cf
from contfric.base.tally import counts

SOFT_STOP = (
    Path(__file__).resolve().parents[2] / "benchmarks" / "stress" / "typed" / "softstop.yaml"
)

#: Two masses with friction, a friction element between them and a spring beyond a gap.
_STRUCTURE = {
    "mass": [1.0, 1.5],
    "damping": "c",
    "stiffness": [[2.0, -1.0], [-1.0, 2.0]],
    "force": {"q1": "F*cos(w*t)"},
    "contacts": {
        "pad": {"kind": "friction", "velocity": "v2", "kinetic": "mu", "static": "1.1*mu"},
        "iwan": {"kind": "jenkins", "displacement": "q1 - q2", "stiffness": "kd", "limit": "S"},
        "stop": {"kind": "spring", "gap": "d - q1", "stiffness": "kg"},
    },
    "parameters": {
        **{"w": 0.845, "F": 1.0, "mu": 0.3, "kd": 0.8, "S": 0.2, "c": 0.04, "d": 0.6, "kg": 10.0}
    },
    "period": "2*pi/w",
}


def test_tangencies_do_not_depend_on_the_step() -> None:
    structure = dict(_STRUCTURE)
    matrices = [structure.pop(name) for name in ("mass", "damping", "stiffness")]
    model = cf.Mechanism(*matrices, **structure, coordinates=["q1", "q2"])
    orbit = cf.find_orbit(model)
    fine = cf.continue_orbit(orbit, "w", (0.7, 2.2), max_step=2e-4)
    wanted = [e.params["w"] for e in fine.bifurcations if e.kind is cf.Kind.T]
    gaps = np.diff(wanted)
    assert len(wanted) == 4 and np.min(gaps) < 1e-4
    rng = np.random.default_rng(1)
    for step in 10.0 ** rng.uniform(-3.5, -1.0, 3):
        branch = cf.continue_orbit(orbit, "w", (0.7, 2.2), max_step=float(step))
        found = [e.params["w"] for e in branch.bifurcations if e.kind is cf.Kind.T]
        assert len(found) == len(wanted), step
        np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-10)


def test_a_point_on_a_segment_of_no_length_makes_no_label_change_elsewhere() -> None:
    """A step may end just where a branch ends at a grazing: the tangent there is rounding.

    A preloaded soft stop, explored again with finer steps from all of its branches.
    """
    params = {"omega": 0.5976646411553906, "k": 26.42116694776751, "zeta": 0.008944969323325445}
    params |= {"c": 0.32076154914311195, "gap": 1.2492900425219953, "A": 1.176107959592724}
    begun = cf.find_orbit(SOFT_STOP, params | {"pre": 0.23153438740497664}, longest=1000)
    diagram = cf.explore(begun, "omega", (0.4469979761394101, 1.1953686313574419), max_periods=2)
    found = diagram.verify(6)
    assert found.passed, str(found)


def test_a_label_that_the_end_of_a_branch_changes_is_not_searched_for() -> None:
    """One point just before the event tells; a search solves for twenty, and finds the event again."""
    orbit = cf.solve_orbit("coulomb", "1a", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    before = counts()
    branch = cf.continue_orbit(orbit, "Omega", (0.4, 0.6))
    solves = (counts() - before).newton_solves
    assert [b.kind.name for b in branch.bifurcations] == ["SS", "T", "SN", "CS"]
    assert branch[0].labels.tolist() != branch[1].labels.tolist()
    assert len(branch) < solves < len(branch) + 82
