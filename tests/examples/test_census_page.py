"""The page on the census: its code runs, and its output is what the command prints."""

from __future__ import annotations

import re
import shlex

import pytest
from pages import run, text_of

from contfric.cli import main
from contfric.cli.exits import Exit

PAGE = text_of("census")


def test_code_runs(capsys: pytest.CaptureFixture[str]) -> None:
    run("census")
    assert "1a False" in capsys.readouterr().out


def test_output_is_that_of_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    shown = re.search(r"```console\n\$ contfric (census [^\n]*)\n(.*?)```", PAGE, re.DOTALL)
    assert shown is not None
    assert main(shlex.split(shown[1])) == Exit.DONE
    printed = capsys.readouterr().out
    # how many starts the grid takes may depend on the last bit of the flow; the rest may not
    assert re.sub(r"\d+ (of \d+ )?starts", "N starts", printed) == re.sub(
        r"\d+ (of \d+ )?starts", "N starts", shown[2]
    )


def test_numbers_of_itineraries() -> None:
    from contfric.censuses.itineraries import closed_itineraries
    from contfric.models import load_model

    found = re.search(r"pair: ([\d, ]+) of the oscillator for N = ([\d, ]+),", PAGE)
    assert found is not None
    counts, stops = ([int(n) for n in part.split(",")] for part in found.groups())
    assert [len(closed_itineraries(load_model("coulomb"), n)) for n in stops] == counts
