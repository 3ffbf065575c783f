"""A slope that is rounding at a sliding event makes no fold there, even where Newton fails at it.

Where curves of orbits cross at the end of a bridge the parameter stands, and its slope has either sign there.
Of bridges of random cases the last step is taken with slopes of either sign at the event, and Newton's method
is made to fail between: nothing is reported. One that turns before is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.completeness.verification import STEP, differences
from contfric.base.attributes import altered
from contfric.continuation import events_of_step as resolve
from contfric.continuation.locating import smooth
from contfric.continuation.points import LARGEST_STEP
from contfric.events.bifurcation import Kind

RANGE = (-0.39, -0.15)


def _scene(seed):
    rng = np.random.default_rng(seed)
    near = {"Omega": 1.0 / 3.0, "S": 0.49, "S0": 0.997, "h": -0.295}
    return {k: v * rng.uniform(0.97, 1.03) for k, v in near.items()} | {
        "zeta": rng.uniform(0.03, 0.07)
    }


def _last_steps(monkeypatch, seed):
    """Return what the last steps of bridges are asked with that end where their parameter stands."""
    asked = []

    def smooth_events(step):
        ends = step.beyond is not step.after and step.before.arc < step.beyond.arc
        if step.orbit.system.holds and ends:
            asked.append(step)
        return smooth.smooth_events(step)

    with monkeypatch.context() as patched:
        patched.setattr(resolve, "smooth_events", smooth_events)
        cf.explore(cf.find_orbit("coulomb", _scene(seed)), "h", RANGE, max_periods=2)
    return [s for s in asked if abs(s.beyond.slope) < 1e-8 and abs(s.before.slope) > 1e-5]


def _folds(step, slope, turns=False):
    before, event = step.before, step.beyond
    base = len(event.tests) - smooth.EXTRA
    direction, tests, w = event.direction.copy(), event.tests.copy(), event.w.copy()
    direction[0] = tests[base] = slope
    if turns:  # the parameter as well
        w[0] = before.value + 0.5 * (before.slope + slope) * (event.arc - before.arc)
    event = altered(event, direction=direction, tests=tests, w=w)
    found = smooth.smooth_events(replace(step, beyond=event))
    return [bifurcation for bifurcation, _ in found if bifurcation.kind is Kind.SN]


@pytest.mark.parametrize("seed", [2, 16, 24, 26])
def test_no_fold_at_an_event_at_which_the_parameter_stands(monkeypatch, seed):
    steps = _last_steps(monkeypatch, seed)
    assert steps
    monkeypatch.setattr(smooth, "locate_change", lambda *_: None)
    rng = np.random.default_rng(seed)
    for step in steps:
        slope = step.before.slope
        rounding = -np.sign(slope) * 10.0 ** rng.uniform(-12.0, -8.0)
        assert not _folds(step, rounding)
        if abs(slope) * (step.beyond.arc - step.before.arc) > 1e-6:  # else it does not turn visibly
            assert _folds(step, -0.9 * slope, turns=True)


@pytest.mark.parametrize("case", [None, 0])
def test_no_fold_nearer_to_the_end_than_it_is_known(case):
    # a bridge ends at a symmetric event, where its equations are singular: the last slope is rounding
    params = {"Omega": 0.3304912975852031, "S": 0.12321992631306294, "S0": 0.14752034469202718}
    bounds = (-0.10758881451932725, 0.14092353092033202)
    if case is not None:
        random = np.random.default_rng([9494, case])
        limit = params["S0"] * (1 + random.uniform(-0.1, 0.1))
        friction = limit * (0.835 + random.uniform(-0.06, 0.06))
        omega = params["Omega"] * (1 + random.uniform(-0.04, 0.04))
        params, bounds = {"Omega": omega, "S": friction, "S0": limit}, (-0.11, 0.14)
    orbit = cf.find_orbit("coulomb", {**params, "h": 0.0, "zeta": 0.0}, longest=1000)
    diagram = cf.explore(orbit, "h", bounds)
    first = diagram.branches[0]
    again = cf.explore(first[len(first) // 2], "h", bounds, max_step=STEP * LARGEST_STEP)
    assert [*differences(diagram, again), *differences(again, diagram)] == []
