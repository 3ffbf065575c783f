"""What the engine asks of a flow, closed form or integrated: seven compiled functions and optional ones.

The engine knows nothing else of a model's motion: not how a state is advanced, how many states there
are, or what the excitation looks like. The types of the functions stand in
:mod:`contfric.compiled`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from contfric.flow.integrated import Functions


@dataclass(frozen=True)
class CompiledFlow:
    """The compiled functions of a model; indices follow the order of its definition.

    Attributes
    ----------
    flow : state after a duration in one mode, with its derivatives
    observe : value of an observable, with its gradient
    level : level of a surface, with its gradient
    stationary : interior stationary times of an observable along a segment
    hit : first time at which an observable takes a level
    period : period of the excitation (0 for an autonomous model), with its gradient
    rate : rate of an observable along a mode, with its gradient
    reset : state after the reset at a surface, with its derivatives; None if the model has no resets
    second : second derivatives in a direction, for curves in two parameters; without it they are
        differences of the first ones
    together : first hits of many motions at once, with derivatives; without it each is asked for by itself
    made_of : the functions of the model that solutions are integrated from; None of a flow that is not
    """

    flow: Any
    observe: Any
    level: Any
    stationary: Any
    hit: Any
    period: Any
    rate: Any
    reset: Any = field(default=None, kw_only=True)
    second: Any = field(default=None, kw_only=True)
    together: Any = field(default=None, kw_only=True)
    made_of: Functions | None = field(default=None, kw_only=True)

    def functions(self) -> int:
        """Return the functions as kernels take them: a handle (:mod:`contfric.flow.layouts`)."""
        return self._blocks[0].address  # type: ignore[no-any-return]

    def following(self) -> int:
        """Return the functions for kernels that only follow motions: without ``stationary``.

        It is not compiled for them: the orbits ask for it, but neither a simulation nor a Lyapunov exponent.
        """
        return self._blocks[1].address  # type: ignore[no-any-return]

    @property
    def second_derivatives(self) -> int:
        """Return the second derivatives as kernels take them; what says that there are none by default."""
        return self._blocks[2].address  # type: ignore[no-any-return]

    def hits_together(self) -> int:
        """Return the first hits of many solutions as kernels take them."""
        return self._together.address  # type: ignore[no-any-return]

    @cached_property
    def _together(self) -> Any:
        from contfric.flow.layouts import TOGETHER
        from contfric.flow.without import no_together
        from contfric.handle import Block

        return Block(TOGETHER, {"together": self.together or no_together})

    @cached_property
    def _blocks(self) -> tuple[Any, Any, Any]:
        """The memory after the handles: all functions, those without ``stationary``, second derivatives."""
        from contfric.flow.layouts import FLOW, SECOND
        from contfric.flow.resets import no_reset
        from contfric.flow.without import no_second, no_stationary
        from contfric.handle import Block

        values = {name: getattr(self, name) for name in FLOW}
        values["reset"] = self.reset or no_reset
        return (
            Block(FLOW, values),
            Block(FLOW, {**values, "stationary": no_stationary}),
            Block(SECOND, {"second": self.second or no_second}),
        )
