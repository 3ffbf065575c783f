"""The orbit of the start: saved, solved for, or what a simulation converges to."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from contfric.base.yaml_schema import SchemaPart, keys_of, whole
from contfric.errors import number_and
from contfric.study.tables import Table, points
from contfric.study.tasks.task import STATE, FigureKind, Found, Job, Skipped, StudyCheck, Task
from contfric.study.wanted import COLUMNS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from contfric.orbit.orbit import Orbit
    from contfric.study.drawings import Drawing
    from contfric.study.read import Study

POINTS = "points.csv"


class Simulated(SchemaPart):
    """Start from a simulation: the orbit that the trajectory converges to."""

    state: list[float] | None = Field(None, description=STATE)
    time: float = Field(0.0, description="a finite number: the initial time")
    periods: int | None = whole("the period wanted", most=64)
    longest: int | None = whole("periods to simulate at most", least=200)


class Start(Task):
    """Where the first orbit comes from: exactly one of the three."""

    name = "orbit"
    figures: ClassVar = {"orbit": FigureKind(9.0, 6.2), "transitions": FigureKind(7.0, 5.0)}

    simulate: Simulated | None = Field(None, description=keys_of(Simulated))
    signature: str | None = Field(
        None, min_length=1, description="the name of a signature, or the path of its file"
    )
    orbit: str | None = Field(None, min_length=1, description="the path of a saved orbit (.npz)")
    at: dict[str, float] | None = Field(
        None,
        description="a mapping of contacts that never slip to the position at which they rest, such as "
        "{brake: 0.12}",
    )

    def check(self, asked: StudyCheck) -> None:
        """Refuse two origins, and a state of another model."""
        given = [k for k in ("simulate", "signature", "orbit") if getattr(self, k) is not None]
        if len(given) != 1:
            got = " and ".join(given) or "none of them"
            asked.fail(("start",), f"'start' has one of simulate, signature, orbit; got {got}")
        state = self.simulate.state if self.simulate else None
        asked.check_state(("start", "simulate", "state"), state)
        if self.at is not None:
            from contfric.orbit.positions.kept import checked_positions

            at = self.at
            asked.attempt(("start", "at"), lambda: checked_positions(asked.model, at))

    def does(self, study: Study) -> str:
        """Return the origin of the orbit, in words."""
        if study.orbit is not None:
            return f"read from {self.orbit}"
        if study.signature is not None:
            return f"solve for the signature {study.signature.name or study.signature}"
        text = "simulate until the trajectory repeats itself, identify its signature, solve for it"
        if self.simulate and self.simulate.state is not None:
            text += f"; from the state {self.simulate.state}"
        if self.simulate and self.simulate.periods is not None:
            text += f"; {number_and(self.simulate.periods, 'period')}"
        if self.at:
            text += "; at rest " + ", ".join(f"{name} at {x:g}" for name, x in self.at.items())
        return text

    def tables(self, study: Study) -> tuple[str, ...]:
        """Return its table, if no branch has its points."""
        return () if study.task else (POINTS,)

    def rows_text(self, study: Study) -> str:
        """Return what a row is."""
        return "" if study.task else points_text(study)

    def skipped(self, study: Study) -> Iterator[Skipped]:
        """Yield the simulation, where the study has another start."""
        if self.simulate is None:
            origin = "a saved orbit" if study.orbit is not None else "a signature"
            yield Skipped("simulation to a steady state", f"the start is {origin}")

    def compute(self, job: Job) -> Orbit:
        """Return the orbit."""
        orbit = self._orbit(job)
        job.say(f"orbit: {orbit.name} over {number_and(orbit.periods, 'period')}")
        return orbit

    def _orbit(self, job: Job) -> Orbit:
        study, heard = job.study, job.progress_of("orbit")
        if study.orbit is not None:
            return study.orbit.resting_at(self.at or {})
        if study.signature is not None:
            from contfric.orbit.solve import solve_orbit

            heard(f"solving for {study.signature.name or study.signature}")
            found = solve_orbit(study.model, study.signature, study.params, progress=heard)
            return found.resting_at(self.at or {})
        from contfric.orbit.finding.find import find_orbit

        assert self.simulate is not None
        heard("simulating")
        how = self.simulate.model_dump()
        return find_orbit(study.model, study.params, progress=heard, at=self.at, **how)

    def cut_short(self, found: Orbit) -> bool:
        """Ctrl-C leaves no orbit."""
        return False

    def table(self, file: str, study: Study, found: Orbit) -> Table:
        """Return the one point."""
        return points(study, (found,))

    def draw(self, figure: Figure, drawing: Drawing, found: Found, title: str) -> None:
        """Draw the orbit, or the graph of transitions with its cycle; neither has a title."""
        orbit: Orbit = found["orbit"]
        if drawing.kind == "orbit":
            from contfric.plot.orbits.orbit import panels_height, plot_orbit_panels

            figure.set_size_inches(self.figures["orbit"].width, panels_height(orbit))
            plot_orbit_panels(orbit, fig=figure)
        else:
            from contfric.plot.graph import plot_transition_graph

            plot_transition_graph(orbit.model, ax=figure.add_subplot(), signature=orbit.signature)

    def entries(self, found: Orbit) -> dict[str, Any]:
        """Return what the orbit is."""
        start = {
            "signature": found.name,
            "segments": str(found.signature),
            "periods": found.periods,
            "params": found.params,
            "residual": found.residual,
        }
        return {
            "start": {
                **start,
                **({"rests": list(map(str, found.resting))} if found.resting else {}),
            }
        }

    @classmethod
    def summary(cls, record: dict[str, Any]) -> Iterator[str]:
        """Yield the orbit of a record."""
        start = record.get("start")
        if start is not None:
            values = ", ".join(f"{name} = {value:g}" for name, value in start["params"].items())
            yield f"start     {start['signature']} over {number_and(start['periods'], 'period')}, {values}"
            yield f"          {start['segments']}"
            yield from (f"          {rests}" for rests in start.get("rests", ()))


def points_text(study: Study) -> str:
    """Return what a row of the table of points is."""
    wanted = [columns for want, columns in COLUMNS.items() if study.wants(want)]
    return f"one row a point: {', '.join(['parameters', *wanted, *study.content.quantities])}"
