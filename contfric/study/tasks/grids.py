"""Grids and ranges of a study: as they are written, as they are computed with, and in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from contfric.base.arrays import FloatArray


def axes_text(grid: Mapping[str, list[float]]) -> str:
    """Return a grid in words."""
    return " x ".join(f"{n} from {v[0]:g} to {v[1]:g} ({v[2]:g})" for n, v in grid.items())


def pairs_of(ranges: Mapping[str, list[float]]) -> dict[str, tuple[float, float]]:
    """Return ranges as they are computed with."""
    return {name: (pair[0], pair[1]) for name, pair in ranges.items()}


def ranges_text(ranges: Mapping[str, list[float]]) -> str:
    """Return ranges in words.

    Examples
    --------
    >>> ranges_text({"S": [0.1, 0.4]})
    'S from 0.1 to 0.4'
    """
    return ", ".join(f"{name} from {low:g} to {high:g}" for name, (low, high) in ranges.items())


def values_of(ends: list[float]) -> FloatArray:
    """Return the values of an axis that [low, high, number of values] stands for."""
    low, high, count = ends
    return np.linspace(low, high, int(count))


def ends_of(values: FloatArray) -> list[float]:
    """Return [low, high, number of values] of an axis, as a record has it."""
    return [float(values[0]), float(values[-1]), len(values)]


def grid_text(entry: dict[str, Any]) -> str:
    """Return the grid of an entry of a record in words."""
    sides = (f"{n} {low:g} to {high:g} ({k})" for n, (low, high, k) in entry["grid"].items())
    return " x ".join(sides)
