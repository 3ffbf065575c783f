"""Solutions that come to no orbit: how long they are followed, and what is said of them."""

from __future__ import annotations

import pytest

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
