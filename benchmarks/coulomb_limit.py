"""The Coulomb limit of the LuGre oscillator: how orbits of `lugre` approach those of `coulomb`.

Along the path ``vS sqrt(sigma0) = 5``: the micro-oscillations of a stick have speeds of about
S0 / sqrt(sigma0), which must stay below vS, or they wear the static limit off. Prints the table of
docs/lugre.md.
"""

from __future__ import annotations

import numpy as np

import contfric as cf

#: Kinetic friction where the symmetric orbit 2s attracts, and where 1a does (Omega = 1/2, S0 = 0.4).
FRICTION = (0.38, 0.2)
STIFFNESS = (1e4, 1e5, 1e6, 1e7)
PATH = 5.0


def extrema(orbit: cf.Orbit) -> np.ndarray:
    """Return the larger and the smaller amplitude: mirror images have the same."""
    return np.sort([orbit.x_max, -orbit.x_min])


def main() -> None:
    """Print the table."""
    print("| S | orbit | sigma0 | vS | difference of the amplitudes | largest multiplier |")
    print("|---|---|---|---|---|---|")
    for S in FRICTION:
        params = {"Omega": 0.5, "S": S, "S0": 0.4}
        limit = cf.find_orbit("coulomb", params)
        for sigma0 in STIFFNESS:
            vS = PATH / sigma0**0.5
            orbit = cf.find_orbit("lugre", {**params, "sigma0": sigma0, "vS": vS}, longest=400)
            gap = float(np.max(np.abs(extrema(orbit) - extrema(limit))))
            mu = float(np.max(np.abs(orbit.multipliers)))
            print(
                f"| {S} | {limit.name} | {sigma0:g} | {vS:.5f} | {gap:.2e} | {mu:.4f} |", flush=True
            )
        mu = float(np.max(np.abs(limit.multipliers)))
        print(f"| {S} | {limit.name} | coulomb | | 0 | {mu:.4f} |", flush=True)


if __name__ == "__main__":
    main()
