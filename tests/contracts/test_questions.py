"""What is kept under a user's function is used again only while the function does the same."""

from __future__ import annotations

import functools
import importlib
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import contfric as cf
from contfric.remember.questions import Question
from contfric.remember.stored import UnstorableError
from contfric.study import read_study
from contfric.study.checkpoint import key_of

WHOLE = """
import math
import numpy as np

LEVEL = 0.5
TABLE = {"a": [1.0, 2.0]}
WEIGHTS = np.array([1.0, 2.0])

def helper(x):
    return x + 1.0

def width(orbit, factor=2.0, *, least=0.0):
    def inner(y):
        return y * 3.0
    return max(least, inner(helper(orbit.x_max)) * factor + LEVEL + TABLE["a"][0] + WEIGHTS[0]) + math.pi
"""
CHANGES = {
    "a constant of the module": ("LEVEL = 0.5", "LEVEL = 0.6"),
    "an entry of a table": ("[1.0, 2.0]}", "[1.5, 2.0]}"),
    "an entry of an array": ("np.array([1.0", "np.array([1.5"),
    "what another function does": ("x + 1.0", "x - 1.0"),
    "what a function inside does": ("y * 3.0", "y * 4.0"),
    "a default": ("factor=2.0", "factor=3.0"),
    "a default by keyword": ("least=0.0", "least=0.1"),
    "which attribute is asked for": ("orbit.x_max", "orbit.x_min"),
    "which function is called": ("max(least", "min(least"),
    "which of another module": ("math.pi", "math.e"),
}


def function_of(text: str) -> Any:
    module = ModuleType("measured")
    exec(text, module.__dict__)
    return module.__dict__["width"]


def key(function: Any) -> bytes:
    return Question().bytes_of(["asked", function])


def test_the_same_text_is_the_same_question() -> None:
    moved = "\n\n# a remark\n" + WHOLE.replace("LEVEL = 0.5", "LEVEL = 0.5  # of the support")
    assert key(function_of(WHOLE)) == key(function_of(moved))


@pytest.mark.parametrize("what", CHANGES)
def test_what_changes_a_result_is_another_question(what: str) -> None:
    before, after = CHANGES[what]
    assert WHOLE.count(before) == 1
    assert key(function_of(WHOLE)) != key(function_of(WHOLE.replace(before, after)))


def test_what_a_function_closes_over_counts() -> None:
    def made(factor: float) -> Any:
        return lambda orbit: factor * orbit.x_max

    assert key(made(1.0)) == key(made(1.0)) != key(made(2.0))
    partial = functools.partial
    assert key(partial(made, factor=1.0)) != key(partial(made, factor=2.0))


def test_functions_that_call_each_other() -> None:
    text = "def width(x):\n    return other(x)\ndef other(x):\n    return width(x - {}) if x > 0 else 0\n"
    assert key(function_of(text.format(1))) == key(function_of(text.format(1)))
    assert key(function_of(text.format(1))) != key(function_of(text.format(2)))


def test_what_has_no_code_is_not_kept() -> None:
    with pytest.raises(UnstorableError):
        key(max)


def write(path: Path, factor: float) -> str:
    """Write a module with a function of an orbit; return its name."""
    name = f"{path.parent.name.replace('-', '_')}_measured"
    (path / f"{name}.py").write_text(f"def width(orbit):\n    return {factor}*orbit.x_max\n")
    return name


def reload(name: str, monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    monkeypatch.delitem(sys.modules, name, raising=False)
    importlib.invalidate_caches()
    for file in (folder / "__pycache__").glob("*"):
        file.unlink()


@pytest.mark.parametrize("by", ["name", "function"])
def test_an_ensemble_goes_on_only_with_the_same_function(
    by: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)

    def largest(factor: float) -> tuple[float, list[str]]:
        said: list[str] = []
        name = write(tmp_path, factor)
        reload(name, monkeypatch, tmp_path)
        row: Any = f"{name}:width" if by == "name" else lambda orbit: factor * orbit.x_max
        found = cf.ensemble(
            *("coulomb", "Omega", (0.5, 0.51), {"S": (0.31, 0.33)}, {"Omega": 0.5, "S0": 0.4}),
            row=row,
            **{"samples": 2, "values": 3, "folder": tmp_path / "kept", "progress": said.append},
        )
        return float(found.rows.orbit_row.max()), said

    (first, _), (again, said), (other, told) = largest(1.0), largest(1.0), largest(2.0)
    assert again == first and "1 of 1 tiles are in" in said[0]
    assert other == pytest.approx(2.0 * first) and "tiles are in" not in told[0]


def test_a_fit_goes_on_only_with_the_same_function(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)

    def fitted(factor: float) -> float:
        name = write(tmp_path, factor)
        reload(name, monkeypatch, tmp_path)
        data = [cf.Measured(f"{name}:width", 1.43, 0.01, {"Omega": 0.5})]
        start = {"S": 0.31, "S0": 0.4}
        return cf.fit("coulomb", data, start, ["S"], folder=tmp_path / "kept").params["S"]

    first = fitted(1.0)
    assert fitted(1.0) == first and abs(fitted(1.001) - first) > 1e-5


def test_a_run_goes_on_only_with_the_same_function(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    study = tmp_path / "study.yaml"

    def key_with(factor: float) -> str:
        name = write(tmp_path, factor)
        reload(name, monkeypatch, tmp_path)
        study.write_text(
            "model: coulomb\nparams: {Omega: 0.5, S: 0.32, S0: 0.4}\n"
            f"continue: {{parameter: Omega, range: [0.49, 0.51]}}\nwant: [{name}:width]\n"
        )
        return key_of(read_study(study))

    assert key_with(1.0) == key_with(1.0) != key_with(2.0)


def test_a_function_is_the_same_in_every_process():
    """The order of texts in a set of its code is another one in each."""
    code = """
from contfric.remember.questions import Question

def width(orbit):
    return 1.0 if orbit in {"a", "bb", "ccc", "dddd"} else float((orbit, {"x", "yy", "zzz"}) in [])

print(Question().bytes_of(width).hex())
"""
    told = set()
    for seed in "123":
        env = {**os.environ, "PYTHONHASHSEED": seed}
        done = subprocess.run(
            [sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True
        )
        told.add(done.stdout)
    assert len(told) == 1
    assert told.pop().strip()
