"""Models in YAML files: read, checked and built, with the line of every mistake."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from contfric.errors import ModelError, NotationError
from contfric.models.definition import Model
from contfric.models.entries import EntryError, plain
from contfric.models.paths import no_file
from contfric.models.structures.matrices import loaded
from contfric.remember.derived import derived

if TYPE_CHECKING:
    from contfric.base.yaml_lines import Address, LocatedYaml


def read_model(path: Path) -> Model:
    """Build the model of a YAML file.

    Raises
    ------
    ModelError
        If the file cannot be read or is wrong: ``file.yaml:LINE: what, and what is valid``.

    Examples
    --------
    >>> from contfric.base.resources import bundled_dir
    >>> read_model(bundled_dir("models") / "belt.yaml").states
    ('x', 'v')
    """
    from contfric.base.yaml_lines import read_yaml

    if fault := no_file(path, "a model"):
        raise ModelError(fault)
    try:
        located = read_yaml(path)
        try:
            data = loaded(located.data, path.parent)
            return from_data(data)
        except EntryError as error:
            located.fail(_written_at(located, error.address), str(error))
    except NotationError as error:
        raise ModelError(str(error)) from None


def from_data(data: Mapping[str, Any]) -> Model:
    """Build the model of data in the schema of the YAML files; the same data are read once.

    Raises
    ------
    EntryError
        For the first mistake, with the address of its entry.
    """
    given = plain(data)  # numpy writes arrays with eight digits, and not whole
    try:
        source = repr(given)
    except ValueError:  # a number of more digits than Python prints: whoever reads it says so
        return model_of(_read_as_text(given))
    return model_of(derived("text", source, lambda: _read_as_text(given)))


def _read_as_text(data: dict[str, Any]) -> str:
    # what reads a model is loaded where one is read, and not where it was read before
    from contfric.models.reading.describe import describe

    return describe(data).text


def _written_at(located: LocatedYaml, address: Address) -> Address:
    """Return where an entry is written: the field of a mode that has none of its own is the common one."""
    if address[:1] == ("modes",) and address[2:3] == ("field",):
        own, common = address[:3], address[2:]
        return common if own not in located.lines else address
    return address


@lru_cache(maxsize=64)
def model_of(definition: str) -> Model:
    """Return the model of a definition: a description as text.

    Raises
    ------
    ModelError
        If it cannot be built.
    """
    return derived("model", definition, lambda: _model_from(definition))


def _model_from(definition: str) -> Model:
    from contfric.models.deriving.derive import model_from
    from contfric.models.described.reading_back import from_text
    from contfric.models.generated.build import prepare

    description = from_text(definition)
    # written first: what has no value is reported by formula and place
    prepare(description.motion)
    return model_from(description)
