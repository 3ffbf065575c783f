"""Certificate files: written, checked, and refused where what they state is not so.

Cheating is caught by mathematics: whatever is changed in a file, the checker says yes only to statements
that 60 digits of brute force (``tests/certificate_oracle.py``) agree with.
"""

from __future__ import annotations

import json
import math
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import contfric as cf
from contfric.base.extras import MissingPackageError
from contfric.certify.files import certificate_data, verify
from contfric.certify.orbit import certify_orbit
from contfric.cli import main
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine
from contfric.verify.file import check_text
from tests.certificate_oracle import Truth, copied, false_statements, mutated

CHECKER = Path(cf.__file__).parent / "verify"
SCENES: list[tuple[str, dict[str, float]]] = [
    ("1a", {"Omega": 0.5, "S": 0.32, "S0": 0.4}),
    ("2s", {"Omega": 0.5, "S": 0.32, "S0": 0.4}),
    ("0s", {"Omega": 1.0, "S": 0.5, "S0": 0.6, "zeta": 0.1}),
    ("0s", {"Omega": 0.55, "S": 0.3, "S0": 0.4}),
]


@cache
def orbit(index: int) -> Orbit:
    name, params = SCENES[index]
    return cf.solve_orbit("coulomb", name, params)


@cache
def certificate(index: int) -> str:
    return json.dumps(certificate_data(orbit(index).certify()))


def forced(found: Orbit, *claims: str) -> dict[str, Any]:
    """Return the file of an orbit, with statements that nobody has proved."""
    data = certificate_data(certify_orbit(found))
    data["statements"] = ["exists", *claims]
    return data


@pytest.mark.parametrize("index", range(len(SCENES)))
def test_true_certificates_are_verified(index: int) -> None:
    data = json.loads(certificate(index))
    answer = check_text(certificate(index))
    assert answer.yes, answer.why
    stable = "stable" if orbit(index).stable else "unstable"
    assert answer.statements == ("exists", "unique", "admissible", stable, "multipliers")
    assert not false_statements(data)


@pytest.mark.parametrize("index", range(len(SCENES)))
def test_no_false_certificate_is_verified(index: int) -> None:
    rng = np.random.default_rng(index)
    refused = 0
    for _ in range(25):
        data = mutated(json.loads(certificate(index)), rng)
        if check_text(json.dumps(data)).yes:
            assert not false_statements(data)
        else:
            refused += 1
    assert refused > 12


@pytest.mark.parametrize("index", range(len(SCENES)))
@pytest.mark.parametrize("count", [3, 5])
def test_several_turns_of_an_orbit_are_none_of_a_longer_period(index: int, count: int) -> None:
    """All but the period is so: the copies solve the equations, are alone and obey the law."""
    data = copied(json.loads(certificate(index)), count)
    answer = check_text(json.dumps(data))
    assert not answer.yes
    assert "no part of its period is one" in answer.why


def test_a_name_that_comes_twice_is_refused() -> None:
    """One reader of the file takes the first one, another the last one."""
    text = certificate(0)
    for name in ("statements", "S"):
        other = text.replace(f'"{name}": ', f'"{name}": 0, "{name}": ', 1)
        assert json.loads(other) == json.loads(text)
        assert "names come once" in check_text(other).why


def test_two_parts_of_a_file_are_not_the_same() -> None:
    """Nor from another joint, a period later, or under another name; two orbits may be."""
    part, other = (json.loads(certificate(index)) for index in (0, 1))
    assert part["params"] == other["params"]
    later = part | {"statements": ["exists"], "multipliers": []}
    period = 2 * math.pi / part["params"]["Omega"]
    joints = [(t, x) for t, x in zip(part["joints"][::2], part["joints"][1::2], strict=True)]
    joints = [*joints[1:], (joints[0][0] + period, joints[0][1])]
    later["joints"] = [c + period * (k % 2 == 0) for k, c in enumerate(sum(joints, ()))]
    later["segments"] = [*part["segments"][1:], part["segments"][0]]
    later["radius"] = [1e-9] * len(later["joints"])
    later["enclosure"] = [f"{c!r} +/- 1e-9" for c in later["joints"]]
    for again in (part, later, other):
        assert check_text(json.dumps(again)).yes
        text = json.dumps({"certificate": "diagram", "format": 1, "checkable": [part, again]})
        answer = check_text(text)
        assert answer.yes == (again is other), answer
        assert answer.yes or answer.why == "false: no two parts are the same, or overlap"


