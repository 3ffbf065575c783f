"""``plane``: the curves of bifurcations in a plane of two parameters."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from contfric.base.yaml_schema import keys_of, positive, whole
from contfric.errors import did_you_mean, number_and
from contfric.study.tables import Table
from contfric.study.tasks.grids import pairs_of, ranges_text
from contfric.study.tasks.task import FigureKind, Found, Job, SeedsEntry, StudyCheck, Task

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from contfric.atlas.plane.plane import Plane
    from contfric.study.drawings import Drawing
    from contfric.study.read import Study

CURVES, SPECIAL, REGIONS = "curves.csv", "special.csv", "regions.csv"


class PlaneTask(Task):
    """Follow the curves of bifurcations in a plane of two parameters."""

    name = "plane"
    row_text = "points of curves, of codimension two, regions"
    of_orbit = True
    own = frozenset({"parameters", "range", "sections", "seeds"})
    figures: ClassVar = {"plane": FigureKind(9.6, 7.0, called="a plane")}

    parameters: list[str] = Field(
        min_length=2, max_length=2, description="the names of two parameters of the model"
    )
    range: dict[str, list[float]] = Field(
        description="a mapping of both parameters to two finite numbers [low, high]"
    )
    sections: dict[str, list[float]] | None = Field(
        None, description="a mapping of one or both parameters to lists of values"
    )
    kinds: list[str] | None = Field(
        None, min_length=1, description="a list with any of SN, BP, PD, CS, SS, AS, GS, T"
    )
    seeds: SeedsEntry | None = Field(None, description=keys_of(SeedsEntry))
    max_step: float | None = positive("largest step, as a share of the ranges", most=1.0)
    max_periods: int | None = whole("longest orbits whose curves count", most=16)
    max_curves: int | None = whole("most curves to compute")
    max_sections: int | None = whole("most sections, those of the study among them")

    def check(self, asked: StudyCheck) -> None:
        """Check ranges, sections and kinds."""
        from contfric.curves.ranges import box_of
        from contfric.events.bifurcation import Kind

        one, other = self.parameters
        ranges = asked.check_ranges(self.name, self.range)
        asked.attempt(("plane",), lambda: box_of(asked.model, (one, other), ranges))
        self._check_sections(asked, ranges)
        known = [kind.value for kind in Kind if kind is not Kind.NS]
        for kind in self.kinds or []:
            if kind not in known:
                text = f"no curves of '{kind}'{did_you_mean(kind, known)}"
                asked.fail(("plane", "kinds"), text)

    def _check_sections(self, asked: StudyCheck, ranges: dict[str, tuple[float, float]]) -> None:
        for name, values in (self.sections or {}).items():
            if name not in ranges:
                text = f"'{name}' is not one of the two parameters{did_you_mean(name, ranges)}"
                asked.fail(("plane", "sections"), text)
            low, high = ranges[name]
            for value in values:
                if not low <= value <= high:
                    text = f"the section {name} = {value:g} is outside of its range [{low:g}, {high:g}]"
                    asked.fail(("plane", "sections", name), text)

    def does(self, study: Study) -> str:
        """Return the curves in words."""
        where = ranges_text(self.range)
        kinds = "" if self.kinds is None else f" of {', '.join(self.kinds)}"
        return f"every curve{kinds} that can be reached, {where}, and what lives between them"

    def tables(self, study: Study) -> tuple[str, ...]:
        """Return its three tables."""
        return CURVES, SPECIAL, REGIONS

    def compute(self, job: Job) -> Plane:
        """Explore a plane; on Ctrl-C what was found so far, with ``complete`` False."""
        from contfric.atlas.plane.explore import explore_plane

        return explore_plane(
            job.found["orbit"],
            (self.parameters[0], self.parameters[1]),
            pairs_of(self.range),
            self.sections,
            progress=job.progress_of(self.name),
            **self.options(),
            **(self.seeds.argument() if self.seeds else {}),
        )

    def cut_short(self, found: Plane) -> bool:
        """Tell whether Ctrl-C ended it (a limit does not count)."""
        from contfric.events.bifurcation import EndReason

        return EndReason.INTERRUPTED.value in found.notes

    def table(self, file: str, study: Study, found: Plane) -> Table:
        """Return the points of curves, those of codimension two, or the regions."""
        tables = {CURVES: _curves, SPECIAL: _special, REGIONS: _regions}
        return tables[file](found)

    def draw(self, figure: Figure, drawing: Drawing, found: Found, title: str) -> None:
        """Draw the curves, over a map of Lyapunov exponents of the same plane."""
        from contfric.plot.appearance.save import title_axes
        from contfric.plot.lyapunov import plot_lyapunov_map
        from contfric.plot.plane import plot_plane

        plane, lmap, axes = found["plane"], found.get("lyapunov"), figure.add_subplot()
        if lmap is not None and tuple(lmap.axes) == plane.parameters:
            plot_lyapunov_map(lmap, ax=axes)
        named = plane.model.mapping(plane.vector)
        fixed = {name: v for name, v in named.items() if name not in plane.parameters}
        title_axes(axes, plane.model, fixed, title)
        plot_plane(plane, ax=axes, legend_below=True)

    def entry(self, found: Plane) -> dict[str, Any]:
        """Return the curves, points of codimension two and regions of a plane."""
        return {
            "parameters": list(found.parameters),
            "complete": found.complete,
            "curves": [
                {
                    "curve": number,
                    "label": curve.label,
                    "points": len(curve),
                    "twin_of": found.twins[number - 1] + 1,
                    "signatures": [name for _, name in curve.signatures],
                    "ends": [str(end) for end in curve.ends],
                }
                for number, curve in enumerate(found.curves, start=1)
            ],
            "special": [{"name": s.name, "params": s.params} for s in found.special],
            "regions": [
                {
                    "point": region.point,
                    "share": region.share,
                    "bounds": [k + 1 for k in region.bounds],
                    "families": [str(f) for f in region.families],
                }
                for region in found.regions
            ],
            "notes": list(found.notes),
        }

    @classmethod
    def lines(cls, entry: dict[str, Any]) -> Iterator[str]:
        """Yield how much was found; what it is stands in the tables."""
        curves = number_and(len(entry["curves"]), "curve")
        special = number_and(len(entry["special"]), "point")
        regions = number_and(len(entry["regions"]), "region")
        names = " x ".join(entry["parameters"])
        yield f"plane {names}: {curves}, {special} of codimension two, {regions}"
        yield from (f"note: {note}" for note in entry["notes"])


def _curves(plane: Plane) -> Table:
    names = plane.model.parameter_names
    rows = (
        (number, curve.label, kind.value, *values, bool(stable))
        for number, curve in enumerate(plane.curves, start=1)
        for kind, stable, *values in zip(
            curve.kinds, curve.stable, *(curve.params[n].tolist() for n in names), strict=True
        )
    )
    return Table(["curve", "label", "kind", *names, "stable"], rows)


def _special(plane: Plane) -> Table:
    names = plane.model.parameter_names
    rows = (
        (s.name, s.kind.name, s.orbit.name, *(s.params[n] for n in names), s.located)
        for s in plane.special
    )
    return Table(["name", "kind", "signature", *names, "located"], rows)


def _regions(plane: Plane) -> Table:
    """Return one row for each region: a point inside, what bounds it, what lives there."""
    rows = (
        (
            number,
            *region.point.values(),
            region.share,
            " ".join(sorted({plane.curves[k].label for k in region.bounds})),
            "; ".join(map(str, region.families)),
            region.sampled,
            "; ".join(map(str, region.disputed)),
        )
        for number, region in enumerate(plane.regions, start=1)
    )
    header = ["region", *plane.parameters, "share", "bounds", "families", "sampled", "disputed"]
    return Table(header, rows)
