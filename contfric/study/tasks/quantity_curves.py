"""``hold`` and ``extremum``: orbits on which a quantity has one value, or is extreme, as parameters vary."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from contfric.base.yaml_schema import positive, whole
from contfric.study.tasks.grids import pairs_of, ranges_text
from contfric.study.tasks.response import Response
from contfric.study.tasks.task import FigureKind, Job, StudyCheck

if TYPE_CHECKING:
    from contfric.curves.of_quantities.curve import QuantityCurve
    from contfric.study.read import Study


class QuantityCurveTask(Response):
    """A curve of orbits in two or more parameters, by a quantity."""

    of_orbit = True
    row_text = "one row an orbit of the curve"
    own = frozenset({"quantity", "value", "parameters", "range"})

    quantity: str = Field(
        min_length=1, description="a quantity, by its name or as an expression, such as x_max"
    )
    parameters: list[str] = Field(min_length=2, description="the names of parameters of the model")
    range: dict[str, list[float]] = Field(
        description="a mapping of these parameters to two finite numbers [low, high]"
    )
    max_step: float | None = positive("largest step, as a share of the ranges", most=1.0)
    max_points: int | None = whole("most points of each side", least=2)

    def check(self, asked: StudyCheck) -> None:
        """Check the quantity, the parameters and their ranges."""
        from contfric.curves.ranges import ranges_of
        from contfric.quantities.registry import number_quantity

        asked.attempt(
            (self.name, "quantity"),
            lambda: number_quantity(self.quantity, asked.model, "a curve"),
        )
        ranges = asked.check_ranges(self.name, self.range)
        asked.attempt((self.name,), lambda: ranges_of(asked.model, tuple(self.parameters), ranges))

    def fixed(self, found: QuantityCurve) -> dict[str, float]:
        """Return the parameters that do not vary along the curve."""
        return {n: float(v[0]) for n, v in found.params.items() if n not in found.parameters}

    def cut_short(self, found: QuantityCurve) -> bool:
        """Tell whether Ctrl-C ended it."""
        from contfric.curves.special import CurveEndReason

        return any(end.reason is CurveEndReason.INTERRUPTED for end in found.ends)

    def entry(self, found: QuantityCurve) -> dict[str, Any]:
        """Return what is held, the number of orbits, and why the curve ends."""
        return {
            "label": found.label,
            "parameters": list(found.parameters),
            "points": len(found),
            "signature": found[0].name,
            "ends": [str(end) for end in found.ends],
        }

    @classmethod
    def lines(cls, entry: dict[str, Any]) -> Iterator[str]:
        """Yield the curve and its ends."""
        names = ", ".join(entry["parameters"])
        yield f"{entry['label']} in {names}: {entry['points']} orbits {entry['signature']}"
        yield from (f"end: {end}" for end in dict.fromkeys(entry["ends"]))


class HoldTask(QuantityCurveTask):
    """Orbits on which a quantity has one value."""

    name = "hold"
    figures: ClassVar = {"hold": FigureKind(7.0, 5.0)}

    parameters: list[str] = Field(
        min_length=2, max_length=2, description="the names of two parameters of the model"
    )
    value: float = Field(description="a finite number: what the quantity is held at")

    def does(self, study: Study) -> str:
        """Return the curve in words."""
        return f"orbits with {self.quantity} = {self.value:g}, {ranges_text(self.range)}"

    def compute(self, job: Job) -> QuantityCurve:
        """Follow the curve both ways."""
        from contfric.curves.of_quantities.trace import continue_quantity

        one, other = self.parameters
        start = job.found["orbit"], self.quantity, self.value
        return continue_quantity(
            *start, (one, other), pairs_of(self.range), progress=job.say, **self.options()
        )


class ExtremumTask(QuantityCurveTask):
    """Orbits at which a quantity is extreme in all parameters but the last."""

    name = "extremum"
    figures: ClassVar = {"extremum": FigureKind(7.0, 5.0)}

    def does(self, study: Study) -> str:
        """Return the curve in words."""
        extreme = ", ".join(self.parameters[:-1])
        return f"orbits at which {self.quantity} is extreme in {extreme}, {ranges_text(self.range)}"

    def compute(self, job: Job) -> QuantityCurve:
        """Follow the curve both ways."""
        from contfric.curves.of_quantities.extremum import continue_extremum

        start = job.found["orbit"], self.quantity, tuple(self.parameters)
        return continue_extremum(*start, pairs_of(self.range), progress=job.say, **self.options())
