"""Maps on executors: the same bits everywhere, and nothing lost when workers, pools or runs are killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import fields
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.chaos import tiles
from contfric.chaos.tiles import TileRows
from contfric.remember.folder import kept_in

GRID = {"Omega": np.linspace(0.3, 0.5, 12), "S": np.linspace(0.02, 0.3, 8)}
OPTIONS: dict[str, Any] = {"periods": 200, "tile": 2, "starts": 2}
TILES = 24
#: Long enough (a second or more for all tiles) that what happens midway does happen midway.
LONG: dict[str, Any] = {"periods": 6000, "tolerance": 0.0}


def compute(**options: Any) -> cf.LyapunovMap:
    return cf.lyapunov_map("coulomb", GRID, {"S0": 0.4}, **{**OPTIONS, **options})


@pytest.fixture(scope="module")
def expected() -> bytes:
    """The bits of one process, tile after tile."""
    with ThreadPoolExecutor(1) as one:
        return bits(compute(executor=one))


@pytest.fixture(scope="module")
def expected_long() -> bytes:
    with ThreadPoolExecutor(1) as one:
        return bits(compute(executor=one, **LONG))


def bits(lmap: cf.LyapunovMap) -> bytes:
    return b"".join(getattr(lmap.rows, f.name).tobytes() for f in fields(TileRows))


def spawned(count: int) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(count, mp_context=get_context("spawn"))


class After:
    """Does something once, when some tiles are finished; keeps what was said."""

    def __init__(self, finished: int, action: Callable[[], None]) -> None:
        self.left, self.action = finished, action
        self.said: list[str] = []

    def __call__(self, text: str) -> None:
        self.said.append(text)
        if " tiles" in text and text.startswith("Lyapunov map"):
            self.left -= 1
            if self.left == 0:
                self.action()


# ----------------------------------------------------------------------------------- the same bits


def test_threads(expected: bytes) -> None:
    assert bits(compute()) == expected
    with ThreadPoolExecutor(3) as pool:
        assert bits(compute(executor=pool)) == expected


def test_processes(expected: bytes) -> None:
    with spawned(2) as pool:
        assert bits(compute(executor=pool)) == expected


def test_loky(expected: bytes) -> None:
    loky = pytest.importorskip("loky")
    with loky.ProcessPoolExecutor(2) as pool:
        assert bits(compute(executor=pool)) == expected


# ----------------------------------------------------------------------------------- killed workers


def test_a_worker_killed_midway_loses_nothing(expected_long: bytes) -> None:
    with spawned(2) as pool:
        worker = pool.submit(os.getpid).result()
        progress = After(3, lambda: os.kill(worker, signal.SIGKILL))
        found = compute(executor=pool, progress=progress, **LONG)
    assert found.complete
    assert bits(found) == expected_long
    lost = [text for text in progress.said if "lost by the executor" in text]
    assert len(lost) == 1
    assert "BrokenProcessPool" in lost[0]


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # those of other packages
def test_dask_cluster_with_a_worker_killed_midway(expected_long: bytes) -> None:
    """A real cluster of worker processes on this machine; dask gives the lost tiles to the others."""
    distributed = pytest.importorskip("distributed")
    cluster = distributed.LocalCluster(
        n_workers=3, threads_per_worker=1, processes=True, dashboard_address=None
    )
    with cluster, distributed.Client(cluster) as client:
        workers = client.run(os.getpid)
        assert len(set(workers.values())) == 3
        assert os.getpid() not in workers.values()
        unfinished: list[int] = []

        def kill() -> None:
            """Kill a worker that has tiles to compute."""
            for address, tiles_there in client.processing().items():
                if tiles_there and not unfinished:
                    unfinished.append(len(tiles_there))
                    victims.append(workers[address])
                    os.kill(workers[address], signal.SIGKILL)

        victims: list[int] = []
        found = compute(executor=client.get_executor(), progress=After(3, kill), **LONG)
        assert unfinished
    assert not is_alive(victims[0])
    assert found.complete
    assert bits(found) == expected_long


def is_alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


class Unreliable(Executor):
    """Fails in each way that executors do, in turn; runs every fourth task."""

    def __init__(self) -> None:
        self.count = 0

    def submit(self, function: Any, /, *arguments: Any, **named: Any) -> Future[Any]:
        self.count += 1
        future: Future[Any] = Future()
        if self.count % 4 == 1:
            raise RuntimeError("cannot schedule new futures")
        if self.count % 4 == 2:
            future.set_exception(ConnectionError("worker lost"))
        elif self.count % 4 == 3:
            future.cancel()
            future.set_running_or_notify_cancel()
        else:
            future.set_result(function(*arguments, **named))
        return future


def test_an_unreliable_executor_loses_nothing(expected: bytes) -> None:
    said: list[str] = []
    assert bits(compute(executor=Unreliable(), progress=said.append)) == expected
    assert "18 tiles were lost" in next(text for text in said if "lost" in text)


def test_an_executor_that_is_shut_down_loses_nothing(expected: bytes) -> None:
    pool = ThreadPoolExecutor(1)
    pool.shutdown()
    assert bits(compute(executor=pool)) == expected


def test_a_real_error_is_not_hidden(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: Any) -> None:
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(tiles, "follow", broken)
    with ThreadPoolExecutor(1) as pool, pytest.raises(ZeroDivisionError, match="a bug"):
        compute(executor=pool)


# ----------------------------------------------------------------------------------- interrupted


def test_interrupt_keeps_finished_tiles(expected: bytes, tmp_path: Path) -> None:
    def interrupt() -> None:
        raise KeyboardInterrupt

    progress = After(5, interrupt)
    found = compute(folder=tmp_path / "tiles", progress=progress)
    assert not found.complete
    missing = found.counts()[cf.Motion.MISSING]
    assert missing == 2 * (12 * 8 - 5 * 4)
    assert np.isnan(found.values).sum() == missing // 2
    assert progress.said[-1] == f"interrupted: 5 of {TILES} tiles are finished"
    kept = (tmp_path / "tiles" / "parts").read_bytes()

    said: list[str] = []
    again = compute(folder=tmp_path / "tiles", progress=said.append)
    assert said[0] == f"5 of {TILES} tiles are in {tmp_path / 'tiles'} already"
    assert len(said) == 1 + TILES - 5
    assert (tmp_path / "tiles" / "parts").read_bytes().startswith(kept)
    assert bits(again) == expected


SCRIPT = """
import sys, numpy as np, contfric as cf
grid = {"Omega": np.linspace(0.3, 0.5, 12), "S": np.linspace(0.02, 0.3, 8)}
found = cf.lyapunov_map(
    "coulomb", grid, {"S0": 0.4}, periods=6000, tile=2, starts=2, tolerance=0.0,
    folder=sys.argv[1], progress=lambda text: print(text, flush=True),
)
print("complete", found.complete)
"""


def run_until_tiles(folder: Path, end: signal.Signals) -> tuple[int, str]:
    """Run a map in a process of its own, and send it a signal when three tiles are there."""
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, str(folder)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdout is not None
    before = [process.stdout.readline() for _ in range(3)]
    assert before[-1].startswith(f"Lyapunov map: 3 of {TILES}"), before
    process.send_signal(end)
    out, _ = process.communicate()
    return process.returncode, "".join([*before, out])


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGINT], ids=["killed", "Ctrl-C"])
def test_a_run_that_is_ended_goes_on(
    end: signal.Signals, tmp_path: Path, expected_long: bytes
) -> None:
    code, out = run_until_tiles(tmp_path, end)
    if end == signal.SIGKILL:
        assert code == -signal.SIGKILL  # half of a tile may be there, which nothing reads
    else:
        assert code == 0, out
        assert "complete False" in out
    said: list[str] = []
    found = compute(folder=tmp_path, progress=said.append, **LONG)
    finished = int(said[0].split()[0])
    assert said[0] == f"{finished} of {TILES} tiles are in {tmp_path} already"
    # a tile is told when it is kept: one that was not told may be there, and what was told is
    assert 0 <= finished - out.count(" tiles, ") <= 1 and finished < TILES
    assert found.complete
    assert bits(found) == expected_long


# ----------------------------------------------------------------------------------- the folder


def test_damaged_tiles_are_computed_again(expected: bytes, tmp_path: Path) -> None:
    compute(folder=tmp_path)
    file = tmp_path / "parts"
    content = bytearray(file.read_bytes())
    records, at = [], content.index(b"\n") + 1
    while at < len(content):
        records.append(at)
        at += 24 + int.from_bytes(content[at : at + 8], "little")
    assert len(records) == TILES
    for k, record in enumerate(records[:5]):  # in the digest, the key and what the tile has
        content[record + (10, 30, 50, 100, 200)[k]] ^= 1
    for damaged, left in ((content, TILES - 5), (content[:-1], TILES - 6)):
        file.write_bytes(damaged)
        said: list[str] = []
        assert bits(compute(folder=tmp_path, progress=said.append)) == expected
        assert said[0].startswith(f"{left} of {TILES} tiles")


@pytest.mark.parametrize(
    "options",
    [
        {"periods": 201},
        {"starts": 3},
        {"time": 1.0},
        {"tile": 3},
        {"starts": 1, "state": [1.0, 0.0]},
    ],
)
def test_a_folder_may_have_tiles_of_several_maps(tmp_path: Path, options: dict[str, Any]) -> None:
    maps = [{"periods": 200}, options]
    wanted = [bits(compute(**how)) for how in maps]
    said: list[str] = []
    for _ in range(2):
        assert [
            bits(compute(folder=tmp_path, progress=said.append, **how)) for how in maps
        ] == wanted
    assert sum("already" in text for text in said) == 2 and "already" in said[-1]


def test_folder_errors(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(cf.ResultFileError, match="file stands where a folder"):
        compute(folder=tmp_path / "file")
    (tmp_path / "parts").write_bytes(b"")  # as one that was killed at once has left it
    assert compute(folder=tmp_path).complete
    (tmp_path / "parts").write_text("something else")
    with pytest.raises(cf.ResultFileError, match="parts of another version"):
        compute(folder=tmp_path)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are not forked here")
def test_a_process_that_was_forked_does_not_keep_the_folder_locked(tmp_path: Path) -> None:
    """Workers outlive a process that is killed; its next run goes on all the same."""
    there, begun = os.pipe()
    with kept_in(tmp_path):
        child = os.fork()
        if child == 0:
            os.write(begun, b".")
            time.sleep(60.0)
            os._exit(0)
    assert os.read(there, 1) == b"."
    try:
        with kept_in(tmp_path):
            pass
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
