"""The operations of a tape by their codes; apart, since who writes a tape compiles nothing."""

from __future__ import annotations

#: What stands at the beginning of an expression: a number, time, a state, a parameter, an observable.
CONSTANT, TIME, STATE, PARAMETER, OBSERVABLE = range(5)
#: What is made of others.
NEGATE, ADD, SUBTRACT, MULTIPLY, DIVIDE, POWER, WHERE = range(5, 12)
#: Functions of one argument, in the order of :data:`contfric.models.language.grammar.UNARY`.
FIRST_FUNCTION = 12
