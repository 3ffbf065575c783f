"""The content of a diagram's page as plain data: lines, events, and orbits to click on.

Numbers are short text that a browser reads: base64 of little-endian arrays.
"""

from __future__ import annotations

import base64
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html.entities import name2codepoint
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.plot.appearance.style import (
    BRIDGE_COLOUR,
    ROWS,
    branch_colours,
    domain_colours,
    lighter,
)
from contfric.plot.diagrams.events import Mark, marks_of
from contfric.plot.diagrams.runs import quantity, stability_runs

if TYPE_CHECKING:
    from contfric.atlas.diagram import Diagram
    from contfric.continuation.branch import Branch
    from contfric.events.bifurcation import Bifurcation
    from contfric.orbit.orbit import Orbit

#: Samples of an orbit: a curve of this many pieces looks smooth at the size that it has on the page.
_SAMPLES = 72
#: Relative: an event is on a branch that has one of its kind this near.
_SAME = 1e-9
#: Steps of a quantised number: the largest number of 16 bits.
_STEPS = 65535
#: What counts as small on a line: this quantile of its values, unless they span more decades than single
#: precision has.
_SMALL, _DECADES = 0.05, 1e-6


@dataclass(frozen=True)
class Detail:
    """How much of a diagram goes into the file.

    Attributes
    ----------
    orbits : most orbits that can be clicked on, without those of the events
    tolerance : what a line may be off, as a share of its own size there; 0 keeps every point
    """

    orbits: int
    tolerance: float


def symbol(name: str) -> str:
    """Return the name of a parameter with Greek letters.

    Examples
    --------
    >>> symbol("Omega"), symbol("S0")
    ('Ω', 'S0')
    """
    return chr(name2codepoint[name]) if name in name2codepoint else name


def collect(
    diagram: Diagram, detail: Detail, orbits: dict[tuple[int, int], dict[str, Any]]
) -> dict[str, Any]:
    """Return everything that the page shows of a diagram.

    ``orbits`` keeps those that were sampled, by branch and point, for a call that asks for fewer.
    """
    points = list(_points(diagram, detail, orbits))
    systems = sorted({p["system"] for p in points})  # few, and long: points only name theirs
    names = sorted({name for p in points for _, name in p["parts"]})
    return {
        **lines_and_marks(diagram, detail, tuple(ROWS)),
        "parameter": symbol(diagram.parameter),
        "range": list(diagram.range),
        "model": diagram.model.name,
        "autonomous": diagram.model.autonomous,
        "states": list(diagram.model.states),
        "domains": domain_colours(diagram.model),
        "systems": [{"signature": signature, "watched": tests} for signature, tests in systems],
        "names": names,
        "points": [
            p
            | {"system": systems.index(p["system"])}
            | {"parts": [[k, names.index(name)] for k, name in p["parts"]]}
            for p in points
        ],
    }


def lines_and_marks(diagram: Diagram, detail: Detail, rows: tuple[str, ...]) -> dict[str, Any]:
    """Return what is seen of a diagram in some rows; without an orbit to click on it takes milliseconds."""
    branches = diagram.branches
    colours = branch_colours(b.name for b in branches if not b.bridge)
    return {
        "rows": [_row(diagram, name) for name in rows],
        "branches": [_branch(b, colours) for b in branches],
        "runs": [run for i in range(len(branches)) for run in _runs(diagram, i, detail, rows)],
    }


def _row(diagram: Diagram, name: str) -> dict[str, Any]:
    """Return one quantity with its marks; of an even one, mirror images lie on their originals."""
    originals = {b.name for b in diagram.branches if not b.mirrored}
    row = ROWS[name]
    left_out = [
        i
        for i, branch in enumerate(diagram.branches)
        if row.even and branch.mirrored and branch.name in originals
    ]
    found = marks_of(diagram.bifurcations, diagram.branches, name, diagram.parameter)
    return {
        "name": name,
        "label": {"stops": "x at stops", "psi": "ψ"}.get(name, name),
        "left_out": left_out,
        "marks": [_mark(mark, diagram) for mark in found],
    }


def _mark(mark: Mark, diagram: Diagram) -> dict[str, Any]:
    there = {
        branch.name
        for branch in diagram.branches
        for event in branch.bifurcations
        if event.kind is mark.kind
        and abs(event.params[diagram.parameter] - mark.x) <= _SAME * abs(mark.x)
    }
    return {
        "kind": mark.kind.value,
        "label": mark.label,
        "meaning": mark.meaning,
        "x": mark.x,
        "y": [_short(value) for value in mark.y],
        "on_bridges": mark.on_bridges,
        "branches": sorted(there),
    }


