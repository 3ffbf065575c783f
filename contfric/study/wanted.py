"""Quantities that a study may ask for: columns of its table of points, and rows of a diagram."""

from __future__ import annotations

from enum import Enum
from typing import Annotated

from pydantic import Field


class Want(str, Enum):
    """Quantities that a study may ask for, beyond the parameters and the names of the orbits."""

    STABILITY = "stability"
    ASYMMETRY = "asymmetry"
    EXTREMA = "extrema"
    STOPS = "stops"


#: Columns of each quantity, in words.
COLUMNS = {
    Want.EXTREMA: "x_max, x_min",
    Want.ASYMMETRY: "psi",
    Want.STOPS: "stop_1, ...",
    Want.STABILITY: "stable",
}


class Row(str, Enum):
    """Rows of a diagram."""

    X_MAX = "x_max"
    X_MIN = "x_min"
    STOPS = "stops"
    PSI = "psi"
    PERIOD = "period"


#: The row that a figure has for what is wanted, where it names no rows.
ROWS = {Want.EXTREMA: Row.X_MAX, Want.STOPS: Row.STOPS, Want.ASYMMETRY: Row.PSI}


def row_name(row: Row | str) -> str:
    """Return the name of a row."""
    return row.value if isinstance(row, Row) else row


# YAML has texts where Python has enumerations: these fields alone are converted
# (a text that is not one of them is a quantity, which the model has or has not)
_Quantity = Annotated[str, Field(min_length=1)]
_Left = Field(union_mode="left_to_right")
Wants = list[Annotated[Annotated[Want, Field(strict=False)] | _Quantity, _Left]]
Rows = Annotated[
    list[Annotated[Annotated[Row, Field(strict=False)] | _Quantity, _Left]], Field(min_length=1)
]
