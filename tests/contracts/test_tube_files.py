"""Tubes in certificate files: verified by the independent checker, refused where they are wrong."""

from __future__ import annotations

import copy
import json
import math
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.certify.branch import certify_branch
from contfric.certify.files import verify
from contfric.certify.tubes import tube_file
from contfric.certify.tubes.tube_file import tubes_of
from contfric.verify.file import check_text

PARAMS = {"Omega": 0.54, "S": 0.32, "S0": 0.4}


@cache
def tube(name: str, omega: float, low: float, high: float, S: float = 0.32) -> str:
    """Return the only tube of a branch of Fig. 5 as a text."""
    orbit = cf.solve_orbit("coulomb", name, {**PARAMS, "Omega": omega, "S": S})
    (found,) = tubes_of(certify_branch(cf.continue_orbit(orbit, "Omega", (low, high))))
    return json.dumps(found)


def fold() -> dict[str, Any]:
    """Return the tube of 1a about its fold, up to its end at a CS."""
    data: dict[str, Any] = json.loads(tube("1a", 0.54, 0.53, 0.6))
    return data


def is_verified(data: dict[str, Any]) -> bool:
    return check_text(json.dumps(data)).yes


def test_a_tube_with_a_fold_and_two_ends_is_verified() -> None:
    data = fold()
    answer = check_text(json.dumps(data))
    assert answer.yes, answer.why
    assert [kind for _, kind in data["events"]] == ["SN"]
    assert data["ends"][1][0] == "CS"
    assert {"one curve", "admissible", "1 events of multipliers"} <= set(answer.statements)


def test_a_tube_is_not_stated_twice() -> None:
    """Nor in the other direction, with other knots at which its orbits are the same."""
    whole = fold()
    at = whole["events"][0][0]
    data = _part(whole, at - 4, at + 5)
    last = len(data["knots"]) - 2
    back: dict[str, Any] = {
        "knots": [
            [c + 1e-12 * (k % 3) for k, c in enumerate(row[:-1])] + row[-1:]
            for row in data["knots"][::-1]
        ],
        "ends": data["ends"][::-1],
        "events": [[last - k, kind] for k, kind in data["events"]],
    }
    assert is_verified(data | back)
    for other in ({}, back):
        parts = {"certificate": "diagram", "format": 1, "checkable": [data, data | other]}
        assert check_text(json.dumps(parts)).why == "false: no two parts are the same, or overlap"


def _part(data: dict[str, Any], first: int, last: int) -> dict[str, Any]:
    """Return the tube between two knots."""
    ends = [
        end if k == n else None
        for end, k, n in zip(data["ends"], (first, last), (0, len(data["knots"]) - 1), strict=True)
    ]
    events = [[k - first, kind] for k, kind in data["events"] if first <= k < last]
    return data | {"knots": data["knots"][first : last + 1], "ends": ends, "events": events}


def _later(data: dict[str, Any], turn: float) -> dict[str, Any]:
    """Return a tube from its second joint on, its orbits so many turns of the phase later."""
    knots = []
    for *joints, value in data["knots"]:
        later = [*joints[2:], joints[0] + 2 * math.pi / value, joints[1]]
        shift = turn * 2 * math.pi / value
        knots.append([c + shift if k % 2 == 0 else c for k, c in enumerate(later)] + [value])
    return data | {"knots": knots, "segments": [*data["segments"][1:], data["segments"][0]]}


def test_tubes_do_not_overlap() -> None:
    """A part of one that is in another states its events and orbits again."""
    data = fold()
    middle, _ = data["events"][0]
    for begins, ends in ((middle, middle + 1), (middle - 1, middle + 2), (middle + 2, middle + 1)):
        first, other = _part(data, middle - 3, ends), _part(data, begins, middle + 4)
        for parts in ([first, other], [_later(other, 3), first]):
            file = {"certificate": "diagram", "format": 1, "checkable": parts}
            answer = check_text(json.dumps(file))
            assert answer.yes == (begins > ends), (begins, ends, answer)
            assert answer.yes or answer.why == "false: no two parts are the same, or overlap"


def _answer(*parts: dict[str, Any]) -> Any:
    file = {"certificate": "diagram", "format": 1, "checkable": list(parts)}
    return check_text(json.dumps(file))


def _back(data: dict[str, Any]) -> dict[str, Any]:
    """Return a tube in the other direction."""
    last = len(data["knots"]) - 2
    turned = {name: data[name][::-1] for name in ("knots", "ends")}
    return data | turned | {"events": [[last - k, kind] for k, kind in data["events"]]}


