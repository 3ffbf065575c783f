"""Structures whose modes are made when they are visited, in units: the same motions, forces and work."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest
import yaml

import contfric as cf
from contfric.models.deriving.growing_model import ComposedModel

K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
DIMENSIONS = {"F": (1, -2), "w": (0, -1), "R": (1, -2), "k": (0, -2), "g": (1, 0), "vb": (1, -1)}
SIZES = {"F": 1.0, "w": 0.5, "R": 0.2, "k": 0.5, "g": 0.3, "vb": 0.02}


def structure(scales: tuple[float, float, float], units: Any, force: float = 1.0) -> cf.Mechanism:
    """Return three masses with contacts that share loads, in units of length, time and mass."""
    length, span, mass = scales
    mass_of = {"F": mass, "R": mass, "k": mass}
    params = {
        n: SIZES[n] * length**a * span**b * mass_of.get(n, 1.0) for n, (a, b) in DIMENSIONS.items()
    }
    contacts = {
        "b1": {"kind": "friction", "velocity": "v1", "kinetic": "1.5*R"},
        "b2": {"kind": "friction", "velocity": "v2 - v1 - vb*cos(w*t)", "kinetic": "R"},
        "j": {"kind": "jenkins", "displacement": "q3 - q2", "stiffness": "k", "limit": "0.5*R"},
        "s": {"kind": "spring", "gap": "g - q3", "stiffness": "0.8*k"},
    }
    return cf.Mechanism(
        np.eye(3) * mass,
        0.04 * np.eye(3) * mass / span,
        K * mass / span**2,
        contacts=contacts,
        force={"q2": f"{force}*F*cos(w*t)"},
        parameters=params,
        period="2*pi/w",
        **({"units": units} if units else {}),
    )


def drawn(seed: int) -> tuple[float, float, float]:
    rng = np.random.default_rng([94, seed])
    return tuple(float(10.0**e) for e in rng.uniform(-6.0, 6.0, 3))  # type: ignore[return-value]


@pytest.mark.parametrize("seed", range(3))
def test_forces_work_and_positions_are_in_the_units_of_the_file(seed: int) -> None:
    scales = drawn(seed)
    length, span, mass = scales
    unit = mass * length / span**2
    plain = cf.find_orbit(structure((1.0, 1.0, 1.0), None))
    model = structure(scales, "auto")
    found = cf.find_orbit(model)
    assert isinstance(found.model, ComposedModel)
    whole = dict(found.model.units)
    assert whole["v1"] == pytest.approx(whole["q1"] / whole["t"])
    assert found.signature == plain.signature
    assert found.period * whole["t"] / span == pytest.approx(plain.period, rel=1e-12)
    for contact in ("b1", "b2", "j", "s"):
        for name, size in ((f"max(force({contact}))", unit), (f"work({contact})", unit * length)):
            assert found.quantity(name) / size == pytest.approx(
                plain.quantity(name), rel=1e-9, abs=1e-11
            )
    one, other = (np.sort_complex(o.multipliers) for o in (found, plain))
    assert one == pytest.approx(other, abs=1e-9)
    scale = np.array([whole[s] / length for s in found.model.states])
    scale[3:6] *= span
    a, b = (
        np.sort(np.abs(o.joints[:, 1:] * by), axis=0) for o, by in ((found, scale), (plain, 1.0))
    )
    assert a == pytest.approx(b, abs=1e-9)


def test_a_contact_that_never_slips_rests_where_the_file_says() -> None:
    scales = (1e-4, 1e-3, 2.0)
    plain, other = structure((1.0, 1.0, 1.0), None, 0.1), structure(scales, "auto", 0.1)
    start = {"b1": 0.05}
    one, two = cf.find_orbit(plain, at=start), cf.find_orbit(other, at={"b1": 0.05e-4})
    assert one.resting
    for a, b in zip(one.resting, two.resting, strict=True):
        assert a.contact == b.contact
        assert b.value * 1e4 == pytest.approx(a.value, abs=1e-12)
        assert b.lower * 1e4 == pytest.approx(a.lower, rel=1e-9)
        assert b.upper * 1e4 == pytest.approx(a.upper, rel=1e-9)


def test_a_branch_has_the_same_events() -> None:
    scales = (1e-4, 1e-3, 2.0)
    events = []
    for model, unit in ((structure((1.0,) * 3, None), 1.0), (structure(scales, "auto"), 1e3)):
        branch = cf.continue_orbit(cf.find_orbit(model), "w", (0.49 * unit, 0.53 * unit))
        events.append([(e.label, e.params["w"] / unit) for e in branch.bifurcations])
    assert events[0]
    for (label, at), (wanted, there) in zip(*events, strict=True):
        assert (label, at) == (wanted, pytest.approx(there, rel=1e-10))


def test_ten_contacts_in_units_load_at_once() -> None:
    """Nothing of size 3^10 is built, and each contact keeps one unit of length."""
    n = 10
    contacts = {
        f"c{i}": {"kind": "friction", "velocity": f"v{i}", "kinetic": "R"} for i in range(1, n + 1)
    }
    stiffness = 1e8 * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    begun = time.process_time()
    model = cf.Mechanism(
        10.0 * np.eye(n),
        300.0 * np.eye(n),
        stiffness,
        contacts=contacts,
        force={"q10": "F*cos(w*t)"},
        parameters={"F": 1e4, "R": 1e3, "w": 1500.0},
        period="2*pi/w",
        units="auto",
    )
    assert dict(model.units)["q1"] == dict(model.units)["q10"] < 1e-3
    assert time.process_time() - begun < 5.0


@pytest.mark.parametrize("seed", range(3))
def test_the_check_proposes_units_that_it_accepts(seed: int) -> None:
    def proposed(model: cf.Mechanism) -> Any:
        texts = [str(f) for f in cf.check_model(model).findings if "Write units: " in str(f)]
        return yaml.safe_load(texts[0].partition("Write units: ")[2]) if texts else {}

    units = proposed(structure(drawn(seed), None))
    assert units
    assert not proposed(structure(drawn(seed), units))
    assert not proposed(structure((1.0,) * 3, None))


def test_a_search_that_fails_in_small_numbers_says_units() -> None:
    """A start of 1 m is far beyond a gap of 70 micrometres: that was called chatter, and no more."""
    pad = {"kind": "friction", "velocity": "v1", "kinetic": "R"}
    wall = {"kind": "impact", "gap": "7e-5 - q2", "restitution": 0.5}
    contacts = {"wall": wall, "pad": pad}
    given: dict[str, Any] = {
        "force": {"q1": "F*cos(w*t)"},
        "parameters": {"F": 180.0, "w": 800.0, "R": 40.0},
        "period": "2*pi/w",
    }
    stiffness = 2e6 * np.array([[2.0, -1.0], [-1.0, 1.5]])
    matrices = 2.0 * np.eye(2), 120.0 * np.eye(2), stiffness
    with pytest.raises(cf.ConvergenceError, match="units: auto"):
        cf.find_orbit(cf.Mechanism(*matrices, contacts=contacts, **given))
    found = cf.find_orbit(cf.Mechanism(*matrices, contacts=contacts, **given, units="auto"))
    ones = np.eye(2), 0.06 * np.eye(2), 0.5e-6 * stiffness
    contacts["wall"] = wall | {"gap": "0.7 - q2"}
    given["parameters"] = {"F": 0.9, "w": 0.8, "R": 0.2}
    wanted = cf.find_orbit(cf.Mechanism(*ones, contacts=contacts, **given))
    assert np.sort_complex(found.multipliers) == pytest.approx(
        np.sort_complex(wanted.multipliers), abs=1e-9
    )


def test_coordinates_that_share_contacts_have_one_unit() -> None:
    with pytest.raises(cf.ModelError, match="have one unit"):
        structure((1.0,) * 3, {"q1": 0.1, "t": 1.0})
