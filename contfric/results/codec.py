"""Results as bytes and arrays: field by field, by the fields of their data classes, and back.

A result is written by :mod:`contfric.remember.stored`, as what a checkpoint keeps is: a new field, or a new
class, needs nothing here. Three things are different in a file that lasts. The model is not in it: its reader
has it. Large arrays are not among the bytes, but by themselves, under the name of their field. A field that
an earlier version has not written has its default.
"""

from __future__ import annotations

from dataclasses import MISSING, Field, fields
from types import FunctionType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contfric.bvp.system import System, build_system
from contfric.curves.special import SpecialPoint
from contfric.equilibria.regions import ModeRegion, regions_of
from contfric.errors import ResultFileError
from contfric.events.bifurcation import Bifurcation, End
from contfric.models.definition import Model
from contfric.orbit.orbit import Orbit
from contfric.quantities.registry import name_of
from contfric.remember.stored import Reader, UnstorableError, Writer, made_of
from contfric.simulation.simulate import Trajectory

Arrays = dict[str, NDArray[Any]]

#: Bytes from which an array stands by itself: each costs a tenth of a millisecond and 300 bytes.
_LARGE = 4096
#: What is one object again afterwards, if it was one. Others are written wherever they stand: whether two
#: parts share an array depends on how they were found, and the same result is the same file.
_SHARED = (Model, System, Orbit, Bifurcation, End, SpecialPoint, ModeRegion)
#: What a curve was computed from is not kept.
_LEFT_OUT = {("CurvePart", "problem")}


class ResultWriter(Writer):
    """Writes a result of a model; ``large`` are the arrays that stand by themselves."""

    def __init__(self, model: Model) -> None:
        super().__init__([model])
        self.large: Arrays = {}
        self._model, self._field_name = model, ""

    def _node(self, value: Any) -> Any:
        if isinstance(
            value, FunctionType
        ):  # a quantity: what it was called lasts, and not what it does
            value = name_of(value)
        if type(value) is System:  # those of one itinerary are one
            self._node(value.model)
            asked = value.itinerary, value.periods, value.half, value.domains
            value = build_system(self._model, *asked)
        if not isinstance(value, _SHARED):
            self._places.pop(id(value), None)
        return super()._node(value)

    def _object(self, value: Any, kind: type) -> Any:
        if isinstance(value, Model):
            if value.name != self._model.name:
                raise ResultFileError(
                    f"orbits of '{value.name}' and '{self._model.name}' cannot be in one file"
                )
            return self._node(self._model)
        return super()._object(value, kind)

    def _field(self, value: Any, name: str) -> Any:
        self._field_name = name
        return None if (type(value).__name__, name) in _LEFT_OUT else super()._field(value, name)

    def _array(self, array: NDArray[Any]) -> list[Any]:
        if array.nbytes < _LARGE:
            return super()._array(array)
        name = f"{self._field_name}{len(self.large)}"
        self.large[name] = array
        return [name]


class ResultReader(Reader):
    """Reads what a :class:`ResultWriter` has written."""

    def __init__(self, content: bytes, model: Model, large: Arrays) -> None:
        super().__init__(content, [model])
        self._large = large

    def _next_array(self, *array: Any) -> Any:
        return self._large[array[0]] if len(array) == 1 else super()._next_array(*array)

    def _read_object(self, path: str, *items: Any) -> Any:
        found = super()._read_object(path, *items)
        written = {name for name, _ in items}
        for field in fields(found):
            if field.name not in written:
                object.__setattr__(found, field.name, _default(field))
        return found


def _default(field: Field[Any]) -> Any:
    if field.default is not MISSING:
        return field.default
    if field.default_factory is not MISSING:
        return field.default_factory()
    raise UnstorableError(f"'{field.name}' is missing")


# Regions hold compiled formulas, and modes are numbered as a solution has visited them.
def _region(model: Model, number: int) -> ModeRegion:
    return regions_of(model)[number]


made_of(ModeRegion, lambda r: (r.model, regions_of(r.model).index(r)), _region)


def _named(found: Trajectory) -> tuple[Any, ...]:
    visited, numbers = np.unique(found.modes, return_inverse=True)
    names = tuple(found.model.modes[k].name for k in visited)
    return names, {f.name: getattr(found, f.name) for f in fields(found)} | {"modes": numbers}


def _trajectory(names: tuple[str, ...], parts: dict[str, Any]) -> Trajectory:
    numbers = np.array([parts["model"].mode_index[name] for name in names], dtype=np.int64)
    return Trajectory(**{**parts, "modes": numbers[parts["modes"]]})


made_of(Trajectory, _named, _trajectory)
