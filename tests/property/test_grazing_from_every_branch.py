"""Impacts that graze where the velocity is a section too: the same diagram from whichever branch.

The smooth orbit of a linear oscillator has a closed form, so its graze is known: there its amplitude is the
distance of the wall. Orbits with an impact now and then begin there, too. The forms of the solution at the
event once had a joint at the touch, where v = 0 is a section, and no impact could come in: what was found
depended on the branch that arrived.
"""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric.continuation.events import Kind

#: A wall this much nearer or farther than the amplitude (relative), and how far the distance varies.
BESIDE, VARIED = 0.03, 0.1


def amplitude(params: dict[str, float]) -> float:
    """Return the amplitude of the oscillator without a wall."""
    detuned = params["k"] - params["w"] ** 2
    return float(params["A"] / np.hypot(detuned, params["c"] * params["w"]))


def drawn(seed: int) -> dict[str, float]:
    """Return random parameters with a wall next to the amplitude."""
    rng = np.random.default_rng([43, seed])
    params = {
        "A": float(rng.uniform(0.5, 1.5)),
        "w": float(rng.uniform(0.5, 1.6)),
        "k": float(rng.uniform(0.6, 1.5)),
        "c": float(rng.uniform(0.15, 0.5)),
        "e": float(rng.uniform(0.2, 0.8)),
    }
    away = float(rng.choice([-1.0, 1.0]) * BESIDE)
    return params | {"d": amplitude(params) * (1.0 + away)}


@pytest.mark.parametrize("seed", range(12))
def test_restarts_agree_at_a_graze(seed: int) -> None:
    params = drawn(seed)
    reach = amplitude(params)
    orbit = cf.find_orbit("impact", params, longest=1000)
    diagram = cf.explore(
        orbit, "d", ((1.0 - VARIED) * reach, (1.0 + VARIED) * reach), max_periods=3
    )
    grazes = [e.bifurcation for e in diagram.events if e.bifurcation.kind is Kind.GS]
    found = [b for b in grazes if abs(b.params["d"] - reach) < 1e-8 * reach]
    assert len(found) == 1, f"{params}: {[str(b) for b in grazes]}"
    held = diagram.verify(4)
    assert all(restart.same for restart in held.restarts), f"{params}: {held}"
    assert all(balance.holds for balance in held.balances), f"{params}: {held}"
