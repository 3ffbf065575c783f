"""The language of expressions in a user's model: read as data, never executed.

An expression has numbers, names, ``+ - * / **``, parentheses and the functions of :data:`FUNCTIONS`;
``where(condition, a, b)`` takes comparisons joined by ``and``, ``or``, ``not``. Python's parser
makes a tree of the text, and what is not on the list below is refused with the reason: no attributes,
no indices, no other calls. The tree is then evaluated in an *algebra* - numbers of any precision,
or formulas - by :class:`Scope`; nothing else ever sees the text.
"""

from __future__ import annotations

import ast
import keyword
import math
import re
import sys
import unicodedata
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from contfric.errors import ModelError, did_you_mean
from contfric.models.language.elsewhere import advice_on
from contfric.models.language.products import difference, of_product

T = TypeVar("T")

#: Functions of one argument.
UNARY = (
    *("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh"),
    *("exp", "log", "sqrt", "abs", "sign"),
)
#: All functions; min and max take two or more arguments.
FUNCTIONS = (*UNARY, "min", "max", "where")
#: Names with a fixed meaning: time, and the period of the excitation (in a symmetry only).
TIME, PERIOD, PI = "t", "T", "pi"
RESERVED = (TIME, PERIOD, PI, *FUNCTIONS)
_MEANINGS = {
    TIME: "the time",
    PERIOD: "the period of the excitation (but for a parameter where 'period: T', and in autonomous models)",
    PI: "the number pi",
}

#: A formula is a line or two; a longer text is a mistake, and Python's parser has limits of its own.
_LONGEST, _DEEPEST = 5000, 60

_OPERATORS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**"}
_COMPARISONS = (ast.Lt, ast.LtE, ast.Gt, ast.GtE)
#: What is refused, with what to write instead.
_ADVICE: dict[type[ast.AST], str] = {
    ast.BitXor: "'^' is no power: write **",
    ast.Mod: "a remainder (%) is that of the time, mod(t, T)",
    ast.FloorDiv: "there is no whole division (//): write /",
    ast.IfExp: "write where(condition, a, b) for 'a if condition else b'",
    ast.Attribute: "a dot can only stand in a number",
    ast.Subscript: "brackets [] have no meaning: use parentheses",
    ast.Eq: "a condition has one of <, <=, >, >=; equality is met at single points only",
    ast.NotEq: "a condition has one of <, <=, >, >=",
    ast.Tuple: "a comma can only separate the arguments of a function",
}


@dataclass(frozen=True)
class Algebra(Generic[T]):
    """What expressions are evaluated in.

    Attributes
    ----------
    number : from the text of a decimal number
    functions : the functions of :data:`UNARY`, by name
    where : ``where(d, a, b)`` is a if d > 0, else b
    divide, power : ``a / b`` and ``base**exponent``
    pi : the number pi
    """

    number: Callable[[str], T]
    functions: Mapping[str, Callable[[T], T]]
    where: Callable[[T, T, T], T]
    divide: Callable[[T, T], T]
    power: Callable[[T, T], T]
    pi: T


def parse(text: str | float) -> ast.expr:
    """Return the tree of an expression; names are looked up later.

    Raises
    ------
    ModelError
        If it is no expression of the language.

    Examples
    --------
    >>> sorted(names_in(parse("cos(Omega*t) - x")))
    ['Omega', 't', 'x']
    """
    source = _source(text)
    try:
        tree = ast.parse(source, mode="eval").body
    except SyntaxError as error:
        raise ModelError(f"cannot read '{source}': {_syntax(source, error)}") from None
    except (ValueError, RecursionError, MemoryError):
        raise ModelError(f"cannot read '{_short(source)}': it is nested too deeply") from None
    _check(tree, source, 0)
    return tree


def _source(text: str | float) -> str:
    if isinstance(text, bool) or not isinstance(text, (str, int, float)):
        raise ModelError(f"an expression is a text or a number, got {text!r}")
    source = str(text).strip()
    if not source:
        raise ModelError("the expression is empty")
    if len(source) > _LONGEST:
        raise ModelError(f"an expression has at most {_LONGEST} characters, this one {len(source)}")
    return " ".join(source.split())


def _syntax(source: str, error: SyntaxError) -> str:
    words = {w for w in re.findall(r"\w+", source) if keyword.iskeyword(w)}
    if foreign := sorted(words - {"and", "or", "not", "if", "else"}):
        return f"'{foreign[0]}' is a word of Python: {_instead(foreign[0])}"
    if "if" in words:
        return "a choice is written where(condition, a, b)"
    place = source[max((error.offset or 1) - 1, 0) :]
    where = f" near '{_short(place)}'" if place else " at its end"
    product = re.search(r"(?<![\w.])\d+(?:\.\d*)?\s*[A-Za-z_(]|\w\s+\w|\)\s*[\w(]", source)
    hint = f": a product needs its * (in '{product.group()}')" if product else ""
    return f"{error.msg or 'no expression'}{where}{hint}"


