"""Two bridges in forty digits: pinned orbits written down by hand from the closed form of a slide.

With zeta = h = 0 a slide in direction s from rest at (t_0, x_0) is

    x = X cos(Omega t) - s S + (x_0 + s S - X cos(Omega t_0)) cos(t - t_0)
        + X Omega sin(Omega t_0) sin(t - t_0),      X = 1 / (1 - Omega^2).

A hold that lasts ``tau`` from a stop with ``|x - cos(Omega t)| = S0`` gives one orbit, so that both
bridges are curves ``Omega(tau)``: they begin at ``tau = 0``, turn where ``dOmega/dtau = 0`` and end where
the load is S0 again at the departure. Nothing here comes from contfric but what is compared.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import mpmath as mp
import numpy as np
import pytest

import contfric as cf
from contfric.orbit.index import index_of

DIGITS = 40
#: Located events are good to 1e-12; what a diagram says of an end is asked to this.
CLOSE = 1e-10
#: A slide: its state (x, v) at a time.
Slide = Callable[[mp.mpf], tuple[mp.mpf, mp.mpf]]


def slide(s: int, S: mp.mpf, omega: mp.mpf, t0: mp.mpf, x0: mp.mpf) -> Slide:
    """The closed form of the module's docstring."""
    X = 1 / (1 - omega**2)
    a = x0 + s * S - X * mp.cos(omega * t0)
    b = X * omega * mp.sin(omega * t0)

    def state(t: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
        c, d = mp.cos(t - t0), mp.sin(t - t0)
        x = X * mp.cos(omega * t) - s * S + a * c + b * d
        return x, -X * omega * mp.sin(omega * t) - a * d + b * c

    return state


def solved(equations: Callable[..., list[mp.mpf]], guess: Sequence[str]) -> list[mp.mpf]:
    with mp.workdps(DIGITS):
        found = mp.findroot(
            equations, [mp.mpf(g) for g in guess], tol=mp.mpf(10) ** (5 - 2 * DIGITS)
        )
        assert max(abs(e) for e in equations(*found)) < mp.mpf(10) ** (5 - DIGITS)
        return list(found)


# -------------------------------------------------- S = 0.32, S0 = 0.4: 1a to 2a, one hold


S_1A, S0_1A = mp.mpf(0.32), mp.mpf(0.4)  # the doubles


def one_hold(
    t0: mp.mpf, t1: mp.mpf, t3: mp.mpf, omega: mp.mpf, tau: mp.mpf
) -> tuple[list[mp.mpf], mp.mpf, mp.mpf]:
    """Residuals of: release at F-, slide+, stop on F+, hold, slide-, stick; and both stops."""
    x0 = mp.cos(omega * t0) - S0_1A
    x1, v1 = slide(1, S_1A, omega, t0, x0)(t1)
    x3, v3 = slide(-1, S_1A, omega, t1 + tau, x1)(t3)
    return [v1, x1 - mp.cos(omega * t1) - S0_1A, v3, x3 - x0], x1, x0


def departs_on_surface(omega: mp.mpf, t: mp.mpf, x: mp.mpf, S0: mp.mpf) -> mp.mpf:
    return x - mp.cos(omega * t) - S0


@cache
def exact_ends_of_1a_bridge() -> tuple[list[mp.mpf], list[mp.mpf]]:
    """(t0, t1, t3, Omega) at tau = 0 and (t0, t1, t3, Omega, tau) at the other end."""
    first = solved(lambda *z: one_hold(*z, mp.mpf(0))[0], ("7.563", "12.768", "19.12", "0.4918"))

    def last(*z: mp.mpf) -> list[mp.mpf]:
        residuals, x1, _ = one_hold(*z)
        return [*residuals, departs_on_surface(z[3], z[1] + z[4], x1, S0_1A)]

    return first, solved(last, ("7.5657", "12.7694", "19.1196", "0.49175", "0.0157"))


@cache
def fig05() -> cf.Diagram:
    params = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
    return cf.explore(cf.find_orbit("coulomb", params), "Omega", (0.4, 0.6))


def the_bridge(found: cf.Diagram, symmetric: bool = False) -> cf.Branch:
    (bridge,) = [
        b for b in found.branches if b.bridge and not b.mirrored and b.symmetric is symmetric
    ]
    return bridge


@pytest.mark.parametrize("side", [0, 1])
def test_ends_of_the_bridge_from_1a(side: int) -> None:
    bridge = the_bridge(fig05())
    exact = exact_ends_of_1a_bridge()[side]
    tau = exact[4] if side else mp.mpf(0)
    _, *stops = one_hold(*exact[:4], tau)
    tip = bridge[-side]
    assert abs(tip.params["Omega"] - float(exact[3])) < CLOSE
    assert np.allclose(sorted(tip.stops), sorted(map(float, stops)), rtol=0, atol=CLOSE)


@pytest.mark.parametrize(("name", "side"), [("1a", 0), ("2a", 1)])
def test_ends_are_those_of_the_regular_branches(name: str, side: int) -> None:
    found = fig05()
    tip = the_bridge(found)[-side]
    regular = next(b for b in found.branches if b.name == name and not b.mirrored)
    k = [end.reason is cf.EndReason.SS for end in regular.ends].index(True)
    end = regular[-k]
    assert abs(end.params["Omega"] - tip.params["Omega"]) < CLOSE
    gap = [abs(np.sort(end.stops) - np.sort(s * tip.stops)).max() for s in (1.0, -1.0)]
    assert min(gap) < CLOSE
    event = regular.ends[k].bifurcation
    assert event is not None
    exact = exact_ends_of_1a_bridge()[side][3]
    assert abs(event.params["Omega"] - float(exact)) < CLOSE


def test_values_of_the_design() -> None:
    """The event of 1a was computed before there were bridges, by simulation on both sides."""
    first, last = exact_ends_of_1a_bridge()
    assert float(first[3]) == pytest.approx(0.4918166595317494, abs=1e-14)
    assert float(last[3]) == pytest.approx(0.49174881385286, abs=1e-13)


def test_inner_points_of_the_bridge_from_1a() -> None:
    bridge = the_bridge(fig05())
    assert len(bridge) > 4
    for orbit in bridge:
        first = orbit.system.holds[0].segment - 1  # the slide that ends where the hold begins
        starts = np.roll(orbit.cycle[:, 0], -first)
        starts[len(starts) - first :] += orbit.period
        tau = mp.mpf(float(starts[2] - starts[1]))
        guess = [repr(float(c)) for c in (*starts[[0, 1, 3]], orbit.params["Omega"])]
        exact = solved(lambda *z, tau=tau: one_hold(*z, tau)[0], guess)
        assert abs(float(exact[3]) - orbit.params["Omega"]) < 1e-12


# ------------------------------------- S = 0.17605, S0 = 0.219291: 0s to 2s, two mirrored holds


S_0S, S0_0S = mp.mpf(0.17605), mp.mpf(0.219291)


def two_holds(t0: mp.mpf, x0: mp.mpf, omega: mp.mpf, tau: mp.mpf) -> list[mp.mpf]:
    """Residuals of half an orbit: slide-, stop on F- at the mirror image of x0, hold."""
    t1 = t0 + mp.pi / omega - tau
    x1, v1 = slide(-1, S_0S, omega, t0, x0)(t1)
    return [v1, x1 + x0, x1 - mp.cos(omega * t1) + S0_0S]


def orbit_of_hold(tau: mp.mpf, guess: Sequence[str] = ("14.5", "1.198", "0.4295")) -> list[mp.mpf]:
    return solved(lambda *z: two_holds(*z, tau), guess)


@cache
def exact_ends_of_0s_bridge() -> tuple[list[mp.mpf], list[mp.mpf]]:
    first = orbit_of_hold(mp.mpf(0), ("14.228", "1.1995", "0.4276"))

    def last(*z: mp.mpf) -> list[mp.mpf]:
        # half a turn on the load is that of the mirror image: the departure is the start of the half
        t0, x0, omega, tau = z
        return [*two_holds(t0, x0, omega, tau), x0 - mp.cos(omega * t0) - S0_0S]

    return first, solved(last, ("15.186", "1.1942", "0.4285", "1.048"))


@cache
def exact_fold() -> mp.mpf:
    """Omega where dOmega/dtau = 0, by the implicit function theorem on the residuals."""

    def stationary(*z: mp.mpf) -> list[mp.mpf]:
        # J (t0', x0', Omega') = -dF/dtau has Omega' = 0: the other two columns and dF/dtau are dependent
        columns = [
            [mp.diff(lambda *w, row=row: two_holds(*w)[row], z, orders) for row in range(3)]
            for orders in ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 0, 1))
        ]
        return [*two_holds(*z), mp.det(mp.matrix(columns))]

    with mp.workdps(DIGITS):
        start = [mp.mpf(g) for g in ("14.6", "1.199", "0.4297", "0.45")]
        found = mp.findroot(stationary, start, tol=mp.mpf(10) ** -40)
        return found[2]


