"""Where a block that rocks is upright without speed every combination of its two feet goes on.

Each foot may be lifted just then (two impacts come in) or not: of a symmetric orbit with an impact on either
side those with both, with one (and its mirror image) and with none leave the event. Whether what leaves is a
motion is asked of another way: the solution in closed form, from impact to impact, over a period.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import contfric as cf

#: Blocks whose unstable symmetric orbit meets the event between the bounds of the search.
BLOCKS = [
    (2.0, 0.85),
    *((1.8 + 0.6 * w, 0.75 + 0.15 * r) for w, r in np.random.default_rng(5).random((3, 2))),
]
#: A scan of so many times sees an excursion that lasts 1e-3 periods: shorter ones are next to the event.
SCAN = 4000
#: Where in a flight the period begins: no impact falls on a time of the scan.
INSIDE = 0.4137


def moved(t: float, state: tuple[float, float], side: float, later: float, a: float, W: float):
    """Return angle and rate after some time on one foot: cosh and sinh beside the forced part."""
    force = a / (1.0 + W * W)
    p = state[0] - side - force * math.cos(W * t)
    q = state[1] + W * force * math.sin(W * t)
    c, s = math.cosh(later), math.sinh(later)
    end = W * (t + later)
    return side + force * math.cos(end) + p * c + q * s, -W * force * math.sin(end) + p * s + q * c


def _height(later: float, *motion) -> float:
    t, state, side, a, W = motion
    return moved(t, state, side, later, a, W)[0]


def impacts_of_a_period(
    t: float, state: tuple[float, float], side: float, a: float, W: float, r: float
):
    """Return the state after a period from one inside a flight, and the number of impacts."""
    left, count = 2.0 * math.pi / W, 0
    step = left / SCAN
    while True:
        ahead = np.arange(1, int(left / step) + 2) * step
        ahead = np.minimum(ahead, left)
        met = next((x for x in ahead if side * moved(t, state, side, x, a, W)[0] < 0.0), None)
        if met is None:
            return moved(t, state, side, left, a, W), count
        bracket = max(met - step, 1e-3 * step), met
        later = brentq(_height, *bracket, args=(t, state, side, a, W), xtol=1e-15)
        rate = moved(t, state, side, later, a, W)[1]
        t, left, side, state, count = t + later, left - later, -side, (0.0, r * rate), count + 1


@pytest.mark.parametrize(("W", "r"), BLOCKS)
def test_every_combination_of_feet_leaves_the_event(W: float, r: float) -> None:
    start = cf.find_orbit("rocking-block", {"a": 0.4, "W": W, "r": r})
    diagram = cf.explore(start, "a", (0.1, 3.0), max_periods=1, max_branches=3)
    node = next(
        node
        for node in diagram.events
        if node.bifurcation.kind is cf.Kind.GS and 0 in node.branches
    )
    leaving = [diagram.branches[i] for i in node.branches]
    counts = sorted(len(branch[0].as_whole().itinerary) for branch in leaving)
    assert counts == [2, 4, 4, 6]
    for branch in leaving:
        orbit = branch[len(branch) // 2].as_whole()
        k = int(np.argmax(orbit.durations))
        begin = float(orbit.begins[k, 0] + INSIDE * orbit.durations[k])
        state, side = orbit.state(begin), 1.0 if orbit.itinerary[k][0] == "right" else -1.0
        a = orbit.params["a"]
        again, impacts = impacts_of_a_period(begin, (state[0], state[1]), side, a, W, r)
        assert impacts == len(orbit.itinerary)
        assert again == pytest.approx(tuple(state), abs=1e-8)
