"""The ensemble of a study: its distributions, and its processes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from contfric.errors import ContfricError, ParameterError, checked_range, did_you_mean
from contfric.models.definition import Model
from contfric.study.schema_response import EnsembleTask

if TYPE_CHECKING:
    from contfric.ensembles.ensemble import Ensemble
    from contfric.study.read import Study
    from contfric.yaml_lines import LocatedYaml


def check(
    located: LocatedYaml, task: EnsembleTask, model: Model, params: Mapping[str, Any]
) -> None:
    """Check an ensemble; what is wrong fails with its line."""
    from contfric.ensembles.drawing import checked_distributions
    from contfric.quantities.registry import number_quantity

    def attempt(key: str, step: Callable[[], object]) -> None:
        try:
            step()
        except ContfricError as error:
            located.fail(("ensemble", key), str(error))

    attempt("parameter", lambda: model.index_of(task.parameter))
    attempt("range", lambda: checked_range(task.parameter, task.range))
    attempt(
        "distributions",
        lambda: checked_distributions(model, _distributions(task), task.parameter),
    )
    if task.row is not None:
        attempt("row", lambda: number_quantity(task.row, model, "an ensemble"))
    low, high = task.range
    start = params.get(task.parameter)
    if isinstance(start, int | float) and not low <= start <= high:
        located.fail(
            ("ensemble", "range"),
            f"an orbit to begin with is looked for at {task.parameter} = {start:g} of 'params', which is "
            f"not between {low:g} and {high:g}",
        )


def _distributions(task: EnsembleTask) -> dict[str, Any]:
    """Return the distributions of a task.

    Raises
    ------
    ParameterError
        If scipy.stats has no such distribution, or it does not take these arguments.
    """
    from scipy import stats

    found: dict[str, Any] = {}
    for name, given in task.distributions.items():
        if isinstance(given, list):
            found[name] = tuple(given)
            continue
        known = [n for n in dir(stats) if isinstance(getattr(stats, n), stats.rv_continuous)]
        kind = next(iter(given), None)
        if len(given) != 1 or kind not in known:
            raise ParameterError(
                f"the distribution of '{name}' is [low, high], or one of scipy.stats with its arguments, "
                f"such as {{norm: [0.32, 0.01]}}; got {given}{did_you_mean(kind, known)}"
            )
        try:
            found[name] = getattr(stats, kind)(*given[kind])
        except (TypeError, ValueError) as error:
            raise ParameterError(f"the distribution of '{name}', {kind}: {error}") from None
    return found


def compute(study: Study, task: EnsembleTask, tiles: Path, say: Callable[[str], None]) -> Ensemble:
    """Compute an ensemble, in processes if the task has several; a killed run goes on from its tiles."""
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    from contfric.ensembles.compute import ensemble

    low, high = task.range
    distributions = _distributions(task)
    params = {name: value for name, value in study.params.items() if name not in distributions}
    if not low <= params[task.parameter] <= high:  # the model's default: nothing was asked for
        params.pop(task.parameter)
    workers = task.workers or 1
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn")) if workers > 1 else None
    with pool or nullcontext():
        return ensemble(
            study.model,
            task.parameter,
            (low, high),
            distributions,
            params,
            executor=pool,
            folder=tiles,
            progress=say,
            **task.options(),
        )
