"""Mass, damping and stiffness of a structure, and what follows from them.

A matrix is a list of rows of expressions, a list of its diagonal, one expression (times identity), or the
word ``identity``; in a file of a model also ``{file: frame.npz, array: M}``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import is_zipfile

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.errors import ModelError, did_you_mean, shown
from contfric.models.entries import EntryError, known_keys
from contfric.models.language.grammar import number_of

#: Rows of expressions.
Texts = list[list[str]]
#: Two entries of a matrix that should be equal, relative to its largest one: measured masses have 6 digits.
_SYMMETRIC = 1e-6
#: An entry of the inverse of a mass matrix this small, relative to the largest one, is rounding.
_ROUNDING = 1e-14
IDENTITY = "identity"


def is_zero(text: str) -> bool:
    """Tell whether an expression is the number 0."""
    try:
        return float(text) == 0.0
    except ValueError:
        return False


def matrix_of(key: str, value: Any, size: int) -> Texts:
    """Return a matrix as rows of expressions.

    Raises
    ------
    EntryError
        If it has another size.
    """
    wanted = (
        f"'{key}' is a matrix of {size} rows of {size}: a list of rows, a list of its diagonal, one "
        f"expression (times identity), or '{IDENTITY}'"
    )
    rows = value if isinstance(value, list) else ["1" if value == IDENTITY else value] * size
    if len(rows) != size:
        raise EntryError(
            (key,), f"{wanted}; it has {len(rows)} rows, and there are {size} coordinates"
        )
    if not isinstance(rows[0], list):
        rows = [[entry if i == j else 0 for j in range(size)] for i, entry in enumerate(rows)]
    for i, row in enumerate(rows):
        if len(row) != size:
            raise EntryError((key, i), f"{wanted}; row {i + 1} is {shown(row)}")
    return [[x if isinstance(x, str) else repr(float(x)) for x in row] for row in rows]


def loaded(data: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return a model's data with the matrices that lie in files.

    Parameters
    ----------
    folder : that of the model, to which the names of the files are relative

    Raises
    ------
    EntryError
        If a file or an array is not there.
    """
    found = dict(data)
    for key in ("mass", "damping", "stiffness"):
        value = data.get(key)
        if isinstance(value, Mapping):
            known_keys(map(str, value), ("file", "array"), (key,))
            file, array = value.get("file"), value.get("array", "")
            for name, text in (("file", file), ("array", array)):
                if not isinstance(text, str):
                    raise EntryError((key, name), f"'{name}' must be a text, got {text!r}")
            try:
                found[key] = _from_file(folder / str(file), str(array))
            except ModelError as error:
                raise EntryError((key,), str(error)) from None
    return found


def _from_file(path: Path, array: str) -> Any:
    """Read a matrix: an array of an npz, or a MatrixMarket file."""
    if not path.is_file():
        raise ModelError(f"there is no file {path}")
    try:
        if path.suffix == ".mtx":
            from scipy.io import mmread

            return _real(path.name, mmread(path))
        if path.suffix != ".npz":
            raise ModelError(f"{path.name} is no npz with named arrays, and no .mtx")
        if not is_zipfile(path):
            raise ModelError(f"{path.name} is no npz file")
        with np.load(path, allow_pickle=False) as arrays:
            if not array:
                raise ModelError(f"say which array of {path.name}: {', '.join(arrays.files)}")
            if array not in arrays.files:
                hint = did_you_mean(array, arrays.files)
                raise ModelError(f"{path.name} has no array '{array}'{hint}")
            return _real(f"'{array}' of {path.name}", arrays[array])
    except (OSError, ValueError) as error:
        raise ModelError(f"{path.name} cannot be read: {error}") from None


def _real(name: str, matrix: Any) -> FloatArray:
    """Return what a file has as an array of real numbers."""
    found = dense(matrix)
    if found.dtype.kind not in "iuf" or found.ndim not in (1, 2):
        what = f"{found.ndim} dimensions of {found.dtype.name}"
        raise ModelError(f"{name} has {what}: a matrix has rows of real numbers")
    return np.asarray(found, dtype=np.float64)


