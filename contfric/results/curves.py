"""Curves and planes to a header and arrays, and back."""

from __future__ import annotations

from typing import Any

import numpy as np

from contfric.atlas.diagram import Diagram
from contfric.atlas.plane import Family, Plane, Region
from contfric.continuation.events import Kind
from contfric.curves.curve import Curve, CurvePart
from contfric.curves.extremum import ExtremumCurve
from contfric.curves.homoclinic import HomoclinicCurve
from contfric.curves.quantity_curve import QuantityCurve
from contfric.curves.special import CodimTwo, CurveEnd, CurveEndReason, SpecialPoint
from contfric.orbit.system import Margin, Test
from contfric.results.pack import Header, Packer
from contfric.results.unpack import Unpacker

#: Arrays of a piece of a curve, each stored as ``curve<i>_part<j>_<name>``.
PART_ARRAYS = ("values", "joints", "arc", "labels", "turn_multipliers")


def pack_curve(curve: Curve, packer: Packer, index: int) -> Header:
    """Return the header of a curve; its arrays are added as they are."""
    packer.arrays[f"curve{index}_vector"] = curve.vector
    listed = list(curve.special)
    listed += [e.special for e in curve.ends if e.special is not None and e.special not in listed]
    packer.arrays[f"curve{index}_special"] = np.array(
        [[*s.params.values(), s.position] for s in listed], dtype=np.float64
    ).reshape(len(listed), 1 + len(curve.model.parameters))
    return {
        "parameters": list(curve.parameters),
        "parts": [
            _pack_part(p, packer, f"curve{index}_part{j}") for j, p in enumerate(curve.parts)
        ],
        "special": [_pack_special(s, packer) for s in listed],
        "inner": len(curve.special),
        "ends": [
            [e.reason.name, e.message, None if e.special is None else listed.index(e.special)]
            for e in curve.ends
        ],
    }


#: Curves on which a quantity is held, by the word for them in a file; and their arrays.
_HELD = {"value": QuantityCurve, "period": HomoclinicCurve, "extremum": ExtremumCurve}
_HELD_ARRAYS = ("vector", "values", "joints", "arc", "stable")


def pack_held(curve: QuantityCurve, packer: Packer) -> Header:
    """Return the header of a curve of a quantity; its arrays are added as they are."""
    packer.arrays |= {f"held_{name}": getattr(curve, name) for name in _HELD_ARRAYS}
    packer.arrays["held_at"] = np.array([curve.value])
    return {
        "held": next(word for word, kind in _HELD.items() if kind is type(curve)),
        "quantity": curve.quantity,
        "parameters": list(curve.parameters),
        "system": packer.system(curve.system),
        "ends": [[end.reason.name, end.message] for end in curve.ends],
    }


def unpack_held(header: Header, pool: Unpacker) -> QuantityCurve:
    """Return the curve of a quantity of a header; errors as for a curve."""
    arrays = {name: pool.arrays[f"held_{name}"] for name in _HELD_ARRAYS}
    names, system = tuple(map(str, header["parameters"])), pool.systems[header["system"]]
    for name in names:
        pool.model.index_of(name)
    count = len(arrays["arc"])
    joints = (count, system.segments, 1 + len(pool.model.states))
    fits = arrays["values"].shape == (count, len(names)) and arrays["joints"].shape == joints
    if not fits or arrays["stable"].shape != (count,) or not count:
        raise ValueError("arrays do not fit each other")
    one, other = (CurveEnd(CurveEndReason[reason], message) for reason, message in header["ends"])
    return _HELD[header["held"]](
        quantity=str(header["quantity"]),
        value=float(pool.arrays["held_at"][0]),
        parameters=names,
        system=system,
        ends=(one, other),
        **arrays,
    )


def _pack_part(part: CurvePart, packer: Packer, key: str) -> Header:
    for name in PART_ARRAYS:
        packer.arrays[f"{key}_{name}"] = getattr(part, name)
    return {
        "kind": part.kind.value,
        "system": packer.system(part.system),
        "test": _plain(part.test),
    }


def _pack_special(special: SpecialPoint, packer: Packer) -> Header:
    return {
        "kind": special.kind.name,
        "name": special.name,
        "orbit": packer.orbit(special.orbit),
        "meets": None if special.meets is None else special.meets.value,
        "tests": [_plain(test) for test in special.tests],
        "located": special.located,
    }


def _plain(test: Test | None) -> list[Any] | None:
    return None if test is None else [test.margin.value, test.segment, test.surface]


def _test(entry: list[Any] | None) -> Test | None:
    return None if entry is None else Test(Margin(entry[0]), int(entry[1]), str(entry[2]))


