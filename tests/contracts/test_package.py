"""What a package index, a reference manager and a user's type checker make of the package."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

tomllib = pytest.importorskip("tomllib")  # since Python 3.11

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def settings() -> dict[str, Any]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def description(settings: dict[str, Any]) -> str:
    """Return the long description, as the build makes it."""
    hook = settings["tool"]["hatch"]["metadata"]["hooks"]["fancy-pypi-readme"]
    text = "".join((ROOT / f["path"]).read_text(encoding="utf-8") for f in hook["fragments"])
    for rule in hook["substitutions"]:
        text = re.sub(rule["pattern"], rule["replacement"], text)
    return text


def test_every_link_of_the_long_description_works_without_the_repository(description: str) -> None:
    targets = re.findall(r"\]\(([^)]*)\)", description)
    assert targets
    assert all(target.startswith("https://") for target in targets)
    assert "![" not in description
    assert "docs/" not in re.sub(r"`[^`]*`|```.*?```", "", description, flags=re.DOTALL)
    for itinerary in ("# contfric", "## Ten lines of Python", "import contfric as cf", "glossary"):
        assert itinerary in description


def test_readme_is_a_screen_and_a_half() -> None:
    lines = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 75
    code = "\n".join(lines).split("```python\n")[1].split("```")[0]
    assert len([line for line in code.splitlines() if line.strip()]) <= 10


def test_addresses_are_addresses(settings: dict[str, Any]) -> None:
    urls = settings["project"]["urls"]
    assert urls and all(re.fullmatch(r"https://\S+", url) for url in urls.values())


CHANGES = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_the_citation_is_valid_and_names_the_authors(settings: dict[str, Any]) -> None:
    cffconvert = pytest.importorskip("cffconvert")
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    citation = cffconvert.Citation(text)
    citation.validate()
    assert "Csernák" in text and "Licskó" in text and "see the doi" not in text
    assert citation.cffobj["version"] == settings["project"]["version"]
    assert "@misc" in citation.as_bibtex() and "contfric" in citation.as_bibtex()
    released = re.search(rf"## \[{re.escape(citation.cffobj['version'])}\] - (\S+)", CHANGES)
    assert released and str(citation.cffobj["date-released"]) == released[1]


def test_what_a_release_needs_is_listed() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = set(re.findall(r"`make ([a-z-]+)`", text))
    assert {"test", "test-all", "docs", "gallery", "notebooks"} <= targets
    assert all(re.search(rf"^{target}:", makefile, re.MULTILINE) for target in targets)


def test_every_installation_names_all_of_its_extras() -> None:
    """A comma ends an argument of make's `call`: `.[dev,docs]` arrived as `.[dev`, and `make docs` failed."""
    stamps = [".venv/.installed", ".venv/.docs-installed", ".venv/.bench-installed"]
    done = subprocess.run(
        ["make", "-n", "-B", *stamps], capture_output=True, text=True, check=True, cwd=ROOT
    )
    named = set(re.findall(r"--editable (\S+)", done.stdout.replace(";", "")))
    assert named == {"'.[dev]'", "'.[dev,docs]'", "'.[dev,bench]'"}


def test_the_animation_is_small_and_moves() -> None:
    image = pytest.importorskip("PIL.Image")
    path = ROOT / "docs/images/growing.gif"
    assert path.stat().st_size < 1_000_000
    with image.open(path) as animation:
        assert animation.n_frames > 20


USER = """
import contfric as cf
import contfric.plot as cplot

orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
diagram: cf.Diagram = cf.explore(orbit, "Omega", (0.4, 0.6))
with cplot.journal("single"):
    cplot.save_figure(diagram.plot(row="psi").figure, "diagram.pdf")
page, live = diagram.to_html("diagram.html"), diagram.live()
shown: dict[cf.Kind, float] = {event.kind: event.params["Omega"] for event in diagram.bifurcations}
ranges = {"Omega": (0.4, 0.6), "S": (0.2, 0.4)}
curve: cf.Curve = cf.continue_bifurcation(diagram.bifurcations[0], ("Omega", "S"), ranges)
peak: float = max(float(b.x_max.max()) for b in diagram.branches)
names: list[str] = [event.label for event in diagram.bifurcations]
reveal_type(orbit)
reveal_type(diagram.branches[0][0])
wrong: int = diagram.parameter
"""


@pytest.mark.slow
def test_a_user_with_strict_mypy_sees_our_types(tmp_path: Path) -> None:
    """What is right passes, and what is wrong does not: py.typed is there and true."""
    assert (ROOT / "contfric/py.typed").is_file()
    user = tmp_path / "user.py"
    user.write_text(USER, encoding="utf-8")
    options = ["--strict", "--follow-imports=silent", f"--cache-dir={tmp_path}", str(user)]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--config-file=", *options],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
        env={"MYPYPATH": str(ROOT), "PATH": "/usr/bin:/bin"},
    )
    errors = [line for line in done.stdout.splitlines() if "error:" in line]
    assert len(errors) == 1 and "user.py:17" in errors[0] and '"str"' in errors[0], done.stdout
    assert 'Revealed type is "contfric.orbit.orbit.Orbit"' in done.stdout
    assert done.stdout.count("contfric.orbit.orbit.Orbit") == 2
