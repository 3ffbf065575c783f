"""`diagram.certify()` and `contfric certify DIR`: what is proved, what is not and why, on disk and back."""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Callable
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import contfric as cf
from contfric.atlas.diagram import Diagram
from contfric.certify import branch as branches
from contfric.certify import diagram as diagrams
from contfric.certify import events, files
from contfric.certify import limit as time_limit
from contfric.certify.diagram_certificate import (
    DiagramCertificate,
    Gap,
    load_diagram_certificate,
    merged,
)
from contfric.certify.events import certify_event
from contfric.certify.tubes import tracing
from contfric.cli import main
from contfric.models.balls.build import ball_model
from contfric.models.balls.model import BallModel
from contfric.study import read_study, run_study

STUDY = """
model: coulomb
params: {Omega: 0.54, S: 0.32, S0: 0.4}
start: simulate
explore: {parameter: Omega, range: [0.535, 0.545], bridges: false}
want: [stability]
"""


@cache
def diagram() -> Diagram:
    orbit = cf.find_orbit("coulomb", {"Omega": 0.54, "S": 0.32, "S0": 0.4})
    return cf.explore(orbit, "Omega", (0.535, 0.545))


@cache
def proved() -> DiagramCertificate:
    return diagram().certify()


def test_a_diagram_is_proved() -> None:
    found = proved()
    assert found.covered > 0.99
    assert [e.kind for e in found.events] == [b.kind.value for b in diagram().bifurcations]
    assert all(e.proved and e.digits >= 30 for e in found.events)
    assert len(found.branches) == sum(not b.mirrored for b in diagram().branches)
    assert not found.ended
    text = str(found)
    assert "% of the arclength proved" in text
    assert f"{len(found.events)} of {len(found.events)} events proved" in text


def test_what_is_not_proved_has_its_place_and_reason() -> None:
    for branch in proved().branches:
        missing = sum(gap.length for gap in branch.gaps)
        assert branch.covered + missing == pytest.approx(branch.length)
        assert all(gap.why for gap in branch.gaps)


@pytest.mark.parametrize(
    "where", [(), ("summary",), ("summary", "branches", 0), ("summary", "events", 0)]
)
def test_an_entry_that_nobody_reads_is_refused(tmp_path: Path, where: tuple[Any, ...]) -> None:
    """A wrong name would leave a default in the place of what was meant."""
    path = tmp_path / "c.json"
    proved().save(path)
    data = json.loads(path.read_text())
    part = data
    for key in where:
        part = part[key]
    name = next(n for n in ("summary", "complete", "checkable", "ended") if n in part)
    part[name + "d"] = part[name]
    path.write_text(json.dumps(data))
    with pytest.raises(cf.ContfricError, match=f"no entry '{name}d'; did you mean '{name}'"):
        load_diagram_certificate(path)


def test_saved_and_read(tmp_path: Path) -> None:
    proved().save(tmp_path / "c.json")
    assert load_diagram_certificate(tmp_path / "c.json") == proved()
    (tmp_path / "c.json").write_text("{}")
    with pytest.raises(cf.ResultFileError, match=r"certificate\.json"):
        load_diagram_certificate(tmp_path / "c.json")


def test_events_of_the_summary_are_those_that_are_checked(tmp_path: Path) -> None:
    """Not at another value, of another kind, twice, without the part of the file that states it."""
    proved().save(tmp_path / "c.json")
    text = (tmp_path / "c.json").read_text()

    def answer(change: Callable[[dict[str, Any]], Any]) -> files.Answer:
        data = json.loads(text)
        data["checkable"] = [p for p in data["checkable"] if p["certificate"] == "event"]
        change(data)
        (tmp_path / "d.json").write_text(json.dumps(data))
        return files.verify(tmp_path / "d.json")

    assert answer(lambda data: None).yes
    fold = json.loads(text)["summary"]["events"][-1]
    assert fold["kind"] == "SN"
    for name, value in (("kind", "PD"), ("ball", "0.5419 +/- 1e-9"), ("ball", None)):
        wrong = fold | {name: value}
        found = answer(lambda data, wrong=wrong: data["summary"]["events"].__setitem__(-1, wrong))
        assert not found.yes and "no part of the file states" in found.why
    assert not answer(lambda data: data["summary"]["events"].append(fold)).yes
    assert not answer(lambda data: data["checkable"].pop()).yes
    assert not answer(lambda data: data.update(summary="none")).yes


def test_a_time_limit_is_named() -> None:
    found = diagram().certify(time_limit=1e-6)
    assert found.ended.startswith("the time limit of 1e-06 s ended the run")
    assert found.covered == 0.0
    assert "time limit" in str(found)
    with pytest.raises(cf.ParameterError, match="time_limit"):
        diagram().certify(time_limit=-1)


