"""The oscillator of the benchmarks, the tolerances, the methods, and contfric's starts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from full_form import full_form

import contfric as cf
from contfric.orbit.orbit import Orbit

#: Those of Fig. 5 of the article that the project started from.
S, S0 = 0.32, 0.4
#: Omega of the orbit, on the stable part of branch 1a; and near its fold, at 0.5419.
OMEGA, NEAR_FOLD = 0.5, 0.54
#: From what a user sees in a picture to what double precision bears.
RTOLS = [10.0**-k for k in range(4, 13)]
TOLS = [10.0**-k for k in range(3, 10)]
#: Nodes of the first mesh of collocation: enough for its loosest tolerance.
NODES = 21

#: Package -> what it is called in the tables; those that are not installed are left out.
OPTIONAL = {"heyoka": "heyoka", "scikit-sundae": "CVODE", "diffrax": "diffrax"}


def params_at(omega: float) -> dict[str, float]:
    """Return the parameters as contfric takes them."""
    return {"Omega": omega, "S": S, "S0": S0}


def orbit_at(omega: float, full: bool = False) -> Orbit:
    """Return orbit 1a, in reduced or in full form."""
    orbit = cf.solve_orbit("coulomb", "1a", params_at(omega))
    return full_form(orbit) if full else orbit


def rows_of(itinerary: tuple[tuple[str, str], ...]) -> list[int]:
    """Rows of the release, the upper stop and the lower stop among the joints of an itinerary."""
    modes = [mode for mode, _ in itinerary]
    return [
        next(i for i in range(len(modes)) if modes[i] == name and modes[i - 1] != name)
        for name in ("slide+", "slide-", "stick")
    ]


def joints_of(orbit: Orbit) -> tuple[float, ...]:
    """Return (t0, x0, t1, x1, t2, x2)."""
    return tuple(map(float, orbit.joints[rows_of(orbit.itinerary), :2].ravel()))


def versions() -> tuple[dict[str, str], list[str]]:
    """Return the versions of the optional packages that are installed, and the names of the others."""
    present, absent = {}, []
    for name in OPTIONAL:
        try:
            present[name] = version(name)
        except PackageNotFoundError:
            absent.append(name)
    return present, absent


@dataclass(frozen=True)
class Method:
    """An integrator for a slide, with the itineraries for it."""

    name: str
    setting: str
    how: Any


def integrators() -> Iterator[Method]:
    """Every integrator that is installed, at every tolerance; the compiled ones are compiled here."""
    from peers.dop853 import Dop853

    for name, refined in (("DOP853", False), ("DOP853, stops refined", True)):
        for rtol in RTOLS:
            yield Method(name, f"rtol {rtol:.0e}", Dop853(rtol, refined))
    present, _ = versions()
    if "heyoka" in present:
        from peers.heyoka_taylor import Heyoka

        for rtol in [*RTOLS, 0.0]:  # 0: its default, the precision of the arithmetic
            yield Method("heyoka", f"tol {rtol:.0e}" if rtol else "tol default", Heyoka(rtol))
    if "scikit-sundae" in present:
        from peers.cvode import Cvode

        for rtol in RTOLS:
            yield Method("CVODE", f"rtol {rtol:.0e}", Cvode(rtol))
    if "diffrax" in present:
        from peers.diffrax_dopri8 import Diffrax

        for rtol in RTOLS:
            yield Method("diffrax", f"rtol {rtol:.0e}", Diffrax(rtol))
