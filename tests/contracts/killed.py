"""Runs that are killed at random moments and started again, until one comes to its end.

    python killed.py FOLDER ROUNDS SEED run STUDY

It is a process of its own, which compiles everything once and forks: each run is a process that can be
killed, and begins at once. What a run that nobody disturbs writes goes to FOLDER/whole, the other one's to
FOLDER/out. It prints, as JSON, the exit codes and how large the checkpoint was when each run began.
"""

from __future__ import annotations

import json
import os
import random
import signal
import sys
import time
from pathlib import Path

from contfric.cli import main
from contfric.study import checkpoint


def forked(command: list[str], out: Path) -> int:
    """Start a command in a process of its own, with its output in a folder."""
    out.mkdir(exist_ok=True)
    process = os.fork()
    if process == 0:
        for stream, name in ((1, "stdout"), (2, "stderr")):
            os.dup2(os.open(out / name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), stream)
        code = main([*command, "--out", str(out / "run")] if command[0] == "run" else command)
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    return process


def finish(process: int) -> int:
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def ended(results: Path) -> bool:
    """Tell whether a run was killed after its end: its results are whole, and nothing is left to do."""
    return (results / "run.json").exists() and not (results / "checkpoint").exists()


def killed_runs(folder: Path, rounds: int, seed: int, command: list[str]) -> dict[str, list[int]]:
    """Kill runs at random moments of what a whole run takes; the last one is let be."""
    main([*command, "--out", str(folder / "first")] if command[0] == "run" else command)
    start = time.perf_counter()
    codes = [finish(forked(command, folder / "whole"))]
    took = time.perf_counter() - start
    rng, sizes = random.Random(seed), []
    kept = folder / "out" / "run" if command[0] == "run" else folder / "checkpoints"
    for k in range(rounds + 1):
        files = [p for p in kept.glob("*") if command[0] != "run" or p.name == "checkpoint"]
        sizes.append(sum(p.stat().st_size for p in files))
        process = forked(command, folder / "out")
        if k < rounds:
            time.sleep(took * rng.uniform(0.05, 0.6))
            os.kill(process, (signal.SIGKILL, signal.SIGTERM)[k % 2])
        code = finish(process)
        codes.append(0 if command[0] == "run" and ended(kept) else code)
        if codes[-1] == 0:
            break
    return {"codes": codes, "sizes": sizes}


if __name__ == "__main__":
    place, number, start, *arguments = sys.argv[1:]
    checkpoint.user_cache = lambda: Path(place)  # the kernels stay where they are
    output = os.dup(1)
    os.dup2(2, 1)
    report = killed_runs(Path(place), int(number), int(start), arguments)
    os.write(output, json.dumps(report).encode())