def _branch(branch: Branch, colours: dict[str, str]) -> dict[str, Any]:
    colour = BRIDGE_COLOUR if branch.bridge else colours[branch.name]
    shown = lighter(colour) if branch.mirrored else colour
    return {
        "name": branch.name,
        "bridge": branch.bridge,
        "mirrored": branch.mirrored,
        "colour": shown,
    }


def _runs(
    diagram: Diagram, i: int, detail: Detail, rows: tuple[str, ...]
) -> Iterator[dict[str, Any]]:
    """Yield the pieces of one stability of a branch: x once, y of every row."""
    branch = diagram.branches[i]
    of_rows = [stability_runs(branch, name) for name in rows]
    for pieces in zip(*of_rows, strict=True):
        x = pieces[0].x
        columns = np.column_stack([x, *(p.y for p in pieces)])
        sizes = np.column_stack(
            [np.full(len(x), diagram.width), *(local_sizes(p.y) for p in pieces)]
        )
        at = kept(columns, sizes, detail.tolerance)
        stable = pieces[0].stable
        style = {True: "stable", False: "unstable", None: "unknown"}[stable]
        yield {
            "branch": i,
            "style": "bridge" if branch.bridge else style,
            "x": floats(x[at]),
            "y": {
                name: [floats(column) for column in piece.y[at].T]
                for name, piece in zip(rows, pieces, strict=True)
            },
        }


# ------------------------------------------------------------------------------- orbits


def _points(
    diagram: Diagram, detail: Detail, known: dict[tuple[int, int], dict[str, Any]]
) -> Iterator[dict[str, Any]]:
    """Yield the orbits that can be clicked on: of the branches, and of every event."""
    stride = _stride([len(b) for b in diagram.branches], detail.orbits)
    for i, branch in enumerate(diagram.branches):
        for k in _spread(len(branch), stride):
            if (i, k) not in known:
                known[i, k] = _on_branch(diagram, i, k)
            yield known[i, k]
        for k, event in enumerate(branch.bifurcations, start=1):
            if (i, -k) not in known:
                known[i, -k] = _at_event(diagram, i, event)
            yield known[i, -k]


def _stride(lengths: Sequence[int], most: int) -> int:
    """Return every how many points one is shown, so that there are not more than asked for.

    It is a power of two: what a coarser page shows, a finer one shows, too.
    """
    stride = 1
    while sum(len(_spread(n, stride)) for n in lengths) > max(most, 2 * len(lengths)):
        stride *= 2
    return stride


def _spread(count: int, stride: int) -> list[int]:
    """Return every so many of a branch's points, the last one too."""
    return sorted({*range(0, count, stride), count - 1}) if count else []


def _on_branch(diagram: Diagram, i: int, k: int) -> dict[str, Any]:
    """Return a point of a branch, with the multipliers that the branch has."""
    branch = diagram.branches[i]
    multipliers = None if branch.bridge or branch.multipliers is None else branch.multipliers[k]
    stable = None if branch.stable is None else bool(branch.stable[k])
    orbit = branch[k]
    y = {name: quantity(orbit, name) for name in ROWS}
    return _point(diagram, i, orbit, multipliers, y) | {"stable": stable, "event": ""}


def _at_event(diagram: Diagram, i: int, event: Bifurcation) -> dict[str, Any]:
    """Return the orbit of an event of a branch; it has no stability, which changes there."""
    branch = diagram.branches[i]
    known = not branch.bridge and branch.multipliers is not None
    multipliers = event.orbit.multipliers if known else None
    y = {name: quantity(event.orbit, name) for name in ROWS}
    found = _point(diagram, i, event.orbit, multipliers, y)
    return found | {"stable": None, "event": event.label}


def _point(
    diagram: Diagram,
    branch: int,
    orbit: Orbit,
    multipliers: NDArray[np.complex128] | None,
    y: dict[str, FloatArray],
) -> dict[str, Any]:
    """Return one orbit: where it is drawn in each row, what is said of it, and its motion."""
    return {
        "branch": branch,
        "x": float(orbit.params[diagram.parameter]),
        "y": {name: [_short(value) for value in values] for name, values in y.items()},
        "system": (str(orbit.signature), _watched(orbit)),
        "periods": orbit.periods,
        "period": _short(orbit.period),
        "multipliers": None if multipliers is None else [_complex(mu) for mu in multipliers],
        "margins": floats(orbit.margins),
        **_motion(orbit),
    }


