"""Simulations of contfric against the reference of fifty digits, event by event.

    python benchmarks/stress/sequences.py --count 100000 --seed 1 --workers 2 --out sequences.json

What is drawn stands in :mod:`sequence_cases`, what is compared in :mod:`sequence_compare`, and what errors
are measured against in :mod:`sequence_errors`. With ``--out`` each chunk that is done is kept next to the
report, and a run that was interrupted goes on from there.
"""

from __future__ import annotations

from chunks import Chunked
from report import Tally
from sequence_cases import draw
from sequence_compare import MAX_EVENTS, PERIODS, compare

#: Trajectories in one chunk of work: some ten seconds, after which the file is written.
CHUNK = 250
#: Cases with the largest ratio of error to bound that a report names.
WORST = 5
WHAT = (
    f"Simulations over {PERIODS} periods of the excitation (at most {MAX_EVENTS} events) against fifty "
    "digits: mode, surface, time and position of each event."
)


def chunk(seed: int, first: int, last: int) -> Tally:
    """Compare the cases of a range of indices."""
    tally = Tally()
    for index in range(first, last):
        tally.index = index
        compare(draw(seed, index), tally)
    keep_worst(tally.worst)
    return tally


def keep_worst(worst: dict[str, float]) -> None:
    """Keep the worst few cases only."""
    names = sorted((n for n in worst if "case" in n), key=lambda n: worst[n], reverse=True)
    for name in names[WORST:]:
        del worst[name]


RUN = Chunked("sequences", WHAT, chunk, CHUNK, keep_worst)

if __name__ == "__main__":
    RUN.command_line(count=3000, seed=1)
