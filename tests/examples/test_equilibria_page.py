"""The code of the page on equilibria runs, and finds what the page says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from pages import run, text_of


def test_the_page_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for model in re.findall(r"```yaml\n(name:.*?)```", text_of("equilibria"), re.DOTALL):
        name = model.split("\n")[0].removeprefix("name: ")
        (tmp_path / f"{name}.yaml").write_text(model, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    scope = run("equilibria")
    assert scope["hopf"].value == pytest.approx(0.48, abs=1e-13) and scope["hopf"].label == "H+"
    assert scope["diagram"].loose_ends == () and len(scope["diagram"].branches) == 2
    (touch,) = [b for b in scope["diagram"].bifurcations if b.kind.value == "GS"]
    assert touch.params["c"] == pytest.approx(0.655, abs=5e-4)
    assert scope["rest"].state[0] == pytest.approx(0.4)
    assert sorted(state[0] for _, state in scope["stuck"].ends) == pytest.approx([-0.4, 0.4])
    assert scope["event"].product == pytest.approx(0.769, abs=5e-4)
    assert scope["event"].unfolding.name == "PERSISTENCE"
    assert scope["cycle"].stable
    printed = capsys.readouterr().out
    assert "subcritical" in printed and "persistence" in printed
