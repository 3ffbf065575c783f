"""The one list of quantities: what rows, tables, stop values and gradients call by the same names.

A quantity is one of the bundled names, one that the model's file declares, an expression
(:mod:`contfric.models.language.quantity_texts`), or a function of an orbit. It is looked up and checked
here, before anything is computed. A function that can be imported has a name, too, ``module:function``:
files, studies and other processes ask for it by that.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache, reduce
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from contfric.errors import ModelError, ParameterError, did_you_mean, shown
from contfric.models.definition import Model
from contfric.models.language.grammar import FLOATS, PI, Scope
from contfric.models.language.quantity_texts import FUNCTIONALS, Parsed, read
from contfric.quantities.inside import Inside, inside_of

if TYPE_CHECKING:
    from contfric.orbit.orbit import Orbit

#: What a quantity is asked for by: a name, an expression, or a function of an orbit.
QuantityLike = str | Callable[["Orbit"], float]


@dataclass(frozen=True)
class Named:
    """A bundled quantity.

    Attributes
    ----------
    meaning : what it is, in one line
    label : its name on an axis; %s is the displacement as mathematics
    attribute : of orbits and branches, where they have it
    text : the expression that it stands for, %s the displacement; empty for what is measured otherwise
    even : whether it is the same for an orbit and its mirror image
    several : whether it is a list of numbers
    """

    meaning: str
    label: str
    attribute: str = ""
    text: str = ""
    even: bool = True
    several: bool = False


NAMED = {
    "x_max": Named("largest displacement", r"$%s_{\max}$", "x_max", "max(%s)", even=False),
    "x_min": Named("smallest displacement", r"$%s_{\min}$", "x_min", "min(%s)", even=False),
    "stops": Named(
        "displacements at the stops", r"$%s$ at stops", "stops", even=False, several=True
    ),
    "psi": Named(
        "asymmetry", r"$\psi$", "asymmetry", "abs(max(%s) + min(%s))/abs(max(%s) - min(%s))"
    ),
    "period": Named("duration of the orbit", "period", "period"),
    "multiplier": Named("largest modulus of a Floquet multiplier", r"$\max|\mu|$"),
    "sticking": Named("share of the period spent sliding on a surface, at rest", "sticking share"),
    "impact_velocity": Named(
        "largest speed at which a wall is met; 0 without impacts", "impact velocity"
    ),
}
#: Trials of an expression with random values, and the powers of ten between which their sizes lie: so
#: log(x - 500) and acos(500*x) have values at one trial in ten.
_DRAWS, _SIZES = 200, (-6.0, 6.0)
#: The name of a function that can be imported: no expression has a colon.
_IMPORTABLE = re.compile(r"\w+(\.\w+)*:\w+(\.\w+)*")


@dataclass(frozen=True, eq=False)
class Quantity:
    """A quantity of the orbits of one model, read and checked.

    Attributes
    ----------
    name : as it was asked for
    model : the model
    parsed : its expression; None of a function, and of a list of numbers
    function : the function of an orbit, if it is one
    label : its name on an axis
    """

    name: str
    model: Model
    parsed: Parsed | None
    function: Callable[[Orbit], Any] | None = None

    @property
    def named(self) -> Named | None:
        """The bundled quantity that it is, if it is one."""
        return NAMED.get(self.name) if self.function is None else None

    @property
    def asked(self) -> QuantityLike:
        """What it can be asked for by again; a text wherever there is one."""
        return self.name if self.function is None else _import_name(self.function) or self.function

    @property
    def several(self) -> bool:
        """Whether it is a list of numbers."""
        return self.named is not None and self.named.several

    @property
    def even(self) -> bool:
        """Whether it is known to be the same for an orbit and its mirror image."""
        return self.named is not None and self.named.even

    @property
    def attribute(self) -> str:
        """The attribute of orbits and branches that holds it; empty if none does."""
        return self.named.attribute if self.named is not None else ""


def quantity_of(asked: QuantityLike, model: Model) -> Quantity:
    """Return a quantity by its name, expression or function.

    Raises
    ------
    ParameterError
        If it cannot be read, or names what the model does not have.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> quantity_of("x_max", load_model("coulomb")).attribute
    'x_max'
    """
    if isinstance(asked, str):
        text = asked.strip()
        if _IMPORTABLE.fullmatch(
            text
        ):  # looked up each time: its module may have been loaded again
            return Quantity(text, model, None, _imported(text))
        return _quantity_of(text, model)
    if callable(asked):
        return Quantity(name_of(asked), model, None, asked)
    raise ParameterError(
        f"a quantity is a name, an expression such as 'max(x) - min(x)', or a function of an orbit; got "
        f"{shown(asked)}"
    )


def name_of(asked: QuantityLike) -> str:
    """Return what a quantity is called in tables, on axes and in files."""
    name = asked if isinstance(asked, str) else getattr(asked, "__name__", "function")
    return name.strip("<>")  # "<lambda>" is no label of an axis


def number_quantity(asked: Any, model: Model, what: str) -> Quantity:
    """Return a quantity that is one number; ``what`` asks for it.

    Raises
    ------
    ParameterError
        If there is no such quantity, or it is a list of numbers.
    """
    if not isinstance(asked, str) and not callable(asked):
        raise ParameterError(
            f"{what} takes a quantity: a name, an expression such as 'rms(v)', or a function of an orbit; "
            f"got {shown(asked)}"
        )
    found = quantity_of(asked, model)
    if found.several:
        raise ParameterError(f"{what} takes a quantity that is one number, and '{asked}' is a list")
    return found


def many(what: str, asked: object) -> list[Any]:
    """Return several quantities that ``what`` is asked for, as a list.

    Raises
    ------
    ParameterError
        If they are no list.
    """
    if isinstance(asked, str) or not isinstance(asked, Iterable):
        example = asked if isinstance(asked, str) else "x_max"
        raise ParameterError(
            f"{what} takes a list of quantities, such as ['{example}'], got {shown(asked)}"
        )
    return [*asked]


def columns_asked(asked: object, model: Model) -> list[Quantity]:
    """Return the quantities that a table is to have columns of, without the stops, which it has."""
    found = [quantity_of(each, model) for each in many("to_dataframe", asked)]
    return [quantity for quantity in found if not quantity.several]


def quantity_names(model: Any) -> list[str]:
    """Return the names of a model's quantities: the bundled ones, then those that its file declares.

    Parameters
    ----------
    model : str, path or Model
        As for :func:`contfric.load_model`.

    Examples
    --------
    >>> quantity_names("coulomb")[-2:]
    ['energy', 'power']
    """
    from contfric.models import load_model

    return [*NAMED, *(name for name, _ in load_model(model).quantities)]


def _imported(name: str) -> Callable[[Orbit], Any]:
    """Return a function by its name, ``module:function``.

    Raises
    ------
    ParameterError
        If it cannot be imported.
    """
    module, _, path = name.partition(":")
    try:
        found = reduce(getattr, path.split("."), import_module(module))
    except Exception as error:  # the user's own code: any kind of failure
        raise ParameterError(
            f"quantity '{name}': the function cannot be imported ({type(error).__name__}: {error}); its "
            "module has to be installed, or lie in a folder of PYTHONPATH"
        ) from error
    if not callable(found):
        raise ParameterError(f"quantity '{name}' is no function, but {shown(found)}")
    return found


def functions_in(tree: Any) -> Iterator[Callable[[Orbit], Any]]:
    """Yield the functions that texts in lists and mappings name, of modules that have been imported."""
    if isinstance(tree, Mapping):
        tree = list(tree.values())
    if isinstance(tree, list | tuple):
        for each in tree:
            yield from functions_in(each)
    elif isinstance(tree, str) and _IMPORTABLE.fullmatch(tree):
        loaded = tree.partition(":")[0] in sys.modules
        with suppress(ParameterError):
            yield from [_imported(tree)] if loaded else []


def _import_name(function: Callable[[Orbit], Any]) -> str:
    """Return the name that a function can be imported by, in other processes too; empty if it has none."""
    module = getattr(function, "__module__", None) or ""
    name = f"{module}:{getattr(function, '__qualname__', '')}"
    if module == "__main__" or not _IMPORTABLE.fullmatch(name):
        return ""
    try:
        return name if _imported(name) is function else ""
    except ParameterError:
        return ""


@lru_cache(maxsize=512)
def _quantity_of(text: str, model: Model) -> Quantity:
    named = NAMED.get(text)
    if named is not None and named.several:
        return Quantity(text, model, None)
    source = text if named is None or not named.text else named.text.replace("%s", model.states[0])
    try:
        parsed = read(source)
        check(parsed, model, ())
    except ModelError as error:
        raise ParameterError(f"quantity '{text}': {error}") from None
    if not _has_values(parsed):
        raise ParameterError(
            f"quantity '{text}' has no finite value, whatever the values of its parts are: something is "
            "divided by zero, or is a root or logarithm of a negative number"
        )
    return Quantity(text, model, parsed)


def _has_values(parsed: Parsed) -> bool:
    """Tell whether an expression is finite for some values of its parts, of many sizes and both signs."""
    rng, names = np.random.default_rng(0), [*parsed.functionals, *sorted(parsed.names - {PI})]
    for _ in range(_DRAWS):
        sizes = rng.normal(size=len(names)) * 10.0 ** rng.uniform(*_SIZES, size=len(names))
        scope = Scope(FLOATS, dict(zip(names, sizes.tolist(), strict=True)))
        try:
            if np.isfinite(scope.evaluate(parsed.tree)):
                return True
        except (ArithmeticError, ValueError, TypeError):  # not here
            continue
    return False


def check(parsed: Parsed, model: Model, above: tuple[str, ...]) -> None:
    """Refuse an expression whose names a model does not have, or that is defined by itself.

    Raises
    ------
    ParameterError
        If that is so.
    """
    inside, own = inside_of(model), dict(model.quantities)
    for functional in parsed.functionals.values():
        inside.check(functional)
    for name in sorted(parsed.names):
        if name in above:
            raise ParameterError(f"'{name}' is defined by itself: {' -> '.join((*above, name))}")
        if name in own:
            check(read(own[name]), model, (*above, name))
        elif name in NAMED and NAMED[name].several:
            raise ParameterError(f"'{name}' is a list of numbers: it cannot stand in an expression")
        elif name not in NAMED and name not in model.parameter_names and name != PI:
            _unknown(name, model, inside)


def _unknown(name: str, model: Model, inside: Inside) -> None:
    if name in inside.known:
        raise ParameterError(
            f"'{name}' varies along an orbit: write one of "
            f"{', '.join(f'{kind}({name})' for kind in FUNCTIONALS[:5])}"
        )
    state, _, which = name.rpartition("_")
    if state in inside.known and which in ("max", "min"):  # as an axis calls the displacement's
        raise ParameterError(
            f"model '{model.name}' has no quantity '{name}': write {which}({state})"
        )
    known = [*NAMED, *(n for n, _ in model.quantities), *model.parameter_names]
    state = model.states[0]
    raise ParameterError(
        f"model '{model.name}' has no quantity '{name}'{did_you_mean(name, known)}; or an expression "
        f"such as max({state}) - min({state})"
    )
