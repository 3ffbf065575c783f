"""Clocks: ``mod(t, T)`` in the formulas of a model, the time since the last tick.

A sawtooth, a pulse of 0.3 periods, a switch that is thrown once in a period: what jumps at known times.
The time since the last tick is made a state, ``clock``, of rate 1; at the surface ``tick``, where it is
the period, it begins again at 0. Everything else that depends on t has the same period, so the clock
stands in the place of t, and the model has no other time: it is autonomous. A joint at a tick, or at
``mod(t, T) = 0.3 T``, is then as ordinary as any other.

A clock that is ahead by a, ``mod(t + a, T)`` with 0 < a < T (two converters half a period apart), is a state
of its own, with a tick of its own. The tick of the first sets it to a: the time between them is no freedom.
Another period than that of the model is refused: where two clocks tick at once, which is first is not known.

Time outside of ``mod(t, T)`` begins again with the clock, or is refused: a model with a clock knows the
time since its last tick and no other. ``sin(2*pi*t/T)`` is the same with either; ``sin(2*pi*t/(16*T))``
would begin again after a sixteenth of its period, and nothing would say so.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import reduce
from typing import Any

import numpy as np

from contfric.base.yaml_lines import Address
from contfric.errors import ModelError
from contfric.models.entries import EntryError
from contfric.models.language.grammar import FLOATS, PERIOD, TIME, Scope, names_in, parse
from contfric.models.shorthand.rewriting import OF_MODES, SHARED, rewritten, tree_of

#: What the clock and its surface are called, and the function that stands for it.
CLOCK, TICK, MOD = "clock", "tick", "mod"
#: Rounding in an identity of two periods.
_SAME = 1e-12
#: Shares by which parameters are moved: two periods that are equal at the defaults may be so by accident.
_MOVED = (0.0, 0.137)
#: Values of time and states at which an expression is compared with itself a period later.
_SAMPLES = 6
#: Rounding in an identity of two values of an expression.
_PERIODIC = 1e-9


def is_clock(state: str) -> bool:
    """Tell whether a state is a time since a tick: ``clock``, ``clock2``."""
    return state.startswith(CLOCK) and (state == CLOCK or state[len(CLOCK) :].isdigit())


def with_clock(data: dict[str, Any]) -> dict[str, Any]:
    """Return a model's data with ``mod(t, T)`` as a state; unchanged where neither it nor a tick is used.

    Raises
    ------
    EntryError
        Where ``mod`` is not that of the time and the model's period, or a name is taken.
    """
    latched = TICK in data["resets"] and TICK not in data["surfaces"]
    if not latched and not any(_ticks(text) for _, text in _expressions(data)):
        return data
    period = data.get("period")
    if period is None:
        raise EntryError((), f"{MOD}(t, T) needs the period T of the model: write 'period: ...'")
    _check_names(data)
    reader = _Reader(period, data)
    values = {name: reader.value(ast.Name(name, ast.Load())) for name in reader.parameters}
    timed = [pair for pair in _expressions(data) if pair[0][0] != "define"]
    every = value_at_defaults(period, data)
    check_time(timed, data["define"], values, every, _is_mod)
    found = rewritten(rewritten(data, SHARED, reader.read), OF_MODES, reader.read)
    ahead = reader.ahead
    rates = {CLOCK: 1, **dict.fromkeys(ahead.values(), 1)}
    ticks = {TICK: CLOCK, **{clock.replace(CLOCK, TICK): clock for clock in ahead.values()}}
    found["modes"] = {name: _mode(mode, rates, ticks) for name, mode in found["modes"].items()}
    if "field" in data:
        found["field"] = {**found["field"], **rates}
    del found["period"]
    begins = {CLOCK: 0, **{clock: text for text, clock in ahead.items()}}
    resets = found["resets"]
    return found | {
        "autonomous": True,
        "states": [*data["states"], *rates],
        "surfaces": {
            **data["surfaces"],
            **{tick: {"observable": clock, "level": period} for tick, clock in ticks.items()},
        },
        "resets": {
            **resets,
            **{tick: {clock: 0, **resets.get(tick, {})} for tick, clock in ticks.items()},
            TICK: {**begins, **resets.get(TICK, {})},
        },
        **_symmetry(data),
        "spread": {**data["spread"], **dict.fromkeys(rates, f"({period})/2")},
    }


def _expressions(data: Mapping[str, Any]) -> list[tuple[Address, str]]:
    """Return all expressions of time with their addresses."""
    found: list[tuple[Address, str]] = []

    def note(text: Any, address: Address) -> Any:
        found.extend([(address, text)] if isinstance(text, str) else [])

    rewritten(data, (*SHARED, *OF_MODES), note)
    return found


def _ticks(text: str) -> bool:
    tree = tree_of(text) if MOD in text or "%" in text else None
    return tree is not None and any(_is_mod(node) for node in ast.walk(tree))


def _is_mod(node: ast.AST) -> bool:
    called = isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == MOD
    return called or (isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mod))


def _check_names(data: Mapping[str, Any]) -> None:
    taken = {*data["states"], *data["parameters"], *data["define"], *data["observables"]}
    if any(map(is_clock, taken)) or TICK in data["surfaces"]:
        raise EntryError(
            (),
            f"a model with {MOD}(t, T) gets a state '{CLOCK}' and a surface '{TICK}': "
            "give other names to yours",
        )


class _Reader(ast.NodeTransformer):
    """Puts the clock in the place of ``mod(t, T)`` and of t."""

    def __init__(self, period: str, data: Mapping[str, Any]) -> None:
        self.period = period
        self.address: Address = ()
        self.parameters = {n: entry["default"] for n, entry in data["parameters"].items()}
        self.ahead: dict[str, str] = {}  # how far other clocks are ahead, and their names
        self.define = {
            name: tree.body
            for name, text in data["define"].items()
            if (tree := tree_of(text)) is not None
        }

    def read(self, text: Any, address: Address) -> Any:
        """Return an expression with the clock in it; a number as it is."""
        tree, self.address = tree_of(text) if isinstance(text, str) else None, address
        return text if tree is None else ast.unparse(self.visit(tree))

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """Replace mod(t, T)."""
        if not _is_mod(node):
            return self.generic_visit(node)
        if len(node.args) != 2 or node.keywords:
            raise EntryError(self.address, f"write {MOD}(t, T): time and period")
        return self._clock(*node.args)

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        """Replace t % T."""
        return self._clock(node.left, node.right) if _is_mod(node) else self.generic_visit(node)

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """Replace t, and the period."""
        if node.id == TIME:
            return ast.Name(CLOCK, ast.Load())
        return ast.parse(self.period, mode="eval").body if node.id == PERIOD else node

    def _clock(self, time: ast.expr, period: ast.expr) -> ast.AST:
        what = f"{MOD}({ast.unparse(time)}, {ast.unparse(period)})"
        shift = _shift_of(time)
        if shift is not None and self._is_period(period):
            return ast.Name(self._clock_ahead(shift, what), ast.Load())
        if shift is None and not (isinstance(time, ast.Name) and time.id == TIME):
            raise EntryError(
                self.address,
                f"{what}: only the time begins again: {MOD}(t, T) or {MOD}(t + a, T). For a switch at "
                f"another time give a surface to an observable '{MOD}(t, T)', at the level of that time; a "
                "state that jumps has a reset",
            )
        if not self._is_period(period):
            raise EntryError(
                self.address,
                f"{what}: what begins again does so with the period of the model, '{self.period}'. A clock "
                "of another period would tick together with that one, and which is first is not known",
            )
        return ast.Name(CLOCK, ast.Load())

    def _clock_ahead(self, shift: ast.expr, what: str) -> str:
        """Return the name of the clock that is ahead by a share of the period, which may be a new one."""
        own = ast.unparse(self.visit(shift))
        sizes = [self.value((ast.parse(t, mode="eval").body), 0) for t in (own, self.period)]
        if sizes[0] < 0.0:
            own, sizes[0] = f"{self.period} + {own}", sizes[1] + sizes[0]
        if not 0.0 < sizes[0] < sizes[1]:
            raise EntryError(
                self.address,
                f"{what}: another clock is ahead or behind by less than a period, and by more than nothing, "
                "at the defaults",
            )
        return self.ahead.setdefault(own, f"{CLOCK}{len(self.ahead) + 2}")

    def value(self, node: ast.expr, k: int = 0) -> float:
        """Return the value of an expression of the parameters at the defaults, or moved a little."""
        moved = {
            name: v * (1.0 + _MOVED[k] * (1 + i * k))
            for i, (name, v) in enumerate(self.parameters.items())
        }
        try:
            return float(Scope(FLOATS, moved, self.define).evaluate(node))
        except ModelError as error:
            raise EntryError(self.address, str(error)) from None

    def _is_period(self, node: ast.expr) -> bool:
        if isinstance(node, ast.Name) and node.id == PERIOD:
            return True
        own = ast.parse(self.period, mode="eval").body
        pairs = ([self.value(e, k) for e in (node, own)] for k in range(len(_MOVED)))
        return all(abs(a - b) <= _SAME * abs(b) for a, b in pairs)


def value_at_defaults(text: str, data: Mapping[str, Any]) -> float:
    """Return the value of an expression of parameters and definitions, at the defaults of a model."""
    reader = _Reader(data.get("period", "1"), data)
    return reader.value(reader.visit(ast.parse(text.strip(), mode="eval")).body)


def _shift_of(time: ast.expr) -> ast.expr | None:
    """Return a of a sum ``t + a``, its terms in any order (``t + T - d``); None of others."""
    terms = list(_terms(time, 1))
    timed = [(s, e) for s, e in terms if any(map(_is_time, ast.walk(e)))]
    if len(terms) < 2 or len(timed) != 1 or timed[0][0] < 0 or not _is_time(timed[0][1]):
        return None
    rest = [e if s > 0 else ast.UnaryOp(ast.USub(), e) for s, e in terms if (s, e) not in timed]
    return reduce(lambda a, b: ast.BinOp(a, ast.Add(), b), rest)


def _terms(node: ast.expr, sign: int) -> Iterator[tuple[int, ast.expr]]:
    """Yield the terms of a sum, each with its sign."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)):
        yield from _terms(node.left, sign)
        yield from _terms(node.right, sign if isinstance(node.op, ast.Add) else -sign)
    else:
        yield sign, node