def test_what_nobody_looks_at_is_not_in_a_file() -> None:
    """Not a name that the checker does not read, and no claim with a value of its own."""
    data = json.loads(certificate(0))
    disc, *others = data["multipliers"]
    wrong = [
        {"signature": "7b"},
        {"stable": False},
        {"parameter": "Omega"},
        {"multipliers": [disc | {"abs": "2"}, *others]},
        {"params": data["params"] | {"g": 9.81}},
        {"statements": dict.fromkeys(data["statements"], False)},
        {"statements": ["exists", "stable", "stable"]},
        {"statements": ["unique"]},
        {"statements": "exists"},
        {"enclosure": dict.fromkeys(data["enclosure"], "no ball")},
        {"joints": {f"{c!r} +/- 1e-20": "another" for c in data["joints"]}},
        {"radius": {f"{c!r} +/- 0": "another" for c in data["radius"]}},
        {"segments": [dict.fromkeys(pair, "not so") for pair in data["segments"]]},
        {"enclosure": data["enclosure"][:-1]},
        {"multipliers": {}},
    ]
    for change in wrong:
        assert check_text(json.dumps(data)).yes
        assert not check_text(json.dumps(data | change)).yes, change
    for name in data:
        assert not check_text(json.dumps({k: v for k, v in data.items() if k != name})).yes


@pytest.mark.parametrize("index", range(len(SCENES)))
def test_a_number_just_out_of_its_ball_is_refused(index: int) -> None:
    """By less than an interval arithmetic with radii of 30 bits rounds; and what is just inside may pass."""
    rng, data = np.random.default_rng(index), json.loads(certificate(index))
    with mp.workdps(60):
        truth = Truth(data).newton([mpf(c) for c in data["joints"]])
        for _ in range(30):
            k, radius = int(rng.integers(len(truth))), mpf(f"{10.0 ** rng.uniform(-29, -2):.13e}")
            off = radius * int(rng.choice([-1, 1]))
            for share, yes in (
                (1 + mpf(10) ** rng.uniform(-13, -9), False),
                (mpf("0.99999"), True),
            ):
                text = f"{mp.nstr(truth[k] + share * off, 55)} +/- {mp.nstr(radius, 14)}"
                enclosure = [*data["enclosure"][:k], text, *data["enclosure"][k + 1 :]]
                assert check_text(json.dumps(data | {"enclosure": enclosure})).yes == yes, text


@pytest.mark.slow
def test_brute_force_knows_several_turns_of_an_orbit() -> None:
    assert "period" in false_statements(copied(json.loads(certificate(0)), 2))
    assert "period" in false_statements(copied(json.loads(certificate(3)), 3))


@pytest.mark.parametrize("name", ["Omega", "S", "S0", "h", "zeta"])
def test_nothing_is_stated_for_a_ball_of_parameters(name: str) -> None:
    """Only the middle of one for S was looked at."""
    data = json.loads(certificate(0))
    data["statements"], data["multipliers"] = ["exists"], []
    data["enclosure"] = [f"{c!r} +/- 1e-9" for c in data["joints"]]
    assert check_text(json.dumps(data)).yes
    data["params"][name] = f"{data['params'][name]!r} +/- 1e-12"
    assert not check_text(json.dumps(data)).yes


def test_one_file_is_of_one_diagram() -> None:
    """Orbits that differ in one parameter may lie on one; each is proved by itself."""
    parts = [json.loads(certificate(0))]
    for change in ({"Omega": 0.501}, {"S": 0.321}):
        found = cf.solve_orbit("coulomb", "1a", SCENES[0][1] | change)
        parts.append(certificate_data(found.certify()))
    assert all(check_text(json.dumps(part)).yes for part in parts)
    for kept, yes in ((parts[:2], True), (parts[::2], True), (parts, False)):
        text = json.dumps({"certificate": "diagram", "format": 1, "checkable": kept})
        assert check_text(text).yes == yes


@pytest.mark.parametrize(
    ("name", "params", "beyond"),
    [  # the equations are solved beyond the SS or CS at which the branch ends
        ("1a", {"Omega": 0.49182, "S": 0.32, "S0": 0.4}, {"Omega": 0.4916}),
        ("1a", {"Omega": 0.5, "S": 0.33, "S0": 0.4}, {"S": 0.3330}),
        ("2s", {"Omega": 0.535, "S": 0.32, "S0": 0.4}, {"Omega": 0.5354}),
        ("0s", {"Omega": 0.55, "S": 0.3, "S0": 0.4}, {"S0": 0.9}),
    ],
)
def test_inadmissible_orbits_are_refused(
    name: str, params: dict[str, float], beyond: dict[str, float]
) -> None:
    found = cf.solve_orbit("coulomb", name, params)
    vector = found.model.vector({**params, **beyond})
    wrong = refine(replace(found, vector=vector))
    assert wrong.converged
    assert not wrong.admissible
    assert wrong.certify().admissible.verdict == "refuted"
    answer = check_text(json.dumps(forced(wrong, "admissible")))
    assert not answer.yes
    assert "false" in answer.why


