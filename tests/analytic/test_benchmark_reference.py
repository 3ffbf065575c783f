"""The 40-digit reference of the benchmarks agrees with contfric, and their peers with it.

None of the packages of the extra ``bench`` is needed: the peers tried here are scipy's.
"""

from __future__ import annotations

import importlib
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

import contfric as cf

FOLDER = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture(scope="module")
def tasks() -> Iterator[ModuleType]:
    """The tasks of the benchmarks, whose modules are scripts in one folder."""
    before = set(sys.modules)
    sys.path.insert(0, str(FOLDER))
    try:
        yield importlib.import_module("tasks")
    finally:
        sys.path.remove(str(FOLDER))
        for name in set(sys.modules) - before:
            if str(FOLDER) in str(getattr(sys.modules[name], "__file__", "")):
                del sys.modules[name]


def test_orbit(tasks: ModuleType) -> None:
    reduced, full = tasks.orbit_at(tasks.OMEGA), tasks.orbit_at(tasks.OMEGA, full=True)
    times = [f"{t:.6f}" for t in tasks.joints_of(reduced)[::2]]
    exact = tasks.Reference(tasks.S, tasks.S0).orbit(tasks.OMEGA, times)
    for orbit in (reduced, full):
        assert tasks.farthest(tasks.joints_of(orbit), exact) < 1e-12


def test_fold(tasks: ModuleType) -> None:
    exact = tasks.exact_fold()
    for full in (False, True):
        orbit = tasks.orbit_at(tasks.NEAR_FOLD, full)
        found, _ = tasks.fold_on(orbit, *tasks.FOLD_ONLY)
        assert abs(found - exact) < 1e-12


def test_points_of_the_branch(tasks: ModuleType) -> None:
    """Measured: 3e-14 at worst."""
    reference = tasks.Reference(tasks.S, tasks.S0)
    found, _ = tasks.followed(tasks.orbit_at(tasks.OMEGA), True)
    assert len(found.points) > 50
    for omega, joints in found.points[::8]:
        assert reference.distance(omega, joints) < 1e-12


def test_distance_sees_an_error(tasks: ModuleType) -> None:
    orbit = tasks.orbit_at(tasks.OMEGA)
    joints = list(tasks.joints_of(orbit))
    joints[1] += 1e-7  # a position is no unknown of the reference: the whole shift is seen
    found = tasks.Reference(tasks.S, tasks.S0).distance(tasks.OMEGA, joints)
    assert found == pytest.approx(1e-7, rel=1e-6)


def test_simulation(tasks: ModuleType) -> None:
    periods = 5
    exact = tasks.Reference(tasks.S, tasks.S0).simulate(tasks.HEIGHT, periods, tasks.OMEGA)
    path = cf.simulate(
        "coulomb", tasks.params_at(tasks.OMEGA), state=[tasks.HEIGHT, 0.0], periods=periods
    )
    period = 2 * math.pi / tasks.OMEGA
    found = [c * period + t for c, t in zip(path.cycles, path.times, strict=True)]
    assert tasks.farthest(found, exact) < 1e-12


def test_peers_of_scipy(tasks: ModuleType) -> None:
    """Shooting and collocation, at a loose tolerance: the benchmark measures what it says."""
    dop853 = importlib.import_module("peers.dop853")
    exact = tasks.exact_fold()
    joints, params = tasks.joints_of(tasks.orbit_at(tasks.OMEGA)), (tasks.OMEGA, tasks.S, tasks.S0)
    how = dop853.Dop853(1e-8, refined=True)
    found, _ = tasks.shooting.orbit_by_newton(joints[0], params, how)
    assert found == pytest.approx(joints, abs=1e-6)
    found, _ = tasks.OrbitByCollocation(joints, params, tasks.NODES).solve(1e-5)
    assert found == pytest.approx(joints, abs=1e-5)
    task = tasks.branch_task()
    found, _ = tasks.BranchByCollocation(task, joints, tasks.NODES).follow(1e-3)
    assert found.fold == pytest.approx(float(exact), abs=1e-4)
