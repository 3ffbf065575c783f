"""The page of the stress runs: what a run writes, and what stays of others."""

from __future__ import annotations

import sys
from pathlib import Path

FOLDER = str(Path(__file__).resolve().parents[2] / "benchmarks" / "stress")
sys.path.insert(0, FOLDER)
from chunks import in_words  # noqa: E402
from report import Report, Tally  # noqa: E402
from write_page import page, sections_of  # noqa: E402

sys.path.remove(FOLDER)


def report(seed: int, wrong: tuple[int, ...] = (), excused: tuple[int, ...] = ()) -> Report:
    """A run of ten cases, one without a start."""
    tally = Tally()
    tally.met("no start: AperiodicError")
    for index in range(9):
        tally.index = index
        tally.met("scenes")
        tally.check("the same", index not in wrong, "it | differs")
        if index in excused:
            tally.set_aside("excused: alike", "a | b\n" + 300 * "x")
    return tally.report("restarts", "Diagrams.", 10, seed, 12.0, "abc1234")


def test_shares_are_of_cases_with_a_start() -> None:
    """A case that is wrong and excused is wrong; several checks of one case are one case."""
    lines = report(3, wrong=(2,), excused=(2, 4)).lines()
    assert lines[0] == "Diagrams. 10 cases, seed 3, 12 s, commit abc1234."
    assert "| wrong | 1 | 11.1 % |" in lines
    assert "| excused | 1 | 11.1 % |" in lines
    assert "| cut | 0 | 0.0 % |" in lines
    assert all(line.count("|") == 4 for line in lines if line.startswith("| 4 |"))


def test_a_report_is_read_as_it_was_written(tmp_path: Path) -> None:
    """With what was set aside and the commit."""
    one = report(3, wrong=(1,), excused=(4,))
    one.write(tmp_path / "one.json")
    assert Report.read(tmp_path / "one.json") == one


def test_cases_on_another_commit_are_named() -> None:
    """A run that goes on later says which of its cases were run on other sources."""
    assert in_words({(0, 10): "a", (10, 20): "a"}) == "a"
    assert in_words({(0, 10): "a", (10, 20): "b", (20, 25): "a"}) == "a (cases 10 to 19: b)"
    assert in_words({(0, 10): ""}) == ""


def test_runs_that_are_not_given_stay() -> None:
    """Runs are known by name and seed; text by hand stays, and nothing is written twice."""
    first = page([report(3, wrong=(2,))]) + "\n## models\n\nBy hand.\n"
    both = page([report(5)], first)
    assert page([], both) == both
    sections = sections_of(both)
    assert list(sections["restarts"].runs) == [3, 5]
    assert sections["models"].head == ["By hand."]
    assert "* case 2, the same: it | differs" in both
    again = page([report(3)], both)
    assert "* case 2" not in again
    assert again.count("10 cases, seed 3,") == 1
    assert "| [restarts](#restarts) | 10 | 5 | 9 | 0 | 12 s |" in again


def test_the_page_is_as_the_script_writes_it() -> None:
    """Its texts, its summary and the order of its sections are those of the script."""
    text = (Path(__file__).resolve().parents[2] / "docs" / "stress.md").read_text(encoding="utf-8")
    version = next(line for line in text.split("\n") if line.startswith("contfric "))
    written = page([], text)
    here = next(line for line in written.split("\n") if line.startswith("contfric "))
    assert written.replace(here, version) == text
