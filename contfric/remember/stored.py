"""Plain data and the package's own data classes as bytes, and back, to the last bit.

What belongs to a computation is written as a tree (JSON) of tagged nodes, with its arrays after it. Reading
it runs no code but that of this package (no pickle): only data classes, named tuples and enumerations of
contfric are made again, field by field. An object that is met twice is one object again afterwards, and one
that the reader has already (an argument of the computation) is that very object.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from importlib import import_module
from operator import attrgetter
from typing import Any, Literal

import numpy as np

_PACKAGE = "contfric"
#: Names that classes had when files were written, and have now.
_RENAMED = {
    "contfric.continuation.events:Verdict": "contfric.events.bifurcation:Decision",
    "contfric.equilibria.regions:Region": "contfric.equilibria.regions:ModeRegion",
}
#: Modules that classes had when files were written, and have now.
_MOVED = {
    "contfric.atlas.balance": "contfric.atlas.completeness.balance",
    "contfric.atlas.degenerate": "contfric.atlas.completeness.degenerate",
    "contfric.atlas.plane": "contfric.atlas.plane.plane",
    "contfric.atlas.verification": "contfric.atlas.completeness.verification",
    "contfric.continuation.events": "contfric.events.bifurcation",
    "contfric.continuation.measured_event": "contfric.events.measured_event",
    "contfric.curves.extremum": "contfric.curves.of_quantities.extremum",
    "contfric.curves.homoclinic": "contfric.curves.of_quantities.homoclinic",
    "contfric.curves.quantity_curve": "contfric.curves.of_quantities.curve",
    "contfric.orbit.holds": "contfric.bvp.holds",
    "contfric.orbit.margins": "contfric.bvp.margins",
    "contfric.orbit.simulation": "contfric.simulation.simulate",
    "contfric.orbit.system": "contfric.bvp.system",
}
#: Objects of one shape that are written as rows of arrays: for fewer it saves nothing.
_MANY = 8
#: What arrays of one column have in common.
_TYPE, _SHAPE = attrgetter("dtype"), attrgetter("shape")


class UnstorableError(Exception):
    """Something is no plain data: whoever asked does without."""


#: Classes whose objects are not written field by field: their parts, and what makes one of them again.
_PARTS: dict[type, tuple[Callable[[Any], tuple[Any, ...]], Callable[..., Any]]] = {}
#: Classes whose objects are known to the reader, and what tells one from another.
_GIVEN: dict[type, Callable[[Any], tuple[Any, ...]]] = {}


def made_of(kind: type, parts: Callable[[Any], tuple[Any, ...]], make: Callable[..., Any]) -> None:
    """Have the objects of a class written as what they are made of.

    Parameters
    ----------
    parts : returns the arguments of ``make``
    make : returns such an object
    """
    _PARTS[kind] = parts, make


def given(kind: type, name: Callable[[Any], tuple[Any, ...]]) -> None:
    """Have the objects of a class written as a name: the reader has them."""
    _GIVEN[kind] = name


class Writer:
    """Writes values one after the other; ``objects`` are those met so far, in their order.

    Parameters
    ----------
    known : sequence
        Objects that the reader has.
    """

    def __init__(self, known: Sequence[Any] = ()) -> None:
        self.objects: list[Any] = []
        self._arrays: list[bytes] = []
        self._places: dict[int, list[Any]] = {id(o): ["known", k] for k, o in enumerate(known)}

    def bytes_of(self, value: Any) -> bytes:
        """Return a value as bytes.

        Raises
        ------
        UnstorableError
            If it has parts that are no plain data.
        """
        tree = json.dumps(self._node(value), separators=(",", ":")).encode()
        return b"".join([len(tree).to_bytes(8, "little"), tree, *self._arrays])

    def _node(self, value: Any) -> Any:
        kind = type(value)
        if value is None or kind in (bool, int, float, str):
            return value
        if kind is tuple:
            return ["tuple", *map(self._node, value)]
        if isinstance(value, Enum):
            return ["enum", _path(kind), value.name]
        if isinstance(value, np.generic):
            return ["scalar", self._array(np.asarray(value))]
        if kind is complex:
            return ["complex", value.real, value.imag]
        seen = self._places.get(id(value))
        return seen if seen is not None else self._object(value, kind)

    def _object(self, value: Any, kind: type) -> Any:
        self._places[id(value)] = ["seen", len(self.objects)]
        self.objects.append(value)  # which keeps it alive, so that its id stays its own
        if kind is np.ndarray:
            return ["array", *self._array(value)]
        if kind is list:
            return ["list", *self._items(value)]
        if kind is dict:
            return ["dict", *([self._node(k), self._node(v)] for k, v in value.items())]
        if kind in (set, frozenset):
            return [kind.__name__, *sorted(map(self._node, value), key=json.dumps)]
        if kind in _GIVEN:
            return ["given", *map(self._node, _GIVEN[kind](value))]
        if kind in _PARTS:
            return ["made", _path(kind), *map(self._node, _PARTS[kind][0](value))]
        if isinstance(value, tuple) and hasattr(kind, "_fields"):
            return ["named", _path(kind), *map(self._node, value)]
        if isinstance(value, Exception):
            return ["error", _path(kind), str(value), self._node(getattr(value, "result", None))]
        if is_dataclass(value):
            names = [field.name for field in fields(value)]
            return ["object", _path(kind), *([n, self._field(value, n)] for n in names)]
        raise UnstorableError(f"{kind.__name__} is no plain data")

    def _field(self, value: Any, name: str) -> Any:
        return self._node(getattr(value, name))

    def _items(self, values: list[Any]) -> list[Any]:
        """Return the nodes of a list; many objects of one shape after the first one are one node."""
        first, rest = values[:1], values[1:]
        columns = self._columns(rest) if len(rest) >= _MANY else None
        if columns is None:
            return list(map(self._node, values))
        nodes = list(map(self._node, first))
        for value in rest:
            self._places[id(value)] = ["seen", len(self.objects)]
            self.objects.append(value)
        self._arrays += [content for _, content in columns]
        listed = (node for node, _ in columns)
        return [*nodes, ["rows", _path(type(rest[0])), len(rest), *listed]]

    def _columns(self, values: list[Any]) -> list[tuple[list[Any], bytes]] | None:
        """Return what objects hold, one node and its array a field; None if they are not all of one shape."""
        kind = type(values[0])
        if not is_dataclass(kind) or kind in _PARTS or kind in _GIVEN:
            return None
        if any(type(v) is not kind or id(v) in self._places for v in values):
            return None
        found = []
        for field in fields(kind):
            column = list(map(attrgetter(field.name), values))
            first, types = column[0], set(map(type, column))
            if types == {np.ndarray}:
                for part in (_TYPE, _SHAPE):  # one after the other: no tuple for each array
                    if list(map(part, column)).count(part(first)) < len(column):
                        return None
                if first.dtype.hasobject:
                    return None
                try:
                    plain, shape, content = None, first.shape, b"".join(column)
                except TypeError:  # of another order in memory
                    return None
            elif types in ({float}, {bool}):
                plain, shape, first = types.pop().__name__, (), np.array(column)
                content = first.tobytes()
            else:
                return None
            node = [field.name, plain, first.dtype.str, [len(values), *shape], "C"]
            found.append((node, content))
        return found

    def _array(self, array: np.ndarray[Any, Any]) -> list[Any]:
        if array.dtype.hasobject:
            raise UnstorableError("an array of objects is no plain data")
        order: Literal["C", "F"] = (
            "F" if array.flags.f_contiguous and not array.flags.c_contiguous else "C"
        )
        self._arrays.append(array.tobytes(order))
        return [array.dtype.str, list(array.shape), order]


class Reader:
    """Reads what a :class:`Writer` has written; ``known`` are the objects that it was given."""

    def __init__(self, content: bytes, known: Sequence[Any] = ()) -> None:
        size = int.from_bytes(content[:8], "little")
        self._content, self._at = content, 8 + size
        self._tree = content[8:][:size]
        self._known = known
        self._objects: list[Any] = []

    def value(self) -> Any:
        """Return the value.

        Raises
        ------
        UnstorableError
            If the bytes hold anything but what this version of contfric writes.
        """
        try:
            return self._value(json.loads(self._tree))
        except (ValueError, LookupError, TypeError, AttributeError, ImportError) as error:
            raise UnstorableError(f"{type(error).__name__}: {error}") from error

    def _value(self, node: Any) -> Any:
        if not isinstance(node, list):
            return node
        tag, *rest = node
        return getattr(self, f"_read_{tag}")(*rest)

    def _new(self, value: Any) -> Any:
        self._objects.append(value)
        return value

    def _read_known(self, k: int) -> Any:
        return self._known[k]

    def _read_seen(self, k: int) -> Any:
        return self._objects[k]

    def _read_tuple(self, *items: Any) -> Any:
        return tuple(map(self._value, items))

    def _read_enum(self, path: str, name: str) -> Any:
        return _class(path, Enum)[name]

    def _read_complex(self, real: float, imag: float) -> Any:
        return complex(real, imag)

    def _read_scalar(self, array: list[Any]) -> Any:
        return self._next_array(*array)[()]

    def _read_array(self, *array: Any) -> Any:
        return self._new(self._next_array(*array))

    def _next_array(self, dtype: str, shape: list[int], order: str) -> Any:
        kind, count = np.dtype(dtype), int(np.prod(shape, dtype=np.int64))
        flat = np.frombuffer(self._content, kind, count, self._at)
        self._at += count * kind.itemsize
        # a copy: it can be written to, and owns its memory
        return np.array(flat.reshape(shape, order="F" if order == "F" else "C"), order="K")

    def _read_list(self, *items: Any) -> Any:
        found = self._new([])
        for item in items:
            if isinstance(item, list) and item[0] == "rows":
                found.extend(self._rows(*item[1:]))
            else:
                found.append(self._value(item))
        return found

    def _rows(self, path: str, count: int, *columns: list[Any]) -> list[Any]:
        """Return the objects of many rows."""
        kind = _data_class(path)
        made = [self._new(object.__new__(kind)) for _ in range(count)]
        for name, plain, *array in columns:
            rows = self._next_array(*array)
            values = [row.copy() for row in rows] if plain is None else rows.tolist()
            for one, value in zip(made, values, strict=True):
                object.__setattr__(one, name, value)
        return made

    def _read_dict(self, *items: Any) -> Any:
        found = self._new({})
        for key, value in items:
            name = self._value(key)
            found[name] = self._value(value)
        return found

    def _read_set(self, *items: Any) -> Any:
        found = self._new(set())
        found.update(map(self._value, items))
        return found

    def _read_frozenset(self, *items: Any) -> Any:
        return self._later(lambda: frozenset(map(self._value, items)))

    def _read_made(self, path: str, *parts: Any) -> Any:
        make = _PARTS[_class(path, object)][1]
        return self._later(lambda: make(*map(self._value, parts)))

    def _read_named(self, path: str, *items: Any) -> Any:
        return self._later(lambda: _class(path, tuple)(*map(self._value, items)))

    def _read_error(self, path: str, text: str, result: Any) -> Any:
        error = self._new(_class(path, Exception)(text))
        if (found := self._value(result)) is not None:
            error.result = found
        return error

    def _read_object(self, path: str, *items: Any) -> Any:
        kind = _data_class(path)
        found = self._new(object.__new__(kind))
        for name, value in items:
            object.__setattr__(found, name, self._value(value))
        return found

    def _later(self, make: Callable[[], Any]) -> Any:
        """Give an object its place before those that it is made of."""
        place = len(self._objects)
        self._objects.append(None)
        self._objects[place] = make()
        return self._objects[place]


def _path(kind: type) -> str:
    if kind.__module__.split(".")[0] != _PACKAGE or "<" in kind.__qualname__:
        raise UnstorableError(f"{kind.__name__} is no class of {_PACKAGE}")
    return f"{kind.__module__}:{kind.__qualname__}"


def _class(path: str, base: type) -> Any:
    module, _, name = _RENAMED.get(path, path).partition(":")
    module = _MOVED.get(module, module)
    if module.split(".")[0] != _PACKAGE:
        raise TypeError(f"{path} is no class of {_PACKAGE}")
    try:
        found: Any = import_module(module)
        for part in name.split("."):
            found = getattr(found, part)
    except (ImportError, AttributeError):
        raise TypeError(f"{path} is of another version of {_PACKAGE}") from None
    if not (isinstance(found, type) and issubclass(found, base)):
        raise TypeError(f"{path} is no such class")
    return found


def _data_class(path: str) -> type:
    found: type = _class(path, object)
    if not is_dataclass(found):
        raise TypeError(f"{path} is no data class")
    return found
