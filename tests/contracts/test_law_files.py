"""Certificates of piecewise-linear orbits, whose files state the law: no false one is verified."""

from __future__ import annotations

import copy
import functools
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np
import pytest

pytest.importorskip("flint")
from flint import arb, arb_mat, arb_poly, ctx

import contfric as cf
from contfric.certify.files import certificate_data, verify
from contfric.cli import main
from contfric.verify.law import Law
from contfric.verify.motion import Refused, ball
from contfric.verify.piecewise import Chain, Field, check_text, discs, is_inside
from tests.law_oracle import LawTruth, false_law_statements, mutated_law, several_turns

MODELS = Path(__file__).parents[1] / "models"
#: Impacts, sticks without excitation and with it, a relay, a firing, a clock, a section that is a phase.
NAMES = (
    *("impact", "dead-band", "coulomb-yaml", "relay", "integrate-and-fire", "thermostat", "buck"),
    *("rocking-block", "one_wall", "preloaded", "bilinear"),
)


@functools.cache
def text_of(name: str) -> str:
    path = MODELS / f"{name}.yaml"
    found = cf.find_orbit(path if path.exists() else name)
    return json.dumps(certificate_data(found.certify()))


def data_of(name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(text_of(name))
    return found


@pytest.mark.parametrize("name", NAMES)
def test_true_certificates_are_verified(name: str) -> None:
    answer = check_text(text_of(name))
    assert answer.yes, answer.why
    assert answer.statements[:4] == ("exists", "unique", "admissible", "stable")


@pytest.mark.parametrize("name", ["thermostat", "integrate-and-fire", "dead-band", "impact"])
def test_no_false_certificate_is_verified(name: str) -> None:
    rng, data = np.random.default_rng(len(name)), data_of(name)
    refused, true = 0, 0
    while true < 3:
        changed = mutated_law(data, rng)
        if not check_text(json.dumps(changed)).yes:
            refused += 1
            continue
        assert false_law_statements(changed) == []
        true += 1
    assert refused > 3


def _wide(data: dict[str, Any]) -> None:
    data["radius"] = [0.05 * (1 + abs(c)) for c in data["joints"]]
    data["enclosure"] = [
        f"{c!r} +/- {r!r}" for c, r in zip(data["joints"], data["radius"], strict=True)
    ]
    data["statements"], data["multipliers"] = ["exists", "admissible", "stable"], []


def _stiffer(data: dict[str, Any]) -> None:
    data["equations"]["modes"]["up"]["field"]["v"]["x"] = "-1.01*k"


def _no_sign(data: dict[str, Any]) -> None:
    data["equations"]["maps"]["wall"]["v"]["v"] = "e"


def _other_side(data: dict[str, Any]) -> None:
    data["equations"]["modes"]["up"]["inside"]["wall"] = -1


def _no_end(data: dict[str, Any]) -> None:
    data["equations"]["modes"]["up"]["inside"] = {}


def _nearer(data: dict[str, Any]) -> None:
    data["params"]["d"] = 0.99


def _unstable(data: dict[str, Any]) -> None:
    data["statements"], data["multipliers"] = ["exists", "admissible", "unstable"], []


def _more(data: dict[str, Any]) -> None:
    data["equations"]["damping"] = "0"


def _code(data: dict[str, Any]) -> None:
    data["equations"]["frequency"] = "__import__('os').getpid()"


CHEATS = (_stiffer, _no_sign, _other_side, _no_end, _nearer, _unstable, _more, _code)


@pytest.mark.parametrize("cheat", CHEATS)
def test_another_law_is_refused(cheat: Callable[[dict[str, Any]], None]) -> None:
    data = data_of("impact")
    cheat(data)
    assert not check_text(json.dumps(data)).yes


def test_an_orbit_of_another_law_that_is_near_is_verified() -> None:
    """What a file states is of the law that it states: a wall a little nearer has an orbit a little off."""
    data = data_of("impact")
    _wide(data)
    _nearer(data)
    assert check_text(json.dumps(data)).yes
    assert false_law_statements(data) == []


def test_a_wall_in_the_way_is_not_passed() -> None:
    """A second wall that the mode names, a little beyond the lowest displacement, and a little within."""
    data, law = data_of("impact"), data_of("impact")["equations"]
    lowest = min(float(mp.nstr(x, 15)) for x in _displacements(data))
    for share, yes in ((1.01, True), (0.99, False)):
        law["surfaces"]["floor"] = {"x": "1", "1": repr(-share * lowest)}
        law["modes"]["up"]["inside"]["floor"] = 1
        assert check_text(json.dumps(data | {"equations": law})).yes is yes
    assert "not met inside" in check_text(json.dumps(data | {"equations": law})).why


def _displacements(data: dict[str, Any]) -> list[Any]:
    truth = LawTruth(data)
    (t, y), (end, _) = (
        truth.joint([mp.mpf(c) for c in data["joints"]], 0),
        truth.joint(data["joints"], 1),
    )
    times = [t + (end - t) * k / 40 for k in range(41)]
    return [truth.reached(0, t, y, s)[0] for s in times]


@pytest.mark.parametrize("name", ["impact", "dead-band", "relay"])
def test_several_turns_are_no_orbit_of_a_longer_period(name: str) -> None:
    for seed in range(3):
        data = copy.deepcopy(data_of(name))
        several_turns(data, np.random.default_rng(seed))
        data["statements"] = ["exists"]
        answer = check_text(json.dumps(data))
        assert not answer.yes and "period" in answer.why, answer


@pytest.mark.parametrize("seed", range(8))
def test_the_flow_against_mpmath(seed: int) -> None:
    rng = np.random.default_rng(seed)
    size = int(rng.integers(1, 6))
    matrix = rng.normal(size=(size, size)) * 10.0 ** rng.integers(-3, 4, (size, size))
    duration = float(rng.uniform(0.01, 20.0 / np.abs(matrix).max()))
    with mp.workdps(80), ctx.workprec(212):
        field = Field([[arb(float(c)) for c in row] for row in matrix])
        flow, wanted = field.flow(arb(duration)), mp.expm(mp.matrix(matrix.tolist()) * duration)
        found = [(flow[i, j], wanted[i, j]) for i in range(size) for j in range(size)]
        for ball_of, number in found:
            assert ball_of.overlaps(arb(mp.nstr(number, 75)))
            assert float(ball_of.rad()) < 1e-40 * float(1 + max(abs(x) for _, x in found))
        w, row = rng.normal(size=size), rng.normal(size=size)
        reach = 1.0 / float(field.bound)
        start = arb_mat([[float(c)] for c in w])
        ((terms, left),) = field.series([[arb(float(c)) for c in row]], start, arb(reach))
        for tau in rng.uniform(-reach, reach, 5):
            moved = mp.expm(mp.matrix(matrix.tolist()) * mp.mpf(float(tau))) * mp.matrix(w.tolist())
            exact = arb(
                mp.nstr(sum(mp.mpf(float(c)) * x for c, x in zip(row, moved, strict=True)), 70)
            )
            off = exact - arb_poly(terms)(arb(float(tau)))
            assert abs(off) < left * arb(abs(float(tau))) ** len(terms) + arb(2) ** -150


@pytest.mark.parametrize("name", ["impact", "dead-band", "coulomb-yaml", "rocking-block"])
def test_the_jacobian_against_differences(name: str) -> None:
    data = data_of(name)
    with ctx.workprec(212):
        law = Law(data["equations"], data["params"])
        chain = Chain(law, data["segments"], data["periods"])
        z, step = [arb(c) for c in data["joints"]], arb(2) ** -60
        jacobian = chain.equations(z)[1]
        for k in range(len(z)):
            sides = [[c + s * step * (j == k) for j, c in enumerate(z)] for s in (1, -1)]
            up, down = (chain.equations(side)[0] for side in sides)
            for i, (a, b) in enumerate(zip(up, down, strict=True)):
                assert abs((a - b) / (2 * step) - jacobian[i, k]) < 1e-25


@pytest.mark.parametrize("seed", range(30))
def test_zeros_of_polynomials(seed: int) -> None:
    """Random real polynomials with given zeros, 0 of them several times: discs hold them, and their side."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 6))
    zeros = [complex(c) for c in rng.uniform(-1.3, 1.3, count)]
    if rng.uniform() < 0.6:
        pair = complex(*rng.uniform(-1.1, 1.1, 2))
        zeros += [pair, pair.conjugate()]
    zeros += [0j] * int(rng.integers(0, 3))
    with mp.workdps(80), ctx.workprec(424):
        coefficients = [mp.mpc(1)]
        for c in zeros:
            shifted = [mp.mpc(0), *coefficients]
            coefficients = [
                s - c * x for s, x in zip(shifted, [*coefficients, mp.mpc(0)], strict=True)
            ]
        poly = arb_poly([arb(mp.nstr(c.real, 78)) for c in coefficients])
        assert is_inside(poly) == all(abs(c) < 1 for c in zeros)
        found = discs(poly)
        for c in zeros:
            own = [d for d in found if abs(complex(d.mid()) - c) < 1e-12 + float(abs(d.rad()))]
            assert own
        assert all(float(d.rad()) < 1e-25 for d in found)


def test_a_zero_on_the_circle_is_not_decided() -> None:
    with ctx.workprec(106), pytest.raises(Exception, match="side of the circle"):
        is_inside(arb_poly([ball("1 +/- 1e-20"), 0, 1]))


def test_formulas_are_no_programs() -> None:
    for text in ("open", "x.y", "[1]", "f(1)", "1 if 1 else 2", "x**1e9", "'a'"):
        with pytest.raises((Refused, SyntaxError)):
            law = data_of("thermostat")["equations"]
            law["surfaces"]["cut"] = {"1": text}
            Law(law, {"x": 2.0, **data_of("thermostat")["params"]})


def test_files_and_exit_codes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "orbit.json"
    cf.find_orbit("impact").certify().save(path)
    assert verify(path).yes
    assert main(["verify", str(path)]) == 0
    assert "in the law of 1 mode that it states" in capsys.readouterr().out
    data = json.loads(path.read_text())
    data["params"]["k"] += 1e-6
    path.write_text(json.dumps(data))
    assert main(["verify", str(path)]) == 1
    assert capsys.readouterr().out.startswith("no: ")


def test_what_has_no_file_says_why(tmp_path: Path) -> None:
    with pytest.raises(cf.ParameterError, match="a family of orbits"):
        cf.find_orbit("iwan").certify().save(tmp_path / "a.json")
