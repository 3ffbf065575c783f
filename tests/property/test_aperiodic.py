"""Solutions that come to no orbit: how long they are followed, and what is said of them."""

from __future__ import annotations

import pytest
from typed import typed

import contfric as cf
from contfric.orbit.finding.aperiodic import MOST, affordable, why_none


def test_fewer_periods_are_followed_where_a_period_is_much_work() -> None:
    small, large = cf.load_model("two-blocks"), cf.load_model("beam-stop")
    assert affordable(small, 200, 0) == affordable(small, 200, 400) == MOST
    periods = [affordable(large, 200, events) for events in (200, 400, 10_000)]
    assert MOST > periods[0] > periods[1] > periods[2] == 1000


def test_chaos_is_told_from_motion_that_contracts() -> None:
    chaotic = cf.simulate("beam-stop", {"W": 6.1}, periods=100)
    error = why_none(chaotic, 100, None, compared=True)
    assert isinstance(error, cf.AperiodicError)
    assert "it is chaotic" in str(error)
    assert "chaotic" not in str(why_none(chaotic, 100, None, compared=False))
    contracts = cf.simulate("two-blocks", {"vb": 0.2}, periods=100)
    assert "stay close" in str(why_none(contracts, 100, None, compared=True))


#: Omega and S of chaotic attractors of `coulomb` whose exponent is so small (0.003 to 0.006 per unit of time)
#: that two solutions part by a factor of less than 1000 in 100 periods.
WEAK = [(0.45, 0.03), (0.48, 0.08), (0.5, 0.03), (0.5, 0.05), (0.51, 0.03), (0.53, 0.03)]


@pytest.mark.parametrize(("omega", "friction"), WEAK)
def test_weak_chaos_is_not_called_quasi_periodic(omega, friction) -> None:
    params = {"Omega": omega, "S": friction, "S0": 0.4}
    exponents = cf.lyapunov_exponent("coulomb", params)
    assert exponents.motion is cf.Motion.CHAOTIC and exponents.largest < 0.006
    with pytest.raises(cf.AperiodicError, match="it is chaotic"):
        cf.find_orbit("coulomb", params)


@pytest.mark.slow
def test_a_large_structure_that_is_chaotic_is_called_so_in_seconds() -> None:
    with pytest.raises(cf.AperiodicError, match=r"found in 1\d\d\d periods.*it is chaotic"):
        cf.find_orbit("beam-stop", {"W": 6.1})


LAG = """
name: lag
states: [x, v, u]
parameters: {tau: 0.5, k: 0.3}
autonomous: true
surfaces: {switch: {observable: x + k*v}}
modes:
  plus: {in: {switch: -}, field: {x: v, v: u, u: (1 - u)/tau}}
  minus: {in: {switch: +}, field: {x: v, v: u, u: (-1 - u)/tau}}
"""


@pytest.mark.parametrize("k", [0.1, 0.3, 0.45])
def test_slow_growth_is_not_called_quasi_periodic(tmp_path, k: float) -> None:
    """A switch is late by d = tau - k: v grows by 2 d there, and the way back takes 2 v. So v^2 = 2 d t."""
    model = typed(tmp_path, LAG)
    trajectory = cf.simulate(model, {"k": k}, state=(10, 0, 0), periods=20_000)
    assert trajectory.states[-1, 1] ** 2 == pytest.approx(2.0 * (0.5 - k) * 20_000, rel=0.05)
    error = str(why_none(trajectory, 20_000, None, compared=True))
    assert "grows" in error and "quasi-periodic" not in error
