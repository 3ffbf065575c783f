"""Parameters that vary along a curve, with their ranges."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.errors import ParameterError, checked_range, did_you_mean, items_of, mapping_of, shown
from contfric.models.definition import Model

#: A start on the edge of a range lies within it: it may be off by rounding, as a share of the width.
_SLACK = 1e-9


@dataclass(frozen=True, eq=False)
class Ranges:
    """Parameters that vary, with their ranges.

    Attributes
    ----------
    names : the q parameters
    low, high : corners, shape (q,)
    """

    names: tuple[str, ...]
    low: FloatArray
    high: FloatArray

    @cached_property
    def widths(self) -> FloatArray:
        """Widths of the ranges, in which arclength is measured."""
        return self.high - self.low

    @cached_property
    def edges(self) -> FloatArray:
        """The sides: rows (a, c) with ``a . p + c >= 0`` inside, in widths, shape (2 q, q + 1)."""
        rows = []
        for k, side in enumerate(np.eye(len(self.names)) / self.widths[:, None]):
            rows += [
                [*side, -self.low[k] / self.widths[k]],
                [*-side, self.high[k] / self.widths[k]],
            ]
        return np.array(rows)

    def text(self, w: FloatArray) -> str:
        """Return a point in words."""
        return ", ".join(f"{n} = {v:.6g}" for n, v in zip(self.names, w, strict=True))

    def check_holds(self, what: str, params: Mapping[str, float]) -> None:
        """Refuse what lies outside of the ranges.

        Raises
        ------
        ParameterError
            If it does.
        """
        w, margin = np.array([params[name] for name in self.names]), _SLACK * self.widths
        if np.any(w < self.low - margin) or np.any(w > self.high + margin):
            raise ParameterError(f"{what} is at {self.text(w)}, outside of the ranges")


@dataclass(frozen=True, eq=False)
class PlaneRanges(Ranges):
    """A plane: two parameters with their ranges."""

    names: tuple[str, str]


def box_of(
    model: Model, parameters: tuple[str, str], ranges: Mapping[str, tuple[float, float]]
) -> PlaneRanges:
    """Check two parameters with their ranges.

    Raises
    ------
    ParameterError
        For anything but two different parameters of the model with a finite range each.
    """
    pair = items_of(parameters)
    if len(pair) != 2:
        raise ParameterError(
            f"a curve needs a pair of parameters, such as {model.parameter_names[:2]}, got "
            f"{shown(parameters)}"
        )
    found = ranges_of(model, pair, ranges)
    return PlaneRanges(pair, found.low, found.high)


def ranges_of(
    model: Model, parameters: tuple[str, ...], ranges: Mapping[str, tuple[float, float]]
) -> Ranges:
    """Check parameters with their ranges.

    Raises
    ------
    ParameterError
        For anything but different parameters of the model with a finite range each.
    """
    for k, name in enumerate(parameters):
        model.index_of(name)
        if name in parameters[:k]:
            raise ParameterError(f"a curve needs different parameters, got '{name}' twice")
    for name in mapping_of("ranges", ranges, f"{{'{parameters[0]}': (lower, upper), ..}}"):
        if name not in parameters:
            raise ParameterError(
                f"'{name}' is not one of the parameters that vary, {', '.join(parameters)}"
                f"{did_you_mean(str(name), parameters)}"
            )
    corners = [_range_of(name, ranges) for name in parameters]
    low, high = (np.array(side) for side in zip(*corners, strict=True))
    return Ranges(parameters, low, high)


def limits_of(model: Model, vector: FloatArray, box: Ranges) -> FloatArray:
    """Return the constraints that bound parameters: rows (a, c) with ``a . p + c >= 0``, shape (k, q + 1)."""
    params, nothing = model.mapping(vector), dict.fromkeys(box.names, 0.0)
    rows = [
        [*(c.coefficients.get(name, 0.0) for name in box.names), c.value({**params, **nothing})]
        for c in model.constraints
        if any(name in c.coefficients for name in box.names)
    ]
    return np.array(rows, dtype=np.float64).reshape(len(rows), len(box.names) + 1)


def _range_of(name: str, ranges: Mapping[str, tuple[float, float]]) -> tuple[float, float]:
    if name not in ranges:
        raise ParameterError(f"the range of '{name}' is missing: {{'{name}': (lower, upper), ..}}")
    return checked_range(name, ranges[name])
