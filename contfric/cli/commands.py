"""The commands; each returns its exit code. What is heavy is imported where it is used."""

from __future__ import annotations

import argparse
import csv
import json
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from contfric.cli.exits import Exit
from contfric.errors import ParameterError, ResultFileError, number_and

if TYPE_CHECKING:
    from contfric.models import Model, ModelSource
    from contfric.study import StudyResult

Command: TypeAlias = Callable[[argparse.Namespace], int]


def say(text: str) -> None:
    """Print a message for the user, apart from the data."""
    print(f"contfric: {text}", file=sys.stderr)


# ---------------------------------------------------------------------------------- studies


def run(options: argparse.Namespace) -> int:
    """``contfric run STUDY``."""
    from contfric.cli.progress import ProgressLine
    from contfric.study import read_study, run_study
    from contfric.study.result import RunStatus

    with ProgressLine(options.quiet) as progress:
        study = read_study(options.study)
        if study.drawings:
            from contfric.plot.appearance.undocumented import load_undocumented

            load_undocumented()
        result = run_study(study, options.out, force=options.force, progress=progress)
    if options.json:
        print(json.dumps(result.info, indent=2))
    elif not options.quiet and result.files:
        _print_summary(result)
    if result.status is not RunStatus.INTERRUPTED:
        return Exit.DONE
    say(_interrupted_text(result))
    return Exit.INTERRUPTED


def _print_summary(result: StudyResult) -> None:
    from contfric.cli.summary import findings, headline

    print(*headline(result.info), *findings(result.info), "", sep="\n")
    print(f"written to {result.out}: {', '.join(path.name for path in result.files)}")


def _interrupted_text(result: StudyResult) -> str:
    on = "; the same command goes on from there" if result.goes_on else ""
    if not result.files:
        return f"interrupted before an orbit was found: there is nothing to save{on}"
    found = "the first orbit"
    if result.diagram:
        found = number_and(len(result.diagram.branches), "branch", "branches")
    elif result.orbit is None:
        found = "the finished part"
    return f"interrupted: what was found until then ({found}) is saved in {result.out}{on}"


def explain(options: argparse.Namespace) -> int:
    """``contfric explain STUDY``."""
    from contfric.study import make_plan, read_study

    print(make_plan(read_study(options.study)))
    return Exit.DONE


def info(options: argparse.Namespace) -> int:
    """``contfric info DIR``."""
    from contfric.cli.summary import findings, headline, work
    from contfric.study.plan import RECORD
    from contfric.study.tasks.diagram_record import proposals

    path: Path = options.folder / RECORD
    try:
        record: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        lines = [*headline(record), *findings(record), *proposals(record), *work(record)]
    except OSError as error:
        raise ResultFileError(
            f"{options.folder} is not the folder of a run: cannot read {path} ({error.strerror})"
        ) from None
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise ResultFileError(
            f"{path} is damaged ({type(error).__name__}: {error}): run the study again"
        ) from None
    print("\n".join(lines))
    _check_files(options.folder, record["files"])
    return Exit.DONE


def _check_files(folder: Path, names: list[str]) -> None:
    """Read the restart data, so that a damaged file is found today and not when it is needed."""
    from contfric.results import load

    for name in names:
        if not (folder / name).is_file():
            raise ResultFileError(f"{folder / name} is missing: run the study again")
        if name.endswith(".npz"):
            load(folder / name)


# ------------------------------------------------------------------------ graph, simulation


def check(options: argparse.Namespace) -> int:
    """``contfric check MODEL``: what would make its results wrong; warnings do not fail it."""
    from contfric.models.check import check_model

    given = [name for name in (options.model, options.also_model) if name is not None]
    if len(given) != 1:
        raise ParameterError("check takes one model: contfric check MODEL, or --model MODEL")
    (options.model,) = given
    params = _parameters(options.params, options.model)
    report = check_model(options.model, params or None)
    print(json.dumps(report.to_dict(), indent=2) if options.json else report)
    return Exit.DONE if report.ok else Exit.BAD_INPUT


def graph(options: argparse.Namespace) -> int:
    """``contfric graph``."""
    from contfric.models import load_model

    model = load_model(options.model)
    if options.out is not None:
        _draw_graph(model, options.out)
        say(f"written to {options.out}")
        return Exit.DONE
    for (source, surface), target in model.transitions.items():
        print(f"{source} -> {target} ({surface})")
    return Exit.DONE


