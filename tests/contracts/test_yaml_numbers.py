"""Numbers in YAML files are those of YAML 1.2, and of every other language."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from contfric.base.yaml_lines import read_yaml


@pytest.mark.parametrize("text", ["1e-3", "1.0e6", "-2E5", "+.5e1", "3.e+2", "1.0e-12", "7e0"])
def test_powers_of_ten_are_numbers(write: Callable[..., Path], text: str) -> None:
    read = read_yaml(write(f"a: {text}\nb: [{text}, x]\n")).data
    assert read == {"a": float(text), "b": [float(text), "x"]}
    assert isinstance(read["a"], float)


@pytest.mark.parametrize("text", ["'1e-3'", "e5", "1e", "1e-3x", "x1e3", "1e3*S", "0x1e-3"])
def test_everything_else_is_not(write: Callable[..., Path], text: str) -> None:
    assert isinstance(read_yaml(write(f"a: {text}\n")).data["a"], str)
