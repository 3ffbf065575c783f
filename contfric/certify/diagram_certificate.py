"""What was proved of a diagram: plain data, on disk and back."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from contfric.base.files import replacing
from contfric.base.shown import Shown
from contfric.errors import ResultFileError, did_you_mean, path_of

_KIND, _FORMAT = "diagram", 1
#: What a file holds that the checker does not look at.
UNCHECKED = (
    "the summary, orbits with holds, tubes that are left out (not decided), "
    "and a tube from an open end to the event there"
)


#: The entry of a file that names the events which are proved and not in it.
LEFT_OUT = "events that are left out"


@dataclass(frozen=True)
class Gap:
    """Where a branch is not proved.

    Attributes
    ----------
    start, stop : the parameter at its ends
    length : in arclength
    why : the reason
    """

    start: float
    stop: float
    length: float
    why: str

    def __str__(self) -> str:
        return f"from {self.start:.12g} to {self.stop:.12g}: {self.why}"


@dataclass(frozen=True)
class BranchSummary:
    """What was proved of a branch.

    Attributes
    ----------
    number : as in the tables of the diagram, from 1
    name : its signature
    length : its arclength
    covered : arclength on which it is proved to be one curve of admissible orbits
    regular : arclength on which it has neither a fold nor a multiplier -1 in addition
    boxes : number of boxes of its tube
    gaps : where it is not proved, and why
    complete : whether it is one curve from end to end, with no event but the proved ones in its tube
    events : labels of these
    open : where another event may be
    points, points_proved : number of its printed orbits, and of those that are proved with their stability
    """

    number: int
    name: str
    length: float
    covered: float
    regular: float
    boxes: int
    gaps: tuple[Gap, ...]
    complete: bool = False
    events: tuple[str, ...] = ()
    open: tuple[str, ...] = ()
    points: int = 0
    points_proved: int = 0


@dataclass(frozen=True)
class EventSummary:
    """What was proved of an event.

    Attributes
    ----------
    label, kind : as the event has them
    branches : numbers of the branches that meet there, from 1
    printed : the parameter that was printed
    ball : decimals that contain the parameter, such as ``0.25 +/- 1e-40``; empty if none are known
    radius : of the ball; None if it is not known
    why : what is not proved; empty if all is
    checkable : whether the file has a certificate of it, which ``contfric verify`` checks
    unchecked : if it has none, why
    """

    label: str
    kind: str
    branches: tuple[int, ...]
    printed: float
    ball: str
    radius: float | None
    why: str
    checkable: bool = True
    unchecked: str = ""

    @property
    def proved(self) -> bool:
        """Whether all of it is proved."""
        return not self.why

    @property
    def digits(self) -> int:
        """Digits of the parameter that are proved."""
        if self.radius is None or not self.proved:
            return 0
        size = abs(self.printed) or 1.0
        return int(-math.log10(max(self.radius, 1e-300) / size))

    @property
    def text(self) -> str:
        """The radius of the proved ball, or ``undecided`` with the reason: a cell of a table."""
        return f"{self.radius:.1e}" if self.proved else self.why


@dataclass(frozen=True, repr=False)
class DiagramCertificate(Shown):
    """What was proved of a diagram.

    Attributes
    ----------
    model, parameter, range : of the diagram
    branches : tuple of BranchSummary
        The computed ones; mirror images are not counted.
    events : tuple of EventSummary
        Each event once, in the order of the parameter.
    seconds : float
        How long it took.
    ended : str
        What ended the run before all was tried (a time limit, an interrupt); empty if nothing did.
    checkable : tuple of dict
        Certificates of events, printed orbits and tubes as plain data, which ``contfric verify`` checks.
    same : tuple of float
        Values of the parameter of printed orbits that are not checkable: in all digits they are those of
        another branch, which meets theirs at an event.
    """

    model: str
    parameter: str
    range: tuple[float, float]
    branches: tuple[BranchSummary, ...]
    events: tuple[EventSummary, ...]
    seconds: float
    ended: str = ""
    checkable: tuple[dict[str, Any], ...] = ()
    same: tuple[float, ...] = ()

    @property
    def covered(self) -> float:
        """Share of the arclength on which the branches are proved."""
        return self._share([b.covered for b in self.branches])

    @property
    def regular(self) -> float:
        """Share of the arclength on which they have neither a fold nor a multiplier -1 in addition."""
        return self._share([b.regular for b in self.branches])

    def _share(self, parts: list[float]) -> float:
        whole = sum(b.length for b in self.branches)
        return sum(parts) / whole if whole else 0.0

    @property
    def undecided(self) -> tuple[str, ...]:
        """What is not proved, a line each, the longest gaps first."""
        events = [f"{e.label}: {e.why}" for e in self.events if not e.proved]
        gaps = [(b, gap) for b in self.branches for gap in b.gaps]
        gaps.sort(key=lambda pair: -pair[1].length)
        lines = [f"branch {b.number} ({b.name}), {self.parameter} {gap}" for b, gap in gaps]
        other = [f"branch {b.number} ({b.name}), {text}" for b in self.branches for text in b.open]
        return (*events, *lines, *other)

    @property
    def unchecked(self) -> tuple[str, ...]:
        """Labels of the events that are proved and that ``contfric verify`` does not check."""
        return tuple(e.label for e in self._unchecked)

    @property
    def left_out(self) -> tuple[str, ...]:
        """What is proved and has no certificate in the file, with the parameter and the reason."""
        events = (
            f"{e.label} at {self.parameter} = {e.printed:.12g}: {e.unchecked}"
            for e in self._unchecked
        )
        why = "the checker does not tell it from one of another branch"
        orbits = (f"an orbit at {self.parameter} = {value:.12g}: {why}" for value in self.same)
        return (*events, *orbits)

    @property
    def _unchecked(self) -> list[EventSummary]:
        return [e for e in self.events if e.proved and not e.checkable]

    def save(self, path: Any) -> None:
        """Write it as a JSON file; :func:`load_diagram_certificate` reads it.

        ``contfric verify`` checks what is ``checkable`` in it: events, orbits and tubes.

        Raises
        ------
        ResultFileError
            If the file cannot be written.
        """
        summary = asdict(self)
        checkable = summary.pop("checkable")
        data = {"certificate": _KIND, "format": _FORMAT, "checkable": checkable}
        data |= {"summary": summary, "unchecked": UNCHECKED, LEFT_OUT: self.left_out}
        text = json.dumps(data)
        with replacing(path_of("a certificate file", path)) as temporary:
            temporary.write_text(text + "\n", encoding="utf-8")

    def __repr__(self) -> str:
        proved = sum(e.proved for e in self.events)
        return (
            f"<DiagramCertificate of {self.model}: {proved} of {len(self.events)} events and "
            f"{self.covered:.1%} of the branches proved>"
        )

    def __str__(self) -> str:
        """Say what is proved, and the ten most important things that are not."""
        good = [e for e in self.events if e.proved]
        events = f"{len(good)} of {len(self.events)} events proved"
        if good:
            events += f", to {min(e.digits for e in good)} digits or more"
        boxes = sum(b.boxes for b in self.branches)
        lines = [
            f"{self.model}, {self.parameter} in [{self.range[0]:g}, {self.range[1]:g}]: "
            f"{len(self.branches)} branches, {boxes} boxes, {self.seconds:.3g} s",
            f"  {_percent(self.covered)} of the arclength proved, "
            f"{_percent(self.regular)} without a fold or a multiplier on the unit circle",
            f"  {sum(b.complete for b in self.branches)} of {len(self.branches)} branches proved from "
            "end to end, with all of their events",
            f"  {sum(b.points_proved for b in self.branches)} of {sum(b.points for b in self.branches)} "
            "printed orbits proved, with their stability",
            f"  {events}",
            *(f"  {self.ended}" for _ in [0] if self.ended),
        ]
        left = self.undecided
        lines += [f"  undecided: {text}" for text in left[:_SHOWN]]
        if len(left) > _SHOWN:
            lines.append(f"  and {len(left) - _SHOWN} more")
        reasons = dict.fromkeys(e.unchecked for e in self._unchecked)
        for why in reasons:
            alike = [e for e in self._unchecked if e.unchecked == why]
            named = "; ".join(f"{e.label} at {self.parameter} = {e.printed:.9g}" for e in alike)
            lines.append(f"  proved, and not in the file for a checker: {named}: {why}")
        return "\n".join(lines)


#: Lines on what is undecided in the summary.
_SHOWN = 10


def _percent(share: float) -> str:
    """Return a share as a text that is never rounded up to all.

    Examples
    --------
    >>> _percent(0.99999), _percent(1.0), _percent(0.5)
    ('99.99 %', '100 %', '50.00 %')
    """
    return "100 %" if share == 1.0 else f"{math.floor(share * 1e4) / 100:.2f} %"


def merged(gaps: list[Gap]) -> tuple[Gap, ...]:
    """Return gaps with those in one that touch each other and have the same reason."""
    found: list[Gap] = []
    for gap in gaps:
        last = found[-1] if found else None
        if last is not None and last.stop == gap.start and last.why == gap.why:
            found[-1] = Gap(last.start, gap.stop, last.length + gap.length, gap.why)
        else:
            found.append(gap)
    return tuple(found)


def load_diagram_certificate(path: Any) -> DiagramCertificate:
    """Read what :meth:`DiagramCertificate.save` wrote.

    Raises
    ------
    ResultFileError
        If the file cannot be read, or holds no certificate of a diagram.
    """
    from pydantic import TypeAdapter  # slow to load

    file: Path = path_of("a certificate file", path)
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
        if data["certificate"] != _KIND or data["format"] != _FORMAT:
            raise ValueError(f"it is no certificate of a diagram of format {_FORMAT}")
        _see_known(data, ("certificate", "format", "checkable", "summary", "unchecked", LEFT_OUT))
        summary = data["summary"]
        _see_known(summary, _names(DiagramCertificate) - {"checkable"})
        for branch in summary["branches"]:
            _see_known(branch, _names(BranchSummary))
            for gap in branch["gaps"]:
                _see_known(gap, _names(Gap))
        for event in summary["events"]:
            _see_known(event, _names(EventSummary))
        found = summary | {"checkable": data["checkable"]}
        return TypeAdapter(DiagramCertificate).validate_python(found)
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise ResultFileError(f"cannot read {file}: {error}; give a certificate.json") from error


def _names(kind: type) -> set[str]:
    return {field.name for field in fields(kind)}


def _see_known(entries: Iterable[str], known: Iterable[str]) -> None:
    """Raise if there is an entry that nobody reads: pydantic ignores it."""
    for name in entries:
        if name not in set(known):
            raise ValueError(f"there is no entry '{name}'{did_you_mean(name, sorted(known))}")
