"""Sweeps, basins and ensembles have the same bits for any number of workers, whatever the model is."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import fields
from multiprocessing import get_context
from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.ensembles.rows import Rows

#: Built in, a file with modes, a structure: the parameter that varies, its range, another one.
MODELS = {
    "coulomb": ("Omega", (0.48, 0.55), "S", (0.3, 0.34)),
    "jenkins": ("W", (0.85, 0.95), "muN", (0.75, 0.85)),
    "blade-damper": ("W", (0.68, 0.72), "F", (0.14, 0.16)),
}


@pytest.fixture(scope="module")
def pool() -> Iterator[Executor]:
    """Three workers: of one and of two, tests of Lyapunov maps and of ensembles tell."""
    with ProcessPoolExecutor(3, mp_context=get_context("spawn")) as three:
        yield three


def of_sweep(model: str, **options: Any) -> bytes:
    parameter, bounds, _, _ = MODELS[model]
    found = cf.sweep(model, parameter, np.linspace(*bounds, 40), transient=20, **options)
    assert found.complete
    arrays = [array for run in found.runs.values() for array in vars(run).values()]
    return b"".join(np.asarray(array).tobytes() for array in arrays)


def of_basins(model: str, **options: Any) -> bytes:
    first, second = cf.load_model(model).states[:2]
    starts = {first: np.linspace(-1.0, 1.0, 5), second: np.linspace(-0.7, 0.8, 4)}
    found = cf.basins(model, starts, tile=6, **options)
    assert found.complete
    joints = b"".join(orbit.joints.tobytes() for orbit in found.orbits)
    return found.labels.tobytes() + found.motions.tobytes() + joints


def of_ensemble(model: str, **options: Any) -> bytes:
    parameter, bounds, other, box = MODELS[model]
    more: dict[str, Any] = {"samples": 3, "tile": 1, "max_branches": 2}
    found = cf.ensemble(model, parameter, bounds, {other: box}, **more, **options)
    assert found.complete
    return b"".join(getattr(found.rows, field.name).tobytes() for field in fields(Rows))


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("of", [of_sweep, of_basins, of_ensemble])
def test_the_same_bits(of: Any, model: str, pool: Executor) -> None:
    assert of(model, executor=pool) == of(model)