@pytest.mark.parametrize("seed", range(6))
def test_tubes_may_meet_at_a_knot(seed: int) -> None:
    """One ends where the other begins: nothing is stated twice, in whatever direction each is written."""
    data, rng = fold(), np.random.default_rng(seed)
    last, fold_at = len(data["knots"]) - 1, data["events"][0][0]
    far = [k for k in range(2, last - 1) if abs(k - fold_at) > 8]  # there Omega is kept along boxes
    at = int(rng.choice(far))
    first, other = _part(data, max(at - 4, 0), at), _part(data, at, min(at + 3, last))
    for a in (first, _back(first)):
        for b in (other, _back(other)):
            assert _answer(a, b).yes, _answer(a, b)
            assert _answer(b, a).yes
    longer = _part(data, at, min(at + 5, last))
    within = _part(data, at - 1, at)
    once = "false: no two parts are the same, or overlap"
    for wrong in ((other, longer), (first, other, longer), (within, first), (first, first)):
        for parts in (wrong, [_back(wrong[0]), *wrong[1:]], wrong[::-1]):
            assert _answer(*parts).why == once
    moved = copy.deepcopy(other)  # begins a little before where the other ends
    between = zip(data["knots"][at], data["knots"][at - 1], strict=True)
    moved["knots"][0] = [x + 1e-3 * (y - x) for x, y in between]
    assert is_verified(moved) and _answer(first, moved).why == once


def test_only_orbits_that_are_the_same_are_a_knot_of_both() -> None:
    """About a fold the orbit next to a knot depends on the next one: an event could be between the two."""
    data = fold()
    at = data["events"][0][0]
    for k in (at, at + 1):
        assert not _answer(_part(data, k - 3, k), _part(data, k, k + 3)).yes
    off = copy.deepcopy(data)
    off["knots"][at + 1] = [c + 1e-6 for c in off["knots"][at + 1]]
    assert not _answer(_part(off, at - 2, at + 1), _part(off, at + 1, at + 3)).yes


def test_every_open_end_is_counted() -> None:
    data = _part(json.loads(tube("0s", 0.55, 0.4, 0.56)), 3, 6)
    for end in (None, [], False, "", 0):
        answer = _answer(data | {"ends": [end, None]})
        assert not answer.yes or "2 open ends" in answer.statements


def test_a_symmetric_tube_and_its_whole_period_are_the_same() -> None:
    data = _part(json.loads(tube("0s", 0.55, 0.4, 0.56)), 3, 6)
    mirrored = {"slide+": "slide-", "slide-": "slide+", "F+": "F-", "F-": "F+"}
    whole = [[mirrored.get(name, name) for name in pair] for pair in data["segments"]]
    knots = []
    for *joints, value in _part(data, 1, 3)["knots"]:
        half = math.pi / value
        other = [-c if k % 2 else c + half for k, c in enumerate(joints)]
        knots.append([*joints, *other, value])
    again = data | {"half": False, "segments": [*data["segments"], *whole], "knots": knots}
    assert data["half"] and is_verified(again)
    for parts in ([data, again], [again, data]):
        file = {"certificate": "diagram", "format": 1, "checkable": parts}
        assert check_text(json.dumps(file)).why == "false: no two parts are the same, or overlap"


@pytest.mark.parametrize(
    ("name", "omega", "span", "kinds", "ends"),
    [
        ("2s", 0.5, (0.485, 0.6), ["BP"], [None, "CS"]),
        ("0s", 0.55, (0.4, 0.56), [], ["CS", None]),
        ("1a", 0.5, (0.4, 0.5), [], ["SS", None]),
    ],
)
def test_tubes_from_event_to_event(
    name: str, omega: float, span: tuple[float, float], kinds: list[str], ends: list[str | None]
) -> None:
    data = json.loads(tube(name, omega, *span))
    answer = check_text(json.dumps(data))
    assert answer.yes, answer.why
    assert [kind for _, kind in data["events"]] == kinds
    assert [end and end[0] for end in data["ends"]] == ends


def _bridge_the_sheets(data: dict[str, Any]) -> None:
    """Leave the boxes about the fold out: from one sheet to the other at about one value of Omega."""
    k = data["events"][0][0]
    del data["knots"][k - 4 : k + 6]
    data["events"] = []


def _shift_a_knot(data: dict[str, Any]) -> None:
    knot = data["knots"][5]
    period = 2 * 3.141592653589793 / knot[-1]
    knot[:-1:2] = [t + period for t in knot[:-1:2]]


def _beyond_the_end(data: dict[str, Any]) -> None:
    data["ends"][1] = None


def _other_end(kind: str) -> Callable[[dict[str, Any]], None]:
    def change(data: dict[str, Any]) -> None:
        data["ends"][1][0] = kind

    return change


def _end_without_one_of_its_stops(data: dict[str, Any]) -> None:
    data["ends"][1][1] = data["ends"][1][1][:1]


