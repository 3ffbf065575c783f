"""The page on users' models: its file and its class are what they say, and make the same model."""

from __future__ import annotations

from pathlib import Path

import pytest
from pages import blocks, run, text_of

import contfric as cf

PAGE = text_of("models")


def test_page_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "my_block.yaml").write_text(blocks(PAGE, "yaml")[0], encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    run("models")
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "model my_block"
    assert "ok" in lines
    assert lines[-1] == "True True"


EXAMPLES = blocks(PAGE, "yaml")[1:]
#: The itineraries of their orbits: domains may be many, modes are few.
WORDS = {
    "neuron": {("rest", "threshold")},
    "clock": {("forth-", "middle"), ("forth+", "stop"), ("back", "stop")},
    "recoil": {("back", "stop"), ("forth-", "gate")},
    "ball": {("flight", "table"), ("chatter", "table_lift")},
    "block": {
        *(("left", "upright"), ("right", "upright")),
        *(("chatter", "upright_lift"), ("chatter", "upright_lift_below")),
    },
    "relay": {("up", "high"), ("down", "low")},
    "heater": {
        *(("heats", "ready"), ("cools", "ready")),
        *(("may_stop", "hot"), ("may_start", "cold")),
    },
    "latch": {("on", "trip"), ("off", "tick")},
    "inverter": {
        *(("plus_up", "switch"), ("minus_up", "kink")),
        *(("minus_down", "switch"), ("plus_down", "kink")),
    },
    "sampled": {("on", "tick"), ("off", "tick")},
    "reactor": {
        *(("up", "phase"), ("up-", "zero"), ("down", "zero"), ("down-", "phase")),
        *(("off-", "pulse"), ("off+", "pulse")),
    },
    "chua": {("x-", "right"), ("x-", "left"), ("x0", "left")},
    "knob": {("turns", "phi+")},
    "theta": {("turns-", "spike"), ("turns+", "th+")},
    "dry": {("forward", "stop"), ("backward", "stop"), ("slide", "slide-"), ("slide", "slide+")},
    "element": {("stick+", "z+"), ("stick+", "z-"), ("slip+", "stop"), ("slip-", "stop")},
    "frame": {("p", "brake"), ("n", "brake"), ("s", "brake+"), ("s", "brake-")},
    "machine": {("p", "pad"), ("n", "pad"), ("s", "pad+"), ("s", "pad-")},
}


#: Where the page says so orbits are found from another start: a block that rocks widely never stands.
STARTS = {"block": [0.0, 0.0]}


@pytest.mark.parametrize("text", EXAMPLES, ids=list(WORDS))
def test_each_example_is_checked_and_found(tmp_path: Path, text: str) -> None:
    path = tmp_path / "example.yaml"
    path.write_text(text, encoding="utf-8")
    report = cf.check_model(path)
    assert report.ok, str(report)
    name = text.split()[1]
    orbit = cf.find_orbit(path, state=STARTS.get(name)).as_whole()
    assert orbit.converged and orbit.admissible and orbit.stable
    assert set(orbit.itinerary) <= WORDS[orbit.model.name], orbit.itinerary
    assert {mode for mode, _ in orbit.itinerary} == {mode for mode, _ in WORDS[orbit.model.name]}