def dense(matrix: Any) -> Any:
    """Return a matrix as an array, also one that is sparse."""
    return np.asarray(matrix.toarray() if hasattr(matrix, "toarray") else matrix)


@dataclass(frozen=True)
class Mass:
    """A mass matrix, ready to be divided by.

    Attributes
    ----------
    inverse : its inverse, rows of expressions
    """

    inverse: Texts

    def of(self, vector: Mapping[int, str]) -> dict[int, str]:
        """Return the inverse times a vector that is given by its entries which are not zero."""
        found: dict[int, list[str]] = {}
        for i, row in enumerate(self.inverse):
            for j, entry in vector.items():
                if not is_zero(row[j]):
                    found.setdefault(i, []).append(times(row[j], entry))
        return {i: summed(parts) for i, parts in found.items()}


def mass_of(texts: Texts, params: Mapping[str, float]) -> Mass:
    """Return a mass matrix.

    Parameters
    ----------
    params : values of the parameters, at which it has to be positive definite

    Raises
    ------
    EntryError
        If it is not symmetric and positive definite, or depends on parameters off its diagonal.
    """
    size = len(texts)
    values = np.array([[_number(i, text, params) for text in row] for i, row in enumerate(texts)])
    largest = float(np.max(np.abs(values)))
    off = np.abs(values - values.T)
    if np.any(off > _SYMMETRIC * largest):
        i, j = map(int, np.unravel_index(np.argmax(off), off.shape))
        raise EntryError(
            ("mass", i),
            f"a mass matrix is symmetric; here entry ({i + 1}, {j + 1}) is {values[i, j]:g} and "
            f"({j + 1}, {i + 1}) is {values[j, i]:g}",
        )
    lowest = float(np.min(np.linalg.eigvalsh(values)))
    if not lowest > _ROUNDING * largest:
        raise EntryError(
            ("mass",),
            f"a mass matrix is positive definite; the smallest eigenvalue of this one is {lowest:g} at the "
            "defaults: leave out coordinates without mass",
        )
    if all(is_zero(texts[i][j]) for i in range(size) for j in range(size) if i != j):
        return Mass(
            [[_over(texts[i][i]) if i == j else "0" for j in range(size)] for i in range(size)]
        )
    if any(_is_expression(text) for row in texts for text in row):
        raise EntryError(
            ("mass",),
            "a mass matrix that is not diagonal has numbers only: parameters cannot stand in it",
        )
    inverse = np.linalg.inv(values)
    small = np.abs(inverse) <= _ROUNDING * np.max(np.abs(inverse))
    inverse[small] = 0.0
    return Mass([[repr(float(x)) for x in row] for row in inverse])


def _number(row: int, text: str, params: Mapping[str, float]) -> float:
    try:
        value = number_of(text, params)
    except ModelError as error:
        raise EntryError(("mass", row), str(error)) from None
    if not np.isfinite(value):
        raise EntryError(("mass", row), f"'{text}' has no value at the defaults")
    return value


def _is_expression(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return True
    return False


def _over(text: str) -> str:
    return f"1/({text})" if _is_expression(text) else repr(1.0 / float(text))


def times(first: str, second: str) -> str:
    """Return a product as an expression."""
    for one, other in ((first, second), (second, first)):
        if one in ("1", "1.0"):
            return other
        if one in ("-1", "-1.0"):
            return f"-({other})"
    return f"({first})*({second})"


def folded(parts: Sequence[str]) -> str:
    """Return a sum as an expression; as one number where its parts are, 0 where these cancel."""
    try:
        numbers = [number_of(part, {}) for part in parts]
    except ModelError:  # parameters
        return summed(parts)
    total = sum(numbers)
    return repr(total) if abs(total) > _ROUNDING * sum(map(abs, numbers)) else "0"


def summed(parts: Sequence[str]) -> str:
    """Return a sum as an expression."""
    kept = [part for part in parts if not is_zero(part)]
    return " + ".join(f"({part})" for part in kept) if len(kept) > 1 else (kept or ["0"])[0]
