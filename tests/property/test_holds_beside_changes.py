"""Bridges of structures while another contact changes its state: short slides, and the order of changes."""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf

#: Scenes drawn with a bridge along which a slide after a hold ends as the other mass stops, and lasts less
#: than 0.1, or the two masses change in another order.
SEEDS = (2, 57, 73)
#: What a velocity differs from zero by at a stop: rounding of a segment.
STOPPED = 1e-9


def drawn(seed: int) -> cf.Diagram:
    """Explore two masses on friction, the first of which is driven."""
    r = np.random.default_rng([77, seed])
    k = r.uniform(0.5, 1.5)
    stiffness = np.array([[1.0 + k, -k], [-k, 1.0 + k]])
    kinetic = [r.uniform(0.1, 0.3) for _ in range(2)]
    static = [s * r.uniform(1.05, 1.6) for s in kinetic]
    force, w = r.uniform(0.5, 1.2), r.uniform(0.3, 0.9)
    model = cf.Mechanism(
        np.eye(2),
        0.04 * stiffness,
        stiffness,
        contacts={
            name: {"kind": "friction", "velocity": f"v{i + 1}", "kinetic": k, "static": s}
            for i, (name, k, s) in enumerate(zip(("low", "high"), kinetic, static, strict=True))
        },
        force={"q1": "F*cos(w*t)"},
        parameters={"w": w, "F": force},
        period="2*pi/w",
    )
    return cf.explore(cf.find_orbit(model), "w", (0.9 * w, 1.1 * w), max_periods=1)


@pytest.mark.parametrize("seed", SEEDS)
def test_slides_after_holds_end_where_they_say(seed: int) -> None:
    """At the end of a slide of any length the velocity of the mass that stops there is zero."""
    short = 0
    for branch in drawn(seed).branches:
        for point in branch if branch.bridge else ():
            for (_, exit_), end, lasts in zip(
                point.itinerary, point.ends, point.durations, strict=True
            ):
                if exit_ in ("low", "high"):
                    assert abs(end[3 if exit_ == "low" else 4]) < STOPPED
                    short += lasts < 0.1
        assert "STEP" not in [end.reason.name for end in branch.ends]
    assert short > 0


def test_masses_on_a_bridge_change_in_another_order() -> None:
    """One is released before the other one stops, and after it on the branch that goes on."""
    diagram = drawn(57)
    followed = [
        e for e in diagram.events if e.bifurcation.kind is cf.Kind.CS and len(e.branches) == 2
    ]
    bridges = [[diagram.branches[n] for n in e.branches] for e in followed]
    assert any(all(branch.bridge for branch in pair) for pair in bridges)