def _end_at_the_other_limit(data: dict[str, Any]) -> None:
    data["ends"][1][1] = [[i, -level] for i, level in data["ends"][1][1]]


def _end_too_early(data: dict[str, Any]) -> None:
    data["knots"] = data["knots"][:-4]


def _of_another_branch(data: dict[str, Any]) -> None:
    """The knots of the other branch of three segments: the mirror image."""
    for knot in data["knots"]:
        knot[1:-1:2] = [-x for x in knot[1:-1:2]]


def _set(name: str, value: Any) -> Callable[[dict[str, Any]], None]:
    return lambda data: data.__setitem__(name, value)


def _param(name: str, value: float) -> Callable[[dict[str, Any]], None]:
    return lambda data: data["params"].__setitem__(name, value)


def _swap_segments(data: dict[str, Any]) -> None:
    data["segments"][0], data["segments"][1] = data["segments"][1], data["segments"][0]


def _rotate_segments(data: dict[str, Any]) -> None:
    data["segments"] = [*data["segments"][1:], data["segments"][0]]


def _fold_elsewhere(data: dict[str, Any]) -> None:
    data["events"][0][0] += 3


def _two_turns(data: dict[str, Any]) -> None:
    """Each orbit twice, as one of two periods."""
    data["periods"], data["segments"] = 2, 2 * data["segments"]
    for k, (*joints, value) in enumerate(data["knots"]):
        turn = 2 * math.pi / value
        later = [c + turn if i % 2 == 0 else c for i, c in enumerate(joints)]
        data["knots"][k] = [*joints, *later, value]


def _back_and_forth(data: dict[str, Any]) -> None:
    """From one sheet to the other and back: each box is right, and the only fold is there twice."""
    k = data["events"][0][0]
    part = data["knots"][k - 3 : k + 5]
    data["knots"] = part + part[-2::-1]
    data["events"], data["ends"] = [[3, "SN"], [2 * len(part) - 6, "SN"]], [None, None]


def _gap(data: dict[str, Any]) -> None:
    """Leave boxes in the middle out, where there is no event."""
    first = data["events"][0][0] // 3
    del data["knots"][first + 1 : 2 * first]
    data["events"][0][0] -= first - 1


def _from_another_parameter(data: dict[str, Any]) -> None:
    """The second half of the knots is of another value of S."""
    other = json.loads(tube("1a", 0.54, 0.53, 0.6, S=0.321))["knots"]
    data["knots"][: len(data["knots"]) // 2] = other[: len(other) // 2]


WRONG: dict[str, Callable[[dict[str, Any]], None]] = {
    "no fold": _set("events", []),
    "a fold in another box": _fold_elsewhere,
    "PD for SN": lambda data: data["events"][0].__setitem__(1, "PD"),
    "two folds": lambda data: data["events"].append([3, "SN"]),
    "from sheet to sheet": _bridge_the_sheets,
    "a knot a period later": _shift_a_knot,
    "beyond the end": _beyond_the_end,
    "SS for CS": _other_end("SS"),
    "AS for CS": _other_end("AS"),
    "SN as an end": _other_end("SN"),
    "one of two stops": _end_without_one_of_its_stops,
    "the other limit": _end_at_the_other_limit,
    "an end that is not reached": _end_too_early,
    "mirrored knots": _of_another_branch,
    "another S": _param("S", 0.3205),
    "another S0": _param("S0", 0.4004),
    "some h": _param("h", 1e-3),
    "some damping": _param("zeta", 1e-3),
    "another parameter": _set("parameter", "S"),
    "three periods": _set("periods", 3),
    "half": _set("half", True),
    "swapped segments": _swap_segments,
    "rotated segments": _rotate_segments,
    "one knot": lambda data: data.__setitem__("knots", data["knots"][:1]),
    "the same knot twice": lambda data: data["knots"].insert(5, data["knots"][5]),
    "two turns": _two_turns,
    "back and forth": _back_and_forth,
    "a gap": _gap,
    "a ball for S": _param("S", "0.32 +/- 1e-6"),  # type: ignore[arg-type]
    "NaN for h": _param("h", math.nan),
    "an infinite knot": lambda data: data["knots"][3].__setitem__(1, math.inf),
    "knots of other parameters": _from_another_parameter,
    "another name": _set("label", "1a"),
    "a second value of the parameter": _param("Omega", 0.54),
    "no numbers": lambda data: data["knots"][3].__setitem__(0, "1"),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_a_wrong_tube_is_refused(wrong: str) -> None:
    data = copy.deepcopy(fold())
    WRONG[wrong](data)
    assert not is_verified(data)


def test_a_part_of_a_tube_is_one(tmp_path: Path) -> None:
    data = json.loads(tube("0s", 0.55, 0.4, 0.56))
    data |= {"knots": data["knots"][3:-3], "ends": [None, None]}
    path = tmp_path / "tube.json"
    path.write_text(json.dumps(data))
    assert verify(path).yes


def test_a_tube_passes_resonance_without_damping() -> None:
    orbit = cf.find_orbit("coulomb", {"Omega": 1.0, "S": 0.9, "S0": 0.9})
    found = tubes_of(certify_branch(cf.continue_orbit(orbit, "Omega", (0.998, 1.002))))
    data = next(d for d in found if d["knots"][0][-1] < 1.0 < d["knots"][-1][-1])
    assert is_verified(data)
    data["params"]["S"] += 1e-4
    assert not is_verified(data)


def test_a_tube_with_overcritical_damping() -> None:
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.3, "S0": 0.4, "zeta": 1.25})
    (data,) = tubes_of(certify_branch(cf.continue_orbit(orbit, "Omega", (0.498, 0.502))))
    assert is_verified(data)
    data["params"]["zeta"] -= 1e-2
    data["events"] = [[0, "PD"]]
    assert not is_verified(data)