def _instead(word: str) -> str:
    return f"write {word}_" + (" or λ" if word == "lambda" else "")


def _short(text: str) -> str:
    return text if len(text) <= 40 else f"{text[:37]}..."


def _check(node: ast.AST, source: str, depth: int) -> None:
    """Refuse whatever is not on the list."""
    if depth > _DEEPEST:
        raise ModelError(f"'{_short(source)}' is nested too deeply: name parts of it in 'define'")
    if isinstance(node, ast.Constant):
        _check_number(node, source)
    elif isinstance(node, ast.Name):
        pass
    elif isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        _check(node.left, source, depth + 1)
        _check(node.right, source, depth + 1)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.UAdd, ast.USub)):
        _check(node.operand, source, depth + 1)
    elif isinstance(node, ast.Call):
        _check_call(node, source, depth)
    else:
        kind = node.op if isinstance(node, (ast.BinOp, ast.UnaryOp, ast.BoolOp)) else node
        _refuse(kind, source)


def _refuse(node: ast.AST, source: str) -> None:
    advice = _ADVICE.get(type(node))
    if advice is None and isinstance(node, (ast.Compare, ast.BoolOp, ast.And, ast.Or, ast.Not)):
        advice = "a condition can only stand at the first place of where(condition, a, b)"
    if advice is None:
        advice = "only numbers, names, + - * / **, parentheses and functions can stand here"
    raise ModelError(f"in '{_short(source)}': {advice}")


def _check_number(node: ast.Constant, source: str) -> None:
    value = node.value
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ModelError(f"in '{_short(source)}': {value!r} is no number")
    if not abs(value) <= sys.float_info.max:
        raise ModelError(f"in '{_short(source)}': a number is too large")


def unknown_function(name: str, known: Sequence[str], source: str) -> str:
    """Return what to say of a function that there is not."""
    hint = advice_on(name, known)
    return f"in '{_short(source)}': unknown function '{name}'{hint} (a product needs its *)"


def _check_call(node: ast.Call, source: str, depth: int) -> None:
    if not isinstance(node.func, ast.Name):
        raise ModelError(
            f"in '{_short(source)}': a call has the name of a function before the parenthesis; "
            "a product needs its *"
        )
    name, count = node.func.id, len(node.args)
    if name not in FUNCTIONS:
        raise ModelError(unknown_function(name, FUNCTIONS, source))
    if node.keywords or any(isinstance(a, ast.Starred) for a in node.args):
        raise ModelError(f"in '{_short(source)}': {name}() takes plain arguments")
    wanted = "3" if name == "where" else "1" if name in UNARY else "2 or more"
    if (wanted == "2 or more" and count < 2) or (wanted != "2 or more" and count != int(wanted)):
        raise ModelError(f"in '{_short(source)}': {name}() takes {wanted} arguments, got {count}")
    for index, argument in enumerate(node.args):
        if name == "where" and index == 0:
            _check_condition(argument, source, depth + 1)
        else:
            _check(argument, source, depth + 1)


def _check_condition(node: ast.expr, source: str, depth: int) -> None:
    if depth > _DEEPEST:
        raise ModelError(f"'{_short(source)}' is nested too deeply")
    if isinstance(node, ast.Compare):
        for operator in node.ops:
            if not isinstance(operator, _COMPARISONS):
                _refuse(operator, source)
        for side in (node.left, *node.comparators):
            _check(side, source, depth + 1)
    elif isinstance(node, ast.BoolOp):
        for part in node.values:
            _check_condition(part, source, depth + 1)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        _check_condition(node.operand, source, depth + 1)
    else:
        raise ModelError(
            f"in '{_short(source)}': the first argument of where() is a condition such as x > 0"
        )


def names_in(tree: ast.expr) -> set[str]:
    """Return the names of an expression, without those of functions."""
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    return {
        node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and id(node) not in called
    }


def check_name(name: object, what: str) -> str:
    """Return a name that expressions can use.

    Raises
    ------
    ModelError
        If it is no identifier, or has a fixed meaning already.
    """
    if not isinstance(name, str) or not name.isidentifier() or name.startswith("_"):
        raise ModelError(
            f"{what} {name!r}: a name has letters, digits and _, and begins with a letter"
        )
    if keyword.iskeyword(name):
        raise ModelError(f"{what} '{name}': this is a word of Python; {_instead(name)}")
    if name in RESERVED:
        meaning = _MEANINGS.get(name, "a function")
        raise ModelError(f"{what} '{name}': this name means {meaning}; take another one")
    if unicodedata.normalize("NFKC", name) != name:
        raise ModelError(f"{what} '{name}': write it with plain letters")
    return name


