"""Curves along which two sliding events happen at once are one curve, and said to be."""

from __future__ import annotations

import numpy as np

import contfric as cf


def test_where_the_load_stands_still_at_a_stop_a_corner_and_an_exit_are_one_curve() -> None:
    """At Omega = 1/2 both stops of 0s are on the limit where 1/3 - 9 h / 5 = S0, whatever S: h = -1/27."""
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    ranges, sections = {"h": (-0.1, 0.1), "S": (0.0, 0.4)}, {"h": [-0.05, 0.0, 0.05]}
    plane = cf.explore_plane(
        orbit, ("h", "S"), ranges, sections=sections, max_periods=1, max_sections=6
    )
    there = [
        k
        for k, curve in enumerate(plane.curves)
        if np.max(np.abs(curve.parts[0].values[:, 0] + 1.0 / 27.0)) < 1e-6
    ]
    kinds = {part.kind.value for k in there for part in plane.curves[k].parts}
    assert len(there) > 1
    assert kinds == {"AS", "CS"}
    assert {plane.twins[k] for k in there} == {there[0]}
    assert [note for note in plane.notes if "codimension two" in note]
    others = [k for k in range(len(plane.curves)) if k not in there]
    assert all(plane.twins[k] not in there for k in others)
