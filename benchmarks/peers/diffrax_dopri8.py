"""A slide by diffrax: Dopri8 compiled by XLA, the stop found by Newton on the interpolant of a step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import optimistix

from peers.oscillator import Counter, Failure, Params, Tangent, checked, until

jax.config.update("jax_enable_x64", True)

#: More steps than any slide takes at the smallest tolerance (they number about 20).
MOST_STEPS = 4096
#: Of the Newton iteration for the stop: that of the arithmetic, for velocities and times of size 1.
ROOT = 1e-14

#: By default the first step is so short that rounding rules its error and, with it, the length of those that
#: follow: the return is then not smooth, and Newton does not converge for tolerances below 1e-7.
FIRST_STEP = 0.5


def _rate(t, z, args):
    omega, force, _ = args
    drive = (jnp.cos(omega * t) - force, 0.0, -t * jnp.sin(omega * t))
    pairs = [(z[2 * k + 1], drive[k] - z[2 * k]) for k in range(len(z) // 2)]
    return jnp.stack([value for pair in pairs for value in pair])


@jax.jit
def _slide(t, limit, start, args, rtol):
    """Compiled once for each number of tangents."""
    stop = diffrax.Event(
        lambda t, y, args, **_: args[2] * y[1],
        optimistix.Newton(ROOT, ROOT),
        direction=False,
    )
    found = diffrax.diffeqsolve(
        diffrax.ODETerm(_rate),
        diffrax.Dopri8(),
        t,
        limit,
        FIRST_STEP,
        start,
        args=args,
        event=stop,
        stepsize_controller=diffrax.PIDController(rtol=rtol, atol=rtol),
        saveat=diffrax.SaveAt(t1=True),
        max_steps=MOST_STEPS,
        throw=False,
    )
    return found.ts[0], found.ys[0], found.stats["num_steps"]


@dataclass(frozen=True)
class Diffrax:
    """Relative (and absolute) tolerance."""

    rtol: float
    unit: str = "steps"

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
        limit = until(t, params)
        start = np.array([x, 0.0, *(v for tangent in tangents for v in tangent)])
        args = (params[0], sign * params[1], float(sign))
        end, z, steps = _slide(t, limit, start, args, self.rtol)
        counter.calls += int(steps)
        if not end < limit:
            raise Failure("a slide without a stop")
        return checked(t, float(end)), np.asarray(z)