def _is_time(node: ast.AST) -> bool:
    return isinstance(node, ast.Name) and node.id == TIME


def _mode(mode: Mapping[str, Any], rates: Mapping[str, int], ticks: Iterable[str]) -> Any:
    found = {**mode, "in": {**mode["in"], **dict.fromkeys(ticks, "-")}}
    return {**found, "field": {**mode["field"], **rates}} if "field" in mode else found


def _symmetry(data: Mapping[str, Any]) -> dict[str, Any]:
    images = dict(data.get("symmetry", {}))
    if images.pop(TIME, TIME) != TIME:
        raise EntryError(
            ("symmetry",),
            f"a model with {MOD}(t, T) has a symmetry of its states only: half a period later the clock "
            "shows another time",
        )
    return {"symmetry": images} if images else {}


def check_time(
    expressions: Iterable[tuple[Address, str]],
    define: Mapping[str, str],
    parameters: Mapping[str, float],
    period: float,
    is_clock: Callable[[ast.AST], bool],
) -> None:
    """Check that time outside of clocks makes no difference after a period.

    Parameters
    ----------
    expressions : address and text of what is evaluated as the solution goes on
    define : texts of the definitions
    is_clock : tells a clock, ``mod(t, T)``; what it shows is the same after a period

    Raises
    ------
    EntryError
        Where an expression is another one after a period.
    """

    def read(text: str) -> ast.expr | None:
        try:
            tree = ast.parse(text.strip(), mode="eval")
            return parse(ast.unparse(_Stopped(is_clock).visit(tree)))
        except (ModelError, SyntaxError, ValueError, RecursionError, MemoryError):
            return None  # whoever reads the expression says what is wrong

    trees = {name: tree for name, text in define.items() if (tree := read(text)) is not None}
    timed = {name for name, tree in trees.items() if names_in(tree) & {TIME}}
    while grown := {n for n, tree in trees.items() if names_in(tree) & timed} - timed:
        timed |= grown
    for address, text in expressions:
        tree = read(text)
        if tree is None or not names_in(tree) & {TIME, *timed}:
            continue
        if _changes(tree, trees, dict(parameters), period):
            raise EntryError(
                address,
                f"'{text}' is not the same a period of {period:g} later, and a model with a clock has no "
                "time but that since the last tick. What is slower than the clock is a state of its own, "
                "such as a sine: states s, c with rates s: w*c, c: -w*s",
            )


