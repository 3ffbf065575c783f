"""What a proof can come to."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Verdict(str, Enum):
    """What became of a statement."""

    PROVED = "proved"
    REFUTED = "refuted"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Finding:
    """The verdict on one statement, with the reason where it is not proved.

    Examples
    --------
    >>> str(Finding(Verdict.UNDECIDED, "the slide touches rest"))
    'undecided (the slide touches rest)'
    """

    verdict: Verdict
    why: str = ""

    def __str__(self) -> str:
        return f"{self.verdict.value}{f' ({self.why})' if self.why else ''}"

    @property
    def proved(self) -> bool:
        """Whether the statement is proved."""
        return self.verdict is Verdict.PROVED


def all_of(findings: list[Finding]) -> Finding:
    """Return the finding on all statements together: the first refuted, else the first undecided.

    Examples
    --------
    >>> all_of([Finding(Verdict.PROVED), Finding(Verdict.REFUTED, "no")]).why
    'no'
    """
    for verdict in (Verdict.REFUTED, Verdict.UNDECIDED):
        for finding in findings:
            if finding.verdict is verdict:
                return finding
    return Finding(Verdict.PROVED)
