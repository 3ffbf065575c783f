"""Bundled models that come to rest from the default start move from those that the page of models names."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import contfric as cf

_PAGE = (Path(__file__).parents[2] / "docs" / "models.md").read_text(encoding="utf-8")
_CALLS = re.findall(
    r"`(cf\.find_orbit\([^`]*state=[^`]*\))`", _PAGE.split("Three of them come to rest")[1]
)


@pytest.mark.parametrize("call", _CALLS[:3])
def test_it_moves(call: str) -> None:
    orbit = eval(call, {"cf": cf})  # a call that the page shows
    assert orbit.converged and orbit.admissible
    with pytest.raises(cf.ConvergenceError, match=r"no periodic orbit: .* another start"):
        cf.find_orbit(orbit.model.name)


@pytest.mark.parametrize("name", ["max_periods", "copies"])
def test_more_periods_than_can_be_followed_are_refused(name: str) -> None:
    with pytest.raises(cf.ParameterError, match=f"{name} is a whole number from 1 to 1024"):
        cf.explore(cf.find_orbit("coulomb"), "Omega", (0.4, 0.6), **{name: 10**9})
