"""The report of a check of a model."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from contfric.base.shown import Shown


class Topic(str, Enum):
    """What is verified; the text says it."""

    DERIVATIVES = "compiled values and derivatives against the formulas"
    SURFACES = "surfaces are regular: the gradient does not vanish on them"
    TRANSITIONS = "every crossing that solutions make has a next domain, which they can enter"
    REACHED = "every mode is entered from another one"
    RESETS = "a reset leads into a domain, and away from the surfaces that it is on there"
    CONTINUITY = "fields and observables do not jump inside of a mode"
    KINKS = "kinks of the fields lie on surfaces that their modes know"
    SLIDING = "sliding modes stay on their surfaces"
    SYMMETRY = "the symmetry holds for fields, surfaces and domains"
    UNDECLARED = "symmetries that are not declared"
    PERIOD = "the field repeats itself after the period"
    CONSTRAINTS = "the defaults obey the constraints"
    TWO_FOLDS = "places at which the fields of both sides are tangent to a surface (two-folds)"
    NAMES = "every parameter is used, and every state is driven"
    SCALES = "states are of sizes, and change in times, that are not far apart"


class Severity(str, Enum):
    """How bad a finding is: an error makes results wrong, a warning deserves a look, a note is of use."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


@dataclass(frozen=True)
class CheckFinding:
    """One finding: what is wrong, and what can be done."""

    topic: Topic
    severity: Severity
    message: str

    def __str__(self) -> str:
        return f"{self.severity.value}: {self.message}"


@dataclass(repr=False)
class ModelReport(Shown):
    """The outcome of :func:`contfric.check_model`.

    Attributes
    ----------
    model : name of the model
    counts : how many single comparisons were made for each topic; 0 where a topic does not apply
    findings : what is wrong, errors and warnings, and what is of use to know, notes
    closed : modes whose solution is a closed form, of a model that is declared by its equations
    integrated : modes whose solution is integrated, each with the reason

    Examples
    --------
    >>> import contfric as cf
    >>> cf.check_model("coulomb").ok
    True
    """

    model: str
    counts: dict[Topic, int] = field(default_factory=lambda: dict.fromkeys(Topic, 0))
    findings: list[CheckFinding] = field(default_factory=list)
    closed: tuple[str, ...] = ()
    integrated: dict[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        found = "ok" if self.ok else "wrong"
        return f"<ModelReport of {self.model}: {found}, {len(self.findings)} findings>"

    @property
    def ok(self) -> bool:
        """Whether there is no error; warnings do not count."""
        return not any(f.severity is Severity.ERROR for f in self.findings)

    def count(self, topic: Topic) -> None:
        """Note that one comparison was made."""
        self.counts[topic] += 1

    def error(self, topic: Topic, message: str) -> None:
        """Note an error, once."""
        self._note(CheckFinding(topic, Severity.ERROR, message))

    def warn(self, topic: Topic, message: str) -> None:
        """Note a warning, once."""
        self._note(CheckFinding(topic, Severity.WARNING, message))

    def note(self, topic: Topic, message: str) -> None:
        """Note what is no fault, once."""
        self._note(CheckFinding(topic, Severity.NOTE, message))

    def _note(self, finding: CheckFinding) -> None:
        if finding not in self.findings:
            self.findings.append(finding)

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return {
            "model": self.model,
            "ok": self.ok,
            "closed_form": list(self.closed),
            "integrated": self.integrated,
            "checks": {topic.name.lower(): count for topic, count in self.counts.items()},
            "findings": [
                {
                    "topic": f.topic.name.lower(),
                    "severity": f.severity.value,
                    "message": f.message,
                }
                for f in self.findings
            ],
        }

    def __str__(self) -> str:
        lines = [f"model {self.model}"]
        for topic, count in self.counts.items():
            own = [f for f in self.findings if f.topic is topic]
            bad = any(f.severity is Severity.ERROR for f in own)
            warned = any(f.severity is not Severity.NOTE for f in own)
            mark = "error" if bad else "warning" if warned else "ok" if count else "-"
            note = f" ({count} comparisons)" if count else " (does not apply)"
            lines.append(f"  {mark:7}  {topic.value}{note}")
            lines.extend(f"             {f}" for f in own)
        if self.closed:
            lines.append(f"  closed form: {', '.join(self.closed)}")
        lines.extend(f"  integrated: {mode} ({why})" for mode, why in self.integrated.items())
        lines.append("ok" if self.ok else "error: results of this model would be wrong")
        return "\n".join(lines)
