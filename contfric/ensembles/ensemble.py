"""An ensemble of bifurcation diagrams, and its statistics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.base.extras import need_pandas, need_xarray
from contfric.base.named import Named
from contfric.base.shown import Shown
from contfric.ensembles.rows import Drawn, Rows, by_sample
from contfric.ensembles.statistics import SobolIndices, share_of, sobol_indices
from contfric.errors import ParameterError, did_you_mean, number_and, shown
from contfric.models.definition import Model
from contfric.quantities.registry import QuantityLike

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes

#: Quantiles of bands: the median within 90 percent.
QUANTILES = (0.05, 0.5, 0.95)
_STABLE = {1: "stable", 0: "unstable", -1: "unknown"}
Table = Literal["samples", "events", "bands", "classes"]
_TABLES = ("samples", "events", "bands", "classes")


@dataclass(frozen=True, eq=False)
class EnsembleEvent:
    """One event over all samples.

    Attributes
    ----------
    label : str
        Kind, and names of the branches that meet; of several alike in a diagram the second is ``... (2)``.
    values : ndarray, shape (samples,)
        Its place in each sample; nan without one.
    count : int
        Samples that have it.
    share, low, high : float
        Share of the whole diagrams that have it, with the limits of the 95 % interval.
    """

    label: str
    values: FloatArray
    count: int
    share: float
    low: float
    high: float
    names: tuple[str, ...]
    seed: int

    def quantiles(self, shares: Sequence[float] = QUANTILES) -> FloatArray:
        """Return quantiles of its place."""
        return np.asarray(np.nanquantile(self.values, shares))

    def sobol(self) -> SobolIndices | None:
        """Return the Sobol indices of its place; None if less than 16 blocks of samples have it.

        Examples
        --------
        >>> import contfric as cf
        >>> box = {"S": (0.30, 0.34)}
        >>> fixed = {"Omega": 0.5, "S0": 0.4}
        >>> found = cf.ensemble("coulomb", "Omega", (0.5, 0.55), box, fixed, samples=48)
        >>> found.event("SN 1a").sobol().blocks
        16
        """
        return sobol_indices(self.values, self.names, self.seed)

    def __repr__(self) -> str:
        return f"<{self.label}: {self.share:.1%} of the diagrams>"


@dataclass(frozen=True, eq=False)
class DiagramClass:
    """Diagrams with the same list of events.

    Attributes
    ----------
    events : tuple of str
        In the order of the parameter.
    samples : ndarray of int
        Their numbers.
    share, low, high : float
        Share of the whole diagrams, with the limits of the 95 % interval.
    """

    events: tuple[str, ...]
    samples: NDArray[np.int64]
    share: float
    low: float
    high: float

    def __repr__(self) -> str:
        return f"<{self.share:.1%}: {', '.join(self.events) or 'no event'}>"


@dataclass(frozen=True, eq=False)
class Band:
    """Quantiles of the row over all orbits of a name, along the parameter.

    Attributes
    ----------
    name : str
        Name of the branches; ``... (image)`` of asymmetric ones is the image with the smaller row.
    stable : str
        ``"stable"``, ``"unstable"`` or ``"unknown"``.
    quantiles : ndarray, shape (shares, values)
    orbits : ndarray, shape (values,)
        Orbits at each value.
    samples : ndarray, shape (values,)
        Samples that have such an orbit.
    """

    name: str
    stable: str
    quantiles: FloatArray
    orbits: NDArray[np.int64]
    samples: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Ensemble(Shown):
    """Diagrams of random parameters; the result of :func:`contfric.ensemble`.

    Attributes
    ----------
    model : Model
    parameter, range : what the diagrams are along, and where
    vector : ndarray, shape (parameters,)
        The parameters; those that vary at their medians.
    row : str or callable
        The quantity that is kept at ``values``.
    values : ndarray
        Values of the parameter.
    distributions : dict
        The parameters that vary, and how, in words.
    seed : int
    samples : ndarray, shape (samples, varied)
        What was drawn.
    rows : Rows
        What is kept of each diagram.

    Examples
    --------
    >>> import contfric as cf
    >>> box = {"S": (0.30, 0.34)}
    >>> params = {"Omega": 0.5, "S0": 0.4}
    >>> found = cf.ensemble("coulomb", "Omega", (0.5, 0.55), box, params, samples=4)
    >>> found.samples.shape
    (4, 1)
    """

    model: Model
    parameter: str
    range: tuple[float, float]
    vector: FloatArray
    row: QuantityLike
    values: FloatArray
    distributions: dict[str, str]
    seed: int
    samples: FloatArray
    rows: Rows

    def __len__(self) -> int:
        return len(self.samples)

    @property
    def params(self) -> dict[str, float]:
        """The parameters that do not vary, by name."""
        found = self.model.mapping(self.vector)
        return Named({n: value for n, value in found.items() if n not in self.distributions})

    @property
    def complete(self) -> bool:
        """Whether all samples have been computed; False after an interrupt."""
        return not bool(np.any(self.rows.outcomes == Drawn.MISSING.code))

    def counts(self) -> dict[str, int]:
        """Return how many samples came to what; what did not occur is left out."""
        found = {d.name.lower(): int(np.sum(self.rows.outcomes == d.code)) for d in Drawn}
        return {name: count for name, count in found.items() if count}

    @property
    def block(self) -> int:
        """Samples that were drawn together: see :mod:`contfric.ensembles.drawing`."""
        return len(self.distributions) + 2

    @cached_property
    def _whole(self) -> NDArray[np.bool_]:
        return np.asarray(self.rows.outcomes == Drawn.COMPLETE.code)

    @cached_property
    def _labels(self) -> list[tuple[str, ...]]:
        """The events of each sample, in the order of the parameter."""
        parts = by_sample(self.rows.event_sample, len(self))
        return [tuple(self.rows.event_label[part].tolist()) for part in parts]

    @cached_property
    def events(self) -> tuple[EnsembleEvent, ...]:
        """Every event that occurs, the most frequent first."""
        values: dict[str, FloatArray] = {}
        places = by_sample(self.rows.event_sample, len(self))
        for number, (labels, part) in enumerate(zip(self._labels, places, strict=True)):
            seen: dict[str, int] = {}
            for label, value in zip(labels, self.rows.event_value[part].tolist(), strict=True):
                again = seen[label] = seen.get(label, 0) + 1
                name = label if again == 1 else f"{label} ({again})"
                values.setdefault(name, np.full(len(self), np.nan))[number] = value
        found = [self._event(label, at) for label, at in values.items()]
        return tuple(sorted(found, key=lambda event: (-event.count, event.label)))

    def _event(self, label: str, at: FloatArray) -> EnsembleEvent:
        there = np.isfinite(at)
        found = share_of(there, self._whole, self.block)
        interval = found.share, found.low, found.high
        return EnsembleEvent(
            label, at, int(there.sum()), *interval, tuple(self.distributions), self.seed
        )

    def event(self, label: str) -> EnsembleEvent:
        """Return an event by its label, such as ``"SN 1a"``.

        Raises
        ------
        ParameterError
            If it does not occur.
        """
        known = {event.label: event for event in self.events}
        if label not in known:
            raise ParameterError(
                f"no event {shown(label)} in the ensemble{did_you_mean(label, known)}"
            )
        return known[label]

    @cached_property
    def classes(self) -> tuple[DiagramClass, ...]:
        """The whole diagrams by their lists of events, the most frequent first."""
        members: dict[tuple[str, ...], list[int]] = {}
        for number in np.flatnonzero(self._whole).tolist():
            members.setdefault(self._labels[number], []).append(number)
        found = []
        for events, numbers in members.items():
            inside = np.zeros(len(self), dtype=bool)
            inside[numbers] = True
            share = share_of(inside, self._whole, self.block)
            found.append(
                DiagramClass(events, np.array(numbers), share.share, share.low, share.high)
            )
        return tuple(sorted(found, key=lambda c: (-len(c.samples), c.events)))

    def bands(self, quantiles: Sequence[float] = QUANTILES) -> tuple[Band, ...]:
        """Return quantiles of the row along the parameter, by name of branch, stable and unstable apart.

        Raises
        ------
        ParameterError
            If a quantile is no share.
        """
        shares = np.atleast_1d(np.asarray(quantiles, dtype=np.float64))
        if not np.all((shares >= 0.0) & (shares <= 1.0)):
            raise ParameterError(f"quantiles are numbers from 0 to 1, got {shown(quantiles)}")
        rows, found = self.rows, []
        for name in np.unique(rows.orbit_name).tolist():
            own = rows.orbit_name == name
            for code, text in _STABLE.items():
                chosen = np.flatnonzero(own & (rows.orbit_stable == code))
                if len(chosen):
                    found.append(self._band(name, text, chosen, shares))
        return tuple(found)

    def _band(self, name: str, stable: str, chosen: NDArray[np.int64], shares: FloatArray) -> Band:
        rows, count = self.rows, len(self.values)
        chosen = chosen[np.argsort(rows.orbit_index[chosen], kind="stable")]
        quantiles = np.full((len(shares), count), np.nan)
        orbits, samples = np.zeros(count, np.int64), np.zeros(count, np.int64)
        for k, part in enumerate(by_sample(rows.orbit_index[chosen], count)):
            at = chosen[part]
            if len(at):
                measured = rows.orbit_row[at]
                finite = measured[np.isfinite(measured)]
                quantiles[:, k] = np.quantile(finite, shares) if len(finite) else np.nan
                orbits[k], samples[k] = len(at), len(np.unique(rows.orbit_sample[at]))
        return Band(name, stable, quantiles, orbits, samples)

    def to_dataframe(self, table: Table = "events") -> pd.DataFrame:
        """Return a table (needs pandas).

        Parameters
        ----------
        table : str
            "samples": parameters and what became of each; "events": place of each event in each sample;
            "bands": quantiles; "classes": lists of events with their shares.

        Raises
        ------
        ParameterError
            If there is no such table.
        """
        need_pandas()
        from contfric.ensembles.tables import frame_of

        if table not in _TABLES:
            raise ParameterError(
                f"the tables of an ensemble are {', '.join(_TABLES)}; got {shown(table)}"
            )
        return frame_of(self, table)

    def to_xarray(self) -> xr.Dataset:
        """Return samples, locations of events and bands as a dataset (needs xarray)."""
        need_xarray()
        from contfric.ensembles.tables import dataset_of

        return dataset_of(self)

    def plot(self, ax: Axes | None = None, *, bridges: bool = False) -> Axes:
        """Draw the bands, each name in its colour, medians of stable orbits solid; and where events are."""
        from contfric.plot.ensemble import plot_ensemble

        return plot_ensemble(self, ax=ax, bridges=bridges)

    def __repr__(self) -> str:
        found = ", ".join(f"{count} {name}" for name, count in self.counts().items())
        varied = ", ".join(self.distributions)
        return (
            f"<Ensemble of {self.model.name}: {len(self)} diagrams in {self.parameter}, random {varied}; "
            f"{found}; {number_and(len(self.classes), 'class', 'classes')}>"
        )
