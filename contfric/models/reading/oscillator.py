"""Models as small classes: methods that return formulas, the same path as a YAML file from there on."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from inspect import signature
from typing import Any, ClassVar

from contfric.errors import ModelError, did_you_mean
from contfric.models.definition import Model
from contfric.models.entries import EntryError
from contfric.models.language.grammar import TIME
from contfric.models.reading.files import from_data

#: What a class says as a file does.
_AS_THEY_ARE = (
    *("references", "states", "constraints", "domains", "departures", "symmetry", "stop_surface"),
    *("kinks", "angles", "spread", "integration", "max_step", "quantities", "units"),
)
#: Likeness of two names from which one is a slip of the pen: a letter left out, added or exchanged.
_SLIP = 0.88


class Symbols:
    """Named formulas: ``y.x``, ``y["x"]``, or ``x, v = y`` in their order."""

    def __init__(self, what: str, symbols: Mapping[str, Any]) -> None:
        self._what, self._symbols = what, dict(symbols)

    def __getitem__(self, name: str) -> Any:
        if name not in self._symbols:
            hint = did_you_mean(name, self._symbols)
            raise ModelError(f"there is no {self._what} '{name}'{hint}")
        return self._symbols[name]

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return self[name]

    def __iter__(self) -> Iterator[Any]:
        return iter(self._symbols.values())


class OscillatorModel:
    """A piecewise-smooth oscillator, declared by a class.

    To write a model:

    1. Derive a class from this one. Its docstring's first line is the title; ``name`` is what results
       are stored under.
    2. Set ``states`` (the first one is the displacement that diagrams show), ``parameters`` (name:
       default, or name: (default, meaning)) and ``constraints`` such as ``"S0 >= S"``.
    3. Write :meth:`observables`: what the surfaces are level sets of. States need none of their own.
    4. Set ``surfaces``: name: (observable, level), the level an expression of the parameters such as
       ``"-S0"``.
    5. Set ``modes``: name: sides of surfaces, +1, -1, or 0 where the mode moves on the surface (it
       sticks). Surfaces that are not named divide a mode into domains; motion passes them unchanged.
    6. Write :meth:`field`: the rates of the states in a mode. ``sign``, ``abs`` and ``where`` of what the
       sides of the mode decide are replaced by what they are there.
    7. Write :meth:`period` if there is an excitation, :meth:`reset` if a surface maps the state (impact).
    8. If there is a symmetry, set ``symmetry``, such as ``"x -> -x, v -> -v, t -> t + T/2"``; ``spread``
       is how far from 0 motion can start. ``kinks``, ``angles``, ``integration``, ``max_step`` and
       ``quantities`` are as in a file.
    9. Load it with ``contfric.load_model(MyClass)``, and verify it with ``contfric.check_model(MyClass)``.

    Formulas are written with the functions of :mod:`contfric.models.functions` (or sympy's own); arguments
    are symbols, so an ``if`` on their values cannot work: use ``where(condition, a, b)``, or another mode.

    Examples
    --------
    >>> import contfric as cf
    >>> class Belt(cf.OscillatorModel):
    ...     '''A block on a moving belt.'''
    ...
    ...     states = ("x", "v")
    ...     parameters = {"vb": 0.2, "F": 1.0}
    ...     surfaces = {"belt": ("slip", 0), "F+": ("x", "F"), "F-": ("x", "-F"), "stop": ("v", 0)}
    ...     modes = {
    ...         "slip+": {"belt": 1},
    ...         "slip-": {"belt": -1},
    ...         "stick": {"belt": 0, "F+": -1, "F-": 1},
    ...     }
    ...
    ...     def observables(self, t, y, p):
    ...         return {"slip": y.v - p.vb}
    ...
    ...     def field(self, mode, t, y, p):
    ...         friction = p.F / (1 + 3 * abs(y.v - p.vb))
    ...         if mode == "stick":
    ...             return p.vb, 0
    ...         return y.v, -y.x - (friction if mode == "slip+" else -friction)
    >>> cf.load_model(Belt).modes[2].rank
    1
    """

    name: ClassVar[str] = ""
    references: ClassVar[Sequence[str]] = ()
    states: ClassVar[Sequence[str]] = ()
    parameters: ClassVar[Mapping[str, Any]] = {}
    constraints: ClassVar[Sequence[str] | Mapping[str, str]] = ()
    surfaces: ClassVar[Mapping[str, Any]] = {}
    modes: ClassVar[Mapping[str, Mapping[str, int]]] = {}
    domains: ClassVar[Mapping[str, Any]] = {}
    departures: ClassVar[Sequence[Any]] = ()
    symmetry: ClassVar[str | Mapping[str, str] | None] = None
    stop_surface: ClassVar[str | None] = None
    kinks: ClassVar[Sequence[str]] = ()
    angles: ClassVar[Sequence[str]] = ()
    spread: ClassVar[Mapping[str, Any]] = {}
    integration: ClassVar[Mapping[str, Any]] = {}
    max_step: ClassVar[float | None] = None
    quantities: ClassVar[Mapping[str, str]] = {}
    units: ClassVar[Mapping[str, float] | str] = {}

    def period(self, p: Symbols) -> Any:
        """Return the period of the excitation; None (as here) without one."""
        return None

    def observables(self, t: Any, y: Symbols, p: Symbols) -> Mapping[str, Any]:
        """Return the observables: name -> formula."""
        return {}

    def field(self, mode: str, t: Any, y: Symbols, p: Symbols) -> Any:
        """Return the rates of the states in a mode: a sequence in their order, or a mapping."""
        raise NotImplementedError

    def reset(self, surface: str, t: Any, y: Symbols, p: Symbols) -> Mapping[str, Any] | None:
        """Return what the state becomes where it meets a surface; None (as here) if nothing changes."""
        return None


def model_of_class(oscillator: OscillatorModel) -> Model:
    """Build the model of an instance: its methods are called once, with symbols.

    Raises
    ------
    ModelError
        If a method fails, or what it returns is no model: class, entry, and what would be valid.
    """
    try:
        return from_data(_data(oscillator))
    except EntryError as error:
        place = " > ".join(str(key) for key in error.address) or "class"
        raise ModelError(f"{type(oscillator).__name__}, {place}: {error}") from None


def _data(oscillator: OscillatorModel) -> dict[str, Any]:
    """Return the class as data in the schema of the YAML files."""
    import sympy

    kind, states = type(oscillator), tuple(oscillator.states)
    _check_names(kind)
    if not states or isinstance(oscillator.states, str):
        raise ModelError(f'{kind.__name__}: \'states\' must be a list of names, such as ("x", "v")')
    t = sympy.Symbol(TIME)
    y = Symbols("state", {name: sympy.Symbol(name) for name in states})
    p = Symbols("parameter", {name: sympy.Symbol(name) for name in oscillator.parameters})
    period = _traced(oscillator, "period", p)
    resets = {
        surface: _by_state(oscillator, states, found, f"reset('{surface}')")
        for surface in oscillator.surfaces
        if (found := _traced(oscillator, "reset", surface, t, y, p)) is not None
    }
    data: dict[str, Any] = {
        "name": oscillator.name or kind.__name__,
        "title": (kind.__doc__ or "").strip().partition("\n")[0],
        **{key: getattr(oscillator, key) for key in _AS_THEY_ARE},
        "parameters": {n: _parameter(v) for n, v in oscillator.parameters.items()},
        "observables": _texts(_traced(oscillator, "observables", t, y, p)),
        "surfaces": {n: _surface(v) for n, v in oscillator.surfaces.items()},
        "modes": {
            mode: {
                "in": dict(sides),
                "field": _by_state(
                    oscillator,
                    states,
                    _traced(oscillator, "field", mode, t, y, p),
                    f"field('{mode}')",
                ),
            }
            for mode, sides in oscillator.modes.items()
        },
        "resets": resets,
    }
    data.update({"autonomous": True} if period is None else {"period": _text(period)})
    return data


def _check_names(kind: type[OscillatorModel]) -> None:
    """Refuse an attribute that is nearly one of those that declare a model: it would do nothing.

    Classes may have attributes of their own; only what looks like a slip of the pen is refused.
    """
    known = [name for name in vars(OscillatorModel) if not name.startswith("_")]
    for base in kind.__mro__[: kind.__mro__.index(OscillatorModel)]:
        for name in vars(base):
            near = get_close_matches(name, known, n=1, cutoff=_SLIP)
            if near and name not in known:
                raise ModelError(
                    f"{kind.__name__}: '{name}' declares nothing; did you mean '{near[0]}'?"
                )


def _traced(oscillator: OscillatorModel, method: str, *arguments: Any) -> Any:
    """Call a method with symbols; what it raises is the user's own mistake, said in one line."""
    try:
        return getattr(oscillator, method)(*arguments)
    except ModelError as error:
        raise ModelError(f"{type(oscillator).__name__}.{method}: {error}") from None
    except NotImplementedError:
        raise ModelError(
            f"{type(oscillator).__name__} has no method '{method}': see the numbered list of "
            "contfric.OscillatorModel"
        ) from None
    except TypeError as error:
        hint = ""
        if "truth value" in str(error):
            hint = "; an 'if', min() or max() cannot look at values: use where(condition, a, b)"
        elif "positional argument" in str(error):
            expected = ", ".join(signature(getattr(OscillatorModel, method)).parameters)
            hint = f"; write {method}({expected})"
        elif "float" in str(error) or "ufunc" in str(error):
            hint = "; use the functions of contfric.models.functions, not those of math or numpy"
        raise ModelError(f"{type(oscillator).__name__}.{method}: {error}{hint}") from error


def _by_state(
    oscillator: OscillatorModel, states: Sequence[str], found: Any, what: str
) -> dict[str, str]:
    if isinstance(found, Mapping):
        return _texts(found)
    if not isinstance(found, Sequence) or len(found) != len(states):
        raise ModelError(
            f"{type(oscillator).__name__}.{what} must return {len(states)} formulas "
            f"({', '.join(states)}) or a mapping, got {found!r}"
        )
    return _texts(dict(zip(states, found, strict=True)))


def _parameter(value: Any) -> Any:
    if isinstance(value, tuple) and len(value) == 2:
        return {"default": value[0], "meaning": value[1]}
    return value


def _surface(value: Any) -> Any:
    if isinstance(value, tuple) and len(value) == 2:
        return {"observable": value[0], "level": _text(value[1])}
    return value


def _texts(found: Mapping[str, Any]) -> dict[str, str]:
    return {str(name): _text(value) for name, value in found.items()}


def _text(value: Any) -> str:
    from contfric.models.functions import as_text

    return value if isinstance(value, str) else as_text(value)
