"""Certificate files of events: written, checked, and refused where what they state is not so."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.certify.files import event_data, verify
from contfric.verify.file import check_text
from tests.event_oracle import changed, false_event

PARAMS = {"Omega": 0.54, "S": 0.32, "S0": 0.4}


@cache
def files() -> dict[str, str]:
    """Return the events of Fig. 5 on 1a, 2s and 0s, and a period doubling, by kind."""
    found: dict[str, Any] = {}
    for name, omega in (("1a", 0.5), ("2s", 0.5), ("0s", 0.55)):
        orbit = cf.solve_orbit("coulomb", name, {**PARAMS, "Omega": omega})
        for event in cf.continue_orbit(orbit, "Omega", (0.45, 0.6)).bifurcations:
            found.setdefault(event.kind.value, event)
    doubled = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.05, "S0": 0.3})
    for event in cf.continue_orbit(doubled, "S", (0.0, 0.3)).bifurcations:
        found.setdefault(event.kind.value, event)
    checked = ("SN", "PD", "BP", "CS", "SS")
    return {k: json.dumps(event_data(e.certify())) for k, e in found.items() if k in checked}


@pytest.mark.parametrize("kind", ["SN", "BP", "CS", "SS"])
def test_true_events_are_verified(kind: str) -> None:
    answer = check_text(files()[kind])
    assert answer.yes, answer.why
    assert f"is a {kind} in Omega" in answer.statements


# a fold is decided by brute force in 60 digits, which takes minutes
_DECIDED = [pytest.param("SN", marks=pytest.mark.slow), "BP", "CS", "SS"]


@pytest.mark.parametrize("kind", _DECIDED)
def test_true_events_are_not_false(kind: str) -> None:
    assert not false_event(json.loads(files()[kind]))


@pytest.mark.parametrize("kind", _DECIDED)
def test_no_false_event_is_verified(kind: str) -> None:
    rng = np.random.default_rng(5)
    refused = 0
    count = 3 if kind == "SN" else 12
    for _ in range(count):
        data = changed(json.loads(files()[kind]), rng)
        if check_text(json.dumps(data)).yes:
            assert not false_event(data), data
        else:
            refused += 1
    assert refused


def test_files_of_events(tmp_path: Path) -> None:
    orbit = cf.solve_orbit("coulomb", "1a", PARAMS)
    branch = cf.continue_orbit(orbit, "Omega", (0.535, 0.545))
    branch.bifurcations[0].certify().save(tmp_path / "fold.json")
    assert verify(tmp_path / "fold.json").yes
    data = json.loads((tmp_path / "fold.json").read_text())
    several = {"certificate": "diagram", "format": 1, "checkable": [data, data]}
    assert check_text(json.dumps(several)).statements == ("2 events",)
    data["value"] = data["value"].replace("0.5419", "0.5418")
    assert not check_text(json.dumps(several | {"checkable": [data]})).yes
    nested = {"certificate": "diagram", "format": 1, "checkable": [several]}
    assert not check_text(json.dumps(nested)).yes


def test_a_load_is_no_multiplier() -> None:
    data = json.loads(files()["BP"])
    data |= {"kind": "CS", "at": [-1, 0]}
    assert not check_text(json.dumps(data)).yes
