"""Orders of convergence: Newton doubles its digits, and located events do not depend on the step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import contfric as cf
from contfric.bvp.blocks import linearise
from contfric.orbit.solve import refine

CASES = {
    "1a": {"Omega": 0.5, "S": 0.32, "S0": 0.4},
    "2s": {"Omega": 0.45, "S": 0.32, "S0": 0.4},
    "0s": {"Omega": 0.58, "S": 0.32, "S0": 0.4},
    "1a-9seg": {"Omega": 0.5, "S": 0.04, "S0": 0.4},
    "2a-14seg": {"Omega": 0.5, "S": 0.06, "S0": 0.4},
}


def newton_step(orbit: cf.Orbit) -> np.ndarray:
    """The correction of the joints at fixed parameters, from the library's blocks by a dense solve."""
    system = orbit.system
    count, m = orbit.joints.shape
    size = len(orbit.vector)
    a, b = np.empty((count, m, m)), np.empty((count, m, m))
    c, r = np.empty((count, m, size)), np.empty((count, m, 1))
    close = np.empty((m, m))
    which = np.arange(size)
    args = (
        system.functions(),
        system.layout,
        orbit.joints,
        orbit.vector,
        which,
        1,
        a,
        b,
        c,
        r,
        close,
    )
    assert linearise(*args)
    full = np.zeros((count * m, count * m))
    for i in range(count):
        rows = slice(i * m, (i + 1) * m)
        full[rows, rows] += a[i]
        after = (i + 1) % count
        columns = slice(after * m, (after + 1) * m)
        full[rows, columns] += b[i] if after else b[i] @ close
    return np.linalg.solve(full, r.reshape(-1)).reshape(count, m)


@pytest.mark.parametrize("name", CASES)
def test_newton_is_quadratic(name: str) -> None:
    """One step from a distance e leaves an error proportional to e^2: the slope over four decades."""
    orbit = cf.solve_orbit("coulomb", name, CASES[name])
    direction = np.random.default_rng(8).standard_normal(orbit.joints.shape)
    direction /= np.max(np.abs(direction))
    distances = 10.0 ** np.arange(-2.5, -6.0, -0.5)
    left = []
    for e in distances:
        moved = replace(orbit, joints=orbit.joints + e * direction)
        left.append(np.max(np.abs(moved.joints + newton_step(moved) - orbit.joints)))
    slope = np.polyfit(np.log(distances), np.log(left), 1)[0]
    assert slope == pytest.approx(2.0, abs=0.1), left


@pytest.mark.parametrize("name", CASES)
def test_solved_from_afar_nothing_is_left(name: str) -> None:
    """From 1e-3 away the library's Newton comes back to rounding."""
    orbit = cf.solve_orbit("coulomb", name, CASES[name])
    noise = np.random.default_rng(9).uniform(-1e-3, 1e-3, orbit.joints.shape)
    for damped in (False, True):
        solved = refine(replace(orbit, joints=orbit.joints + noise), damped=damped)
        assert solved.converged and solved.residual < 1e-14
        assert np.max(np.abs(solved.joints - orbit.joints)) < 1e-12


@pytest.mark.parametrize("name", CASES)
def test_jacobian_in_the_parameters(name: str) -> None:
    """Blocks of the parameters, the period's included, against central differences."""
    orbit = cf.solve_orbit("coulomb", name, CASES[name])

    def residual(vector: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        count, m = orbit.joints.shape
        a, b = np.empty((count, m, m)), np.empty((count, m, m))
        c, r = np.empty((count, m, len(vector))), np.empty((count, m, 1))
        system = orbit.system
        which = np.arange(len(vector))
        args = (system.functions(), system.layout, orbit.joints, vector, which, 1, a, b, c, r)
        assert linearise(*args, np.empty((m, m)))
        return -r[:, :, 0], c

    slopes = residual(orbit.vector)[1]
    for k in range(len(orbit.vector)):
        step = np.zeros_like(orbit.vector)
        step[k] = 1e-6
        up, down = (residual(orbit.vector + sign * step)[0] for sign in (1, -1))
        # rounding 1e-15 * size / 1e-6 and the third derivative times 1e-12
        size = 1.0 + np.max(np.abs(slopes[:, :, k]))
        assert np.max(np.abs((up - down) / 2e-6 - slopes[:, :, k])) < 1e-8 * size


STEPS = (0.05, 0.02, 0.008, 0.003)


def test_events_do_not_depend_on_the_step() -> None:
    orbit = cf.solve_orbit("coulomb", "1a", CASES["1a"])
    located = []
    for max_step in STEPS:
        branch = cf.continue_orbit(orbit, "Omega", (0.4, 0.6), max_step=max_step)
        located.append([(b.kind.value, b.params["Omega"]) for b in branch.bifurcations])
    first = located[0]
    assert [kind for kind, _ in first] == ["SS", "T", "SN", "CS"]
    for other in located[1:]:
        assert [kind for kind, _ in other] == [kind for kind, _ in first]
        for (_, a), (_, b) in zip(first, other, strict=True):
            assert a == pytest.approx(b, rel=1e-12)


def test_points_between_steps_lie_on_the_branch_to_second_order() -> None:
    """The chord between neighbouring points misses the branch by the square of their distance: the
    points themselves carry no error that would show as a lower order."""
    orbit = cf.solve_orbit("coulomb", "2s", CASES["2s"])
    errors, distances = [], []
    for max_step in (0.05, 0.025, 0.0125, 0.00625, 0.003):
        branch = cf.continue_orbit(orbit, "Omega", (0.4, 0.5), max_step=max_step)
        i = int(np.argmin(np.abs(branch.values - 0.43)))
        vector = branch[i].vector.copy()
        vector[orbit.model.index_of("Omega")] = 0.5 * (branch.values[i] + branch.values[i + 1])
        middle = 0.5 * (branch.joints[i] + branch.joints[i + 1])
        exact = refine(replace(branch[i], joints=middle, vector=vector), damped=False)
        assert exact.converged
        errors.append(float(np.max(np.abs(exact.joints - middle))))
        distances.append(abs(float(branch.values[i + 1] - branch.values[i])))
    slope = np.polyfit(np.log(distances), np.log(errors), 1)[0]
    assert slope == pytest.approx(2.0, abs=0.2), (distances, errors)
