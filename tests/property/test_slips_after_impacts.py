"""Impacts of masses that rub: a contact whose velocity an impact reverses or gives slips, and does not stick.

Every event of a simulation begins in its mode: what the mode moves on is met, what it lies beside is on its
side, to rounding. Masses went on with a stuck contact that moved.
"""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf

#: Rounding of heights of order 1 after hundreds of events.
NEAR = 1e-9


def drawn(seed: int) -> tuple[cf.Model, list[float]]:
    """Draw a chain of two or three masses that rub, with one or two walls, or impacts between two of them."""
    r = np.random.default_rng([71, seed])
    n = int(r.integers(2, 4))
    ends, own = r.uniform(0.3, 2.0, n + 1), r.uniform(0.5, 2.0, n)
    stiffness = np.diag(ends[:-1] + ends[1:]) - np.diag(ends[1:-1], 1) - np.diag(ends[1:-1], -1)
    w = float(r.uniform(0.4, 1.4))
    contacts: dict[str, dict[str, object]] = {}
    for i in range(n):
        kinetic = float(r.uniform(0.05, 0.2))
        if i == 0 or r.random() < 0.6:
            static = kinetic + float(r.choice([0.0, 0.1]))
            contacts[f"f{i}"] = {"kind": "friction", "velocity": f"v{i + 1}", "kinetic": kinetic}
            contacts[f"f{i}"] |= {"static": static} if static > kinetic else {}
    for wall in range(int(r.integers(1, 3))):
        i = int(r.integers(0, n))
        apart = f"q{i} - q{i + 1}" if i and r.random() < 0.5 else f"q{i + 1}"
        gap = f"{r.uniform(0.1, 0.4)} {'-+'[wall]} ({apart})"
        contacts[f"i{wall}"] = {
            "kind": "impact",
            "gap": gap,
            "restitution": float(r.uniform(0.4, 0.9)),
        }
    for i in range(1, n):
        apart = f"q{i} - q{i + 1}"
        limit = float(r.uniform(0.05, 0.3))
        jenkins = {"kind": "jenkins", "displacement": apart, "stiffness": 1.0, "limit": limit}
        contacts |= {f"j{i}": jenkins} if r.random() < 0.8 else {}
    names = [str(name) for name in r.permutation(list(contacts))]
    force = {f"q{i + 1}": f"{r.uniform(0.4, 1.5)}*cos({w}*t + {r.uniform(0, 3)})" for i in range(n)}
    model = cf.Mechanism(
        np.diag(own),
        0.05 * stiffness,
        stiffness,
        contacts={name: contacts[name] for name in names},
        force=force,
        period=f"2*pi/{w}",
    )
    elements = sum(contact["kind"] == "jenkins" for contact in contacts.values())
    return model, [0.0] * n + r.uniform(-0.3, 0.3, n).tolist() + [0.0] * elements


def fits(side: int, height: float | None) -> bool:
    """Tell whether a height is on a side, to rounding; of the surface that was met none is asked."""
    return height is None or (height * side >= -NEAR if side else abs(height) <= NEAR)


@pytest.mark.parametrize("seed", [0, 2, 20, 21])
def test_each_event_begins_in_its_mode(seed: int) -> None:
    model, state = drawn(seed)
    run = cf.simulate(model, state=state, periods=20)
    flow, struck = model.view(model.vector(run.params)), 0
    walls = {model.surface_index[r.surface] for r in model.resets}
    for k in range(len(run.times) - 1):
        t, y = float(run.times[k]), run.states[k]
        if int(run.exits[k]) in walls:
            y, struck = flow.reset(model.surfaces[int(run.exits[k])].name, t, y), struck + 1
        met = {model.phase, model.surfaces[int(run.exits[k])].name}
        heights = {s.name: flow.height(s.name, t, y) for s in model.surfaces if s.name not in met}
        own = model.domains_of(run.itinerary[k + 1][0])
        assert any(all(fits(side, heights.get(n)) for n, side in d.signs.items()) for d in own), k
    assert struck
