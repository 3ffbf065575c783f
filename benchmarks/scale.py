"""Write docs/benchmarks-scale.md: segments, a million points, and each monitor on and off."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import scale_memory
import scale_monitors
import scale_segments
from origin import origin

TEMPLATE = """# Cost at scale

Written by `make bench` (`benchmarks/scale.py`, which took {took:.0f} s): {origin}.

## Segments

Orbit 1a has three segments. Run through twice, four times, .. it is an orbit of 6, 12, .. segments and
as many unknowns; the engine solves it as any other. All operations are warm, in one process, medians of
{rounds} rounds in turns. A point of a branch is one of {points} over a short range without events, all
that starting and ending a branch costs included.

![Time against segments](images/scale_segments.png)

{segments}

{segments_verdict} {segments_shares}

The other three are asked for orbit by orbit, never along a branch: the multipliers of a single orbit come
from a QR factorisation of each joint in numpy; the signature is read off segment by segment.

## A million points

A branch 1a in fine steps, continued and written by one fresh process, read by another. Peaks are those of
the resident memory that the operating system reports, in units of 10^6 bytes. Python, numpy, numba with LLVM,
and the loaded kernels take their part before the first point.

{memory}

{memory_verdict}

## Each monitor, on and off

Warm, in one process, medians of {monitor_rounds} rounds in turns ({figure_rounds} for figures). What a
scene does not name is not computed. A unit is a point, or a figure (its modules loaded; the first one also
imports matplotlib, see [scenes](benchmarks-scenes.md)). Admissibility cannot be switched off: it is what
makes an orbit one. The time of a table includes waiting for the disk to accept it (fsync: 4 ms or more).

{monitors}

{monitors_savings}
"""


def main() -> None:
    """Measure, draw and write the page."""
    began = time.perf_counter()
    docs = Path(__file__).parents[1] / "docs"
    segments = scale_segments.run()
    scale_segments.draw(segments, docs / "images" / "scale_segments.png")
    with tempfile.TemporaryDirectory() as folder:
        memory = scale_memory.run(Path(folder))
    monitors = scale_monitors.run()
    page = docs / "benchmarks-scale.md"
    page.write_text(
        TEMPLATE.format(
            took=time.perf_counter() - began,
            origin=origin(),
            rounds=scale_segments.ROUNDS,
            points=2 * scale_segments.POINTS - 1,
            segments=scale_segments.table(segments),
            segments_verdict=scale_segments.verdict(segments),
            segments_shares=scale_segments.shares(segments),
            memory=scale_memory.table(memory),
            memory_verdict=scale_memory.verdict(memory),
            monitor_rounds=scale_monitors.ROUNDS,
            figure_rounds=scale_monitors.OF_FIGURES,
            monitors=scale_monitors.table(monitors),
            monitors_savings=scale_monitors.savings(monitors),
        ),
        encoding="utf-8",
    )
    print(page.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
