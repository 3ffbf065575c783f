"""The tables of an ensemble, for pandas and xarray."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from contfric.ensembles.ensemble import QUANTILES
from contfric.ensembles.rows import Drawn
from contfric.quantities.registry import name_of

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from contfric.ensembles.ensemble import Ensemble


def frame_of(found: Ensemble, table: str) -> pd.DataFrame:
    """Return one of the tables of an ensemble."""
    import pandas as pd

    make: dict[str, Callable[[Ensemble], Any]] = {
        "samples": samples_table,
        "events": events_table,
        "bands": _bands,
        "classes": _classes,
    }
    return pd.DataFrame(make[table](found))


def _varied(found: Ensemble) -> dict[str, Any]:
    return dict(zip(found.distributions, found.samples.T, strict=True))


def samples_table(found: Ensemble) -> dict[str, Any]:
    """Return one row for each sample: parameters, outcome, how much was found."""
    rows = found.rows
    counts = {"branches": rows.branches, "loose_ends": rows.loose, "reason": rows.reasons}
    return {**_varied(found), "outcome": Drawn.words()[rows.outcomes], **counts}


def events_table(found: Ensemble) -> dict[str, Any]:
    """Return one row for each event of each sample."""
    at = found.rows.event_sample
    columns = {name: values[at] for name, values in _varied(found).items()}
    places = {"event": found.rows.event_label, found.parameter: found.rows.event_value}
    return {"sample": at, **columns, **places}


def _bands(found: Ensemble) -> list[dict[str, Any]]:
    return [
        {
            "branch": band.name,
            "stable": band.stable,
            found.parameter: value,
            **{f"q{q:g}": x for q, x in zip(QUANTILES, band.quantiles[:, k], strict=True)},
            "orbits": band.orbits[k],
            "samples": band.samples[k],
        }
        for band in found.bands()
        for k, value in enumerate(found.values.tolist())
        if band.orbits[k]
    ]


def _classes(found: Ensemble) -> list[dict[str, Any]]:
    return [
        {
            "events": ", ".join(c.events),
            "samples": len(c.samples),
            "share": c.share,
            "low": c.low,
            "high": c.high,
        }
        for c in found.classes
    ]


def dataset_of(found: Ensemble) -> xr.Dataset:
    """Return an ensemble as a dataset: samples, locations of events, bands."""
    import xarray as xr

    bands, events = found.bands(), found.events
    band = [f"{b.name}, {b.stable}" for b in bands]
    size = (len(QUANTILES), len(found.values))
    quantiles = np.array([b.quantiles for b in bands]).reshape(-1, *size)
    orbits = np.array([b.orbits for b in bands]).reshape(-1, size[1])
    places = np.array([event.values for event in events]).reshape(-1, len(found))
    varied = {name: ("sample", values) for name, values in _varied(found).items()}
    outcomes = Drawn.words()[found.rows.outcomes]
    return xr.Dataset(
        {
            **varied,
            "outcome": ("sample", outcomes),
            "place": (("event", "sample"), places),
            "quantiles": (("band", "quantile", found.parameter), quantiles),
            "orbits": (("band", found.parameter), orbits),
        },
        coords={
            "event": [event.label for event in events],
            "band": band,
            "quantile": list(QUANTILES),
            found.parameter: found.values,
        },
        attrs={
            "model": found.model.name,
            "row": name_of(found.row),
            "seed": found.seed,
            **found.params,
        },
    )
