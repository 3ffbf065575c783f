"""The gallery: every study runs to its end, and the pages show what is computed."""

from __future__ import annotations

import re
import sys
from functools import cache
from typing import Any

import networkx as nx
import numpy as np
import pytest
from pages import DOCS, script

from contfric.signature.notation import parse_signature

GALLERY = DOCS / "gallery"


make = script("gallery/make.py")
PAGE_OF = {study: page for page, studies in make.PAGES.items() for study in studies}
#: Studies of minutes are computed by ``make gallery`` alone; tests/analytic/test_lugre.py has their numbers.
DIAGRAMS = [name for name in make.STUDIES if name != "fig03" and name not in make.LONG]


@pytest.fixture(scope="module")
def result_of(tmp_path_factory: pytest.TempPathFactory) -> Any:
    @cache
    def run(name: str) -> Any:
        return make.run(name, tmp_path_factory.mktemp(name) / "out", figures=False)

    return run


def page(name: str) -> str:
    return (GALLERY / f"{PAGE_OF[name]}.md").read_text(encoding="utf-8")


def test_every_bundled_study_has_a_page() -> None:
    from contfric.study import study_names

    text = (GALLERY / "planes.md").read_text(encoding="utf-8")
    planes = set(re.findall(r"<!-- plane: (fig\d+) -->", text))
    listed = (GALLERY / "README.md").read_text(encoding="utf-8")
    literature = re.findall(r"`contfric run ([a-z-]+)`", listed)
    assert set(study_names()) <= set(make.STUDIES) | planes | set(literature)
    assert re.findall(r"\]\((fig\d+)\.md\)", listed) == list(make.PAGES)


@pytest.mark.parametrize("name", DIAGRAMS)
def test_nothing_is_left_over(name: str, result_of: Any) -> None:
    result = result_of(name)
    assert result.study.signature is None, "no signature is typed"
    assert result.diagram.complete
    assert result.diagram.loose_ends == ()
    assert result.info["modules"]["matplotlib"] is ("matplotlib" in sys.modules)
    assert not [path for path in result.files if path.suffix == ".png"]


@pytest.mark.parametrize("name", DIAGRAMS)
def test_branches_are_connected_up_to_mirror_images(name: str, result_of: Any) -> None:
    found = result_of(name).diagram
    graph = nx.Graph(found.graph)
    for k, branch in enumerate(found.branches):
        if branch.mirrored:  # an image stands after its original
            graph.add_edge(k - 1, k)
    # what only a seed leads to is a part of its own: 1a, 9seg of Fig. 4, with its bridges
    assert nx.number_connected_components(graph) == (2 if name == "fig04" else 1)


@pytest.mark.parametrize("name", DIAGRAMS)
def test_tables_are_what_is_computed(name: str, result_of: Any) -> None:
    diagram = result_of(name).diagram
    rows = make.rows_of(name, diagram)
    shown = [line.strip("|").split("|") for line in make.tables_in(page(name))[name]]
    head, _, *lines = [[cell.strip() for cell in cells] for cells in shown]
    assert head[1] == diagram.parameter
    assert [[a, c, d] for a, _, c, d, _ in lines] == [[r.event, r.branches, r.says] for r in rows]
    for cells, row in zip(lines, rows, strict=True):
        # radii are rounding
        assert re.sub(r"\de-\d\d", "", cells[4]) == re.sub(r"\de-\d\d", "", row.proved)
        if row.proved[:1].isdigit():
            assert abs(np.log10(float(cells[4]) / float(row.proved))) < 2
        rounding = 0.5 * 10.0**-make.DIGITS
        assert abs(float(cells[1]) - row.value) <= rounding + row.accuracy


def test_the_orbit_of_fig03(result_of: Any) -> None:
    result = result_of("fig03")
    shown = "\n".join(make.tables_in(page("fig03"))["fig03"])
    number = re.compile(r"\d\.\d+")
    computed = "\n".join(make.table_of("fig03", result))
    assert number.sub("", shown) == number.sub("", computed)
    for a, b in zip(number.findall(shown), number.findall(computed), strict=True):
        assert float(a) == pytest.approx(float(b), abs=1e-9)
    paper = "x0v+ -> stick -> x+v- -> x0v- -> stick -> x-v+"  # section 3.1, the first structure
    assert parse_signature(paper, result.orbit.model) == result.orbit.signature


@pytest.mark.parametrize("name", DIAGRAMS)
def test_everything_published_has_its_event(name: str, result_of: Any) -> None:
    import yaml

    entries = yaml.safe_load((GALLERY / "published.yaml").read_text(encoding="utf-8"))[name]
    said = "; ".join(row.says for row in make.rows_of(name, result_of(name).diagram))
    assert all(entry["says"] in said for entry in entries)


@pytest.mark.parametrize("name", make.STUDIES)
def test_figures_of_the_pages_exist(name: str) -> None:
    figures = re.findall(r"!\[[^\]]*\]\(([^)]+)\)", page(name))
    assert f"../images/gallery/{name}.png" in figures
    assert all((GALLERY / figure).is_file() for figure in figures)


def test_a_table_is_put_in_its_place() -> None:
    text = "a\n<!-- events: x -->\n<!-- end -->\nb\n<!-- events: y -->\nold\n<!-- end -->\nc\n"
    text = make.with_table(text, "x", ["1", "2"])
    text = make.with_table(text, "y", ["3"])
    assert make.tables_in(text) == {"x": ["1", "2"], "y": ["3"]}
    assert re.sub(r"<!--.*?-->\n|\d\n", "", text) == "a\nb\nc\n"
    with pytest.raises(ValueError, match="no place for the table of z"):
        make.with_table(text, "z", [])