@cache
def symmetric_diagram() -> cf.Diagram:
    params = {"Omega": 0.44, "S": 0.17605, "S0": 0.219291}
    return cf.explore(cf.find_orbit("coulomb", params), "Omega", (0.42, 0.44))


@pytest.mark.parametrize("side", [0, 1])
def test_ends_of_the_symmetric_bridge(side: int) -> None:
    bridge = the_bridge(symmetric_diagram(), symmetric=True)
    assert bridge.symmetric and bridge[0].signature.holds == 2
    exact, tip = exact_ends_of_0s_bridge()[side], bridge[-side]
    assert abs(tip.params["Omega"] - float(exact[2])) < CLOSE
    assert abs(tip.x_max - float(exact[1])) < CLOSE
    assert float(exact[2]) == pytest.approx((0.427578, 0.4285)[side], abs=(5e-7, 5e-5)[side])


@pytest.mark.parametrize(("name", "side"), [("0s, 10seg", 0), ("2s, 10seg", 1)])
def test_symmetric_ends_are_those_of_the_regular_branches(name: str, side: int) -> None:
    found = symmetric_diagram()
    tip = the_bridge(found, symmetric=True)[-side]
    regular = next(b for b in found.branches if b.name == name)
    k = [end.reason is cf.EndReason.SS for end in regular.ends].index(True)
    end = regular[-k]
    assert abs(end.params["Omega"] - tip.params["Omega"]) < CLOSE
    assert np.allclose(np.sort(end.stops), np.sort(tip.stops), rtol=0, atol=CLOSE)


