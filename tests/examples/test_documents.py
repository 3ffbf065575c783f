"""The code in README and the guide runs, and the guide leaves out no public name."""

from __future__ import annotations

import doctest
import importlib
import inspect
import json
import re
import shlex
import subprocess
import sys
from itertools import groupby
from pathlib import Path
from typing import Any

import pytest
from pages import DOCS, ROOT, blocks
from typed import typed

import contfric
from contfric.cli.parser import parse
from contfric.study import read_study

#: Pages whose code a test of their own runs.
ELSEWHERE = {
    *("bridges", "census", "certificates", "curves", "equilibria", "lyapunov", "models"),
    *("quantities", "response"),
    "ensembles",
}
#: Pages whose code is run here, and what it prints or makes.
HERE = {
    "README": "SN_1a",
    "docs/guide": "SN_1a",
    "docs/index": "",
    "docs/figures": "",
    "docs/live-diagram": "",
    "docs/lugre": "Branch 0s, 2seg",
    "docs/gallery/impact-friction": "",
}


@pytest.mark.parametrize("name", HERE)
def test_code_runs(
    name: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    found = blocks((ROOT / f"{name}.md").read_text(encoding="utf-8"))
    assert found
    monkeypatch.chdir(tmp_path)  # pages save files
    scope: dict[str, object] = {}
    for block in found:  # one after the other, as a reader would type them
        exec(compile(block, name, "exec"), scope)
    assert HERE[name] in capsys.readouterr().out


def test_no_page_has_code_that_is_not_run() -> None:
    with_code = set()
    for page in DOCS.rglob("*.md"):
        text, name = page.read_text(encoding="utf-8"), page.relative_to(ROOT).with_suffix("")
        if "```python" in text:
            with_code.add(name.as_posix())
        assert not re.search(r"\n\n    (?:import |from |.*\bcf\.)", text), f"{name}: not a block"
    assert with_code == {f"docs/{name}" for name in ELSEWHERE} | (set(HERE) - {"README"})
    for name in ELSEWHERE:
        own = (ROOT / f"tests/examples/test_{name}_page.py").read_text(encoding="utf-8")
        assert f'run("{name}")' in own


def test_commands_are_commands() -> None:
    """Every line of a console is understood by the program, or is a target of make."""
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    tried = 0
    for page in [ROOT / "README.md", *DOCS.rglob("*.md")]:
        for block in re.findall(r"```console\n(.*?)```", page.read_text("utf-8"), re.DOTALL):
            for line in re.findall(r"^\$ (.*)", block, re.MULTILINE):
                program, *arguments = shlex.split(line, comments=True)
                tried += 1
                if program == "make":
                    assert set(arguments) <= targets, line
                elif program == "python":  # a measurement, which takes long
                    (code,) = re.findall(r"<<'EOF'\n(.*?)^EOF$", block, re.DOTALL | re.MULTILINE)
                    compile(code, str(page), "exec")
                else:
                    assert program == "contfric", line
                    parse(arguments)  # ends the program if it does not understand
    assert tried >= 8


def test_the_study_on_the_first_page_is_one(tmp_path: Path) -> None:
    (found,) = re.findall(
        r"```yaml\n(title:.*?)```", (DOCS / "index.md").read_text("utf-8"), re.DOTALL
    )
    (tmp_path / "study.yaml").write_text(found, encoding="utf-8")
    assert read_study(tmp_path / "study.yaml").title == "Asymmetry against kinetic friction"


#: Of each notebook of the tutorial: a word that it prints. The second one compiles its model first.
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
    monkeypatch.chdir(tmp_path)  # they save files
    scope: dict[str, object] = {}
    for cell in code_of(json.loads((DOCS / f"tutorial/{name}.ipynb").read_text(encoding="utf-8"))):
        source = "".join(cell["source"])
        if file := re.match(r"%%writefile (\S+)\n", source):
            Path(file[1]).write_text(source[file.end() :], encoding="utf-8")
        else:
            exec(compile(source, name, "exec"), scope)
    assert re.search(printed, capsys.readouterr().out)


NOTEBOOKS = sorted((DOCS / "tutorial").glob("*.ipynb"))


def code_of(notebook: dict[str, Any]) -> list[dict[str, Any]]:
    return [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]


def said(notebook: dict[str, Any]) -> list[str]:
    """Return what each cell of code prints or shows: text, and the kinds of what else there is."""
    found = []
    for cell in code_of(notebook):
        shown = [output.get("data", {"text": output.get("text", "")}) for output in cell["outputs"]]
        # what a cell prints comes in as many pieces as its kernel happens to send
        kinds = [kind for kind, _ in groupby(k for data in shown for k in sorted(data))]
        plain = ["".join(data.get("text/plain", data.get("text", ""))) for data in shown]
        found.append("\n".join([*kinds, "".join(plain)]))
    return found


def test_every_notebook_of_the_tutorial_is_run() -> None:
    named = {getattr(p, "values", p)[0] for p in TUTORIAL}
    assert named == {path.stem for path in NOTEBOOKS}
    assert len(NOTEBOOKS) == 5
    assert not list((DOCS / "tutorial").glob("*.md"))


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_say_what_they_say(path: Path) -> None:
    """In a kernel of their own they run from top to bottom, and what is stored in them comes out."""
    script = (
        "import json, runpy, sys; from pathlib import Path;"
        f"ran = runpy.run_path({str(DOCS / '_site/notebooks.py')!r})['execute'](Path(sys.argv[1]));"
        "print(json.dumps(ran))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, str(path)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-3000:]
    now = said(json.loads(done.stdout.splitlines()[-1]))
    number = re.compile(r"[-+]?\d+\.\d+(?:e[-+]?\d+)?")
    for old, new in zip(said(json.loads(path.read_text(encoding="utf-8"))), now, strict=True):
        assert number.sub("#", new) == number.sub("#", old)
        values = [[float(v) for v in number.findall(text)] for text in (old, new)]
        assert values[1] == pytest.approx(values[0], rel=1e-5, abs=1e-9)


def test_the_model_on_the_first_page_is_one(tmp_path: Path) -> None:
    text = (DOCS / "index.md").read_text(encoding="utf-8")
    (found,) = [b for b in re.findall(r"```yaml\n(.*?)```", text, re.DOTALL) if "modes:" in b]
    model = typed(tmp_path, found)
    assert [d.name for d in model.domains] == ["pressed+", "pressed-", "free+", "free-"]
    assert model.transitions["pressed-", "contact"] == "free-"


def test_guide_mentions_every_public_name() -> None:
    guide = (ROOT / "docs/guide.md").read_text()
    missing = [n for n in contfric.__all__ if not re.search(rf"cf\.{n}\b|`{n}`", guide)]
    assert not missing


#: Their examples need a model file: docs/equilibria.md has them.
WITHOUT_EXAMPLE = {"BoundaryPoint", "EquilibriumSet", "TwoFold"}


def test_every_public_name_has_an_example() -> None:
    public = {n: getattr(contfric, n) for n in contfric.__all__ if n not in WITHOUT_EXAMPLE}
    named = {n: o for n, o in public.items() if inspect.isclass(o) or inspect.isfunction(o)}
    assert [n for n, o in named.items() if ">>>" not in (inspect.getdoc(o) or "")] == []


def modules_with_examples() -> list[str]:
    root = Path(contfric.__file__).parents[1]
    files = (file.relative_to(root) for file in (root / "contfric").rglob("*.py"))
    with_examples = (file for file in files if ">>>" in (root / file).read_text(encoding="utf-8"))
    return sorted(
        ".".join(file.with_suffix("").parts).removesuffix(".__init__") for file in with_examples
    )


@pytest.mark.parametrize("name", modules_with_examples())
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
    from contfric.continuation import points
    from contfric.continuation.core import steps

    assert points.EXTRA == steps.EXTRA