def test_before_the_first_tube_all_printed_orbits_are_proved(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The time is over as soon as a tube is begun: they are cheap, those of later branches, too."""
    wanted, over = proved().branches, False

    def clock() -> float:
        return 10.0 if over else 0.0

    cover = branches.cover

    def late(*args: Any) -> list[Any]:
        nonlocal over
        over = True
        return cover(*args)

    for module in (time_limit, branches, tracing, diagrams):
        monkeypatch.setattr(module, "time", SimpleNamespace(time=clock))
    monkeypatch.setattr(branches, "cover", late)
    found = diagram().certify(time_limit=5.0)
    assert over and found.covered == 0.0 and len(found.branches) > 1
    for one, whole in zip(found.branches, wanted, strict=True):
        assert one.points == whole.points
        assert one.points_proved >= whole.points_proved - 1  # one next to the fold needs the tube


def test_an_event_ends_at_the_time_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wherever it comes: no orbit is evaluated after it, and no inequality."""
    event = next(b for b in diagram().bifurcations if b.kind is cf.Kind.SN)
    evaluations: list[Any] = []

    def clock() -> float:
        return float(len(evaluations))

    def counted(*args: Any) -> BallModel:
        evaluations.append(args)
        return ball_model(*args)

    monkeypatch.setattr(time_limit, "time", SimpleNamespace(time=clock))
    monkeypatch.setattr(events, "ball_model", counted)
    assert certify_event(event, "Omega").proved
    whole = len(evaluations)
    for limit in range(whole):
        evaluations.clear()
        found = certify_event(event, "Omega", until=limit)
        assert found.ended and time_limit.LATE in found.why
        assert len(evaluations) == limit + 1


@pytest.mark.parametrize("kind", [ProcessPoolExecutor, ThreadPoolExecutor])
def test_progress_and_executor(kind: type[Executor]) -> None:
    said: list[str] = []
    with kind(2) as pool:  # type: ignore[call-arg] # both take a number of workers
        found = diagram().certify(executor=pool, time_limit=600.0, progress=said.append)
    assert said and not [text for text in said if "lost" in text]
    assert found.branches == proved().branches
    assert found.events == proved().events
    assert found.checkable == proved().checkable


def test_no_executor() -> None:
    with pytest.raises(cf.ParameterError, match="executor"):
        diagram().certify(executor=3)  # type: ignore[arg-type]


def test_gaps_that_touch_are_one() -> None:
    gaps = [Gap(0.0, 1.0, 2.0, "a"), Gap(1.0, 3.0, 1.0, "a"), Gap(3.0, 4.0, 1.0, "b")]
    assert merged(gaps) == (Gap(0.0, 3.0, 3.0, "a"), Gap(3.0, 4.0, 1.0, "b"))


def test_a_folder_gets_a_certificate_and_a_column(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "near-fold.yaml"
    path.write_text(STUDY)
    folder = tmp_path / "run"
    run_study(read_study(path), folder)
    for _ in range(2):  # a second time nothing is added twice
        assert main(["certify", str(folder), "--quiet"]) == 0
    assert "events proved" in capsys.readouterr().out
    with (folder / "bifurcations.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]).count("proved") == 1
    assert all(float(row["proved"]) < 1e-30 for row in rows)
    data = json.loads((folder / "certificate.json").read_text())
    assert data["certificate"] == "diagram"
    assert main(["verify", str(folder / "certificate.json")]) == 0
    kinds = [part["certificate"] for part in data["checkable"]]
    counts = f"yes: {kinds.count('event')} events, {kinds.count('orbit')} orbits"
    assert kinds.count("event") == len(rows) and capsys.readouterr().out.startswith(counts)
    run_study(read_study(path), folder, force=True)  # what it says is of the run before
    assert not (folder / "certificate.json").exists()


def test_what_is_no_run_folder_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["certify", str(tmp_path)]) == 2
    assert main(["certify", str(tmp_path / "none")]) == 2
    monkeypatch.setitem(sys.modules, "flint", None)
    assert main(["certify", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert "holds no diagram" in said
    assert "pip install 'contfric[certify]'" in said


def test_an_event_that_the_checker_refuses_is_said_and_not_in_the_file(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Where two events happen at once a file of one would be refused, and all that stands next to it."""
    assert not proved().unchecked
    orbit = cf.find_orbit("coulomb", {"Omega": 0.54})
    branch = cf.continue_orbit(orbit, "Omega", (0.538, 0.545))
    proofs: list[Any] = [branch.bifurcations[0].certify(), orbit.certify()]
    assert [part["certificate"] for part in files.checkable(proofs)] == ["event", "orbit"]
    own = files.event_data
    monkeypatch.setattr(files, "event_data", lambda proof: own(proof) | {"kind": "PD"})
    assert [part["certificate"] for part in files.checkable(proofs)] == ["orbit"]
    diagram = cf.explore(orbit, "Omega", (0.538, 0.545), bridges=False)
    found = diagram.certify()
    assert found.unchecked and set(found.unchecked) == {e.label for e in found.events if e.proved}
    assert "not in the file for a checker: SN_1a at Omega = 0.5419" in str(found)
    for proof in (found, branch.certify()):
        proof.save(tmp_path / "c.json")
        assert main(["verify", str(tmp_path / "c.json")]) == 0
        said = capsys.readouterr().out
        assert "not in the file: SN_1a" in said and "the checker refuses it: false" in said