class _Stopped(ast.NodeTransformer):
    """Puts a number in the place of a clock."""

    def __init__(self, is_clock: Callable[[ast.AST], bool]) -> None:
        self.is_clock = is_clock

    def visit_Call(self, node: ast.Call) -> ast.AST:
        return ast.Constant(0.5) if self.is_clock(node) else self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        return ast.Constant(0.5) if self.is_clock(node) else self.generic_visit(node)


def _changes(
    tree: ast.expr, define: Mapping[str, ast.expr], parameters: dict[str, float], period: float
) -> bool:
    """Tell whether an expression has another value a period later, at sampled times and states."""
    rng = np.random.default_rng(1)
    others = set().union(*map(names_in, (tree, *define.values())))
    others -= {*parameters, *define, TIME}
    for _ in range(_SAMPLES):
        values = {**parameters, **{name: float(rng.uniform(0.1, 1.0)) for name in sorted(others)}}
        values[PERIOD], time = period, float(rng.uniform(0.0, period))
        try:
            now, later = (
                float(Scope(FLOATS, {**values, TIME: t}, define).evaluate(tree))
                for t in (time, time + period)
            )
        except (ModelError, ArithmeticError, ValueError):
            continue  # no value at these states
        if abs(later - now) > _PERIODIC * (1.0 + abs(now)):
            return True
    return False
