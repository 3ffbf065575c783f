"""Curves along which two sliding events happen at once are one curve, and said to be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import contfric as cf
from contfric.atlas.plane.known_curves import at_once, twins_of
from contfric.curves.curve import Curve, CurvePart

RANGES = {"h": (-0.1, 0.1), "S": (0.0, 0.4)}


def coarser(part: CurvePart, kind: cf.Kind) -> CurvePart:
    """Return every second point of a piece of a curve, under another name."""
    names = ("values", "joints", "arc", "labels", "turn_multipliers")
    return replace(part, kind=kind, **{name: getattr(part, name)[::2] for name in names})


def another(curve: Curve, kind: cf.Kind) -> Curve:
    """Return a curve with fewer points and another name."""
    return replace(curve, parts=tuple(coarser(part, kind) for part in curve.parts))


def test_curves_of_two_kinds_with_the_same_solutions_are_one() -> None:
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    plane = cf.explore_plane(
        orbit, ("h", "S"), RANGES, sections={"h": [0.05]}, max_periods=1, max_sections=1
    )
    curves = [c for c in plane.curves if c.parts[0].kind is cf.Kind.CS and len(c.parts) == 1]
    curve = max(curves, key=lambda c: float(c.parts[0].arc[-1]))
    smooth = next(c for c in plane.curves if c.parts[0].kind is cf.Kind.BP)
    known = [smooth, curve, another(curve, cf.Kind.AS), another(curve, cf.Kind.CS)]
    twins = twins_of(known)
    assert twins == (0, 1, 1, 1)
    (note,) = at_once(known, twins)
    assert "one curve" in note and "codimension two" in note
    assert not at_once([curve, known[3]], (0, 0))  # of one kind


def test_where_the_load_stands_still_at_a_stop_a_corner_and_an_exit_are_one_curve() -> None:
    """At Omega = 1/2 both stops of 0s are on the limit where 1/3 - 9 h / 5 = S0, whatever S: h = -1/27.

    Everything is degenerate there, so that whether a curve is followed along it is rounding: the note of the
    events that are not, or that of the curves that are one, says what is there.
    """
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    sections = {"h": [-0.05, 0.0, 0.05], "S": [0.3]}
    plane = cf.explore_plane(
        orbit, ("h", "S"), RANGES, sections=sections, max_periods=1, max_sections=6
    )
    there = [
        k
        for k, curve in enumerate(plane.curves)
        if np.max(np.abs(curve.parts[0].values[:, 0] + 1.0 / 27.0)) < 1e-6
    ]
    assert {plane.twins[k] for k in there} == set(there[:1])
    kinds = {part.kind for k in there for part in plane.curves[k].parts}
    told = [note for note in plane.notes if "codimension two all along" in note]
    assert bool(told) == (kinds == {cf.Kind.AS, cf.Kind.CS})
    assert [
        n for n in plane.notes if "S=0.3" in n and "h=-0.037037037037" in n and "degenerate" in n
    ]
    others = [k for k in range(len(plane.curves)) if k not in there]
    assert all(plane.twins[k] not in there for k in others)
