"""`check` says where rates have no slope at a surface, and only there."""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from by_scipy import after

import contfric as cf
from contfric.models.reading.files import from_data

#: A super-twisting controller with a disturbance; its root is written in some way.
TWISTING = """
name: twisting
states: [s, w]
parameters: {k: 1.5, q: 1.1, A: 0.8, W: 2.0}
period: 2*pi/W
surfaces: {switch: {observable: s}}
field: {s: "-k*ROOT + w + A*sin(W*t)", w: -q*sign(s)}
modes: {p: {in: {switch: +}}, n: {in: {switch: -}}}
symmetry: s -> -s, w -> -w, t -> t + T/2
"""


def twisting(root: str) -> cf.Model:
    return from_data(yaml.safe_load(TWISTING.replace("ROOT", root)))


@pytest.mark.parametrize("power", [0.25, 0.5, 1.5, 2])
def test_a_root_has_no_slope_where_it_vanishes(power: float) -> None:
    report = cf.check_model(twisting(f"abs(s)**{power}*sign(s)"))
    said = [f for f in report.findings if "no slope on surface 'switch'" in f.message]
    assert len(said) == (power < 1)
    assert all("mode 'p'" in f.message or "mode 'n'" in f.message for f in said)


def test_what_is_proposed_in_its_place_is_solved() -> None:
    """Half a period of the root itself, by scipy, leads to the mirror image but for what was put in."""
    model = twisting("s/sqrt(abs(s) + 1.0e-6)")
    assert not [f for f in cf.check_model(model).findings if "no slope" in f.message]
    orbit = cf.find_orbit(model)
    time, *start = orbit.begins[0]

    def field(t: float, y: np.ndarray) -> list[float]:
        root = np.sqrt(abs(y[0])) * np.sign(y[0])
        return [-1.5 * root + y[1] + 0.8 * np.sin(2 * t), -1.1 * np.sign(y[0])]

    half = after(field, start, (time, time + np.pi / 2), method="RK45", rtol=1e-8, atol=1e-10)
    assert half == pytest.approx(-np.array(start), abs=1e-3)
