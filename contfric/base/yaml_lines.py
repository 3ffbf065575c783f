"""YAML files with the line of every entry, so that an error can say where it is."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias, TypeVar

from contfric.errors import ContfricError, NotationError

if TYPE_CHECKING:
    import yaml

T = TypeVar("T")
#: Where an entry is: keys and list indices from the top.
Address: TypeAlias = tuple[str | int, ...]
#: Largest file, and most entries in it: a model or a study has a few hundred. (Reading takes a second then.)
_MOST_BYTES, _MOST_ENTRIES = 100_000, 20_000
#: Words for true and false other than these two, which are names elsewhere.
_TRUTH = {"yes": True, "on": True, "no": False, "off": False}
#: What keeps YAML from reading a text with a colon.
_HINTS = {
    "mapping values": "; a text with ': ' in it needs quotes",
    "found character '\\t'": ", a tab: indent with spaces",
}
#: Levels of nesting whose lines are kept.
_DEEPEST = 4
#: Brackets within brackets: a study nests four. Where a thousand are open PyYAML takes ten seconds.
_MOST_OPEN = 50


@dataclass(frozen=True)
class LocatedYaml:
    """The content of a YAML file whose top is a mapping, and the line of each entry, from 1."""

    path: Path
    data: dict[str, Any]
    lines: dict[Address, int]

    def line(self, address: Address) -> int:
        """Return the line of an entry, or of the nearest entry around it."""
        while address and address not in self.lines:
            address = address[:-1]
        return self.lines.get(address, 1)

    def fail(self, address: Address, message: str) -> NoReturn:
        """Raise the error ``file.yaml:LINE: message``."""
        raise NotationError(f"{self.path}:{self.line(address)}: {message}")

    def attempt(self, address: Address, step: Callable[[], T]) -> T:
        """Return what a step returns, of which an error of the input belongs to an entry of the file."""
        try:
            return step()
        except ContfricError as error:
            self.fail(address, str(error))


def read_yaml(path: Path) -> LocatedYaml:
    """Read a YAML file.

    Raises
    ------
    NotationError
        If the file cannot be read, is no YAML, is no mapping or has a key twice.

    Examples
    --------
    >>> from contfric.base.resources import bundled_dir
    >>> read_yaml(bundled_dir("signatures") / "1a.yaml").data["periods"]
    1
    """
    import yaml

    text = _text(path)
    try:
        loader = _loader()(text)  # which refuses characters that YAML does not have
        node = loader.get_single_node()
        if node is not None and _entries(node, {}) > _MOST_ENTRIES:
            raise NotationError(
                f"{path}:1: has more than {_MOST_ENTRIES} entries, those that its aliases repeat among them"
            )
        data = None if node is None else loader.construct_document(node)
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        hint = next((h for start, h in _HINTS.items() if str(error.problem).startswith(start)), "")
        raise NotationError(f"{path}:{line}: not valid YAML: {error.problem}{hint}") from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        # ValueError: scalars that look like a date but are not one
        raise NotationError(f"{path}:1: not valid YAML: {error}") from None
    if node is None or not isinstance(data, dict):
        raise NotationError(f"{path}:1: must be a mapping of keys to values")
    located = LocatedYaml(path, data, {(): node.start_mark.line + 1})
    _locate(located, node, ())
    return located


def _entries(node: yaml.Node, known: dict[int, int]) -> int:
    """Return the number of entries of a node, each as often as aliases repeat it."""
    import yaml

    if isinstance(node, yaml.ScalarNode):
        return 1
    if id(node) not in known:
        known[id(node)] = -1  # until its parts are counted
        if isinstance(node, yaml.MappingNode):
            below = [part for pair in node.value for part in pair]
        else:
            below = list(node.value)
        known[id(node)] = 1 + sum(_entries(part, known) for part in below)
    if known[id(node)] < 0:
        problem = "an alias stands within what it names"
        raise yaml.composer.ComposerError(None, None, problem, node.start_mark)
    return known[id(node)]


@cache
def _loader() -> type[yaml.SafeLoader]:
    """Return PyYAML's safe loader, with truth values and numbers as in YAML 1.2.

    On, off, yes and no are names; 1e-3 and 1.0e6 are numbers.
    """
    import yaml
    from yaml.scanner import ScannerError

    class Loader(yaml.SafeLoader):
        """Reads plain data."""

        def fetch_flow_collection_start(self, token: type[yaml.Token]) -> None:
            """Open a bracket, if not too many are open."""
            if self.flow_level >= _MOST_OPEN:
                problem = f"more than {_MOST_OPEN} brackets are open at once"
                raise ScannerError(None, None, problem, self.get_mark())
            super().fetch_flow_collection_start(token)

    truth = "tag:yaml.org,2002:bool"
    Loader.yaml_implicit_resolvers = {
        first: [(tag, pattern) for tag, pattern in found if tag != truth]
        for first, found in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }
    Loader.add_implicit_resolver(
        truth, re.compile("^(?:true|True|TRUE|false|False|FALSE)$"), list("tTfF")
    )
    power = re.compile(r"^[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)[eE][-+]?[0-9]+$")
    Loader.add_implicit_resolver("tag:yaml.org,2002:float", power, list("-+.0123456789"))
    return Loader


def _text(path: Path) -> str:
    try:
        if path.exists() and not path.is_file() and not path.is_dir():
            raise NotationError(f"cannot read {path}: it is no ordinary file")
        if path.stat().st_size > _MOST_BYTES:
            raise NotationError(
                f"{path}:1: is larger than {_MOST_BYTES // 1000} kB, and files of this kind are pages of text"
            )
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise NotationError(f"cannot read {path}: {error.strerror or error}") from None
    except UnicodeDecodeError as error:
        raise NotationError(
            f"{path}:1: is no UTF-8 text: {error.reason}; save it as UTF-8"
        ) from None


def as_truth(value: Any) -> Any:
    """Return True or False for a word that means it, where it cannot be a name; other values as they are.

    Examples
    --------
    >>> as_truth("off"), as_truth("yes"), as_truth("perhaps")
    (False, True, 'perhaps')
    """
    return _TRUTH.get(value.lower(), value) if isinstance(value, str) else value


def comma_hint(key: str, value: object = "") -> str:
    """Return an explanation of a key that is half of an expression or of a text: ``{x: max(a, b)}``.

    Parameters
    ----------
    value : what it is the key of; what follows a comma inside { } has none

    Examples
    --------
    >>> comma_hint("b)")
    '; inside { } an expression with a comma needs quotes: {x: "max(a, b)"}'
    >>> comma_hint("min(b", None)
    '; inside { } an expression with a comma needs quotes: {x: "max(a, b)"}'
    >>> comma_hint("of the wall", None)
    '; inside { } a text with a comma needs quotes: {meaning: "a, b"}'
    """
    if key.count(")") != key.count("("):
        return '; inside { } an expression with a comma needs quotes: {x: "max(a, b)"}'
    if value is None:
        return '; inside { } a text with a comma needs quotes: {meaning: "a, b"}'
    return ""


def _locate(located: LocatedYaml, node: yaml.Node, address: Address) -> None:
    """Enter the lines of everything below a node; duplicate keys are an error."""
    import yaml

    # an alias may refer to a node around itself; a study nests four levels at most
    if len(address) > _DEEPEST:
        return
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            below = (*address, str(key.value))
            if below in located.lines:
                first = located.lines[below]
                located.lines[below] = key.start_mark.line + 1
                hint = comma_hint(str(key.value))
                located.fail(
                    below, f"key '{key.value}' is given twice (first in line {first}){hint}"
                )
            located.lines[below] = key.start_mark.line + 1
            _locate(located, value, below)
    elif isinstance(node, yaml.SequenceNode):
        for index, item in enumerate(node.value):
            located.lines[(*address, index)] = item.start_mark.line + 1
            _locate(located, item, (*address, index))
