"""Tasks of studies: one list from which schema, plan, run, record and summary follow."""

from __future__ import annotations

import csv
import json
from typing import Any, ClassVar

import pytest
from pydantic import Field

import contfric as cf
from contfric.base.resources import bundled_dir
from contfric.base.yaml_schema import keys_of
from contfric.cli import main
from contfric.study import make_plan, read_study
from contfric.study.plan import RESULT_FILES
from contfric.study.schema import schema_of
from contfric.study.tables import Table
from contfric.study.tasks import STEPS, TASKS
from contfric.study.tasks.task import Task

HEAD = "model: coulomb\nparams: {Omega: 0.5, S: 0.1, S0: 0.4}\n"


class ShareTask(Task):
    """How much of the static limit the kinetic friction is: a task of a test."""

    name = "share"
    result = "share"
    saved_as = "share.npz"
    row_text = "one row a share"
    own = frozenset({"of"})

    of: list[str] = Field(min_length=2, max_length=2, description="two names of parameters")
    digits: int = Field(3, ge=0, description="a whole number >= 0")
    asked: ClassVar[list[str]] = []

    def check(self, asked) -> None:
        for name in self.of:
            if name not in asked.params:
                asked.fail((self.name, "of"), f"no parameter '{name}'")

    def does(self, study) -> str:
        return f"the share {self.of[0]} / {self.of[1]}"

    def compute(self, job) -> Any:
        self.asked.append(str(self.options()))
        job.progress_of(self.name)("divides")
        one, other = (job.study.params[name] for name in self.of)
        return cf.poincare(job.study.model, job.study.params, periods=2), one / other

    def cut_short(self, found) -> bool:
        return not found[0].complete

    def saved(self, found) -> Any:
        return found[0]

    def table(self, file, study, found) -> Table:
        return Table(["share"], [(round(found[1], self.digits),)])

    def entry(self, found) -> dict[str, Any]:
        return {"share": found[1]}

    @classmethod
    def lines(cls, entry):
        yield f"share {entry['share']:.3g}"


@pytest.fixture
def with_share(monkeypatch) -> None:
    """The list of tasks with one more."""
    monkeypatch.setattr("contfric.study.read.SCHEMA", schema_of((*TASKS, ShareTask)))
    monkeypatch.setattr("contfric.cli.summary.STEPS", (*STEPS, ShareTask))


def test_a_new_task_is_one_class(with_share, write, tmp_path, capsys) -> None:
    path = write(HEAD + "share: {of: [S, S0]}\n")
    plan = make_plan(read_study(path))
    assert [step.name for step in plan.steps] == ["share", "tables", "data", "record"]
    assert plan.files == ("share.csv", "share.npz", "run.json")
    assert "1. share: the share S / S0" in str(plan)
    result = cf.run_study(path, tmp_path / "out")
    assert result.found["share"][1] == 0.25
    assert ShareTask.asked == ["{'digits': 3}"]
    with (result.out / "share.csv").open(newline="") as file:
        assert list(csv.DictReader(file)) == [{"share": "0.25"}]
    assert json.loads((result.out / "run.json").read_text())["share"] == {"share": 0.25}
    assert main(["info", str(result.out)]) == 0
    assert "\nshare 0.25\n" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("share: {of: [S]}", "'of' must be two names of parameters, got .'S'. .list."),
        ("share: {fo: [S, S0]}", "unknown key 'fo'; did you mean 'of'"),
        ("share: {}", "key 'of' is missing; it must be two names of parameters"),
        ("share: 3", "'share' must be a mapping with of; also digits, got 3"),
        ("share: {of: [S, T]}", "no parameter 'T'"),
        ("shar: {}", "unknown key 'shar'; did you mean 'share'"),
    ],
)
def test_its_mistakes_are_explained(with_share, write, text, message) -> None:
    with pytest.raises(cf.StudyError, match=rf"scene\.yaml:3: {message}"):
        read_study(write(HEAD + text + "\n"))


@pytest.mark.parametrize("task", STEPS, ids=lambda task: task.name)
def test_every_field_says_what_it_must_be(task) -> None:
    assert all(info.description for info in task.model_fields.values())
    assert task.__doc__ and task.name and task.result and task.saved_as in RESULT_FILES
    assert keys_of(task).startswith("a mapping with ")


def test_every_task_is_asked_for_by_a_study() -> None:
    files = [*bundled_dir("studies").glob("*.yaml")]
    asked = {task.name for file in files for task in read_study(file).content.given}
    assert {"explore", "lyapunov", "plane"} <= asked <= {task.name for task in TASKS}
