"""The site leaves out no page and no public name, and its links lead somewhere."""

from __future__ import annotations

import importlib
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

import contfric

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
NOTEBOOKS = sorted(DOCS.rglob("*.ipynb"))
PAGES = sorted([*DOCS.rglob("*.md"), *NOTEBOOKS])
SECTIONS = ["Tutorial", "How-to", "Theory", "Gallery", "Reference", "Evidence"]


class _Loader(yaml.SafeLoader):
    """Reads mkdocs.yml, in which a function of Python is named: here it stands for nothing."""


_Loader.add_multi_constructor("tag:yaml.org,2002:python/", lambda *_: None)


def navigation() -> list[Any]:
    settings = yaml.load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"), Loader=_Loader)
    return list(settings["nav"])


def named(entries: Any) -> Iterator[str]:
    """Yield the files that a part of the navigation names."""
    if isinstance(entries, str):
        yield entries
    elif isinstance(entries, dict):
        for below in entries.values():
            yield from named(below)
    else:
        for below in entries:
            yield from named(below)


def relative(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def test_every_page_is_in_the_navigation_once() -> None:
    pages = [
        p.relative_to(DOCS).with_suffix(".md").as_posix() for p in PAGES
    ]  # as the site has them
    assert sorted(named(navigation())) == sorted(pages)


def test_sections_stand_in_their_order() -> None:
    assert [name for entry in navigation() if isinstance(entry, dict) for name in entry] == SECTIONS


def test_every_public_name_has_one_place_in_the_reference() -> None:
    pages = [p.read_text(encoding="utf-8") for p in sorted((DOCS / "reference").glob("*.md"))]
    found = [n for text in pages for n in re.findall(r"^::: contfric\.(\w+)$", text, re.MULTILINE)]
    assert "`contfric.__version__`" in pages[[": contfric" in t for t in pages].index(False)]
    assert sorted([*found, "__version__"]) == sorted(contfric.__all__)


def test_a_warning_fails_the_build() -> None:
    """With --quiet mkdocs does not count its warnings, and --strict lets them pass."""
    (line,) = re.findall(r"^\t.*mkdocs build.*$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert "--strict" in line
    assert "quiet" not in line


def prose(page: Path) -> str:
    """Return the text of a page without what stands as code."""
    text = page.read_text(encoding="utf-8")
    if page.suffix == ".ipynb":
        cells = [c for c in json.loads(text)["cells"] if c["cell_type"] == "markdown"]
        text = "\n\n".join("".join(cell["source"]) for cell in cells)
    text = re.sub(r"^( *)```.*?^\1```", "", text, flags=re.M | re.S)
    return re.sub(r"`[^`\n]*`", lambda m: re.sub(r"[\[\]()]", "", m[0]), text)


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as GitHub and the site make them."""
    found: dict[str, int] = {}
    for heading in re.findall(r"^#+ +(.*?) *#*$", prose(page), re.MULTILINE):
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").replace("*", "")
        slug = re.sub(r"[^\w\- ]", "", plain.lower()).strip().replace(" ", "-")
        found[slug] = found.get(slug, -1) + 1
    return {f"{slug}-{k}" if k else slug for slug, last in found.items() for k in range(last + 1)}


def wrong_links(page: Path) -> list[str]:
    """Return the links of a page that lead nowhere, or out of what the site shows."""
    wrong = []
    for target in re.findall(r"\]\(<?([^)\s>]+)>?\)", prose(page)):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        outside = page.is_relative_to(DOCS) and not file.is_relative_to(DOCS)
        if outside or not file.is_file() or (anchor and anchor not in anchors(file)):
            wrong.append(target)
    return wrong


@pytest.mark.parametrize("page", PAGES, ids=relative)
def test_lists_go_on_where_they_do_on_github(page: Path) -> None:
    """mkdocs ends a list at a paragraph that is indented by less than four spaces, GitHub does not."""
    assert re.findall(r"(?<=\n\n) {1,3}[^ \n].*", prose(page)) == []
    assert re.findall(r"^ {4}[^ *\n-].*\n(?:[*-]|\d+\.) .*", prose(page), re.MULTILINE) == []


@pytest.mark.parametrize(
    "page",
    [*(ROOT / f"{n}.md" for n in ("README", "CONTRIBUTING", "CHANGELOG")), *PAGES],
    ids=relative,
)
def test_links_resolve(page: Path) -> None:
    assert wrong_links(page) == []


def test_wrong_links_are_seen(tmp_path: Path) -> None:
    """The check itself: a wrong file, a wrong anchor, and four that are right or code."""
    page = tmp_path / "page.md"
    page.write_text(
        "# One `a(b)` head\n[x](none.md) [x](#no) [x](#one-ab-head) [x](page.md) [x](https://a.b)\n"
        "`[x](code.md)`\n\n```\n[x](code.md)\n```\n",
        encoding="utf-8",
    )
    assert wrong_links(page) == ["none.md", "#no"]


def test_docstrings_of_one_line_a_parameter_are_descriptions(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Otherwise the site shows "seed (number the samples are drawn from) –". Types stay where they are."""
    pytest.importorskip("griffe")
    monkeypatch.syspath_prepend(DOCS / "_site")
    rewritten = importlib.import_module("roles").rewritten
    text = (
        "Do it.\n\nParameters\n----------\nseed, more : what :func:`contfric.explore` is given\nk : int\n"
        "x : float\n    Its place.\nlast : where it ends\n\nReturns\n-------\ny : what it is"
    )
    assert rewritten(text) == text.replace(
        "seed, more : what :func:`contfric.explore`",
        "seed, more\n    what [`explore`][contfric.explore]",
    ).replace("last : where", "last\n    where")
