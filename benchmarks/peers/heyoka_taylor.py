"""A slide by heyoka: Taylor's method compiled by LLVM, the stop a root of the polynomial of a step."""

from __future__ import annotations

from collections.abc import Sequence

import heyoka as hy
import numpy as np

from peers.oscillator import Counter, Failure, Params, Tangent, checked, until


def _compiled(tangents: int, tolerance: float) -> hy.taylor_adaptive_dbl:
    """Return an integrator of the slide with this many tangents; compiling takes some 0.1 s."""
    x, v, a, va, b, vb = hy.make_vars("x", "v", "a", "va", "b", "vb")
    omega, force, sign = hy.par[0], hy.par[1], hy.par[2]
    phase = omega * hy.time
    equations = [
        (x, v),
        (v, hy.cos(phase) - force - x),
        (a, va),
        (va, -a),
        (b, vb),
        (vb, -hy.time * hy.sin(phase) - b),
    ][: 2 + 2 * tangents]
    # the velocity in the direction of the slide falls through zero at the stop, and rises from zero before
    stop = hy.t_event(sign * v, direction=hy.event_direction.negative)
    state = [0.0] * len(equations)
    return hy.taylor_adaptive(equations, state, tol=tolerance, t_events=[stop])


class Heyoka:
    """The tolerance; 0 stands for that of the arithmetic. All variants are compiled at once, before use."""

    unit = "steps"

    def __init__(self, rtol: float) -> None:
        self.rtol = rtol
        self._integrators = [_compiled(tangents, rtol) for tangents in range(3)]

    def slide(
        self,
        t: float,
        x: float,
        sign: int,
        params: Params,
        counter: Counter,
        tangents: Sequence[Tangent] = (),
    ) -> tuple[float, np.ndarray]:
        """See :class:`peers.oscillator.Integrator`."""
        integrator = self._integrators[len(tangents)]
        integrator.reset_cooldowns()
        integrator.time = t
        integrator.pars[:] = (params[0], sign * params[1], sign)
        integrator.state[:] = (x, 0.0, *(v for tangent in tangents for v in tangent))
        limit = until(t, params)
        steps = integrator.propagate_until(limit)[3]
        counter.calls += steps
        if integrator.time >= limit:
            raise Failure("a slide without a stop")
        return checked(t, integrator.time), integrator.state.copy()