def unpack_curve(header: Header, pool: Unpacker, index: int) -> Curve:
    """Return the curve of a header.

    Raises
    ------
    ValueError, KeyError
        If arrays are missing or do not fit each other.
    """
    special = _unpack_special(header, pool, index)
    ends = [
        CurveEnd(CurveEndReason[reason], message, None if k is None else special[k])
        for reason, message, k in header["ends"]
    ]
    one, other = header["parameters"]
    for name in (one, other):
        pool.model.index_of(name)
    parts = [_unpack_part(p, pool, f"curve{index}_part{j}") for j, p in enumerate(header["parts"])]
    vector = pool.arrays[f"curve{index}_vector"]
    if vector.shape != (len(pool.model.parameters),) or not parts:
        raise ValueError("arrays do not fit each other")
    return Curve(
        (one, other), vector, tuple(parts), tuple(special[: header["inner"]]), (ends[0], ends[1])
    )


def _unpack_special(header: Header, pool: Unpacker, index: int) -> list[SpecialPoint]:
    rows, names = pool.arrays[f"curve{index}_special"].tolist(), pool.model.parameter_names
    return [
        SpecialPoint(
            CodimTwo[entry["kind"]],
            entry["name"],
            dict(zip(names, row[:-1], strict=True)),
            pool.orbits[entry["orbit"]],
            None if entry["meets"] is None else Kind(entry["meets"]),
            tuple(t for t in map(_test, entry["tests"]) if t is not None),
            row[-1],
            entry["located"],
        )
        for entry, row in zip(header["special"], rows, strict=True)
    ]


def _unpack_part(entry: Header, pool: Unpacker, key: str) -> CurvePart:
    system = pool.systems[entry["system"]]
    found = {name: pool.arrays[f"{key}_{name}"] for name in PART_ARRAYS}
    count = len(found["values"])
    if found["joints"].shape != (count, system.segments, 1 + len(pool.model.states)):
        raise ValueError("arrays do not fit each other")
    if found["values"].shape != (count, 2) or any(len(a) != count for a in found.values()):
        raise ValueError("arrays do not fit each other")
    return CurvePart(Kind(entry["kind"]), None, system, _test(entry["test"]), **found)


def pack_plane(plane: Plane, packer: Packer) -> Header:
    """Return the header of a plane; its arrays are added as they are."""
    packer.arrays["ranges"], packer.arrays["vector"] = plane.ranges, plane.vector
    packer.arrays["cells"] = plane.cells
    packer.arrays["region_points"] = np.array(
        [[*r.point.values(), r.share] for r in plane.regions], dtype=np.float64
    ).reshape(len(plane.regions), 3)
    sections = []
    for k, section in enumerate(plane.sections):
        sections.append(packer.diagram(section))
        packer.arrays[f"section{k}_range"] = packer.arrays.pop("range")
    return {
        "parameters": list(plane.parameters),
        "curves": [pack_curve(c, packer, i) for i, c in enumerate(plane.curves)],
        "twins": list(plane.twins),
        "sections": sections,
        "regions": [
            {
                "bounds": list(r.bounds),
                "families": [[f.name, f.stable] for f in r.families],
                "disputed": [[f.name, f.stable] for f in r.disputed],
                "sampled": r.sampled,
            }
            for r in plane.regions
        ],
        "complete": plane.complete,
        "notes": list(plane.notes),
    }


def unpack_plane(header: Header, pool: Unpacker) -> Plane:
    """Return the plane of a header.

    Raises
    ------
    ValueError, KeyError
        If arrays are missing or do not fit each other.
    """
    one, other = header["parameters"]
    rows = pool.arrays["region_points"].tolist()
    regions = tuple(
        Region(
            {one: row[0], other: row[1]},
            row[2],
            tuple(entry["bounds"]),
            tuple(Family(*f) for f in entry["families"]),
            entry["sampled"],
            tuple(Family(*f) for f in entry["disputed"]),
        )
        for entry, row in zip(header["regions"], rows, strict=True)
    )
    curves = tuple(unpack_curve(c, pool, i) for i, c in enumerate(header["curves"]))
    return Plane(
        pool.model,
        (one, other),
        pool.arrays["ranges"],
        pool.arrays["vector"],
        curves,
        tuple(header["twins"]),
        regions,
        pool.arrays["cells"],
        tuple(_section(entry, pool, k) for k, entry in enumerate(header["sections"])),
        header["complete"],
        tuple(header["notes"]),
    )


def _section(entry: Header, pool: Unpacker, k: int) -> Diagram:
    pool.arrays["range"] = pool.arrays[f"section{k}_range"]
    return pool.diagram(entry)
