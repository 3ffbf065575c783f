"""The page of a live diagram: one file that holds everything, and what a browser makes of it."""

from __future__ import annotations

import base64
import html
import json
import re
import shutil
import subprocess
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.base.extras import MissingPackageError
from contfric.cli import main
from contfric.plot.appearance.style import ROWS
from contfric.plot.live import page
from contfric.plot.live.collect import Detail, floats, kept, local_sizes, quantised

LARGEST = 2_000_000
BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "chrome"))), None)


@pytest.fixture(scope="module")
def diagram(orbit: cf.Orbit) -> cf.Diagram:
    return cf.explore(orbit, "Omega", (0.48, 0.55))


@pytest.fixture(scope="module")
def written(diagram: cf.Diagram, tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("bokeh")
    return diagram.to_html(tmp_path_factory.mktemp("live") / "diagram.html")


@pytest.fixture(scope="module")
def data(written: Path) -> dict[str, Any]:
    return data_of(written)


def data_of(path: Path) -> dict[str, Any]:
    text = path.read_text(encoding="utf-8")
    found = re.search(r'id="contfric-data">(.*?)</script>', text, re.DOTALL)
    assert found is not None
    return dict(json.loads(found[1]))


def numbers(text: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), "<f4")


def unquantised(packed: list[Any]) -> np.ndarray:
    low, step, text = packed
    return low + step * np.frombuffer(base64.b64decode(text), "<u2")


# ------------------------------------------------------------------------------- the file


def test_the_file_is_small_and_asks_nothing_of_others(written: Path) -> None:
    text = written.read_text(encoding="utf-8")
    assert len(text.encode()) <= LARGEST
    assert not re.search(r"""<(script|img|iframe)[^>]*\ssrc=|<link\b""", text)
    assert not re.search(r"""@import|url\(\s*['"]?https?:""", text)


def test_every_branch_is_in_it_to_its_ends(diagram: cf.Diagram, data: dict[str, Any]) -> None:
    assert [b["name"] for b in data["branches"]] == [b.name for b in diagram.branches]
    assert [b["bridge"] for b in data["branches"]] == [b.bridge for b in diagram.branches]
    assert any(b.bridge for b in diagram.branches)
    for i, branch in enumerate(diagram.branches):
        runs = [run for run in data["runs"] if run["branch"] == i]
        x = np.concatenate([numbers(run["x"]) for run in runs])
        assert np.isclose(x.min(), branch.values.min(), rtol=1e-6)
        assert np.isclose(x.max(), branch.values.max(), rtol=1e-6)
        assert {run["style"] for run in runs} <= (
            {"bridge"} if branch.bridge else {"stable", "unstable"}
        )
        top = np.concatenate([numbers(run["y"]["x_max"][0]) for run in runs])
        assert np.isclose(top.max(), max(branch.x_max.max(), top.max()), rtol=1e-6)
        assert all(set(run["y"]) == set(ROWS) for run in runs)


def test_stable_and_unstable_parts_are_apart(diagram: cf.Diagram, data: dict[str, Any]) -> None:
    fold = next(b for b in diagram.bifurcations if b.label == "SN_1a")
    styles = {
        run["style"]
        for run in data["runs"]
        if np.any(np.abs(numbers(run["x"]) - fold.params["Omega"]) < 1e-6)
    }
    assert styles == {"stable", "unstable"}


def test_every_event_is_marked_in_every_row(diagram: cf.Diagram, data: dict[str, Any]) -> None:
    for row in data["rows"]:
        marks = [(m["kind"], m["x"]) for m in row["marks"]]
        for event in diagram.bifurcations:
            at = event.params["Omega"]
            assert any(k == event.kind.value and abs(x - at) <= 1e-9 for k, x in marks), event
        assert all(m["label"] and m["branches"] for m in row["marks"])


def test_points_tell_their_orbits(diagram: cf.Diagram, data: dict[str, Any]) -> None:
    checked = 0
    for point in data["points"][::7]:
        branch = diagram.branches[point["branch"]]
        if point["event"]:
            continue
        k = int(np.argmin(np.abs(branch.values - point["x"])))
        orbit = branch[k]
        if orbit.params["Omega"] != point["x"]:
            continue
        times, states, _ = orbit.trajectory(72)
        assert np.allclose(unquantised(point["t"]), times - times[0], atol=1e-3)
        for packed, column in zip(point["s"], states.T, strict=True):
            assert np.allclose(unquantised(packed), column, atol=1e-4)
        assert data["systems"][point["system"]]["signature"] == str(orbit.signature)
        margins = np.frombuffer(base64.b64decode(point["margins"]), "<f4")
        assert margins == pytest.approx(orbit.margins, rel=1e-6, abs=1e-9)
        assert len(data["systems"][point["system"]]["watched"]) == len(margins)
        if branch.bridge:
            assert point["multipliers"] is None
        else:
            assert float(point["multipliers"][0].split()[0]) == pytest.approx(
                branch.multipliers[k][0].real, abs=1e-5
            )
        checked += 1
    assert checked > 10


