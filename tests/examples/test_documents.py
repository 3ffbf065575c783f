"""The code in README and the guide runs, and the guide leaves out no public name."""

from __future__ import annotations

import doctest
import importlib
import pkgutil
import re
from pathlib import Path

import matplotlib
import pytest

import contfric

matplotlib.use("Agg")
ROOT = Path(__file__).parents[2]


def blocks(name: str) -> list[str]:
    return re.findall(r"```python\n(.*?)```", (ROOT / name).read_text(), re.DOTALL)


@pytest.mark.parametrize("name", ["README.md", "docs/guide.md"])
def test_code_runs(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    found = blocks(name)
    assert found
    scope: dict[str, object] = {}
    for block in found:  # one after the other, as a reader would type them
        exec(compile(block, name, "exec"), scope)
    assert "SN_1a" in capsys.readouterr().out


#: Of each page of the tutorial: a word that it prints. The second one compiles its model first.
TUTORIAL = [
    ("first-diagram", "SS_a"),
    pytest.param("own-model", "RANGE|range", marks=pytest.mark.slow),
    ("two-parameters", "SN-CS"),
    ("chaos", "CHAOTIC"),
    ("from-other-programs", "accepted"),
]


@pytest.mark.parametrize(("name", "printed"), TUTORIAL)
def test_tutorial_runs(
    name: str,
    printed: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    page = f"docs/tutorial/{name}.md"
    for model in re.findall(r"```yaml\n(.*?)```", (ROOT / page).read_text(), re.DOTALL):
        (tmp_path / "bilinear.yaml").write_text(model, encoding="utf-8")
    monkeypatch.chdir(tmp_path)  # pages save files
    scope: dict[str, object] = {}
    for block in blocks(page):
        exec(compile(block, page, "exec"), scope)
    assert re.search(printed, capsys.readouterr().out)


def test_every_page_of_the_tutorial_is_run() -> None:
    named = {getattr(p, "values", p)[0] for p in TUTORIAL}
    assert named == {page.stem for page in (ROOT / "docs/tutorial").glob("*.md")}


def test_the_model_in_the_readme_is_one(tmp_path: Path) -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (found,) = [b for b in re.findall(r"```yaml\n(.*?)```", text, re.DOTALL) if "modes:" in b]
    path = tmp_path / "bilinear.yaml"
    path.write_text(found, encoding="utf-8")
    model = contfric.load_model(path)
    assert [d.name for d in model.domains] == ["pressed+", "pressed-", "free+", "free-"]
    assert model.transitions["pressed-", "contact"] == "free-"


def test_guide_mentions_every_public_name() -> None:
    guide = (ROOT / "docs/guide.md").read_text()
    missing = [n for n in contfric.__all__ if not re.search(rf"cf\.{n}\b|`{n}`", guide)]
    assert not missing


def modules() -> list[str]:
    found = pkgutil.walk_packages(contfric.__path__, "contfric.")
    return sorted(m.name for m in found if not m.name.endswith("__main__"))


@pytest.mark.parametrize("name", modules())
def test_docstring_examples(name: str) -> None:
    module = importlib.import_module(name)
    failed, _ = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert failed == 0


def test_glossary_has_every_kind_and_end() -> None:
    glossary = (ROOT / "docs/glossary.md").read_text()
    for kind in contfric.Kind:
        assert re.search(rf"^\| {kind.value} \|", glossary, re.MULTILINE), kind
    for reason in contfric.EndReason:
        assert f"`{reason.name}`" in glossary, reason


def test_engine_constants_agree() -> None:
    """The number of extra tests stands twice, so that tracing is not compiled before it is used."""
    from contfric.continuation import points, steps

    assert points.EXTRA == steps.EXTRA
