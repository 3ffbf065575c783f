"""The live diagram with sliders: what the server answers, and what a browser makes of it."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import contfric as cf
from contfric.atlas.other_parameters import anew
from contfric.cli import main
from contfric.plot.appearance.style import ROWS
from contfric.plot.live.serve import _sliders, answered

BROWSER, DRIVER = (shutil.which(name) for name in ("chromium", "chromedriver"))
PARAMS = {"S": 0.32, "S0": 0.45, "h": 0.0, "zeta": 0.0}


@pytest.fixture(scope="module")
def diagram() -> cf.Diagram:
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    return cf.explore(orbit, "Omega", (0.48, 0.56))


def test_other_parameters_give_the_diagram_that_they_have(diagram: cf.Diagram) -> None:
    found = anew(diagram, PARAMS)
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.45})
    direct = cf.explore(orbit, "Omega", (0.48, 0.56))
    assert found.settings == diagram.settings and found.range == diagram.range
    assert [b.label for b in found.bifurcations] == [b.label for b in direct.bifurcations]
    for one, other in zip(found.bifurcations, direct.bifurcations, strict=True):
        assert one.params["Omega"] == pytest.approx(other.params["Omega"], rel=1e-9)


def test_a_start_is_looked_for_along_the_range(
    monkeypatch: pytest.MonkeyPatch, diagram: Any
) -> None:
    """Where nothing periodic attracts in the middle, another value of the parameter is tried."""
    tried = []

    def finding(model: Any, params: dict[str, float]) -> cf.Orbit:
        tried.append(params["Omega"])
        if len(tried) == 1:
            raise cf.AperiodicError("nothing periodic")
        return cf.find_orbit(model, params)

    monkeypatch.setattr("contfric.atlas.other_parameters.find_orbit", finding)
    assert anew(diagram, PARAMS).branches
    assert tried == pytest.approx([0.52, 0.5])


def test_while_one_drags_only_the_row_that_is_seen_is_sent(diagram: cf.Diagram) -> None:
    quick = answered(diagram, anew, {"params": PARAMS, "row": "psi", "quick": True})
    assert [row["name"] for row in quick["rows"]] == ["psi"]
    assert all(list(run["y"]) == ["psi"] for run in quick["runs"]) and "points" not in quick
    assert quick["fixed"] == "S = 0.32, S0 = 0.45"
    full = answered(diagram, anew, {"params": PARAMS, "row": "psi", "quick": False})
    assert [row["name"] for row in full["rows"]] == list(ROWS)
    assert len(full["points"]) > 20 and len(full["branches"]) == len(quick["branches"])
    json.dumps(full, allow_nan=False)


def test_what_the_model_does_not_allow_is_said(diagram: cf.Diagram) -> None:
    found = answered(diagram, anew, {"params": {**PARAMS, "S0": 0.1}, "row": "psi", "quick": True})
    assert "S0" in found["trouble"]


def test_there_is_a_slider_for_every_fixed_parameter(diagram: cf.Diagram) -> None:
    sliders = {s["name"]: s for s in _sliders(diagram)}
    assert set(sliders) == {"S", "S0", "h", "zeta"}
    assert (sliders["S0"]["low"], sliders["S0"]["high"]) == (0.32, 0.8)  # S0 >= S
    assert all(s["low"] <= s["value"] <= s["high"] for s in sliders.values())


@pytest.fixture(scope="module")
def url(diagram: cf.Diagram, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Serve the diagram as a user does from the shell."""
    folder = tmp_path_factory.mktemp("run")
    cf.save(diagram, folder / "diagram.npz")
    command = [sys.executable, "-m", "contfric", "view", str(folder), "--live"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        yield server.stdout.readline().strip()
        server.terminate()


def asked(url: str, origin: str) -> dict[str, Any]:
    body = json.dumps({"params": PARAMS, "row": "x_max", "quick": True}).encode()
    request = urllib.request.Request(f"{url}again", body, {"Origin": origin})
    with urllib.request.urlopen(request) as reply:
        return dict(json.loads(reply.read()))


def test_only_its_own_page_is_answered(url: str) -> None:
    assert asked(url, url.rstrip("/"))["fixed"] == "S = 0.32, S0 = 0.45"
    with pytest.raises(urllib.error.HTTPError, match="403"):
        asked(url, "http://example.org")


@pytest.mark.slow
@pytest.mark.skipif(not (BROWSER and DRIVER), reason="no chromium with its driver on this machine")
def test_a_browser_drags(url: str) -> None:
    pytest.importorskip("selenium")
    from selenium import webdriver
    from selenium.webdriver.support.ui import WebDriverWait

    options = webdriver.ChromeOptions()
    options.binary_location = str(BROWSER)
    for itinerary in ("headless=new", "no-sandbox", "disable-gpu", "disable-background-networking"):
        options.add_argument(f"--{itinerary}")
    browser = webdriver.Chrome(options, webdriver.ChromeService(DRIVER))
    try:
        browser.set_script_timeout(120)
        browser.get(url)
        wait = WebDriverWait(browser, 60)
        wait.until(lambda b: b.execute_script("return document.body.dataset.steer") == "ready")
        drag = """
            const slider = document.getElementById("steer-S0");
            for (const value of [0.42, 0.44, 0.44, 0.45]) {
              slider.value = value;
              slider.dispatchEvent(new Event("input"));
            }
        """
        state = (
            "return [contfric.redraws, contfric.data.points.length, contfric.data.rows[0].marks]"
        )
        before = browser.execute_script(state)
        browser.execute_script(drag)
        label = "return document.getElementById('fixed').textContent"
        wait.until(
            lambda b: b.execute_script(label) == "S = 0.32, S0 = 0.4496"
        )  # a step of the slider
        redraws, points, marks = browser.execute_script(state)
        assert before[0] == 0 and before[1] > 20
        assert (
            1 <= redraws <= 4 and points == 0
        )  # of what was asked meanwhile only the last is drawn
        assert marks != before[2]
        browser.execute_script(
            'document.getElementById("steer-S0").dispatchEvent(new Event("change"))'
        )
        wait.until(lambda b: b.execute_script(state)[1] > 20)  # released: orbits to click on
        facts = browser.execute_script("return document.getElementById('facts').innerText")
        assert "signature" in facts and "stable" in facts
        severe = [line for line in browser.get_log("browser") if line["level"] == "SEVERE"]
        assert [line for line in severe if "favicon" not in line["message"]] == []
    finally:
        browser.quit()


NOTEBOOK = """
import contfric as cf
orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
live = cf.explore(orbit, "Omega", (0.49, 0.51)).live()
live
---
import asyncio, urllib.request
page = await asyncio.to_thread(lambda: urllib.request.urlopen(live.url).read().decode())
live.stop()
page.count("contfric-data")
"""


@pytest.mark.slow
def test_a_notebook_serves_it_while_it_goes_on() -> None:
    """In a process of its own: the libraries of notebooks warn of much that is not ours."""
    script = (
        "import sys, nbformat.v4 as v4; from nbclient import NotebookClient;cells = [v4.new_code_cell(text) "
        "for text in sys.argv[1].split('---')];book = NotebookClient(v4.new_notebook(cells=cells), "
        "timeout=300).execute();print(*[o['data'] for c in book.cells for o in c['outputs']], sep='\\n')"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, NOTEBOOK], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    frame, count = done.stdout.splitlines()
    assert '<iframe src="http://localhost:' in frame
    assert "'1'" in count or "'2'" in count


def test_without_a_diagram_nothing_is_served(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["view", str(tmp_path), "--live"]) == 2
    assert "diagram.npz" in capsys.readouterr().err
