"""How sliding ends does not depend on the default parameters, and no solution slides on beyond its limits."""

from __future__ import annotations

import logging
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from typed import typed

import contfric as cf

DRAGGED = """
name: dragged
states: [v]
parameters: {{S: {default}, c: {c}}}
period: 2*pi
surfaces: {{stop: {{observable: v, sliding: filippov}}}}
field: {{v: cos(t) - c*v - S*sign(v)}}
modes: {{forward: {{in: {{stop: +}}}}, backward: {{in: {{stop: -}}}}}}
"""


def _slide(start: float, friction: float, c: float) -> float:
    """Return when a slide that begins at rest ends: v' = cos t - c v - S in closed form."""

    def forced(t: float) -> float:
        return (c * math.cos(t) + math.sin(t)) / (1.0 + c * c) - friction / c

    def speed(t: float) -> float:
        return forced(t) - forced(start) * math.exp(-c * (t - start))

    return float(brentq(speed, start + 0.1, start + 3.0, xtol=1e-14))


@pytest.mark.parametrize("seed", range(4))
def test_a_contact_that_never_slips_at_the_defaults_slips_at_other_parameters(
    seed: int, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    draw = np.random.default_rng(seed)
    friction, c = draw.uniform(0.65, 0.95), draw.uniform(0.1, 0.5)
    model = typed(tmp_path, DRAGGED.format(default=draw.uniform(1.2, 3.0), c=c))
    assert model.filippov
    with caplog.at_level(logging.WARNING):
        orbit = cf.find_orbit(model, {"S": friction})
    assert not caplog.records  # it rests at all its joints, and is of order 1 between them
    begin = -math.acos(friction)
    end = _slide(begin, friction, c)
    expected = [begin, end, begin + math.pi, end + math.pi]
    found = np.sort(np.mod(orbit.begins[:, 0], math.tau))
    own = [t for t in found if min(abs(t - e % math.tau) for e in expected) < 1e-10]
    assert {round(t, 9) for t in own} == {round(e % math.tau, 9) for e in expected}
    assert orbit.stable and orbit.multipliers[0] == 0.0


OPEN = """
name: open
states: [x, v]
parameters: {S: 0.3, S0: 0.4, w: 0.5}
period: 2*pi/w
observables: {u: x - cos(w*t)}
surfaces: {F+: {observable: u, level: S0}, F-: {observable: u, level: -S0}, v: {observable: v}}
field: {x: v, v: -u - S*sign(v)}
modes: {f: {in: {v: +}}, b: {in: {v: -}}, s: {in: {v: 0, F+: -, F-: +}, field: {x: 0, v: 0}}}
departures: [{where: {F+: 0}, leaves: {v: +}}, {where: {F-: 0}, leaves: {v: -}}]
"""


@pytest.mark.parametrize("seed", range(3))
def test_a_solution_ends_where_its_sliding_mode_does_and_nothing_follows(
    seed: int, tmp_path: Path
) -> None:
    draw, file = np.random.default_rng(seed), tmp_path / "open.yaml"
    file.write_text(OPEN)  # its departures lead nowhere
    x, limit = draw.uniform(0.7, 0.9), draw.uniform(0.35, 0.45)
    motion = cf.simulate(file, {"S0": limit}, state=[x, 0.0], periods=20)
    assert motion.end.name == "IMPOSSIBLE"
    assert motion.last[3] == "s"
    phase = math.acos(x - limit) / 0.5  # cos(w t) = x - S0
    assert motion.last[1] == pytest.approx(phase, abs=1e-12)
    with pytest.raises(cf.ConvergenceError, match=r"has left the region of 's' at 'F[+-]'"):
        cf.find_orbit(file, {"S0": limit}, state=[x, 0.0])
    sweep = cf.sweep(file, "w", [0.45, 0.5, 0.55], {"S0": limit}, periods=20)
    basins = cf.basins(file, {"x": np.linspace(-1, 1, 3), "v": [0.0, 0.4]}, {"S0": limit})
    for text in (str(sweep), str(basins)):
        assert "no_solution" in text
    assert "error" in str(cf.check_model(file)).lower()
