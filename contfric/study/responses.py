"""Steps of a run that ask for simulated responses: what they compute, check, write and say."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from contfric.errors import ContfricError
from contfric.models.definition import Model
from contfric.study.schema_response import SweepTask

if TYPE_CHECKING:
    from contfric.response.sweep import Sweep
    from contfric.study.read import Study
    from contfric.study.schema import StudyFile
    from contfric.yaml_lines import LocatedYaml

Response: TypeAlias = "Sweep"
Say = Callable[[str], None]

#: The keys of a study that ask for a response, in the order of the steps.
KEYS = ("sweep",)


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
    low, high, count = task.values
    direction = "both" if task.direction is None else task.direction.value
    return (
        f"simulations at {count:g} values of {task.parameter} from {low:g} to {high:g}, {direction}"
    )


def row_text(key: str) -> str:
    """Return what a row of its table is."""
    return {"sweep": "one row a point of the sweep"}[key]


def check(located: LocatedYaml, content: StudyFile, model: Model) -> None:
    """Check what can be wrong with the tasks; what is fails with its line."""
    for key, task in tasks_of(content).items():
        if task.state is not None and len(task.state) != len(model.states):
            located.fail(
                (key, "state"),
                f"a state of '{model.name}' is {len(model.states)} numbers "
                f"({', '.join(model.states)}), got {len(task.state)}",
            )
        _check_section(located, key, task, model)
        _check_sweep(located, key, task, model)


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

    found = _sweep(study, task, tiles, say)
    if found.complete:
        shutil.rmtree(tiles, ignore_errors=True)
    return found


def _sweep(study: Study, task: SweepTask, tiles: Path, say: Say) -> Sweep:
    from contfric.response.sweeping import sweep

    low, high, count = task.values
    others = {name: value for name, value in study.params.items() if name != task.parameter}
    values = np.linspace(low, high, int(count))
    return sweep(
        study.model, task.parameter, values, others, folder=tiles, progress=say, **task.options()
    )


def header_of(found: Response) -> list[str]:
    """Return the columns of the table of a response."""
    return ["direction", found.parameter, "outcome", "period", "mode", "t", *found.model.states]


def rows_of(found: Response) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of the table of a response."""
    from contfric.response.outcome import Outcome

    outcomes = [outcome.name.lower() for outcome in Outcome]
    modes = [mode.name for mode in found.model.modes]
    for name, run in found.runs.items():
        for i, value in enumerate(run.index.tolist()):
            yield (
                name,
                found.values[value].item(),
                outcomes[run.outcomes[value]],
                run.periods[value].item(),
                modes[run.modes[i]],
                run.times[i].item(),
                *run.states[i].tolist(),
            )


def entries_of(found: Response) -> dict[str, Any]:
    """Return what the record of a run says of a response."""
    return {
        "parameter": found.parameter,
        "values": [float(found.values[0]), float(found.values[-1]), len(found.values)],
        "params": found.params,
        "section": found.section,
        "complete": found.complete,
        "points": {name: len(run) for name, run in found.runs.items()},
        "outcomes": {outcome.name.lower(): count for outcome, count in found.counts().items()},
    }
