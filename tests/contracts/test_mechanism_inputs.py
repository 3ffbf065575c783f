"""What is given to `Mechanism`, to plots and as parameters in the wrong form: one line says what is valid."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import contfric as cf

BRAKE = {"kind": "friction", "velocity": "v1", "kinetic": "S"}


def frame(**given: Any) -> cf.Model:
    entries: dict[str, Any] = {
        "contacts": {"brake": BRAKE},
        "force": {"q1": "cos(w*t)"},
        "parameters": {"w": 0.7, "S": 0.2},
        "period": "2*pi/w",
    }
    return cf.Mechanism(np.eye(2), 0.1 * np.eye(2), [[2.0, -1.0], [-1.0, 2.0]], **entries | given)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"force": ["cos(w*t)", "0"]}, "'force' must be a mapping of coordinates"),
        ({"force": np.array([1.0, 0.0])}, "'force' must be a mapping of coordinates"),
        ({"contacts": [BRAKE]}, "'contacts' must be a mapping of names"),
        (
            {"contacts": {"brake": "friction"}},
            "contacts -> brake: 'contacts' must be a mapping of names to contacts",
        ),
        ({"parameters": {"w": np.array([0.7]), "S": 0.2}}, "must be a finite number"),
    ],
)
def test_what_is_no_mapping_is_refused(given: dict[str, Any], says: str) -> None:
    with pytest.raises(cf.ModelError, match=says):
        frame(**given)


def test_numbers_of_numpy_are_numbers() -> None:
    brake = BRAKE | {"kinetic": np.array(0.25)}
    model = frame(
        contacts={"brake": brake}, parameters={"w": np.float64(0.7), "S": np.float32(0.5)}
    )
    assert dict(zip(model.parameter_names, model.vector({}), strict=True)) == {"w": 0.7, "S": 0.5}


@pytest.mark.parametrize("w", [0.0, -0.6])
def test_a_period_that_is_none_is_refused(w: float) -> None:
    with pytest.raises(cf.ParameterError, match="the period of the excitation of 'mechanism' is"):
        cf.find_orbit(frame(), {"w": w})


def test_a_plot_is_asked_for_by_its_row() -> None:
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    wrong: Any = "x_max"
    with pytest.raises(
        cf.ParameterError, match="ax is one pair of axes of matplotlib, got 'x_max'"
    ):
        orbit.plot(wrong)
