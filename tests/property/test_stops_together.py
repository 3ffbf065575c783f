"""A Jenkins element and a friction contact that stop together: what follows, against time stepping."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

import contfric as cf
from contfric.simulation.simulate import SimulationEnd

#: Periods that are compared, and the step. Stops and slips are told a step late: the error is of that order,
#: times the few units of time over which it grows.
PERIODS, STEP, NEAR = 3, 1e-3, 2e-2


class Element(NamedTuple):
    """Numbers of two masses that rest on friction, with an element between them that slides, too."""

    friction: float
    stiffness: float
    limit: float
    w: float
    force: float


def drawn(seed: int) -> Element:
    """Draw an element."""
    r = np.random.default_rng([53, seed])
    return Element(
        *(float(r.uniform(*ends)) for ends in ((0.1, 0.4), (0.5, 2), (0.05, 0.15), (0.3, 1.3))),
        force=float(r.uniform(0.6, 1.5)),
    )


STIFFNESS = np.array([[1.5, -0.5], [-0.5, 1.5]])


def structure(e: Element) -> cf.Model:
    """Return it as a structure; one mass stops, then the other: the element stops with the second."""
    friction = {"kind": "friction", "kinetic": e.friction}
    jenkins = {"kind": "jenkins", "displacement": "q1 - q2"}
    return cf.Mechanism(
        np.eye(2),
        0.08 * STIFFNESS,
        STIFFNESS,
        contacts={
            "c1": {**friction, "velocity": "v1"},
            "c2": {**friction, "velocity": "v2"},
            "jk": {**jenkins, "stiffness": e.stiffness, "limit": e.limit},
        },
        force={"q1": f"{e.force}*cos({e.w}*t)"},
        period=f"2*pi/{e.w}",
    )


def stepped(e: Element, state: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Follow both masses and the stretch of the element by small steps; friction takes what speed it can.

    Impulses of friction are projected onto their limits, one after the other, as masses are not coupled
    within a step.
    """
    q1, q2, v1, v2, z = map(float, state)
    rows, t, h = [], 0.0, STEP
    for _ in range(len(times)):
        rows.append((q1, q2, v1, v2, z))
        f = -e.stiffness * z
        a1 = e.force * np.cos(e.w * t) - 1.5 * (q1 + 0.08 * v1) + 0.5 * (q2 + 0.08 * v2) + f
        a2 = 0.5 * (q1 + 0.08 * v1) - 1.5 * (q2 + 0.08 * v2) - f
        v1, v2 = v1 + h * a1, v2 + h * a2
        v1 -= min(max(v1, -h * e.friction), h * e.friction)
        v2 -= min(max(v2, -h * e.friction), h * e.friction)
        q1, q2, t = q1 + h * v1, q2 + h * v2, t + h
        z = min(max(z + h * (v1 - v2), -e.limit / e.stiffness), e.limit / e.stiffness)
    return np.array(rows)


#: Cases with segments of no length, in both orders of the stops, and one without; 0 is one in which a mass
#: that sticks keeps a velocity of rounding, while the element is at its limit until the other is released.
@pytest.mark.parametrize("seed", [0, 1, 3, 7, 9])
def test_of_an_element_between_two_masses_on_friction(seed: int) -> None:
    """Where both masses rest, the element does: three surfaces are met in one place, in any order."""
    e = drawn(seed)
    model = structure(e)
    found = cf.simulate(model, state=[1.5, 0.3, 0.0, 0.0, 0.0], periods=PERIODS)
    assert found.end is SimulationEnd.TIME
    times = np.arange(0.0, 0.999 * PERIODS * 2.0 * np.pi / e.w, STEP)
    there = stepped(e, np.array([1.5, 0.3, 0.0, 0.0, 0.0]), times)
    assert np.max(np.abs(found.sample(times[::50]) - there[::50])) < NEAR
