"""The period-adding cascade that lies under the bridge of Fig. 5, against simulation."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.matching import identity

PARAMS = {"Omega": 0.5, "S": 0.32, "S0": 0.4}


@cache
def diagram() -> cf.Diagram:
    return cf.explore(cf.find_orbit("coulomb", PARAMS), "Omega", (0.48, 0.55))


@cache
def windows() -> tuple[cf.Window, ...]:
    bridge = next(b for b in diagram().branches if b.bridge and not b.mirrored)
    return cf.period_adding(bridge, longest=6)


def test_the_windows_in_order() -> None:
    """Between two neighbours stands the itinerary of both, as in a Farey tree; then one turn of 1a more."""
    assert [w.itinerary for w in windows()] == [
        "1a-2a-2a",
        "1a-2a-1a-2a-2a",
        "1a-2a",
        "1a-1a-2a",
        "1a-1a-1a-2a",
        "1a-1a-1a-1a-2a",
        "1a-1a-1a-1a-1a-2a",
    ]
    lows = [w.range[0] for w in windows()]
    highs = [w.range[1] for w in windows()]
    assert lows == sorted(lows) and highs == sorted(highs)
    assert lows[0] < 0.49174881 < highs[0], "the first one lives next to 2a, too"
    assert lows[1] > 0.49174881 and highs[-1] < 0.49181666


@pytest.mark.slow
def test_every_simulation_in_the_gap_settles_on_a_itinerary_of_the_list_or_a_longer_one() -> None:
    known = {identity(w.branch[0]) for w in windows()}
    for value in np.linspace(0.4917489, 0.4918166, 40):
        orbit = cf.find_orbit("coulomb", {**PARAMS, "Omega": float(value)})
        if orbit.periods <= 6:
            assert identity(orbit) in known, orbit


@pytest.mark.parametrize("index", range(7))
def test_simulation_settles_on_the_itinerary(index: int) -> None:
    """From near the orbit: windows overlap a little, and two attractors have their basins there."""
    window = windows()[index]
    low, high = window.range
    orbit = window.branch[len(window.branch) // 2]
    assert low < orbit.params["Omega"] < high
    state = orbit.state(0.3) + np.array([1e-7, 0.0])
    found = cf.find_orbit("coulomb", orbit.params, state=state, time=0.3)
    assert found.periods == len(window.turns)
    assert identity(found) == identity(orbit)
    assert np.max(np.abs(np.sort(found.stops) - np.sort(orbit.stops))) < 1e-9
    assert found.stable and bool(np.all(window.branch.stable))


@pytest.mark.parametrize("index", range(7))
def test_a_window_ends_where_a_stop_meets_the_surface(index: int) -> None:
    """Just outside of the window the simulation leaves the itinerary within its period."""
    window = windows()[index]
    for end, side in zip(window.branch.ends, (0, -1), strict=True):
        assert end.reason is cf.EndReason.SS
        tip = window.branch[side]
        out = np.sign(tip.params["Omega"] - np.mean(window.range))
        for step, follows in ((-1e-9, True), (1e-9, False)):
            params = {**tip.params, "Omega": tip.params["Omega"] + out * step}
            # the orbit itself moves by less than its margin does: converge next to it first
            run = cf.simulate(
                "coulomb", params, state=tip.state(0.3), time=0.3, periods=16.0 * tip.periods
            )
            count = len(tip.itinerary)
            itinerary = run.itinerary[-12 * count :]
            repeats = all(
                itinerary[k] == itinerary[k + count] for k in range(len(itinerary) - count)
            )
            same = repeats and sorted(itinerary[:count]) == sorted(tip.itinerary)
            assert same is follows, (window, side, step)


def test_what_is_no_bridge_is_refused() -> None:
    with pytest.raises(cf.ParameterError, match="no bridge"):
        cf.period_adding(diagram().branches[0])
    with pytest.raises(cf.ParameterError, match="longest"):
        cf.period_adding(diagram().branches[2], longest=1)