def _draw_graph(model: Model, path: Path) -> None:
    formats = (".png", ".svg", ".pdf")
    if path.suffix.lower() not in formats:
        raise ResultFileError(
            f"cannot draw to '{path}': its ending is not one of {', '.join(formats)}"
        )
    from contfric.plot.appearance.save import new_figure, save_figure
    from contfric.plot.graph import plot_transition_graph
    from contfric.results import replacing

    figure = new_figure(7.0, 5.0)
    plot_transition_graph(model, ax=figure.add_subplot())
    with replacing(path) as temporary:
        save_figure(figure, temporary)


def simulate(options: argparse.Namespace) -> int:
    """``contfric simulate``: mode that ended and surface met at each event."""
    from contfric.models import load_model
    from contfric.simulation import simulate as simulation

    model = load_model(options.model)
    params = _parameters(options.params, options.model)
    state = None if options.state is None else _state(options.state)
    found = simulation.simulate(
        model,
        params,
        state=state,
        time=options.time,
        periods=options.periods,
        events=options.events,
        domain=options.domain,
    )
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(["cycle", "phase", *model.states, "mode", "surface"])
    columns = (found.cycles.tolist(), found.times.tolist(), *found.states.T.tolist())
    for row, pair in zip(zip(*columns, strict=True), found.itinerary, strict=True):
        writer.writerow([*row, *pair])
    sys.stdout.flush()
    say(f"{len(found)} events: {found.end.value}")
    if options.find:
        _say_what_settles(model, params, state, options.time)
    return Exit.DONE


def _say_what_settles(
    model: Model, params: dict[str, float], state: list[float] | None, time: float
) -> None:
    from contfric.cli.progress import ProgressLine
    from contfric.orbit.finding.find import find_orbit

    with ProgressLine() as progress:
        orbit = find_orbit(model, params, state=state, time=time, progress=progress)
    multipliers = ", ".join(f"{value:.6g}" for value in orbit.multipliers)
    say(f"converges to {orbit.name} over {number_and(orbit.periods, 'period')}: {orbit.signature}")
    say(f"x from {orbit.x_min:.12g} to {orbit.x_max:.12g}, multipliers {multipliers}")


def census(options: argparse.Namespace) -> int:
    """``contfric census``: the orbits as a table, then what was tried and what bounds it."""
    from contfric.censuses.census import census as take
    from contfric.cli.progress import ProgressLine
    from contfric.study.checkpoint import checkpoint_of

    if options.old_model is not None:
        warnings.warn(
            "'contfric census MODEL' is now 'contfric census --model MODEL'",
            DeprecationWarning,
            stacklevel=2,
        )
        options.model = options.old_model
    params = _parameters(options.params, options.model)
    asked = (options.periods, options.stops, options.finer, options.seed)
    checkpoint = checkpoint_of(("census", options.model, sorted(map(str, params.items())), *asked))
    with ProgressLine(options.quiet) as progress, checkpoint.kept():
        if checkpoint.earlier:
            progress(f"goes on: {checkpoint.earlier} results of the census before are kept")
        found = take(
            options.model,
            params,
            periods=options.periods,
            stops=options.stops,
            finer=options.finer,
            seed=options.seed,
            progress=progress,
        )
    print(json.dumps(found.to_dict(), indent=2) if options.json else found)
    if not found.interrupted:
        checkpoint.done()
        return Exit.DONE
    on = "; the same command goes on from there" if checkpoint.leave() else ""
    say(f"interrupted: what was found until then is listed{on}")
    return Exit.INTERRUPTED


def _parameters(texts: list[str], model: ModelSource) -> dict[str, Any]:
    """Return what is assigned by -p: numbers, and names of other parameters (``-p S0=S``: a tie)."""
    from contfric.models import load_model

    found: dict[str, Any] = {}
    for text in texts:
        name, sign, value = (part.strip() for part in text.partition("="))
        if not sign or not name:
            raise ParameterError(f"-p takes NAME=VALUE, such as -p Omega=0.5; got '{text}'")
        if value in load_model(model).parameter_names:
            found[name] = {"tie": value}
        else:
            found[name] = _number(value, f"parameter '{name}'")
    return found


def _state(text: str) -> list[float]:
    return [_number(part, "--state: each part") for part in text.split(",")]


def _number(text: str, what: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ParameterError(f"{what} must be a number, got '{text}'") from None
