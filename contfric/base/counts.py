"""Counts of what was computed: a run reports them, and tests hold that nothing else was."""

from __future__ import annotations

from dataclasses import dataclass

from contfric.base.tally import tally


@dataclass(frozen=True)
class Counts:
    """How often each kind of work was done."""

    newton_solves: int = 0
    multiplier_evaluations: int = 0
    admissibility_checks: int = 0
    simulated_events: int = 0

    def __sub__(self, other: Counts) -> Counts:
        return Counts(
            self.newton_solves - other.newton_solves,
            self.multiplier_evaluations - other.multiplier_evaluations,
            self.admissibility_checks - other.admissibility_checks,
            self.simulated_events - other.simulated_events,
        )


def counts() -> Counts:
    """Return the counts of this process so far; subtract two of them to get those of a run."""
    return Counts(*(int(value) for value in tally()))
