"""What the engine asks of a flow, closed form or integrated: seven compiled functions and optional ones.

The engine knows nothing else of a model's motion: not how a state is advanced, how many states there
are, or what the excitation looks like. The types of the functions stand in
:mod:`contfric.compiled`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

#: Place of ``turning`` among the functions.
_TURNING = 3


@dataclass(frozen=True)
class CompiledFlow:
    """The compiled functions of a model; indices follow the order of its definition.

    Attributes
    ----------
    flow : state after a duration in one mode, with its derivatives
    observe : value of an observable, with its gradient
    level : level of a surface, with its gradient
    turning : interior stationary times of an observable along a segment
    hit : first time at which an observable takes a level
    period : period of the excitation (0 for an autonomous model), with its gradient
    rate : rate of an observable along a mode, with its gradient
    reset : state behind the reset at a surface, with its derivatives; None if the model has no resets
    second : second derivatives in a direction, for curves in two parameters; without it they are
        differences of the first ones
    """

    flow: Any
    observe: Any
    level: Any
    turning: Any
    hit: Any
    period: Any
    rate: Any
    reset: Any = field(default=None, kw_only=True)
    second: Any = field(default=None, kw_only=True)

    def functions(self) -> tuple[Any, ...]:
        """Return the functions as kernels take them."""
        return self._first_class

    def following(self) -> tuple[Any, ...]:
        """Return the functions for kernels that only follow motions: without ``turning``.

        Where motion is integrated, ``turning`` takes half of the time of compilation; the orbits ask for
        it, but neither a simulation nor a Lyapunov exponent does.
        """
        return self._without_turning

    @cached_property
    def second_derivatives(self) -> Any:
        """Return the second derivatives as kernels take them; one that says that there is none by default."""
        from contfric.compiled import FirstClass
        from contfric.flow.without import no_second

        return FirstClass(no_second if self.second is None else self.second)

    @cached_property
    def _without_turning(self) -> tuple[Any, ...]:
        from contfric.compiled import FirstClass
        from contfric.flow.resets import no_reset
        from contfric.flow.without import no_turning

        order = (
            self.flow,
            self.observe,
            self.level,
            no_turning,
            self.hit,
            self.period,
            self.rate,
            self.reset or no_reset,
        )
        return tuple(FirstClass(kernel) for kernel in order)

    @cached_property
    def _first_class(self) -> tuple[Any, ...]:
        from contfric.compiled import FirstClass

        before, after = self._without_turning[:_TURNING], self._without_turning[_TURNING + 1 :]
        return (*before, FirstClass(self.turning), *after)
