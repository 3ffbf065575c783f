"""``equilibria``: where the model rests, over a range of a parameter, with its events."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

from contfric.base.shown import aligned
from contfric.base.yaml_schema import positive, whole
from contfric.errors import checked_range
from contfric.study.tables import Table
from contfric.study.tasks.response import Response
from contfric.study.tasks.task import AlongParameter, FigureKind, Job, StudyCheck, incomplete

if TYPE_CHECKING:
    from contfric.equilibria.events import EquilibriumEvent
    from contfric.equilibria.explore import EquilibriumDiagram
    from contfric.study.read import Study


class EquilibriaTask(Response, AlongParameter):
    """Equilibria over a range of a parameter, with their events."""

    name = "equilibria"
    row_text = "one row a point or event of the equilibria"
    figures: ClassVar = {"equilibria": FigureKind(8.4, 5.0)}

    values: int | None = whole("values of the parameter at which equilibria are looked for")
    starts: int | None = whole("starts of Newton's method in a mode")
    max_step: float | None = positive("largest step, as a share of the range", most=1.0)

    def check(self, asked: StudyCheck) -> None:
        """Check the parameter, its range, and that the model has formulas."""
        super().check(asked)
        asked.attempt((self.name, "range"), lambda: checked_range(self.parameter, self.range))
        if not asked.model.definition:
            text = f"equilibria are found from formulas, and '{asked.model.name}' is not declared by formulas"
            asked.fail((self.name,), text)

    def does(self, study: Study) -> str:
        """Return the range in words."""
        return f"equilibria, {self.span}, and their events"

    def compute(self, job: Job) -> EquilibriumDiagram:
        """Find and follow equilibria."""
        from contfric.equilibria.explore import explore_equilibria

        return explore_equilibria(
            job.study.model,
            self.parameter,
            self.bounds,
            job.study.params,
            progress=job.progress_of(self.name),
            **self.options(),
        )

    def table(self, file: str, study: Study, found: EquilibriumDiagram) -> Table:
        """Return the points of each branch, and then its events."""
        columns = ["branch", "event", found.parameter, "mode", *found.model.states]
        return Table([*columns, "stable", "admissible"], _rows(found))

    def entry(self, found: EquilibriumDiagram) -> dict[str, Any]:
        """Return branches and events."""
        return {
            "parameter": found.parameter,
            "range": list(found.bounds),
            "branches": [
                {
                    "modes": list(dict.fromkeys(branch.modes)),
                    "points": len(branch),
                    "from": float(branch.values.min()),
                    "to": float(branch.values.max()),
                    "ends": [end.value for end in branch.ends],
                }
                for branch in found.branches
            ],
            "sets": len(found.sets),
            "events": [_event_entry(event) for event in found.events],
            "complete": found.complete,
        }

    @classmethod
    def lines(cls, entry: dict[str, Any]) -> Iterator[str]:
        """Yield branches and events as tables."""
        low, high = entry["range"]
        name = entry["parameter"]
        yield f"equilibria for {name} from {low:g} to {high:g}"
        rows = [["branch", "modes", "points", name, "", "ends"]]
        for number, b in enumerate(entry["branches"]):
            span = [f"{b['from']:.8g}", f"{b['to']:.8g}"]
            modes, ends = ", ".join(b["modes"]), "; ".join(b["ends"])
            rows.append([str(number), modes, str(b["points"]), *span, ends])
        yield from aligned(rows)
        if entry["sets"]:
            yield f"{entry['sets']} whole sets of equilibria, which are not followed"
        if entry["events"]:
            events = [["event", name, "meaning"]]
            events += [[e["label"], f"{e['value']:.13g}", e["meaning"]] for e in entry["events"]]
            yield from aligned(events)
        yield from incomplete(entry, "the search was stopped before it was done")


def _rows(found: EquilibriumDiagram) -> Iterator[tuple[Any, ...]]:
    for number, branch in enumerate(found.branches):
        looks = zip(branch.stable.tolist(), branch.admissible.tolist(), strict=True)
        for k, look in enumerate(looks):
            place = number, "", branch.values[k].item(), branch.regions[k].mode
            yield *place, *branch.states[k].tolist(), *look
        for event in branch.events:
            at = event.equilibrium
            yield number, event.label, event.value, at.mode, *at.state.tolist(), "", ""


def _event_entry(event: EquilibriumEvent) -> dict[str, Any]:
    from contfric.equilibria.events import BoundaryPoint, HopfPoint

    entry: dict[str, Any] = {
        "label": event.label,
        "meaning": event.meaning,
        "value": event.value,
        "state": event.equilibrium.state.tolist(),
    }
    if isinstance(event, HopfPoint):
        entry |= {"frequency": event.frequency, "lyapunov": event.lyapunov}
    if isinstance(event, BoundaryPoint):
        entry |= {"unfolding": event.unfolding.name.lower(), "partner": event.partner}
    return entry
