"""A tile of an ensemble: some samples, each explored; any process computes it to the same bits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from contfric.atlas.diagram import Diagram
from contfric.atlas.explore import explore
from contfric.chaos.work import TileTask
from contfric.continuation.events import EndReason
from contfric.ensembles.reading import events_of, named_crossings
from contfric.ensembles.rows import Drawn, Rows
from contfric.errors import ContfricError, ConvergenceError, ParameterError
from contfric.models.definition import FloatArray, Model
from contfric.orbit.find import find_orbit
from contfric.orbit.orbit import Orbit
from contfric.orbit.system import IntArray
from contfric.quantities.registry import quantity_of
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
    row: str
    values: FloatArray
    options: dict[str, Any]


def compute_ensemble_tile(tile: EnsembleTile, stop: IntArray | None = None) -> Rows:
    """Explore the samples of a tile; ``stop`` is set by Ctrl-C, and ends it between two of them.

    Raises
    ------
    KeyboardInterrupt
        If Ctrl-C came in the midst of it: what is cut short is no result.
    """
    gathered = _Gathered()
    for number, vector in enumerate(tile.vectors):
        if stop is not None and stop[0]:
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
    """Return the diagram of a sample, or why there is none."""
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
        If there is none at any of the values that are tried: the error of the first.
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
