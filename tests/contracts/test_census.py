"""What a census hands back: tables, limits, errors, the command."""

from __future__ import annotations

import json

import pytest

import contfric as cf
from contfric.censuses.conditions import Fate
from contfric.cli import main
from contfric.cli.exits import Exit

PARAMS = {"Omega": 0.5376, "S": 0.32, "S0": 0.4}
ARGUMENTS = [
    "census",
    "--model",
    "coulomb",
    *(f"-p={name}={value}" for name, value in PARAMS.items()),
]


@pytest.fixture(scope="module")
def census() -> cf.Census:
    return cf.census("coulomb", PARAMS)


def test_it_is_a_sequence_of_orbits(census: cf.Census) -> None:
    assert len(census) == 3 and list(census) == list(census.orbits)
    assert census[0].name == "0s"
    assert [orbit.name for orbit in census.stable] == ["0s", "1a"]
    assert census.with_mirrors == 5
    expected = "<Census of coulomb: 3 orbits (2 stable) of up to 2 periods and 6 stops;"
    assert repr(census).startswith(expected)


def test_table_and_text(census: cf.Census) -> None:
    head, *rows = census.table().splitlines()
    columns = ["name", "periods", "stops", "images", "stable", "multipliers", "signature"]
    assert head.split() == columns
    assert [row.split()[0] for row in rows] == ["0s", "1a", "1a"]
    assert "1.37216, 0" in rows[1] and "x0v+ -> stick" in rows[1]
    text = str(census)
    assert census.table() in text
    for fate, count in census.itineraries.items():
        assert (f"{count}  {fate.value}" in text) == (count > 0)
    assert all(line in text for line in census.limits)


def test_dataframe(census: cf.Census) -> None:
    table = census.to_dataframe()
    assert len(table) == 3
    assert table["stable"].tolist() == [True, False, True]
    assert table["mu1"][1] == pytest.approx(1.3721574947, rel=1e-9)
    assert table["images"].tolist() == [1, 2, 2]


def test_limits_are_said(census: cf.Census) -> None:
    text = "\n".join(census.limits)
    assert "up to 2 periods and 6 stops" in text
    assert "positions within" in text
    assert "no start makes more than 6 stops" in text
    few = cf.census("coulomb", PARAMS, stops=1)
    assert not few.orbits
    assert any("starts make more than 1 stops" in line for line in few.limits)


def test_limit_on_starts_is_no_silent_one() -> None:
    found = cf.census("coulomb", PARAMS, most_starts=100)
    assert not found.complete and "incomplete" in repr(found)
    assert any("most_starts" in line for line in found.limits)


def test_interrupted_census_keeps_what_it_has() -> None:
    def progress(text: str) -> None:
        if "slide+|v" in text:
            raise KeyboardInterrupt

    found = cf.census("coulomb", PARAMS, progress=progress)
    assert found.interrupted and not found.complete
    assert [orbit.name for orbit in found] == ["1a", "1a"], "the curve of the releases was done"
    assert found.limits[-1].startswith("interrupted")


def test_same_seed_same_census(census: cf.Census) -> None:
    again = cf.census("coulomb", PARAMS)
    assert again.to_dict() == census.to_dict()


def test_fates_have_their_meaning(census: cf.Census) -> None:
    for walk in census.walks:
        assert (walk.fate is Fate.FOUND) == (walk.orbits > 0)
        assert walk.fate.value in str(walk)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"periods": 0}, "periods is a whole number >= 1, got 0"),
        ({"stops": 1.5}, "stops is a whole number >= 1, got 1.5"),
        ({"finer": 9}, "finer is a whole number from 0 to 3, got 9"),
        ({"most_starts": 0}, "most_starts is a whole number >= 1"),
    ],
)
def test_bad_options(options: dict[str, int], message: str) -> None:
    with pytest.raises(cf.ParameterError, match=message.replace("(", r"\(")):
        cf.census("coulomb", PARAMS, **options)


def test_bad_parameter() -> None:
    with pytest.raises(cf.ParameterError, match="did you mean 'Omega'"):
        cf.census("coulomb", {"Omga": 0.5})


# ------------------------------------------------------------------------------------- command


def test_command_prints_the_census(census: cf.Census, capsys) -> None:
    assert main(ARGUMENTS) == Exit.DONE
    printed = capsys.readouterr()
    assert printed.out == f"{census}\n"
    assert printed.err == "", "stderr is no terminal: no progress"


def test_command_prints_json(census: cf.Census, capsys) -> None:
    assert main([*ARGUMENTS, "--json"]) == Exit.DONE
    found = json.loads(capsys.readouterr().out)
    assert found == census.to_dict()
    assert found["walks"]["FOUND"] == 2


def test_the_model_as_it_was_named_before(capsys) -> None:
    with pytest.warns(DeprecationWarning, match="contfric census --model MODEL"):
        assert main(["census", "colomb"]) == Exit.BAD_INPUT
    assert "did you mean 'coulomb'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["census", "--model", "colomb"], "unknown model 'colomb'; did you mean 'coulomb'"),
        (["census", "--param", "Omga=1"], "no parameter 'Omga'; did you mean 'Omega'"),
        (["census", "--periods", "0"], "--periods: invalid whole number >= 1 value: '0'"),
        (["census", "--finer", "4"], "finer is a whole number from 0 to 3, got 4"),
        (["cenus"], "unknown command 'cenus'; did you mean 'census'"),
    ],
)
def test_command_refuses(arguments: list[str], message: str, capsys) -> None:
    assert main(arguments) == Exit.BAD_INPUT
    printed = capsys.readouterr()
    assert printed.out == "" and printed.err.count("\n") == 1
    assert message in printed.err
