"""A tile of an ensemble: some samples, each explored; any process computes it to the same bits.

Of a diagram its events are read by name, and a quantity of every orbit at fixed values of the parameter.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contfric.atlas.diagram import Diagram
from contfric.atlas.explore import explore
from contfric.base.arrays import FloatArray, IntArray
from contfric.chaos.work import TileTask
from contfric.continuation.branch import Branch
from contfric.ensembles.rows import Drawn, Rows, joined
from contfric.errors import ContfricError, ConvergenceError, ParameterError
from contfric.events.bifurcation import EndReason
from contfric.models.definition import Model
from contfric.orbit.finding.find import find_orbit
from contfric.orbit.orbit import Orbit
from contfric.quantities.measure import of_branch, of_orbit
from contfric.quantities.registry import Quantity, QuantityLike, quantity_of
from contfric.remember.advance import cores_are_busy

#: Values of the parameter at which an orbit to begin with is looked for: the one given, then others, spread
#: by the golden section. Where four in five are chaotic, eight miss the rest in one of six, and say so.
_STARTS = 8
_GOLDEN = 0.6180339887498949
#: Periods after which a start counts as aperiodic: convergence is seen within some hundreds, and there are
#: other starts; 50,000, as :func:`contfric.find_orbit` has it, would cost as much as some diagrams.
_LONGEST = 2000
#: Ends of branches that are limits of the computation.
_LIMITS = (EndReason.POINTS, EndReason.WORK)
#: Events nearer to each other than this, relative to the range, stand in the order of their names: they are
#: located to 1e-12, so that the order of their values would be one of roundings.
_AT_ONCE = 1e-9
#: Newton steps for the place of a value between two points: of a nearly straight cubic three reach rounding.
_STEPS = 4


#: What follows the name of a branch where its mirror image is meant.
IMAGE = " (image)"


@dataclass(frozen=True, eq=False)
class EnsembleTile(TileTask):
    """A task: some samples of an ensemble.

    Attributes
    ----------
    model : Model
    vectors : ndarray, shape (samples, parameters)
        The parameters; that of the diagrams is where an orbit to begin with is looked for first.
    parameter, range : what the diagrams are along, and where
    row : the quantity that is kept at ``values``
    options : further arguments of :func:`contfric.explore`
    """

    model: Model
    vectors: FloatArray
    parameter: str
    range: tuple[float, float]
    row: QuantityLike
    values: FloatArray
    options: dict[str, Any]


def compute_ensemble_tile(
    tile: EnsembleTile,
    stop: IntArray | None = None,
    begun: Callable[[EnsembleTile, Rows], None] | None = None,
) -> Rows:
    """Explore the samples of a tile; ``stop`` is set by Ctrl-C, and ends it between two of them.

    Parameters
    ----------
    begun : told of the samples that were finished until then

    Raises
    ------
    KeyboardInterrupt
        If Ctrl-C came in the midst of it: what is cut short is no result.
    """
    gathered = _Gathered()
    for number, vector in enumerate(tile.vectors):
        if stop is not None and stop[0]:
            if begun is not None and number:
                begun(tile, joined([gathered.rows(), Rows.empty(len(tile.vectors) - number)]))
            raise KeyboardInterrupt
        with cores_are_busy():
            gathered.add(tile, number, vector)
    return gathered.rows()


class _Gathered:
    """Rows of the samples so far."""

    def __init__(self) -> None:
        self.samples: list[tuple[int, int, int, str]] = []
        self.events: list[tuple[int, str, float]] = []
        self.names: list[str] = []
        self.parts: list[tuple[Any, ...]] = []

    def add(self, tile: EnsembleTile, number: int, vector: FloatArray) -> None:
        """Explore one sample, and keep what it has."""
        diagram = _diagram(tile, vector)
        if isinstance(diagram, ContfricError):
            outside = isinstance(diagram, ParameterError)
            code = (Drawn.OUTSIDE if outside else Drawn.FAILED).code
            self.samples.append((code, 0, 0, " ".join(str(diagram).split())))
            return
        limited = not diagram.complete or any(
            end.reason in _LIMITS for branch in diagram.branches for end in branch.ends
        )
        outcome = Drawn.LIMITED if limited else Drawn.COMPLETE
        counts = len(diagram.branches), len(diagram.loose_ends)
        self.samples.append((outcome.code, *counts, ""))
        labels, places = events_of(diagram)
        self.events += [(number, *event) for event in zip(labels, places, strict=True)]
        quantity = quantity_of(tile.row, tile.model)
        for name, found in named_crossings(diagram, quantity, tile.values):
            self.names += [name] * len(found.index)
            where = np.full(len(found.index), number, dtype=np.int32)
            self.parts.append((where, found.index, found.stable, found.row))

    def rows(self) -> Rows:
        """Return all as arrays."""
        outcomes, branches, loose, reasons = zip(*self.samples, strict=True)
        samples, labels, places = zip(*self.events, strict=True) if self.events else ((), (), ())
        like = Rows.empty(0)
        tables = zip(*self.parts, strict=True) if self.parts else ([], [], [], [])
        where, index, stable, row = (
            np.concatenate(list(column)) if self.parts else np.zeros(0) for column in tables
        )
        return Rows(
            np.array(outcomes, dtype=np.uint8),
            np.array(branches, dtype=np.int32),
            np.array(loose, dtype=np.int32),
            np.array(reasons, dtype=np.str_),
            np.array(samples, dtype=np.int32),
            np.array(labels, dtype=np.str_),
            np.array(places, dtype=np.float64),
            where.astype(np.int32),
            np.array(self.names, dtype=np.str_),
            index.astype(np.int32),
            stable.astype(like.orbit_stable.dtype),
            row.astype(np.float64),
        )


def _diagram(tile: EnsembleTile, vector: FloatArray) -> Diagram | ContfricError:
    """Return the diagram of a sample, or why there is no diagram."""
    try:
        tile.model.check_params(tile.model.mapping(vector))
    except ParameterError as error:
        return error
    try:
        start = _start(tile, vector)
        diagram = explore(start, tile.parameter, tile.range, **tile.options)
    except ConvergenceError as error:
        return error
    except Exception as error:  # a fault of ours costs its sample only, and is counted
        return ContfricError(f"internal error, {type(error).__name__}: {error} (please report it)")
    reasons = {end.reason for branch in diagram.branches for end in branch.ends}
    if EndReason.INTERRUPTED.value in diagram.notes or EndReason.INTERRUPTED in reasons:
        raise KeyboardInterrupt
    return diagram


def _start(tile: EnsembleTile, vector: FloatArray) -> Orbit:
    """Return an orbit to begin with.

    Raises
    ------
    ConvergenceError
        If there is no orbit at any of the values that are tried: the error of the first.
    """
    (low, high), params = tile.range, tile.model.mapping(vector)
    others = low + (high - low) * np.mod(_GOLDEN * np.arange(1, _STARTS), 1.0)
    first: ConvergenceError | None = None
    for value in (params[tile.parameter], *others.tolist()):
        try:
            return find_orbit(tile.model, {**params, tile.parameter: value}, longest=_LONGEST)
        except ConvergenceError as error:
            first = first or error
    assert first is not None
    raise first


def names_of(diagram: Diagram) -> list[str]:
    """Return the names of the branches; a mirror image follows its branch, and is called the same."""
    names: list[str] = []
    for branch in diagram.branches:
        names.append(names[-1] if branch.mirrored and names else branch.name)
    return names


def events_of(diagram: Diagram) -> tuple[list[str], list[float]]:
    """Return the events of a diagram in the order of the parameter: names and values.

    An event is called by its kind and by the names of all branches that meet there, in their order.
    """
    found, called = [], names_of(diagram)
    for node in diagram.events:
        names = sorted({called[k] for k in node.branches})
        label = f"{node.bifurcation.kind.value} {' + '.join(names)}"
        found.append((node.bifurcation.params[diagram.parameter], label))
    near = _AT_ONCE * diagram.width
    first = 0
    for k in range(1, len(found) + 1):
        if k == len(found) or found[k][0] - found[k - 1][0] > near:
            found[first:k] = sorted(found[first:k], key=lambda event: event[1])
            first = k
    return [label for _, label in found], [value for value, _ in found]


@dataclass(frozen=True, eq=False)
class Crossings:
    """Orbits of a branch at fixed values: numbers of the values, stability (-1 unknown), a quantity."""

    index: IntArray
    stable: NDArray[np.int8]
    row: FloatArray


def named_crossings(
    diagram: Diagram, quantity: Quantity, values: FloatArray
) -> Iterator[tuple[str, Crossings]]:
    """Yield the orbits of each branch at some values, with its name.

    Of an asymmetric orbit and its mirror image the one with the larger quantity has the name, the other one
    stands as image: which of them was computed depends on the start.
    """
    names, branches = names_of(diagram), diagram.branches
    for k, (name, branch) in enumerate(zip(names, branches, strict=True)):
        if branch.mirrored:
            continue
        if k + 1 == len(branches) or not branches[k + 1].mirrored:
            yield name, crossings_of([branch], quantity, values)[0]
            continue
        one, other = crossings_of(branches[k : k + 2], quantity, values)
        yield name, replace(one, row=np.maximum(one.row, other.row))
        yield name + IMAGE, replace(other, row=np.minimum(one.row, other.row))


def crossings_of(
    branches: Sequence[Branch], quantity: Quantity, values: FloatArray
) -> list[Crossings]:
    """Return a quantity of every orbit of a branch, and of its mirror image, at values of the parameter.

    Between two points of the branch parameter and quantity are cubics in the arclength, with slopes of
    parabolas through three points. Located events are points, too: stability changes there, and folds are
    not cut off.

    Parameters
    ----------
    branches : the branch, and its mirror image if that is wanted: the same points, so that they differ in
        the quantity alone
    """
    arc, both, stable = _nodes(branches, quantity)
    if len(arc) < 2:
        none = Crossings(np.zeros(0, np.int64), np.zeros(0, np.int8), np.zeros(0))
        return [none for _ in branches]
    at = both[0]
    low, high = np.minimum(at[:-1], at[1:]), np.maximum(at[:-1], at[1:])
    first = np.searchsorted(values, low, side="left")
    last = np.searchsorted(values, high, side="left")
    last[-1] = np.searchsorted(values, high[-1], side="right")  # the end of the branch is its own
    counts = last - first
    k = np.repeat(np.arange(len(counts)), counts)
    index = first[k] + np.arange(len(k)) - np.repeat(np.cumsum(counts) - counts, counts)
    slopes = np.gradient(both, arc, axis=1, edge_order=2 if len(arc) > 2 else 1)
    along, *across = (_Cubics(arc, y, slope, k) for y, slope in zip(both, slopes, strict=True))
    shares, known = _shares(along, values[index]), stable[k]
    return [Crossings(index, known, cubics.at(shares)[0]) for cubics in across]


def _nodes(
    branches: Sequence[Branch], quantity: Quantity
) -> tuple[FloatArray, FloatArray, NDArray[np.int8]]:
    """Return arclength, then parameter and quantities, and the stability of what follows.

    At points and located events of a branch, the first one; the others are its mirror images.
    """
    branch = branches[0]
    own = np.full(len(branch), -1) if branch.stable is None else branch.stable
    use = [
        k
        for k, b in enumerate(branch.bifurcations)
        if b.located and b.orbit.system is branch.system
    ]
    events = [branch.bifurcations[k] for k in use]
    arc = np.concatenate([branch.arc, [b.position for b in events]])
    at = np.concatenate([branch.values, [b.params[branch.parameter] for b in events]])
    rows = [
        np.concatenate(
            [of_branch(quantity, b), [of_orbit(quantity, b.bifurcations[k].orbit) for k in use]]
        )
        for b in branches
    ]
    stable = np.concatenate([own, np.full(len(events), -2)]).astype(np.int8)
    order = np.argsort(arc, kind="stable")
    order = order[np.concatenate([[True], np.diff(arc[order]) > 0.0])]
    arc, both, stable = arc[order], np.array([at, *rows])[:, order], stable[order]
    both[~np.isfinite(both)] = np.nan  # multipliers of holds: no band has them
    # after an event a branch is as stable as at its next point
    points = np.flatnonzero(stable != -2)
    following = points[np.minimum(np.searchsorted(points, np.arange(len(arc))), len(points) - 1)]
    stable = stable[following]
    stable[:1] = stable[
        1:2
    ]  # at the event that a branch begins at a multiplier is on the unit circle
    return arc, both, stable


class _Cubics:
    """Cubics of a quantity of the nodes of a branch, in the share of the arclength from node k to k + 1."""

    def __init__(self, arc: FloatArray, y: FloatArray, slopes: FloatArray, k: IntArray) -> None:
        length, rise = arc[k + 1] - arc[k], y[k + 1] - y[k]
        a, b = length * slopes[k], length * slopes[k + 1]
        self.rise = rise
        self.parts = y[k], a, 3.0 * rise - 2.0 * a - b, a + b - 2.0 * rise

    def at(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return values and derivatives by the share."""
        y, a, c, d = self.parts
        return y + x * (a + x * (c + x * d)), a + x * (2.0 * c + 3.0 * x * d)


def _shares(cubics: _Cubics, wanted: FloatArray) -> FloatArray:
    """Return where the parameter has a value, as a share of the arclength between two nodes."""
    rise, none = cubics.rise, np.zeros(len(wanted))
    share = np.divide(wanted - cubics.parts[0], rise, out=none.copy(), where=rise != 0.0)
    for _ in range(_STEPS):
        value, slope = cubics.at(share)
        step = np.divide(wanted - value, slope, out=none.copy(), where=slope != 0.0)
        share = np.clip(share + step, 0.0, 1.0)
    return share
