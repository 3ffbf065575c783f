"""Structures with contacts from matrices in Python."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from contfric.errors import ModelError
from contfric.models.definition import Model
from contfric.models.entries import EntryError, plain
from contfric.models.reading.files import from_data
from contfric.models.structures.names import COORDINATES


def Mechanism(  # the name that is promised: it makes a model as a class makes an object
    mass: Any,
    damping: Any,
    stiffness: Any,
    *,
    contacts: Mapping[str, Mapping[str, Any]],
    force: Mapping[str, Any] | None = None,
    parameters: Mapping[str, float] | None = None,
    period: str = "",
    coordinates: list[str] | None = None,
    name: str = "mechanism",
    **more: Any,
) -> Model:
    """Return the model of ``M q'' + C q' + K q = f(t)`` with contacts.

    Parameters
    ----------
    mass, damping, stiffness : arrays of shape (n, n), sparse ones too, or lists of expressions of parameters
    contacts : as in a model's file, such as ``{"pad": {"kind": "friction", ...}}``
    force : expression of the force on each coordinate that has one
    parameters : their defaults
    period : expression of the period of the excitation; empty for an autonomous model
    coordinates : their names; q1, q2, ... by default. Their velocities are v1, v2, ...
    more : what else a model's file may have: ``constraints``, ``define``, ``symmetry``, ``spread``, ...

    Raises
    ------
    ModelError
        For the first mistake, with the name of its entry.

    Examples
    --------
    >>> import contfric as cf
    >>> brake = {"kind": "friction", "velocity": "v1", "kinetic": "S", "static": "S0"}
    >>> cf.Mechanism([[1.0]], [[0.0]], [[1.0]], contacts={"brake": brake}, force={"q1": "cos(Omega*t)"},
    ...              parameters={"Omega": 0.5, "S": 0.3, "S0": 0.4}, period="2*pi/Omega").states
    ('q1', 'v1')
    """
    mass, damping, stiffness = map(plain, (mass, damping, stiffness))
    size = _size(stiffness, mass, damping) if coordinates is None else len(coordinates)
    data: dict[str, Any] = {
        "name": name,
        COORDINATES: coordinates or [f"q{i}" for i in range(1, size + 1)],
        "parameters": {} if parameters is None else parameters,
        "mass": mass,
        "damping": damping,
        "stiffness": stiffness,
        "force": {} if force is None else force,
        "contacts": contacts,
        **({"period": period} if period else {"autonomous": True}),
        **more,
    }
    try:
        return from_data(data)
    except EntryError as error:
        where = " -> ".join(map(str, error.address))
        raise ModelError(f"model '{name}', {where or 'as a whole'}: {error}") from None


def _size(*matrices: Any) -> int:
    """Return the number of coordinates: the rows of the first matrix that has rows."""
    for matrix in matrices:
        if isinstance(matrix, (list, tuple)):
            return len(matrix)
    raise ModelError(
        "none of these matrices has rows, so they do not say how many coordinates there are: "
        "give 'stiffness' as rows, or coordinates=['q1', ...]"
    )