@pytest.mark.parametrize("index", range(len(SCENES)))
def test_a_multiplier_on_the_wrong_side_is_refused(index: int) -> None:
    claim = "unstable" if orbit(index).stable else "stable"
    answer = check_text(json.dumps(forced(orbit(index), claim)))
    assert not answer.yes
    assert "multiplier" in answer.why


def test_damaged_files_are_no_crash() -> None:
    rng = np.random.default_rng(7)
    text = certificate(0)
    for _ in range(80):
        at = int(rng.integers(len(text)))
        junk = str(rng.choice(["", "[", "null", "-", "1e400", '"', "NaN", "{}", "9" * 50]))
        broken = text[:at] + junk + text[at + int(rng.integers(6)) :]
        if check_text(broken).yes:
            assert not false_statements(json.loads(broken))


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"certificate": "orbit"}', "[" * 100_000])
def test_what_is_no_certificate_is_refused(text: str) -> None:
    assert not check_text(text).yes


NONE = {
    b"": "it is empty",
    b" \n": "it is empty",
    b"\x80PNG\r\n": "it is no text",
    b"Omega: 0.5": "it is no JSON file",
    b"[1, 2]": "it is a JSON file without the entry 'certificate'",
    b'"certificate"': "it is a JSON file without the entry 'certificate'",
    b'{"study": "fig05", "seconds": 2.1}': "it is a JSON file without the entry 'certificate'",
    b'{"certificate": ["orbit"]}': "its entry 'certificate' is not one of event, orbit, tube, diagram",
    b'{"certificate": "tube", "format": 2}': "it has format 2, and format 3 is checked; write it anew",
    b'{"certificate": "diagram", "checkable": [{"format": 1}]}': "format 1, and format 3 is checked",
}


@pytest.mark.parametrize("content", NONE)
def test_a_file_that_is_no_certificate_says_so_in_one_line(
    content: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "run.json"
    path.write_bytes(content)
    assert main(["verify", str(path)]) == 1
    printed = capsys.readouterr()
    (line,) = (printed.out + printed.err).splitlines()
    assert line.startswith("no: run.json is no certificate: ")
    assert NONE[content] in line


def test_texts_of_a_file_do_not_overwrite_the_answer(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    part, lie = json.loads(certificate(0)), "\x1b[2K\ryes: 99 orbits\n"
    file = {"certificate": "diagram", "format": 1, "checkable": [part], "left_out": [lie]}
    for number, wrong in enumerate(
        (file, part | {"certificate": "event", "kind": lie, "at": [0, 1]})
    ):
        path = tmp_path / f"{number}.json"
        path.write_text(json.dumps(wrong))
        main(["verify", str(path)])
        printed = capsys.readouterr().out
        assert all(line.isprintable() for line in printed.splitlines())
        assert not any(line.startswith("yes: 99") for line in printed.splitlines())


def test_files_and_exit_codes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, wrong = tmp_path / "a.json", tmp_path / "b.json"
    orbit(0).certify().save(path)
    assert verify(path).yes
    assert main(["verify", str(path)]) == 0
    assert capsys.readouterr().out.startswith("yes: exists")
    data = json.loads(path.read_text())
    data["params"]["S"] += 1e-6
    wrong.write_text(json.dumps(data))
    assert main(["verify", str(wrong)]) == 1
    assert capsys.readouterr().out.startswith("no: false")
    assert main(["verify", str(tmp_path / "none.json")]) == 1


def test_a_file_without_a_statement_says_so(tmp_path: Path) -> None:
    path = tmp_path / "b.json"  # of a diagram of a declared model
    path.write_text(json.dumps({"certificate": "diagram", "format": 1, "checkable": []}, indent=1))
    assert not verify(path).yes
    assert "no statement that is checked here" in verify(path).why


def test_without_flint_the_error_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    found = orbit(0)
    monkeypatch.setitem(sys.modules, "flint", None)
    with pytest.raises(MissingPackageError, match=r"pip install 'contfric\[certify\]'"):
        found.certify()


def test_the_checker_is_small() -> None:
    lines = {path.name: len(path.read_text().splitlines()) for path in CHECKER.rglob("*.py")}
    declared = lines.pop("law.py") + lines.pop("piecewise.py")  # a checker of its own
    assert sum(lines.values()) <= 500
    assert declared <= 560
