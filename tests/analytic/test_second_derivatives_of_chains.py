"""Second derivatives of a whole chain from several joints at once, against its equations in 40 digits."""

from __future__ import annotations

from typing import Any

import mpmath as mp
import numpy as np
import pytest

import contfric as cf
from contfric.bvp.system import build_system
from contfric.continuation.singular_points.crossing import _ChainProblem

MODEL = cf.load_model("coulomb")
OMEGA, S, S0, ZETA, WIDTH = 0.5, 0.32, 0.4, 0.07, 0.3
UP, DOWN = ("slide+", "v"), ("slide-", "v")
REST_UP, REST_DOWN = ("stick", "F+"), ("stick", "F-")
#: Chains by their numbers of segments: even and odd ones, which joints are moved together of differs.
CHAINS = {
    4: (UP, REST_UP, DOWN, REST_DOWN),
    5: (UP, DOWN, UP, DOWN, REST_DOWN),
    6: (UP, DOWN, REST_DOWN, UP, REST_UP, DOWN),
    7: (UP, REST_UP, DOWN, UP, DOWN, UP, DOWN),
}


def slide(sign: int, t: Any, x: Any, v: Any, d: Any, omega: Any) -> tuple[Any, Any]:
    """State after a slide, by its particular solution and decaying rotation."""
    z = mp.mpf(ZETA)
    answer = 1 / (1 - omega**2 + 2j * z * omega)

    def steady(at: Any) -> tuple[Any, Any]:
        wave = answer * mp.expj(omega * at)
        return wave.real - sign * mp.mpf(S), (1j * omega * wave).real

    r = mp.sqrt(1 - z * z)
    a = x - steady(t)[0]
    b = (v - steady(t)[1] + z * a) / r
    c, s, e = mp.cos(r * d), mp.sin(r * d), mp.exp(-z * d)
    y, w = steady(t + d)
    return y + e * (a * c + b * s), w + e * ((b * r - z * a) * c - (a * r + z * b) * s)


def residual(segment: tuple[str, str], z: list[Any], shift: Any, turned: bool) -> list[Any]:
    """The equations of a segment, from its joint, the next one and the frequency over WIDTH.

    Parameters
    ----------
    shift : periods between the next joint and the end of the last segment (``turned``)
    """
    mode, exit_ = segment
    t, x, v, after, y, w, omega = z
    omega = omega * mp.mpf(WIDTH)
    end = after + shift * 2 * mp.pi / omega if turned else after
    moved = (
        (x, mp.mpf(0))
        if mode == "stick"
        else slide(1 if mode == "slide+" else -1, t, x, v, end - t, omega)
    )
    u = y - mp.cos(omega * end)
    level = {"v": w, "F+": u - mp.mpf(S0), "F-": u + mp.mpf(S0)}[exit_]
    return [moved[0] - y, moved[1] - w, level]


@pytest.mark.parametrize("count", list(CHAINS))
def test_second_derivatives_of_long_chains(count: int) -> None:
    """At no orbit: the equations hold for any joints. Every segment lasts, so that no exit is a short one."""
    itinerary, draw = CHAINS[count], np.random.default_rng(count)
    periods = 2 if count > 5 else 1
    system = build_system(MODEL, itinerary, periods)
    assert system.segments == count
    vector = MODEL.vector({"Omega": OMEGA, "S": S, "S0": S0, "zeta": ZETA})
    lasts = draw.uniform(0.7, 1.3, count) * periods * 2.0 * np.pi / OMEGA / count
    times = np.cumsum(lasts) - lasts[0] + 0.4
    joints = np.column_stack([times, draw.uniform(-1.5, 1.5, count), draw.normal(0.0, 0.2, count)])
    x = np.append(joints.ravel(), OMEGA / WIDTH)
    problem = _ChainProblem(system, vector, MODEL.index_of("Omega"), WIDTH)
    psi = draw.normal(size=3 * count)
    expected, found = np.zeros((len(x), len(x))), np.empty(3 * count)
    with mp.workdps(50):
        step = mp.mpf(10) ** -12
        for i, segment in enumerate(itinerary):
            after = 3 * ((i + 1) % count)
            own = [*range(3 * i, 3 * i + 3), *range(after, after + 3), len(x) - 1]
            at = [mp.mpf(float(x[k])) for k in own]

            def weighed(k: int, j: int, a: int, b: int, segment=segment, i=i, at=at) -> Any:
                z = [q + step * (a * (n == k) + b * (n == j)) for n, q in enumerate(at)]
                rows = residual(segment, z, periods, i + 1 == count)
                return sum(
                    mp.mpf(float(p)) * r for p, r in zip(psi[3 * i :][:3], rows, strict=True)
                )

            found[3 * i : 3 * i + 3] = residual(segment, at, periods, i + 1 == count)
            for k in range(7):
                for j in range(k + 1):
                    corners = weighed(k, j, 1, 1) - weighed(k, j, 1, -1)
                    corners += weighed(k, j, -1, -1) - weighed(k, j, -1, 1)
                    value = float(corners / (4 * step * step))
                    expected[own[k], own[j]] += value
                    if j != k:
                        expected[own[j], own[k]] += value
    assert problem.at(x)[0] == pytest.approx(found, abs=1e-12)
    assert np.max(np.abs(problem.hessian(x, psi) - expected)) < 1e-6 * np.max(np.abs(expected))