@dataclass
class Scope(Generic[T]):
    """Names with their values in an algebra; definitions are evaluated when they are first used."""

    algebra: Algebra[T]
    values: dict[str, T]
    defines: Mapping[str, ast.expr] = field(default_factory=dict)
    _open: list[str] = field(default_factory=list)

    def lookup(self, name: str) -> T:
        """Return the value of a name."""
        if name == PI:
            return self.algebra.pi
        if name not in self.values:
            self.values[name] = self._defined(name)
        return self.values[name]

    def _defined(self, name: str) -> T:
        if name not in self.defines:
            known = [*self.values, *(d for d in self.defines if d not in self.values), PI]
            raise ModelError(f"unknown name '{name}'{did_you_mean(name, known)}")
        if name in self._open:
            ring = " -> ".join([*self._open[self._open.index(name) :], name])
            raise ModelError(f"'{name}' is defined by itself: {ring}")
        self._open.append(name)
        try:
            return self.evaluate(self.defines[name])
        finally:
            self._open.pop()

    def evaluate(self, node: ast.expr) -> T:
        """Return the value of a tree."""
        if isinstance(node, ast.Constant):
            return self.algebra.number(repr(node.value))
        if isinstance(node, ast.Name):
            return self.lookup(node.id)
        if isinstance(node, ast.UnaryOp):
            value: Any = self.evaluate(node.operand)
            return -value if isinstance(node.op, ast.USub) else value  # type: ignore[no-any-return]
        if isinstance(node, ast.BinOp):
            return self._binary(node)
        assert isinstance(node, ast.Call)
        assert isinstance(node.func, ast.Name)
        return self._call(node.func.id, node.args)

    def _binary(self, node: ast.BinOp) -> T:
        left: Any = self.evaluate(node.left)
        right: Any = self.evaluate(node.right)
        operator = _OPERATORS[type(node.op)]
        if operator == "+":
            found = left + right
        elif operator == "-":
            found = left - right
        elif operator == "*":
            found = left * right
        elif operator == "/":
            found = self.algebra.divide(left, right)
        else:
            found = self.algebra.power(left, right)
        return found  # type: ignore[no-any-return]

    def _call(self, name: str, arguments: list[ast.expr]) -> T:
        if name == "where":
            return self._branch(arguments[0], *map(self.evaluate, arguments[1:]))
        if name in ("abs", "sign"):
            return of_product(self, self.algebra.functions[name], arguments[0])
        values: list[Any] = [self.evaluate(argument) for argument in arguments]
        if name in UNARY:
            return self.algebra.functions[name](values[0])
        found = values[0]
        for value in values[1:]:
            larger = value - found
            first, second = (found, value) if name == "min" else (value, found)
            found = self.algebra.where(larger, first, second)
        return found  # type: ignore[no-any-return]

    def _branch(self, condition: ast.expr, yes: T, no: T) -> T:
        if isinstance(condition, ast.UnaryOp):
            return self._branch(condition.operand, no, yes)
        if isinstance(condition, ast.BoolOp):
            *others, last = condition.values
            found = self._branch(last, yes, no)
            for part in reversed(others):
                either = isinstance(condition.op, ast.Or)
                found = self._branch(part, yes if either else found, found if either else no)
            return found
        assert isinstance(condition, ast.Compare)
        sides, found = [condition.left, *condition.comparators], yes
        for index in reversed(range(len(condition.ops))):
            found = self._compared(condition.ops[index], sides[index : index + 2], found, no)
        return found

    def _compared(self, operator: ast.cmpop, sides: list[ast.expr], yes: T, no: T) -> T:
        """Choose by one comparison; ``a >= b`` is asked for as ``b > a``, with the outcomes exchanged."""
        above = isinstance(operator, (ast.Gt, ast.LtE))
        left, right = sides if above else reversed(sides)
        if isinstance(operator, (ast.GtE, ast.LtE)):
            yes, no = no, yes
        return self.algebra.where(difference(self, left, right), yes, no)


def _real_power(base: float, exponent: float) -> float:
    try:
        value = base**exponent
    except ArithmeticError:
        return math.nan
    return math.nan if isinstance(value, complex) else float(value)


def _quiet(function: Callable[[float], float]) -> Callable[[float], float]:
    """Give nan where a function of the math module raises."""

    def value(x: float) -> float:
        try:
            return function(x)
        except (ValueError, OverflowError):
            return math.nan

    return value


#: Ordinary numbers; nan where there is no value.
FLOATS: Algebra[float] = Algebra(
    number=float,
    functions={
        **{name: _quiet(getattr(math, name)) for name in UNARY if name not in ("abs", "sign")},
        "abs": abs,
        "sign": lambda x: float((x > 0) - (x < 0)),
    },
    where=lambda d, a, b: a if d > 0 else b,
    divide=lambda a, b: a / b if b != 0.0 else math.nan,
    power=_real_power,
    pi=math.pi,
)


def number_of(text: str | float, values: Mapping[str, float]) -> float:
    """Evaluate an expression in ordinary numbers; nan where it has no value.

    Examples
    --------
    >>> number_of("2*a + 1", {"a": 3.0})
    7.0
    """
    return Scope(FLOATS, dict(values)).evaluate(parse(text))