def test_every_event_can_be_clicked_on(diagram: cf.Diagram, data: dict[str, Any]) -> None:
    there = {(p["event"], round(p["x"], 9)) for p in data["points"]}
    for branch in diagram.branches:
        for event in branch.bifurcations:
            assert (event.label, round(event.params["Omega"], 9)) in there


def test_a_large_diagram_is_shown_with_less(
    diagram: cf.Diagram, data: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(page, "LARGEST", 1_420_000)
    monkeypatch.setattr(page, "_DETAILS", (Detail(80, 0.0), Detail(20, 1e-3)))
    coarse = diagram.to_html(tmp_path / "coarse.html")
    assert coarse.stat().st_size <= 1_420_000
    less = data_of(coarse)
    assert len(less["points"]) < len(data["points"])
    assert len(less["runs"]) == len(data["runs"])  # no branch is missing
    assert less["rows"] == data["rows"]  # nor any event


@pytest.mark.slow
def test_orbits_of_a_hundred_segments_fit_in_the_file(tmp_path: Path) -> None:
    """The cascade of the bang-bang oscillator, 150 events on 21 branches, took 2.1 MB at its coarsest."""
    cf.run_study("bang-bang", out=tmp_path / "run")
    page_of_it = cf.load(tmp_path / "run/diagram.npz").to_html(tmp_path / "page.html")
    assert page_of_it.stat().st_size <= LARGEST


def drawn(columns: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return points of the thinned line that stand for its vertices."""
    found = np.empty_like(columns)
    for first, last in pairwise(at):
        share = (np.arange(last - first + 1) / (last - first))[:, None]
        found[first : last + 1] = (1 - share) * columns[first] + share * columns[last]
    return found


@pytest.mark.parametrize("seed", range(5))
def test_a_vertex_that_is_left_out_is_near_the_line(seed: int) -> None:
    generator = np.random.default_rng(seed)
    columns = np.cumsum(generator.normal(size=(200, 3)), axis=0)
    sizes = generator.uniform(0.5, 2.0, size=columns.shape)
    tolerance = float(10.0 ** generator.uniform(-2, 1))
    at = kept(columns, sizes, tolerance)
    assert at[0] == 0
    assert at[-1] == 199
    assert np.max(np.abs(drawn(columns, at) - columns) / sizes) <= tolerance * (1 + 1e-9)
    assert np.array_equal(kept(columns, sizes, 0.0), np.arange(200))


@pytest.mark.parametrize("seed", range(5))
def test_a_resonance_does_not_flatten_the_rest(seed: int) -> None:
    """A line that grows by six decades is drawn exactly where it is small."""
    generator = np.random.default_rng(seed)
    x = 1.0 - np.geomspace(1.0, 1e-6, 2000)
    y = 1.0 / (1.0 - x) + 0.3 * np.sin(generator.uniform(5, 20) * x)
    columns = np.column_stack([x, y])
    sizes = np.column_stack([np.ones_like(x), local_sizes(y)])
    at = kept(columns, sizes, 1e-3)
    assert len(at) < len(x)
    error = np.abs(drawn(columns, at) - columns)
    small = y < 5.0
    assert error[small, 1].max() <= 1e-3 * (y[small].max() + np.quantile(np.abs(y), 0.05))
    assert error[:, 0].max() <= 1e-3


@pytest.mark.parametrize("seed", range(3))
def test_packed_numbers_come_back(seed: int) -> None:
    values = np.random.default_rng(seed).normal(size=50) * 10.0**seed
    assert np.allclose(numbers(floats(values)), values, rtol=1e-6)
    assert np.allclose(unquantised(list(quantised(values))), values, atol=np.ptp(values) / 65000)
    assert np.allclose(unquantised(list(quantised(np.full(3, values[0])))), values[0])


# ------------------------------------------------------------------------ errors, the shell


def test_a_page_has_the_suffix_of_one(diagram: cf.Diagram, tmp_path: Path) -> None:
    with pytest.raises(cf.ParameterError, match=r"a page ends with \.html or \.htm, got .*x\.pdf"):
        diagram.to_html(tmp_path / "x.pdf")
    assert not list(tmp_path.iterdir())


def test_without_bokeh_one_line_names_the_extra(
    diagram: cf.Diagram, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "bokeh", None)
    with pytest.raises(MissingPackageError) as caught:
        diagram.to_html(tmp_path / "diagram.html")
    assert "contfric[live]" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_view_writes_beside_the_results(
    diagram: cf.Diagram,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("bokeh")
    monkeypatch.setattr(page, "_DETAILS", (Detail(10, 1e-3),))  # which is quick
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    cf.save(diagram, tmp_path / "diagram.npz")
    assert main(["view", str(tmp_path)]) == 0
    assert capsys.readouterr().out.strip() == str(tmp_path / "diagram.html")
    assert data_of(tmp_path / "diagram.html")["parameter"] == "Ω"
    assert opened == []
    assert main(["view", str(tmp_path), "--open"]) == 0
    assert opened == [(tmp_path / "diagram.html").as_uri()]


def test_view_says_what_is_missing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("bokeh")
    assert main(["view", str(tmp_path)]) == 2
    message = capsys.readouterr().err
    assert "diagram.npz" in message
    assert message.count("\n") == 1
    file = tmp_path / "study.yaml"
    file.write_text("model: coulomb\n")
    assert main(["view", str(file)]) == 2
    assert "is a file; give the folder that a run wrote" in capsys.readouterr().err


# --------------------------------------------------------------------------- in a browser

#: Chooses another row, switches off bridges, events and a branch, and clicks on a point of another one; each
#: time it notes what is drawn. It waits for the page as a user would.
_DRIVER = """
<script>
function drive() {
  if (document.body.dataset.contfric !== "ready") return setTimeout(drive, 50);
  const source = (name) => Bokeh.documents[0].get_model_by_name(name).data;
  const seen = [];
  const note = () => seen.push({
    stable: source("stable").x.length, unstable: source("unstable").x.length,
    bridge: source("bridge").x.length, marks: source("marks").x.length,
    labels: source("labels").label, facts: document.getElementById("facts").innerText,
    parts: source("parts").x.length, margins: document.querySelectorAll("#margins li").length,
    curves: source("curves").y.map((y) => y.length),
  });
  const change = (node, key, value) => {
    node[key] = value;
    node.dispatchEvent(new Event("change", {bubbles: true}));
    note();
  };
  note();
  change(document.getElementById("bridges"), "checked", false);
  change(document.getElementById("events"), "checked", false);
  change(document.querySelector('#branches input[value="1a"]'), "checked", false);
  change(document.getElementById("row"), "selectedIndex", 2);
  const target = contfric.data.points.find(
    (p) => !p.event && contfric.data.branches[p.branch].name === "2s");
  contfric.pick(target.x, target.y.stops[0]);
  note();
  const out = document.createElement("pre");
  out.id = "seen";
  out.textContent = JSON.stringify(seen);
  document.body.append(out);
}
drive();
</script>
"""


@pytest.mark.skipif(BROWSER is None, reason="no chromium on this machine")
def test_a_browser_shows_it(written: Path, tmp_path: Path) -> None:
    driven = tmp_path / "driven.html"
    text = written.read_text(encoding="utf-8")
    driven.write_text(text.replace("</body>", _DRIVER + "</body>"), encoding="utf-8")
    profile = f"--user-data-dir={tmp_path / 'profile'}"
    done = subprocess.run(
        [
            *(str(BROWSER), "--headless=new", "--no-sandbox", "--disable-gpu", profile),
            *("--virtual-time-budget=20000", "--dump-dom", driven.as_uri()),
        ],
        capture_output=True,
        text=True,
        timeout=180,
        check=False,
    )
    found = re.search(r'<pre id="seen">(.*?)</pre>', done.stdout, re.DOTALL)
    assert found is not None, done.stderr[-2000:]
    start, no_bridges, no_events, no_1a, stops, picked = json.loads(html.unescape(found[1]))
    assert min(start["stable"], start["unstable"], start["bridge"], start["marks"]) > 0
    assert "SN_1a" in start["labels"]
    assert no_bridges["bridge"] == 0
    assert no_bridges["stable"] == start["stable"]
    assert no_events["marks"] == 0
    assert no_events["labels"] == []
    assert no_1a["stable"] < start["stable"]
    assert stops["stable"] > no_1a["stable"]  # several stops, several lines
    for name in ("signature", "Floquet multipliers", "smallest margin"):
        assert name in picked["facts"]
    assert "2s" in picked["facts"]
    assert picked["margins"] > 4  # every inequality that is watched
    assert picked["parts"] >= 4  # phases of slip and stick
    assert len(set(picked["curves"])) == 1


def test_a_notebook_shows_the_page_in_a_frame(diagram: cf.Diagram, written: Path) -> None:
    shown = diagram.show(height=500)
    frame = shown._repr_html_()
    (source,) = re.findall(r'<iframe srcdoc="([^"]*)"', frame)
    assert 'height="500"' in frame and "allow-same-origin" not in frame
    page_itself = html.unescape(source)
    assert page_itself.count("<html") == 1 and diagram.branches[0].name in page_itself
    assert len(repr(shown)) < 200