def test_the_index_tells_of_the_bridge_with_one_hold() -> None:
    """Where 2s ends and the bridge with two holds begins, one with one hold and its image must be, too.

    2s (-1) is on the one side, the bridge (+1) on the other: without the pair (+1 each) nothing balances.
    """
    found = symmetric_diagram()
    (event,) = [e for e in found.events if abs(e.bifurcation.params["Omega"] - 0.4285234) < 1e-6]
    meeting = [found.branches[i] for i in event.branches]
    assert sorted((b.symmetric, b.bridge) for b in meeting) == [
        (False, True),
        (False, True),
        (True, False),
        (True, True),
    ]
    sides: dict[bool, int] = {}
    for branch in meeting:
        at = int(np.argmin(np.abs(branch.values - event.bifurcation.params["Omega"])))
        beside = branch[at + 1 if at + 1 < len(branch) else at - 1]
        above = beside.params["Omega"] > event.bifurcation.params["Omega"]
        sides[above] = sides.get(above, 0) + (index_of(beside) or 0)
    assert sides == {False: 1, True: 1}


def test_fold_of_the_symmetric_bridge() -> None:
    (fold,) = [
        b
        for b in the_bridge(symmetric_diagram(), symmetric=True).bifurcations
        if b.kind is cf.Kind.SN
    ]
    assert abs(fold.params["Omega"] - float(exact_fold())) < CLOSE
    assert fold.params["Omega"] == pytest.approx(0.42970, abs=1e-5)
