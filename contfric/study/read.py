"""Reading a study: every mistake is found before anything is computed, with its line."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from contfric.base.yaml_lines import Address, LocatedYaml, read_yaml
from contfric.base.yaml_schema import validated
from contfric.errors import NotationError, ParameterError, StudyError, did_you_mean
from contfric.models import load_model
from contfric.models.definition import Model
from contfric.models.paths import relative_name
from contfric.models.tied import tied
from contfric.orbit.orbit import Orbit
from contfric.quantities.registry import number_quantity, quantity_names
from contfric.signature import Signature, load_signature
from contfric.study.drawings import Drawing, drawings_of
from contfric.study.library import study_path
from contfric.study.schema import SCHEMA, StudyFile
from contfric.study.tasks.task import StudyCheck
from contfric.study.wanted import Row, Want

if TYPE_CHECKING:
    from contfric.study.tasks.one_parameter import OneParameter
    from contfric.study.tasks.task import Task


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
        """The title, or the name of a study without title."""
        return self.content.title or self.name

    @property
    def task(self) -> OneParameter | None:
        """What is done with the first orbit along one parameter."""
        return self.content.task

    @property
    def tasks(self) -> list[Task]:
        """What is computed, in the order of the steps: the orbit of the start, if needed, and the tasks."""
        return self.content.tasks

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
    if "model" not in data and "states" in data:
        located.fail(
            ("states",),
            "this is a model, not a study: `contfric check` reads it, and a study names it (model: "
            f"{located.path.name})",
        )
    start = data.get("start")
    if start == "simulate" or start == {"simulate": None}:
        data["start"] = {"simulate": {}}
    elif isinstance(start, str):
        located.fail(
            ("start",),
            f"'start' is 'simulate' or a mapping such as {{signature: 1a}}, got '{start}'",
        )
    return validated(located, SCHEMA, data)


def _checked(located: LocatedYaml, content: StudyFile) -> Study:
    name = relative_name(content.model, located.path)
    model = located.attempt(("model",), lambda: load_model(name))
    whole, (model, content) = content, _tied(located, content, model)
    params = _params(located, content, model)
    orbit = _orbit(located, content, model)
    if orbit is not None:
        params = _same_params(located, content, orbit)
    alike = [task.name for task in content.given if task.result == "diagram"]
    if len(alike) > 1:
        located.fail((alike[-1],), f"a study has one of {' and '.join(alike)}, not both")
    asked = StudyCheck(located, content, model, params)
    for task in [content.start, *content.given]:
        task.check(asked)
    _check_quantities(located, content, model)
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
            model, _ = located.attempt(("params", name), partial(tied, model, {name: value}))
    free = {name: value for name, value in content.params.items() if not isinstance(value, dict)}
    return model, content.model_copy(update={"params": free})


def _params(located: LocatedYaml, content: StudyFile, model: Model) -> dict[str, float]:
    for name in content.params:
        located.attempt(("params", name), partial(model.index_of, name))
    try:
        return model.check_params(content.params)
    except ParameterError as error:
        if (params := _replaced(content, model)) is not None:
            return params
        located.fail(("params", *_violated(content, model)), str(error))


def _replaced(content: StudyFile, model: Model) -> dict[str, float] | None:
    """Return all parameters, where no default is used that cannot go with the others; None if one is.

    A sweep, say, does not use that of its own parameter.
    """
    try:
        tasks = [task.replaced() for task in content.given]
        shared = [n for n in chain(*tasks[:1]) if all(n in others for others in tasks[1:])]
        instead = {n: tasks[0][n] for n in shared if n not in content.params}
        return model.check_params({**instead, **content.params}) if instead else None
    except ParameterError:
        return None


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


def _signature(located: LocatedYaml, content: StudyFile, model: Model) -> Signature | None:
    source = content.start.signature
    if source is None:
        return None
    name = relative_name(source, located.path)
    return located.attempt(("start", "signature"), lambda: load_signature(name, model))


def _orbit(located: LocatedYaml, content: StudyFile, model: Model) -> Orbit | None:
    source = content.start.orbit
    if source is None:
        return None
    from contfric.results import load

    address = ("start", "orbit")
    orbit = located.attempt(address, lambda: load(located.path.parent / source, model))
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
    if content.task is not None:
        stops = content.task.stop_at or {}
        asked += [((content.task.name, "stop_at", name), name, []) for name in stops]
    known = quantity_names(model)
    for address, name, others in asked:
        place = next(str(part) for part in reversed(address[:-1]) if isinstance(part, str))
        valid = list(dict.fromkeys((*others, *known)))
        if name.isidentifier() and name not in known:
            located.fail(address, f"'{place}' has no '{name}'{did_you_mean(name, valid)}")
        located.attempt(address, partial(number_quantity, name, model, f"'{place}'"))
