"""The orders of both integrators, their coefficients, and errors in proportion to tolerances."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest
from catalogue import OSCILLATOR, flow
from fixed_steps import fixed_steps

from contfric.flow.integration import dop853
from contfric.flow.integration.collocation import collocation_matrix, radau_nodes

NONE, NOTHING = np.empty(0, dtype=np.int64), np.empty((0, 0))
PARAMETERS = np.array([1.0, 1e-13, *np.zeros(9)])
START = np.array([0.5, 1.2])


def slope_of(steps, errors):
    return np.polyfit(np.log(1.0 / np.array(steps)), np.log(errors), 1)[0]


def after(implicit, steps, dt=2.0):
    out = np.empty(2 + 2 * 4)
    fixed_steps(implicit, OSCILLATOR, START, dt, steps, PARAMETERS, np.array([0]), out)
    return out


@pytest.mark.parametrize(
    ("implicit", "order", "steps"), [(False, 8, (8, 12, 18, 26)), (True, 13, (2, 3, 4))]
)
def test_order(implicit, order, steps):
    exact = after(False, 400)
    errors = np.array([np.abs(after(implicit, n) - exact) for n in steps])
    assert slope_of(steps, errors[:, :2].max(axis=1)) == pytest.approx(order, abs=1.0)
    assert slope_of(steps, errors[:, 2:].max(axis=1)) == pytest.approx(order, abs=1.0)


def test_variations_are_the_derivatives_of_the_discrete_map():
    # with few long steps the map is far from the flow, but not from its own derivatives
    for implicit, steps in ((False, 3), (True, 1)):
        base = after(implicit, steps)
        for j in range(2):
            moved = []
            for side in (1e-5, -1e-5):
                out = np.empty(10)
                start = START + side * np.eye(2)[j]
                fixed_steps(implicit, OSCILLATOR, start, 2.0, steps, PARAMETERS, np.array([0]), out)
                moved.append(out[:2])
            difference = (moved[0] - moved[1]) / 2e-5
            assert np.abs(difference - base[2:].reshape(2, 4)[:, 1 + j]).max() < 1e-8


def test_error_is_in_proportion_to_the_tolerance():
    tolerances = 10.0 ** np.arange(-12, -4)
    exact, errors = np.empty(2), []
    flow(OSCILLATOR, 0.0, START, 6.0, PARAMETERS, NONE, exact, NOTHING)
    for tolerance in tolerances:
        p, y1 = np.array([1.0, tolerance, *np.zeros(9)]), np.empty(2)
        flow(OSCILLATOR, 0.0, START, 6.0, p, NONE, y1, NOTHING)
        errors.append(np.abs(y1 - exact).max())
    errors = np.array(errors)
    assert np.polyfit(np.log(tolerances), np.log(errors), 1)[0] == pytest.approx(1.0, abs=0.15)
    assert np.all(errors < 3.0 * tolerances)
    assert np.all(errors > 1e-3 * tolerances)  # nor is more done than was asked for


def test_coefficients_of_order_eight():
    b, c, a = dop853._WEIGHT, dop853._NODES, dop853._STAGE
    assert np.abs(a.sum(axis=1) - c).max() < 4e-15
    for k in range(8):
        assert b @ c**k == pytest.approx(1.0 / (k + 1), abs=1e-14)
        # b^T A c^k and b^T diag(c) A c^k: two families of the order conditions
        if k < 7:
            assert b @ (a @ c**k) == pytest.approx(1.0 / ((k + 1) * (k + 2)), abs=1e-14)
        if k < 6:
            assert (b * c) @ (a @ c**k) == pytest.approx(1.0 / ((k + 1) * (k + 3)), abs=1e-14)
    assert abs(dop853._ERROR5.sum()) < 1e-14
    assert abs(dop853._ERROR3.sum()) < 1e-14


@pytest.mark.parametrize("s", [3, 5, 7])
def test_radau_nodes_and_matrix(s):
    with mp.workdps(40):
        exact = [
            mp.findroot(lambda x: mp.legendre(s, 2 * x - 1) - mp.legendre(s - 1, 2 * x - 1), c)
            for c in radau_nodes(s)[:-1]
        ] + [mp.mpf(1)]
        powers = mp.matrix(s, s)
        for i in range(s):
            for k in range(s):
                powers[i, k] = exact[i] ** k
        inverse = powers**-1
        matrix = np.array(
            [
                [
                    float(mp.fsum(exact[i] ** (k + 1) / (k + 1) * inverse[k, j] for k in range(s)))
                    for j in range(s)
                ]
                for i in range(s)
            ]
        )
    assert np.abs(radau_nodes(s) - np.array(exact, dtype=float)).max() < 2e-16
    assert np.abs(collocation_matrix(radau_nodes(s)) - matrix).max() < 2e-15
    assert math.isclose(collocation_matrix(radau_nodes(s))[-1].sum(), 1.0, rel_tol=1e-15)