def test_a_tube_along_damping_passes_the_critical_one() -> None:
    """At zeta = 1 the free exponents are one: the checker divides by no difference of them."""
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.3, "S0": 0.4, "zeta": 0.989})
    proof = certify_branch(cf.continue_orbit(orbit, "zeta", (0.988, 1.012)))
    (data,) = tubes_of(proof)
    assert len(data["knots"]) <= 2 * len(proof.pieces)
    assert data["knots"][0][-1] < 1.0 < data["knots"][-1][-1]
    assert is_verified(data)
    data["events"] = [[30, "BP"]]
    assert not is_verified(data)


def test_a_tube_ends_at_the_time_limit() -> None:
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.3, "S0": 0.4})
    proof = certify_branch(cf.continue_orbit(orbit, "Omega", (0.499, 0.501)))
    assert len(tubes_of(proof)) == 1
    assert tubes_of(proof, until=time.time() - 1) == []


def test_a_branch_with_equal_limits_is_proved_off_resonance() -> None:
    """Rest is left with acceleration 0, at every frequency: not to be seen in balls of phases."""
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.3, "S0": 0.3, "zeta": 0.02})
    proof = certify_branch(cf.continue_orbit(orbit, "Omega", (0.499, 0.501)))
    assert proof.proved
    assert all(is_verified(data) for data in tubes_of(proof))


def test_a_tube_of_two_knots_cannot_have_two_ends() -> None:
    data = fold()
    data |= {"knots": data["knots"][-2:], "events": [], "ends": [data["ends"][1]] * 2}
    assert not is_verified(data)


@pytest.mark.slow
def test_a_tube_goes_round_a_closed_curve_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """All boxes are right, and events that come again are stated again."""
    params = {"Omega": 0.4667, "S": 0.33, "S0": 0.464, "h": -0.12}
    orbit = cf.find_orbit("coulomb", params, state=(0.3, 0.3), longest=400)
    branch = cf.continue_orbit(orbit, "S", (0.05, 0.46))
    assert branch.ends[1].reason is cf.EndReason.CLOSED
    proof = certify_branch(branch)
    (data,) = tubes_of(proof)
    assert [kind for _, kind in data["events"]] == ["SN", "SN"]
    assert is_verified(data)
    monkeypatch.setattr(tube_file, "_kept", lambda branch: (branch.arc[0], branch.arc[-1]))
    (again,) = tubes_of(proof)  # its last point is beyond its first one
    assert data["knots"][:-1] == again["knots"][: len(data["knots"]) - 1]
    assert check_text(json.dumps(again)).why == "false: no orbit comes again"
    turns = {"knots": [*again["knots"][-8:], *again["knots"][1:]], "events": again["events"]}
    assert not is_verified(again | turns)


@pytest.mark.slow
def test_a_tube_up_to_an_end_at_as() -> None:
    """A stick is touched at its limit: at another kind, limit, time or segment the tube is refused."""
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.3, "S0": 0.4, "h": 0.25})
    proof = certify_branch(cf.continue_orbit(orbit, "h", (0.249, 0.3)))
    assert proof.complete, (proof.gaps, proof.open)
    (data,) = tubes_of(proof)
    assert is_verified(data)
    kind, [[i, surface, time_]] = data["ends"][1]
    assert kind == "AS"
    later = time_.replace(time_[:4], f"{float(time_[:4]) + 0.01:.2f}", 1)
    wrong = [["GS", [[i, surface, time_]]], ["AS", [[i, "F-", time_]]], ["CS", [[i, 1]]], None]
    wrong += [["AS", [[i, surface, later]]], ["AS", [[i - 1, surface, time_]]]]
    for end in wrong:
        assert not is_verified(data | {"ends": [data["ends"][0], end]}), end
