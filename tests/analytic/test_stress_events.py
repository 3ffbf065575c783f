"""Events of random explorations against 50 digits: the first cases of ``benchmarks/stress/events.py``.

The whole run is there; here are as many as take seconds, and that an event that is off is told.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import bordered
import chain
import events
import pytest
from mpmath import mp, mpf
from report import Tally

import contfric as cf
from contfric.continuation.accuracy import rounding
from contfric.events.bifurcation import ACCURACY

DIAGRAMS = {
    "S": ({"Omega": 0.5, "S": 0.3, "S0": 0.4}, (0.03, 0.39)),
    "S0": ({"Omega": 0.6, "S": 0.3, "S0": 0.35}, (0.3, 0.8)),
    "h": ({"Omega": 0.5, "S": 0.3, "S0": 0.4}, (-0.3, 0.3)),
    "zeta": ({"Omega": 1.6, "S": 0.1, "S0": 0.1, "zeta": 0.05}, (-0.2, 0.1)),
}


@cache
def found(parameter: str) -> tuple[cf.Bifurcation, ...]:
    params, bounds = DIAGRAMS[parameter]
    diagram = cf.explore(cf.find_orbit("coulomb", params), parameter, bounds, bridges=False)
    # at a continuum (Omega = 1/2) events are located to the root of rounding, and say so
    return tuple(b for b in diagram.bifurcations if b.accuracy <= ACCURACY)


@pytest.mark.parametrize("parameter", DIAGRAMS)
def test_accuracy_is_a_bound_of_the_error(parameter: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the least value that is claimed: no smaller than the error, and not empty."""
    monkeypatch.setattr(rounding, "LEAST", 0.0)
    params, (low, high) = DIAGRAMS[parameter]
    orbit = cf.find_orbit("coulomb", params)
    diagram = cf.explore(orbit, parameter, (low, high), bridges=False)
    asked = 0
    for event in diagram.bifurcations:
        claimed = event.accuracy * (high - low)
        with mp.workdps(chain.DIGITS):
            try:
                exact = bordered.locate(event, parameter)
            except chain.NoReference:  # of two conditions at once, which says so
                assert event.accuracy > ACCURACY
                continue
            error = float(abs(exact.value - mpf(event.params[parameter])))
        assert error <= claimed, event
        assert claimed <= 1e3 * exact.allowed or event.accuracy > ACCURACY, event
        asked += 1
    assert asked > 0


def test_random_events() -> None:
    report = events.run(count=8, seed=12)
    assert not report.failed, report.failed
    kinds = [kind for kind in cf.Kind if report.passed.get(f"{kind.value}: its parameter")]
    assert len(kinds) >= 7


@pytest.mark.parametrize("parameter", DIAGRAMS)
def test_an_event_that_is_off_is_told(parameter: str) -> None:
    """By ten times what rounding explains, or twice 1e-12 of the parameter if that is more."""
    told = 0
    for event in found(parameter):
        value = event.params[parameter]
        with mp.workdps(chain.DIGITS):
            exact = bordered.locate(event, parameter)
            off = max(10.0 * exact.allowed, 2e-12 * abs(value))
            assert off < 1e-9
            vector = event.orbit.vector.copy()
            vector[event.orbit.model.index_of(parameter)] += off
            wrong = replace(
                event,
                params=event.params | {parameter: value + off},
                orbit=replace(event.orbit, vector=vector),
            )
            tally = Tally()
            events.events_of(tally, event, parameter, "")
            assert not tally.failed, tally.failed
            events.events_of(tally, wrong, parameter, "")
            told += len(tally.failed)
    assert told == len(found(parameter)) > 0
