"""A local dask cluster of two workers: tiles of every kind have the bits of one process."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import Executor
from dataclasses import fields
from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.chaos.tiles import TileRows
from contfric.ensembles.rows import Rows

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("default")]  # those of other packages

PARAMS = {"Omega": 0.541, "S": 0.32, "S0": 0.4}


@pytest.fixture(scope="module")
def executor() -> Iterator[Executor]:
    """The executor of a cluster of worker processes on this machine."""
    distributed = pytest.importorskip("distributed")
    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    )
    with cluster, distributed.Client(cluster) as client:
        workers = client.run(os.getpid)
        assert len(set(workers.values())) == 2 and os.getpid() not in workers.values()
        yield client.get_executor()


def test_a_sweep(executor: Executor) -> None:
    def compute(**options: Any) -> bytes:
        values = np.linspace(0.48, 0.55, 30)
        found = cf.sweep("coulomb", "Omega", values, {"S": 0.32, "S0": 0.4}, **options)
        assert found.complete
        arrays = [array for run in found.runs.values() for array in vars(run).values()]
        return b"".join(np.asarray(array).tobytes() for array in arrays)

    assert compute(executor=executor) == compute()


def test_basins(executor: Executor) -> None:
    def compute(**options: Any) -> bytes:
        starts = {"x": np.linspace(-2.0, 2.0, 24), "v": np.linspace(-1.5, 1.5, 20)}
        found = cf.basins("coulomb", starts, PARAMS, tile=60, **options)
        assert found.complete
        return found.labels.tobytes() + found.motions.tobytes()

    assert compute(executor=executor) == compute()


def test_a_release_map(executor: Executor) -> None:
    def compute(**options: Any) -> bytes:
        found = cf.release_map("coulomb", PARAMS, count=80, tile=20, **options)
        return found.images.tobytes() + found.branch.tobytes()

    assert compute(executor=executor) == compute()


def test_an_ensemble(executor: Executor) -> None:
    said: list[str] = []

    def compute(**options: Any) -> bytes:
        box, fixed = {"S": (0.30, 0.34)}, {"Omega": 0.5, "S0": 0.4}
        more: dict[str, Any] = {"samples": 12, "tile": 2, "progress": said.append}
        found = cf.ensemble("coulomb", "Omega", (0.48, 0.55), box, fixed, **more, **options)
        assert found.complete
        return b"".join(getattr(found.rows, field.name).tobytes() for field in fields(Rows))

    assert compute(executor=executor) == compute()
    assert not any("lost" in text for text in said)


def test_a_lyapunov_map(executor: Executor) -> None:
    def compute(**options: Any) -> bytes:
        grid = {"Omega": np.linspace(0.3, 0.5, 8), "S": np.linspace(0.02, 0.3, 6)}
        found = cf.lyapunov_map("coulomb", grid, {"S0": 0.4}, periods=200, tile=3, **options)
        assert found.complete
        return b"".join(getattr(found.rows, field.name).tobytes() for field in fields(TileRows))

    assert compute(executor=executor) == compute()
