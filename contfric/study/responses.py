"""Steps of a run that need no orbit (responses, equilibria, ensembles): what they compute, check and say."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from contfric.errors import ContfricError
from contfric.models.definition import Model
from contfric.study import ensemble as study_ensemble
from contfric.study.schema_response import (
    BasinsTask,
    EnsembleTask,
    EquilibriaTask,
    PoincareTask,
    SweepTask,
)

if TYPE_CHECKING:
    from contfric.ensembles.ensemble import Ensemble
    from contfric.equilibria.explore import EquilibriumDiagram
    from contfric.response.basins import Basins
    from contfric.response.returns import Returns
    from contfric.response.sweep import Sweep
    from contfric.study.read import Study
    from contfric.study.schema import StudyFile
    from contfric.yaml_lines import LocatedYaml

Response: TypeAlias = "Sweep | Returns | Basins | EquilibriumDiagram | Ensemble"
Say = Callable[[str], None]

#: The keys of a study that ask for a response, in the order of the steps.
KEYS = ("sweep", "poincare", "basins", "equilibria", "ensemble")


@dataclass(frozen=True)
class ResponseFiles:
    """Names of the files of a response."""

    data: str
    table: str


FILES = {key: ResponseFiles(f"{key}.npz", f"{key}.csv") for key in KEYS}


def tasks_of(content: StudyFile) -> dict[str, Any]:
    """Return the tasks of a study by their keys."""
    found = {key: getattr(content, key) for key in KEYS}
    return {key: task for key, task in found.items() if task is not None}


def text_of(task: Any) -> str:
    """Return what a step does, in words."""
    if isinstance(task, PoincareTask):
        return f"points of one solution at {task.section if task.section is not None else 'stops'}"
    if isinstance(task, BasinsTask):
        sides = (f"{n} from {v[0]:g} to {v[1]:g} ({v[2]:g})" for n, v in task.grid.items())
        return f"what starts converge to, {' x '.join(sides)}"
    if isinstance(task, EquilibriaTask):
        low, high = task.range
        return f"equilibria, {task.parameter} from {low:g} to {high:g}, and their events"
    if isinstance(task, EnsembleTask):
        low, high = task.range
        varied = ", ".join(task.distributions)
        return f"diagrams of random {varied}, {task.parameter} from {low:g} to {high:g}"
    low, high, count = task.values
    direction = "both" if task.direction is None else task.direction.value
    return (
        f"simulations at {count:g} values of {task.parameter} from {low:g} to {high:g}, {direction}"
    )


def row_text(key: str) -> str:
    """Return what a row of its table is."""
    return {
        "sweep": "one row a point of the sweep",
        "poincare": "one row a point of the section",
        "basins": "one row a start of the basins",
        "equilibria": "one row a point or event of the equilibria",
        "ensemble": "one row an event of a sample",
    }[key]


def check(located: LocatedYaml, content: StudyFile, model: Model) -> None:
    """Check what can be wrong with the tasks; what is fails with its line."""
    for key, task in tasks_of(content).items():
        if isinstance(task, BasinsTask):
            _check_basins(located, task, model)
            continue
        if isinstance(task, EquilibriaTask):
            _check_equilibria(located, task, model)
            continue
        if isinstance(task, EnsembleTask):
            study_ensemble.check(located, task, model, content.params)
            continue
        if task.state is not None and len(task.state) != len(model.states):
            located.fail(
                (key, "state"),
                f"a state of '{model.name}' is {len(model.states)} numbers "
                f"({', '.join(model.states)}), got {len(task.state)}",
            )
        _check_section(located, key, task, model)
        if isinstance(task, SweepTask):
            _check_sweep(located, key, task, model)


def _check_basins(located: LocatedYaml, task: BasinsTask, model: Model) -> None:
    from contfric.response.basin_map import check_starts

    for name, values in task.grid.items():
        if name in model.states:
            check_axis(located, ("basins", "grid", name), name, values)
    try:
        check_starts(model, _axes(task), task.at)
    except ContfricError as error:
        located.fail(("basins",), str(error))


def _check_equilibria(located: LocatedYaml, task: EquilibriaTask, model: Model) -> None:
    from contfric.errors import checked_range

    try:
        model.index_of(task.parameter)
    except ContfricError as error:
        located.fail(("equilibria", "parameter"), str(error))
    try:
        checked_range(task.parameter, task.range)
    except ContfricError as error:
        located.fail(("equilibria", "range"), str(error))
    if not model.definition:
        located.fail(
            ("equilibria",),
            f"equilibria are found from formulas, and '{model.name}' is not declared by formulas",
        )


def _axes(task: BasinsTask) -> dict[str, Any]:
    return {
        name: np.linspace(values[0], values[1], int(values[2])) if len(values) == 3 else values
        for name, values in task.grid.items()
    }


def _check_section(located: LocatedYaml, key: str, task: Any, model: Model) -> None:
    from contfric.response.sections import section_of

    options = task.options()
    try:
        section_of(model, options.get("section", "stops"), options.get("sense", "either"))
    except ContfricError as error:
        located.fail((key, "section"), str(error))


def _check_sweep(located: LocatedYaml, key: str, task: SweepTask, model: Model) -> None:
    try:
        model.index_of(task.parameter)
    except ContfricError as error:
        located.fail((key, "parameter"), str(error))
    check_axis(located, (key, "values"), task.parameter, task.values)


def check_axis(
    located: LocatedYaml, address: tuple[str, ...], name: str, values: list[float]
) -> None:
    """Check the values [low, high, number] of a parameter or of a state."""
    fits = len(values) == 3 and values[0] < values[1] and values[2] >= 2
    if not fits or values[2] != int(values[2]):
        located.fail(
            address,
            f"the values of {name} are [low, high, number of values], with low < high and a whole "
            f"number of at least 2, got {values}",
        )


def compute(study: Study, key: str, task: Any, tiles: Path, say: Say) -> Response:
    """Compute a response; finished parts are kept, and a killed run goes on from them."""
    import shutil

    found: Response
    if isinstance(task, PoincareTask):
        from contfric.response.poincare import poincare

        return poincare(study.model, study.params, **task.options())
    if isinstance(task, EquilibriaTask):
        return _equilibria(study, task, say)
    if isinstance(task, EnsembleTask):
        found = study_ensemble.compute(study, task, tiles, say)
    elif isinstance(task, BasinsTask):
        found = _basins(study, task, tiles, say)
    else:
        found = _sweep(study, task, tiles, say)
    if found.complete:
        shutil.rmtree(tiles, ignore_errors=True)
    return found


def _equilibria(study: Study, task: EquilibriaTask, say: Say) -> EquilibriumDiagram:
    from contfric.equilibria.explore import explore_equilibria

    low, high = task.range
    return explore_equilibria(
        study.model,
        task.parameter,
        (low, high),
        study.params,
        progress=lambda text: say(f"equilibria: {text}"),
        **task.options(),
    )


def _sweep(study: Study, task: SweepTask, tiles: Path, say: Say) -> Sweep:
    from contfric.response.sweeping import sweep

    low, high, count = task.values
    others = {name: value for name, value in study.params.items() if name != task.parameter}
    values = np.linspace(low, high, int(count))
    return sweep(
        study.model, task.parameter, values, others, folder=tiles, progress=say, **task.options()
    )


def _basins(study: Study, task: BasinsTask, tiles: Path, say: Say) -> Basins:
    from contfric.response.basin_map import basins

    options: dict[str, Any] = {} if task.periods is None else {"periods": task.periods}
    return basins(
        study.model,
        _axes(task),
        study.params,
        task.at,
        folder=tiles,
        progress=say,
        **options,
    )
