"""Reading a study: every mistake is found before anything is computed, with its line."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from contfric.errors import (
    NotationError,
    ParameterError,
    ResultFileError,
    StudyError,
    did_you_mean,
)
from contfric.models import load_model
from contfric.models.definition import Model
from contfric.models.files import relative_model
from contfric.models.tied import tied
from contfric.orbit.orbit import Orbit
from contfric.quantities.registry import number_quantity, quantity_names
from contfric.signature import Signature, load_signature
from contfric.study import responses
from contfric.study.drawings import Drawing, drawings_of
from contfric.study.explain_error import fail_with
from contfric.study.library import SUFFIXES, study_path
from contfric.study.schema import ContinueTask, ExploreTask, Row, StudyFile, Want
from contfric.yaml_lines import Address, LocatedYaml, read_yaml


@dataclass(frozen=True, eq=False)
class Study:
    """A study that has been read and found valid.

    Attributes
    ----------
    path : Path
        Its file.
    content : StudyFile
        What the file says.
    model : Model
    params : dict
        All parameters of the start, defaults filled in.
    signature : Signature or None
        What to start from, if it is a signature.
    orbit : Orbit or None
        What to start from, if it is a saved orbit.
    drawings : tuple of Drawing
        The figures, each with its file.
    """

    path: Path
    content: StudyFile
    model: Model
    params: dict[str, float]
    signature: Signature | None
    orbit: Orbit | None
    drawings: tuple[Drawing, ...]

    @property
    def name(self) -> str:
        """Name of the file without its suffix."""
        return self.path.stem

    @property
    def title(self) -> str:
        """The title, or the name if there is none."""
        return self.content.title or self.name

    @property
    def task(self) -> ExploreTask | ContinueTask | None:
        """What is done with the first orbit."""
        return self.content.task

    def wants(self, quantity: Want) -> bool:
        """Return whether the study asks for a quantity."""
        return quantity in self.content.want

    def as_dict(self) -> dict[str, Any]:
        """Return what the file says, as plain data."""
        return self.content.as_dict()


def read_study(source: str | Path) -> Study:
    """Read a study by its path or bundled name.

    Raises
    ------
    StudyError
        If there is no such study, or it is wrong: ``file.yaml:LINE: what, and what is valid``.

    Examples
    --------
    >>> read_study("fig05").params["S"]
    0.32
    """
    path = study_path(source)
    try:
        located = read_yaml(path)
        return _checked(located, _validated(located))
    except NotationError as error:
        raise StudyError(str(error)) from None


def _validated(located: LocatedYaml) -> StudyFile:
    data = dict(located.data)
    start = data.get("start")
    if start == "simulate" or start == {"simulate": None}:
        data["start"] = {"simulate": {}}
    elif isinstance(start, str):
        located.fail(
            ("start",),
            f"'start' is 'simulate' or a mapping such as {{signature: 1a}}, got '{start}'",
        )
    try:
        return StudyFile.model_validate(data)
    except ValidationError as error:
        fail_with(located, error)


def _checked(located: LocatedYaml, content: StudyFile) -> Study:
    try:
        model = load_model(relative_model(content.model, located.path))
    except ParameterError as error:
        located.fail(("model",), str(error))
    whole, (model, content) = content, _tied(located, content, model)
    params = _params(located, content, model)
    orbit = _orbit(located, content, model)
    if orbit is not None:
        params = _same_params(located, content, orbit)
    _check_start(located, content, model)
    _check_task(located, content, model, params)
    _check_grid(located, content, model)
    _check_plane(located, content, model)
    _check_quantities(located, content, model)
    responses.check(located, content, model)
    return Study(
        located.path,
        whole,
        model,
        params,
        _signature(located, content, model),
        orbit,
        drawings_of(located, content),
    )


def _tied(located: LocatedYaml, content: StudyFile, model: Model) -> tuple[Model, StudyFile]:
    """Return the model with its tied parameters, and the study without them."""
    for name, value in content.params.items():
        if isinstance(value, dict):
            try:
                model, _ = tied(model, {name: value})
            except ParameterError as error:
                located.fail(("params", name), str(error))
    free = {name: value for name, value in content.params.items() if not isinstance(value, dict)}
    return model, content.model_copy(update={"params": free})


def _params(located: LocatedYaml, content: StudyFile, model: Model) -> dict[str, float]:
    for name in content.params:
        try:
            model.index_of(name)
        except ParameterError as error:
            located.fail(("params", name), str(error))
    try:
        return model.check_params(content.params)
    except ParameterError as error:
        located.fail(("params", *_violated(content, model)), str(error))


def _violated(content: StudyFile, model: Model) -> list[str]:
    """Return the first parameter of the file that is part of a violated constraint."""
    given = {name: v for name, v in content.params.items() if isinstance(v, float)}
    values = {**model.defaults, **given}
    return [
        name
        for constraint in model.constraints
        if (left := constraint.value(values)) < 0.0 or (constraint.strict and left == 0.0)
        for name in constraint.coefficients
        if name in content.params
    ][:1]


def _check_start(located: LocatedYaml, content: StudyFile, model: Model) -> None:
    start = content.start
    given = [key for key in ("simulate", "signature", "orbit") if getattr(start, key) is not None]
    if len(given) != 1:
        got = " and ".join(given) or "none of them"
        located.fail(("start",), f"'start' has one of simulate, signature, orbit; got {got}")
    state = start.simulate.state if start.simulate else None
    if state is not None and len(state) != len(model.states):
        located.fail(
            ("start", "simulate", "state"),
            f"a state of '{model.name}' is {len(model.states)} numbers "
            f"({', '.join(model.states)}), got {len(state)}",
        )


def _signature(located: LocatedYaml, content: StudyFile, model: Model) -> Signature | None:
    source = content.start.signature
    if source is None:
        return None
    try:
        if source.endswith(SUFFIXES) or "/" in source:
            return load_signature(located.path.parent / source, model)
        return load_signature(source, model)
    except NotationError as error:
        located.fail(("start", "signature"), str(error))


def _orbit(located: LocatedYaml, content: StudyFile, model: Model) -> Orbit | None:
    source = content.start.orbit
    if source is None:
        return None
    from contfric.results import load

    address = ("start", "orbit")
    try:
        orbit = load(located.path.parent / source, model)
    except ResultFileError as error:
        located.fail(address, str(error))
    if not isinstance(orbit, Orbit):
        located.fail(
            address,
            f"{source} holds a {type(orbit).__name__}, and a study starts from an orbit: save one "
            "of its points, contfric.save(branch[0], 'orbit.npz')",
        )
    if not orbit.converged:
        located.fail(address, f"the orbit of {source} is not solved: {orbit.status.value}")
    return orbit


def _same_params(located: LocatedYaml, content: StudyFile, orbit: Orbit) -> dict[str, float]:
    """Return the parameters of a saved orbit, which those of the file must not contradict."""
    for name, value in content.params.items():
        if value != orbit.params[name]:
            located.fail(
                ("params", name),
                f"{name} = {value!r}, but the saved orbit has {name} = {orbit.params[name]!r}: "
                "leave 'params' out, or start from another orbit",
            )
    return orbit.params


def _check_task(
    located: LocatedYaml, content: StudyFile, model: Model, params: dict[str, float]
) -> None:
    if content.explore and content.continue_:
        located.fail(("continue",), "a study has one of explore and continue, not both")
    task = content.task
    if task is None:
        return
    key = "explore" if content.explore else "continue"
    try:
        model.index_of(task.parameter)
    except ParameterError as error:
        located.fail((key, "parameter"), str(error))
    fault = _range_fault(model, params, task)
    if fault is not None:
        located.fail((key, "range"), fault)


def _check_quantities(located: LocatedYaml, content: StudyFile, model: Model) -> None:
    """Refuse columns, rows and values to stop at of quantities that the model does not have."""
    asked: list[tuple[Address, str, list[str]]] = [
        (("want", k), name, [want.value for want in Want])
        for k, name in enumerate(content.want)
        if not isinstance(name, Want)
    ]
    for i, figure in enumerate(content.figures):
        rows = figure.rows or []
        named = [row.value for row in Row]
        asked += [
            (("figures", i, "rows", k), row, named)
            for k, row in enumerate(rows)
            if not isinstance(row, Row)
        ]
    key = "explore" if content.explore else "continue"
    stops = content.task.stop_at if content.task and content.task.stop_at else {}
    asked += [((key, "stop_at", name), name, []) for name in stops]
    known = quantity_names(model)
    for address, name, others in asked:
        place = next(str(part) for part in reversed(address[:-1]) if isinstance(part, str))
        valid = list(dict.fromkeys((*others, *known)))
        if name.isidentifier() and name not in known:
            located.fail(address, f"'{place}' has no '{name}'{did_you_mean(name, valid)}")
        try:
            number_quantity(name, model, f"'{place}'")
        except ParameterError as error:
            located.fail(address, str(error))


def _check_grid(located: LocatedYaml, content: StudyFile, model: Model) -> None:
    task = content.lyapunov
    if task is None:
        return
    if task.state is not None and len(task.state) != len(model.states):
        located.fail(
            ("lyapunov", "state"),
            f"a state of '{model.name}' is {len(model.states)} numbers "
            f"({', '.join(model.states)}), got {len(task.state)}",
        )
    for name, values in task.grid.items():
        address = ("lyapunov", "grid", name)
        try:
            model.index_of(name)
        except ParameterError as error:
            located.fail(address, str(error))
        responses.check_axis(located, address, name, values)
    from contfric.chaos.compute import check_size

    shape = tuple(int(values[2]) for values in task.grid.values())
    try:
        check_size(shape, task.starts or 1, len(model.states))
    except ParameterError as error:
        located.fail(("lyapunov", "grid"), str(error))


def _check_plane(located: LocatedYaml, content: StudyFile, model: Model) -> None:
    task = content.plane
    if task is None:
        return
    from contfric.continuation.events import Kind
    from contfric.curves.problem import box_of

    one, other = task.parameters
    ranges = {name: (pair[0], pair[-1]) for name, pair in task.range.items()}
    wrong = next((name for name, pair in task.range.items() if len(pair) != 2), None)
    if wrong is not None:
        located.fail(
            ("plane", "range", wrong), f"the range of '{wrong}' is two numbers [low, high]"
        )
    try:
        box_of(model, (one, other), ranges)
    except ParameterError as error:
        located.fail(("plane",), str(error))
    for name, values in (task.sections or {}).items():
        if name not in ranges:
            hint = did_you_mean(name, ranges)
            located.fail(("plane", "sections"), f"'{name}' is not one of the two parameters{hint}")
        low, high = ranges[name]
        for value in values:
            if not low <= value <= high:
                text = f"the section {name} = {value:g} is outside of its range [{low:g}, {high:g}]"
                located.fail(("plane", "sections", name), text)
    known = [kind.value for kind in Kind if kind is not Kind.NS]
    for kind in task.kinds or []:
        if kind not in known:
            located.fail(("plane", "kinds"), f"no curves of '{kind}'{did_you_mean(kind, known)}")


def _range_fault(
    model: Model, params: dict[str, float], task: ExploreTask | ContinueTask
) -> str | None:
    """Return what is wrong with a range, None if nothing is."""
    name, (low, high) = task.parameter, task.range
    if low > high:
        return f"the range [{low:g}, {high:g}] is reversed: write [{high:g}, {low:g}]"
    if low == high:
        return (
            f"the range [{low:g}, {high:g}] is empty: the lower end comes first, then a larger one"
        )
    bottom, top, why_bottom, why_top = model.limits(name, params)
    if max(low, bottom) >= min(high, top):
        why = " and ".join(text for text in (why_bottom, why_top) if text)
        return (
            f"no {name} in the range [{low:g}, {high:g}] is possible: model '{model.name}' needs "
            f"{why}, which leaves {name} from {bottom:g} to {top:g}"
        )
    if not low <= params[name] <= high:
        return (
            f"the start, {name} = {params[name]:g}, is outside of the range [{low:g}, {high:g}]: "
            f"give {name} a value inside in 'params', or widen the range"
        )
    return None
