"""Events that follow each other faster and faster without an end, and those that only look like it."""

from collections.abc import Callable

import numpy as np
import pytest
from typed import typed

import contfric as cf
from contfric.orbit.finding.rest import quickens
from contfric.simulation.simulate import SimulationEnd

#: As many events as `find_orbit` meets before it asks.
EVENTS = 100_000

#: A switch with a lag: the surface and its rate come to 0 together, in turns like 1/n.
LAGGED = """
name: lagged
states: [v, u]
parameters: {lag: 0.3, A: 0.5, W: 0.2}
period: 2*pi/W
surfaces: {switch: {observable: v}}
field: {v: A*cos(W*t) - u, u: (sign(v) - u)/lag}
"""

#: A ball whose restitution comes to 1 at low speeds: they go down like 1/n.
BALL = """
name: ball
states: [x, v]
parameters: {A: 0.5, g: 1.0, vc: 2.0, W: 1.0}
period: 2*pi/W
define: {rel: v - A*W*cos(W*t), e: exp(-abs(rel)/vc)}
surfaces: {table: {observable: x - A*sin(W*t)}}
modes: {flight: {in: {table: +}, field: {x: v, v: -g}}}
resets: {table: {v: A*W*cos(W*t) - e*rel}}
"""

#: A switch with hysteresis z, which falls to z1: events come ever faster for long, and then evenly.
CHIRP = """
name: chirp
states: [x, z]
parameters: {r: 0.01, z1: 0.01, A: 0.5, W: 0.001}
period: 2*pi/W
surfaces: {high: {observable: x - z}, low: {observable: x + z}}
modes:
  up: {in: {high: -}, field: {x: 1 + A*cos(W*t), z: -r*(z - z1)}}
  down: {in: {low: +}, field: {x: -1 + A*cos(W*t), z: -r*(z - z1)}}
"""

Draw = Callable[[np.random.Generator], tuple[dict[str, float], list[float]]]


def lagged(draw: np.random.Generator) -> tuple[dict[str, float], list[float]]:
    where = {"lag": 10 ** draw.uniform(-2, -0.5), "A": draw.uniform(0.1, 0.9)}
    return where | {"W": 10 ** draw.uniform(-1, -0.5)}, [1.0, 0.0]


def ball(draw: np.random.Generator) -> tuple[dict[str, float], list[float]]:
    W, g = draw.uniform(0.3, 1.2), draw.uniform(0.5, 2.0)
    A = draw.uniform(0.1, 0.9) * g / W**2  # the table never falls faster than the ball
    return {"A": A, "g": g, "vc": 10 ** draw.uniform(-0.2, 0.8), "W": W}, [A + 0.5, 0.0]


def chirp(draw: np.random.Generator) -> tuple[dict[str, float], list[float]]:
    """Draw a switch that quickens by up to 50 times after a flight, while the middle of its levels moves."""
    z = 10 ** draw.uniform(-3, -1)
    where = {"r": 10 ** draw.uniform(-5, -1) / z, "z1": z * 10 ** draw.uniform(-1.7, -0.3)}
    return where | {"A": draw.uniform(0.0, 0.95), "W": z * 10 ** draw.uniform(-5, -3)}, [
        -draw.uniform(),
        z,
    ]


@pytest.mark.parametrize(
    ("text", "draws", "without_end"),
    [(LAGGED, lagged, True), (BALL, ball, True), (CHIRP, chirp, False)],
    ids=["lagged", "ball", "chirp"],
)
def test_events_that_quicken(tmp_path, text: str, draws: Draw, without_end: bool) -> None:
    model, draw, seen = typed(tmp_path, text), np.random.default_rng(5), 0
    for _ in range(6):
        where, state = draws(draw)
        longest = 20_000_000.0 * where["W"]
        run = cf.simulate(model, where, state=state, periods=longest, events=EVENTS)
        if run.end is not SimulationEnd.EVENTS:
            continue  # so near to the limit that no time passes between two events
        seen += 1
        assert quickens(run, 2.0 * np.pi / where["W"]) == without_end, where
    assert seen >= 3
