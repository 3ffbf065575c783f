"""Impacts that accumulate: a diagram ends there with its reason, whatever the start."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import contfric as cf
from contfric.atlas.completeness.verification import differences

WHERE = {"A": 0.1668338086444802, "w": 0.503, "k": 1.0, "c": 0.3, "d": 0.5}


def ratio_of_grazes(e: float) -> float:
    """Return by what successive grazes come closer: the inverse of how a chatter leaves the complete one.

    One flight in units of the time s that is left, with w the speed at its start and p its length::

        w = p/2 - p^2/6,    w' = e (p/2 - p^2/3) / (1 - p)^2

    for the speed after the next impact; the complete chatter is the fixed point.
    """
    left = brentq(lambda r: r**2 * (2.0 + r) - e * (1.0 + 2.0 * r), 1e-9, 1.0)
    p = 1.0 - left
    assert e * (p / 2 - p**2 / 3) / left**2 == pytest.approx(p / 2 - p**2 / 6)
    grows = e * ((1 / 2 - 2 * p / 3) / left**2 + 2 * (p / 2 - p**2 / 3) / left**3)
    return (1 / 2 - p / 3) / grows


@pytest.mark.parametrize("e", [0.2, 0.3, 0.5])
def test_a_cascade_of_grazes_ends_with_its_reason(e: float) -> None:
    # each graze adds an impact: without end, and each of them had taken longer than the one before
    orbit = cf.find_orbit("impact", WHERE | {"e": e})
    diagram = cf.explore(orbit, "A", (0.01, 1.0), max_periods=1)
    assert diagram.complete
    assert not diagram.notes
    (end,) = diagram.loose_ends
    last = end.end.bifurcation
    assert last is not None
    assert ["impacts accumulate" in p.why for p in last.proposals] == [True]
    grazes = np.array(sorted(b.params["A"] for b in diagram.of_kind("GS")))
    gaps = np.diff(grazes)
    assert len(gaps) >= 5
    assert gaps[-1] / gaps[-2] == pytest.approx(ratio_of_grazes(e), rel=0.03)
    assert math.isclose(grazes[-1], last.params["A"])
    # the branch that begins last has been refused at its far end only
    branch = diagram.branches[end.branch]
    again = cf.explore(branch[len(branch) // 2], "A", (0.01, 1.0), max_periods=1, max_step=0.02)
    assert not list(differences(again, diagram))
    assert not list(differences(diagram, again))


def test_a_graze_after_few_impacts_is_followed() -> None:
    orbit = cf.find_orbit("impact", WHERE | {"e": 0.3, "A": 0.6})
    diagram = cf.explore(orbit, "A", (0.55, 0.62), max_periods=1)
    assert not diagram.loose_ends
    assert not any("accumulate" in p.why for b in diagram.bifurcations for p in b.proposals)
