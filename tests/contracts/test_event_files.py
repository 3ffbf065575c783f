"""Certificate files of events: written, checked, and refused where what they state is not so."""

from __future__ import annotations

import json
from contextlib import suppress
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import contfric as cf
from contfric.certify.files import event_data, verify
from contfric.errors import ParameterError
from contfric.verify.file import check_text
from tests.event_oracle import changed, false_event

PARAMS = {"Omega": 0.54, "S": 0.32, "S0": 0.4}


#: Where each kind is found: an orbit, and the branch through it.
SCENES: tuple[tuple[dict[str, float], str, tuple[float, float], str], ...] = (
    ({"Omega": 0.5}, "Omega", (0.45, 0.6), "1a"),
    ({"Omega": 0.5}, "Omega", (0.45, 0.6), "2s"),
    ({"Omega": 0.55}, "Omega", (0.45, 0.6), "0s"),
    ({"Omega": 0.5, "S": 0.072}, "S", (0.06, 0.09), ""),
    ({"Omega": 0.5, "S": 0.3, "h": 0.25}, "h", (0.15, 0.3), ""),
    ({"Omega": 0.5, "S": 0.3, "h": 0.2885}, "h", (0.28, 0.3), "1a"),
    ({"Omega": 1.6, "S": 0.1, "S0": 0.1, "zeta": 0.05}, "zeta", (-0.1, 0.06), "0s"),
)
KINDS = ("SN", "PD", "BP", "NS", "CS", "SS", "AS", "GS", "T")


@cache
def files() -> dict[str, str]:
    """Return one event of each kind."""
    found: dict[str, str] = {}
    for change, parameter, span, name in SCENES:
        params = {**PARAMS, **change}
        orbit = cf.find_orbit("coulomb", params)
        if name:
            orbit = cf.solve_orbit("coulomb", name, params)
        for event in cf.continue_orbit(orbit, parameter, span).bifurcations:
            if event.kind.value not in found:
                with suppress(ParameterError):  # at a joint
                    found[event.kind.value] = json.dumps(event_data(event.certify()))
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_true_events_are_verified(kind: str) -> None:
    answer = check_text(files()[kind])
    assert answer.yes, answer.why
    parameter = json.loads(files()[kind])["parameter"]
    assert f"is a {kind} in {parameter}" in answer.statements


# a fold is decided by brute force in 60 digits, which takes minutes
_SLOW = pytest.mark.slow
_DECIDED = [
    pytest.param(k, marks=_SLOW) if k in ("SN", "PD", "BP", "NS", "AS", "GS", "T") else k
    for k in KINDS
]


@pytest.mark.parametrize("kind", _DECIDED)
def test_true_events_are_not_false(kind: str) -> None:
    assert not false_event(json.loads(files()[kind]))


@pytest.mark.parametrize("kind", _DECIDED)
def test_no_false_event_is_verified(kind: str) -> None:
    rng = np.random.default_rng(5)
    refused = 0
    count = {"SN": 3, "GS": 8}.get(kind, 12)
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
    whole = {"certificate": "diagram", "checkable": [data]}
    assert check_text(json.dumps(whole)).statements[:3] == ("1 events", "0 orbits", "0 tubes")
    data["value"] = data["value"].replace("0.5419", "0.5418")
    assert not check_text(json.dumps(whole | {"checkable": [data]})).yes
    nested = {"certificate": "diagram", "checkable": [whole]}
    assert not check_text(json.dumps(nested)).yes


@pytest.mark.parametrize("kind", KINDS)
def test_what_nobody_looks_at_is_not_in_the_file_of_an_event(kind: str) -> None:
    """Another value of the parameter, say, next to the one that is proved."""
    data = json.loads(files()[kind])
    for params in ({data["parameter"]: 0.777}, {data["parameter"]: data["knots"][0][-1]}):
        assert not check_text(json.dumps(data | {"params": data["params"] | params})).yes
    assert not check_text(json.dumps(data | {"label": "SN_1a"})).yes
    for other in {"CS", "SS", "SN", "BP", "PD", "NS", "AS", "GS", "T"} - {kind}:
        assert not check_text(json.dumps(data | {"kind": other})).yes, other


def test_a_load_is_no_multiplier() -> None:
    data = json.loads(files()["BP"])
    data |= {"kind": "CS", "at": [-1, 0]}
    assert not check_text(json.dumps(data)).yes


@pytest.mark.parametrize("kind", ["AS", "GS", "T"])
def test_a_touch_of_another_kind_elsewhere_or_at_another_time_is_refused(kind: str) -> None:
    data = json.loads(files()[kind])
    i, surface, time = data["at"]
    other = (i + 1) % len(data["segments"])
    centre, _, radius = time.partition(" +/- ")
    later = f"{float(centre) + 1e-3!r} +/- {radius}"
    wrong = [{"kind": k} for k in KINDS if k != kind]
    wrong += [
        {"at": at} for at in ([i, surface, later], [other, surface, time], [i, surface], None)
    ]
    for change in wrong:
        assert not check_text(json.dumps(data | change)).yes, change


def test_an_event_beside_the_place_that_it_states_is_refused() -> None:
    for kind in ("PD", "AS", "GS", "T"):
        data = json.loads(files()[kind])
        centre, _, radius = data["value"].partition(" +/- ")
        data["value"] = f"{float(centre) + 1e-12!r} +/- {radius}"
        assert not check_text(json.dumps(data)).yes


def test_the_file_of_a_branch_holds_its_orbits_and_events(tmp_path: Path) -> None:
    orbit = cf.solve_orbit("coulomb", "0s", {**PARAMS, "Omega": 0.55})
    branch = cf.continue_orbit(orbit, "Omega", (0.53, 0.56))
    proof = branch.certify()
    assert proof.points_proved >= len(branch) - 1  # at the event there is none
    proof.save(tmp_path / "branch.json")
    answer = verify(tmp_path / "branch.json")
    assert answer.yes
    assert answer.statements[:3] == ("1 events", f"{proof.points_proved} orbits", "1 tubes")
    data = json.loads((tmp_path / "branch.json").read_text())
    data["checkable"][3]["joints"][1] += 1e-6
    assert not check_text(json.dumps(data)).yes
    bilinear = cf.find_orbit("impact")
    with pytest.raises(ParameterError, match="no proof of this branch"):
        cf.continue_orbit(bilinear, "w", (0.99, 1.01)).certify().save(tmp_path / "none.json")


def test_a_file_of_an_older_format_is_to_be_written_anew() -> None:
    data = json.loads(files()["AS"]) | {"format": 2}
    answer = check_text(json.dumps(data))
    assert not answer.yes
    assert "format 3" in answer.why
