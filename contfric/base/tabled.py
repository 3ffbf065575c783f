"""Results that are tables, and enumerations whose members are numbers in arrays."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from contfric.base.extras import need_pandas
from contfric.base.shown import Shown

if TYPE_CHECKING:
    import pandas as pd

#: Arrays of one length by the names of the columns.
Columns: TypeAlias = dict[str, NDArray[Any]]


def as_table(columns: Any, origins: Iterable[tuple[str, str]] = ()) -> pd.DataFrame:
    """Return columns by their names, or rows, as a table (needs pandas).

    Its ``attrs["origins"]`` say what states are measured from, if it is not zero.
    """
    need_pandas()
    import pandas as pd

    table = pd.DataFrame(columns)
    if found := dict(origins):
        table.attrs["origins"] = found
    return table


def stacked(parts: Iterable[tuple[dict[str, Any], pd.DataFrame]]) -> pd.DataFrame:
    """Return tables one below the other, each after columns of one value (needs pandas)."""
    need_pandas()
    import pandas as pd

    tables = []
    for labels, table in parts:
        for k, (name, value) in enumerate(labels.items()):
            table.insert(k, name, value)
        tables.append(table)
    whole = pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()
    whole.attrs |= tables[0].attrs if tables else {}
    return whole


class Tabled(Shown):
    """A result that is a table, for pandas and for the CSV file of a run.

    Attributes
    ----------
    length_columns, time_columns : tuple of str
        Columns that are displacements, and times, beyond those with the name of a state and ``t``: their
        units are those of the model.
    """

    length_columns: ClassVar[tuple[str, ...]] = ()
    time_columns: ClassVar[tuple[str, ...]] = ()

    def columns(self) -> Columns:
        """Return arrays of one length by the names of the columns."""
        raise NotImplementedError

    def to_dataframe(self) -> pd.DataFrame:
        """Return the columns as a table (needs pandas)."""
        return as_table(self.columns())


class Coded(str, Enum):
    """An enumeration; the order of its members is that of their numbers in arrays."""

    @property
    def code(self) -> int:
        """Its number in arrays."""
        return list(type(self)).index(self)

    @classmethod
    def words(cls) -> NDArray[np.str_]:
        """Return the names of the members as words, by their numbers."""
        return np.array([member.name.lower() for member in cls])