def _short(value: float) -> float | None:
    return float(f"{value:.6g}") if np.isfinite(value) else None  # JSON knows no nan


def _complex(value: complex) -> str:
    """Return a multiplier as text.

    Examples
    --------
    >>> _complex(0.5 + 0j), _complex(0.5 - 0.25j)
    ('0.5', '0.5 − 0.25i')
    """
    if value.imag == 0.0 or not np.isfinite(value):
        return f"{value.real:.6g}"
    return f"{value.real:.6g} {'−' if value.imag < 0.0 else '+'} {abs(value.imag):.6g}i"


def _watched(orbit: Orbit) -> tuple[str, ...]:
    """Return what each margin is, and where."""
    return tuple(
        f"{test.margin.value}, at {test.surface}, in segment {test.segment + 1}: "
        f"{orbit.system.itinerary[test.segment][0]}"
        for test in orbit.system.tests
    )


def _motion(orbit: Orbit) -> dict[str, Any]:
    """Return time and states along one period, and where each segment begins."""
    times, states, names = orbit.trajectory(_SAMPLES)
    changes = [k for k in range(len(names)) if k == 0 or names[k] != names[k - 1]]
    return {
        "t": quantised(times - times[0]),
        "s": [quantised(column) for column in states.T],
        "parts": [[k, names[k]] for k in changes],
    }


def floats(values: FloatArray) -> str:
    """Return numbers in single precision, which a screen cannot tell from double.

    Examples
    --------
    >>> floats(np.array([1.0]))
    'AACAPw=='
    """
    return base64.b64encode(np.asarray(values, dtype="<f4").tobytes()).decode("ascii")


def quantised(values: FloatArray) -> tuple[float, float, str]:
    """Return the least value, the step, and the numbers of steps in 16 bits each.

    Examples
    --------
    >>> quantised(np.array([1.0, 2.0]))
    (1.0, 1.5259021896696422e-05, 'AAD//w==')
    """
    low, high = float(np.min(values)), float(np.max(values))
    step = (high - low) / _STEPS or 1.0
    counts = np.rint((values - low) / step).astype("<u2")
    return low, step, base64.b64encode(counts.tobytes()).decode("ascii")


def local_sizes(values: FloatArray) -> FloatArray:
    """Return the size of a quantity at each of its values: what an error there is compared with.

    Near a resonance a branch grows by many decades, and one zooms in to where it is small.
    """
    sizes = np.abs(np.nan_to_num(values))
    if not np.any(sizes):
        return np.ones_like(sizes)
    found = sizes[np.isfinite(values)]
    small = max(float(np.quantile(found, _SMALL)), _DECADES * float(found.max()))
    return np.asarray(sizes + small)


def kept(columns: FloatArray, sizes: FloatArray, tolerance: float) -> NDArray[np.intp]:
    """Return the indices of the vertices that a polyline needs (Douglas and Peucker, 1973).

    Parameters
    ----------
    columns : ndarray, shape (k, quantities)
        The vertices as they are drawn; nan where a quantity is absent.
    sizes : ndarray, shape (k, quantities)
        What distances at each vertex are compared with.
    tolerance : float
        Largest distance of a vertex that is left out, relative to its sizes; 0 keeps all.
    """
    count = len(columns)
    needed = np.ones(count, dtype=bool)
    if tolerance > 0.0 and count > 2:
        needed[1:-1] = False
        filled = np.nan_to_num(columns)
        pieces = [(0, count - 1)]
        while pieces:
            first, last = pieces.pop()
            if last - first < 2:
                continue
            share = np.linspace(0.0, 1.0, last - first + 1)[:, None]
            chord = (1.0 - share) * filled[first] + share * filled[last]
            here = slice(first, last + 1)
            far = (np.abs(filled[here] - chord) / sizes[here]).max(axis=1)
            far[[0, -1]] = 0.0  # the ends are kept already
            worst = int(np.argmax(far))
            if far[worst] > tolerance:
                needed[first + worst] = True
                pieces += [(first, first + worst), (first + worst, last)]
    return np.flatnonzero(needed)
