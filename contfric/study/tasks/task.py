"""The base class of tasks: a schema, and the methods that a run calls.

A task is a pydantic class in a module of its own; an instance is what a study says under its key. What it
needs to compute, to write or to draw is imported by the method that does it: reading a study loads none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, NoReturn, TypeAlias

from pydantic import Field

from contfric.base.yaml_schema import SchemaPart, keys_of, whole
from contfric.study.tasks.grids import pairs_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from contfric.base.yaml_lines import Address, LocatedYaml
    from contfric.models.definition import Model
    from contfric.study.drawings import Drawing
    from contfric.study.read import Study
    from contfric.study.schema import StudyFile
    from contfric.study.tables import Table

#: Results of a run by their names, as they come.
Found: TypeAlias = dict[str, Any]
Say: TypeAlias = Callable[[str], None]

PARAMETER = "the name of a parameter of the model"
STATE = "a list of finite numbers, one for each state of the model"


class FigureKind(NamedTuple):
    """A kind of figure: its size in inches, what each row adds, and what it is called in messages."""

    width: float
    height: float
    row_height: float = 0.0
    called: str = ""


class Skipped(NamedTuple):
    """Something that is not computed, loaded or written, and why."""

    what: str
    why: str

    def __str__(self) -> str:
        return f"{self.what}: {self.why}"


@dataclass(frozen=True)
class Job:
    """What a task has to compute with.

    Attributes
    ----------
    study : the study that asks for it
    found : results of the tasks before it
    say : takes a line of text now and then
    """

    study: Study
    found: Found
    say: Say

    def progress_of(self, name: str) -> Say:
        """Return a function that takes lines of text of one step."""
        return lambda text: self.say(f"{name}: {text}")


@dataclass(frozen=True)
class StudyCheck:
    """What a task is checked against while a study is read.

    Attributes
    ----------
    located : the file with the lines of its entries, for mistakes
    content : all that the file says
    model, params : the model, and its parameters at the start
    """

    located: LocatedYaml
    content: StudyFile
    model: Model
    params: dict[str, float]

    def fail(self, address: Address, text: str) -> NoReturn:
        """Say what is wrong with an entry."""
        self.located.fail(address, text)

    def attempt(self, address: Address, step: Callable[[], object]) -> None:
        """Take a step of which an error of the input belongs to an entry of the file."""
        self.located.attempt(address, step)

    def check_state(self, address: Address, state: list[float] | None) -> None:
        """Check the number of states, if there are any."""
        names = self.model.states
        if state is not None and len(state) != len(names):
            self.fail(
                address,
                f"a state of '{self.model.name}' is {len(names)} numbers ({', '.join(names)}), got "
                f"{len(state)}",
            )

    def check_axis(self, address: Address, name: str, values: list[float]) -> None:
        """Check the values [low, high, number] of a parameter or of a state."""
        fits = len(values) == 3 and values[0] < values[1] and values[2] >= 2
        if not fits or values[2] != int(values[2]):
            self.fail(
                address,
                f"the values of {name} are [low, high, number of values], with low < high and a whole "
                f"number of at least 2, got {values}",
            )

    def check_ranges(
        self, task: str, ranges: Mapping[str, list[float]]
    ) -> dict[str, tuple[float, float]]:
        """Check that every range is two numbers, and return them."""
        for name, pair in ranges.items():
            if len(pair) != 2:
                self.fail(
                    (task, "range", name), f"the range of '{name}' is two numbers [low, high]"
                )
        return pairs_of(ranges)


class Task(SchemaPart):
    """One task; see the module.

    Attributes
    ----------
    name : the step of the run, and the key of the study
    result : what its result is called; by default as the task
    saved_as : file of the result; by default its name with ``.npz``
    row_text : what a row of its tables is
    of_orbit : whether it begins with the orbit of the start
    own : keys that :meth:`compute` hands over itself; the others are arguments by their names
    figures : kinds of figures that show its result
    """

    name: ClassVar[str]
    result: ClassVar[str]
    saved_as: ClassVar[str]
    row_text: ClassVar[str] = ""
    of_orbit: ClassVar[bool] = False
    own: ClassVar[frozenset[str]] = frozenset()
    figures: ClassVar[Mapping[str, FigureKind]] = {}

    @classmethod
    def __pydantic_init_subclass__(cls, **given: Any) -> None:
        super().__pydantic_init_subclass__(**given)
        if "name" in vars(cls):
            cls.result = getattr(cls, "result", cls.name)
            cls.saved_as = getattr(cls, "saved_as", f"{cls.name}.npz")

    @classmethod
    def described(cls) -> str:
        """Return what stands under its key, for messages."""
        return keys_of(cls)

    def options(self) -> dict[str, Any]:
        """Return what is given beyond its own keys, as arguments."""
        return self.model_dump(mode="json", exclude=set(self.own), exclude_none=True)

    # ------------------------------------------------------------------------------ reading, plan

    def check(self, asked: StudyCheck) -> None:
        """Check what the schema cannot know; a mistake fails with its line."""

    def replaced(self) -> dict[str, float]:
        """Return the parameters whose value in the study is not used, each with one that is."""
        return {}

    def does(self, study: Study) -> str:
        """Return what the step does, in words."""
        raise NotImplementedError

    def tables(self, study: Study) -> tuple[str, ...]:
        """Return the names of its tables."""
        return (f"{self.name}.csv",)

    def rows_text(self, study: Study) -> str:
        """Return what a row of its tables is."""
        return self.row_text

    def skipped(self, study: Study) -> Iterator[Skipped]:
        """Yield what it leaves out."""
        yield from ()

    # ---------------------------------------------------------------------------------- computing

    def ahead(self) -> None:
        """Begin what it will need, before the first task."""

    def compute(self, job: Job) -> Any:
        """Return its result; on Ctrl-C what was found until then."""
        raise NotImplementedError

    def cut_short(self, found: Any) -> bool:
        """Tell whether Ctrl-C ended the computation."""
        return not found.complete

    # -------------------------------------------------------------------------------------- files

    def saved(self, found: Any) -> Any:
        """Return what of its result is saved."""
        return found

    def table(self, file: str, study: Study, found: Any) -> Table:
        """Return one of its tables; by default the result is one."""
        from contfric.study.tables import table_of

        return table_of(found.columns())

    def draw(self, figure: Figure, drawing: Drawing, found: Found, title: str) -> None:
        """Draw a figure of one of its kinds."""
        raise NotImplementedError

    # ------------------------------------------------------------------------------------- record

    def entries(self, found: Any) -> dict[str, Any]:
        """Return what the record of the run says of the result."""
        return {self.name: self.entry(found)}

    def entry(self, found: Any) -> dict[str, Any]:
        """Return the entry of the record under its name."""
        raise NotImplementedError

    @classmethod
    def summary(cls, record: dict[str, Any]) -> Iterator[str]:
        """Yield the record of its result as lines of text; nothing of a run without it."""
        if cls.name in record:
            yield ""
            yield from cls.lines(record[cls.name])

    @classmethod
    def lines(cls, entry: dict[str, Any]) -> Iterator[str]:
        """Yield its entry of the record as lines of text."""
        yield from ()


class AlongParameter(Task):
    """A task over a range of one parameter."""

    own = frozenset({"parameter", "range"})

    parameter: str = Field(description=PARAMETER)
    range: list[float] = Field(
        min_length=2, max_length=2, description="two finite numbers [low, high]"
    )

    @property
    def bounds(self) -> tuple[float, float]:
        """The ends of the range."""
        return self.range[0], self.range[1]

    @property
    def span(self) -> str:
        """The parameter and its range, in words."""
        return f"{self.parameter} from {self.range[0]:g} to {self.range[1]:g}"

    def check(self, asked: StudyCheck) -> None:
        """Check that the model has the parameter."""
        asked.attempt((self.name, "parameter"), lambda: asked.model.index_of(self.parameter))


class SeedsEntry(SchemaPart):
    """Simulations whose attractors start branches that nothing else reaches."""

    values: int = whole("values of the parameter", default=20)
    states: int = whole("initial conditions at each", default=3)
    seed: int = whole("seed of the random ones", least=0, default=0)

    def argument(self) -> dict[str, Any]:
        """Return the argument ``seeds`` of an exploration."""
        from contfric.atlas.starts.seeds import Seeds

        return {"seeds": Seeds(**self.model_dump())}


#: What a result says that can be completed.
GOES_ON = "the same command goes on from the finished tiles"


def incomplete(entry: dict[str, Any], text: str = GOES_ON) -> Iterator[str]:
    """Yield a line that says that the result is not complete, if it is not."""
    if not entry["complete"]:
        yield f"incomplete: {text}"
