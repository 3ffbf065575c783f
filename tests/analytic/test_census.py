"""The census against a scan that shares nothing with it, and against families known from elsewhere.

The scan is for orbits that stick (zeta = h = 0). A release at ``u = S0`` is fixed by its phase; a slide
from rest is, with ``V = 1 / (1 - Omega^2)``,

    v = -(x0 - V cos(w0) + s S) sin(d) + V Omega sin(w0) cos(d) - V Omega sin(w0 + Omega d),

and ends at the first change of sign of v on a grid, refined by bisection; a stick is left at the next
instant with ``cos(w) = x -+ S0``. Periodic orbits of p periods are the phases that return to
themselves after p periods: changes of sign between neighbours on a fine grid of phases.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.matching import identity, stops_distance
from contfric.base.arrays import FloatArray
from contfric.censuses.itineraries import canonical_pair
from contfric.censuses.sections import exit_arcs
from contfric.signature.reduced import mirror_pair

TURN = 2.0 * math.pi
#: Grid of a slide (in natural time), and how long one is followed.
STEP, LONGEST = 0.02, 15.0
#: A return may change by this between two neighbouring phases (in periods), and be continuous.
SMOOTH = 0.05


def slide(w0: FloatArray, x0: FloatArray, s: FloatArray, omega: float, S: float) -> FloatArray:
    """Return durations of slides from rest, shape (K,)."""
    V = 1.0 / (1.0 - omega**2)

    def speed(d: FloatArray) -> FloatArray:
        a, b = x0 - V * np.cos(w0) + s * S, V * omega * np.sin(w0)
        shape = (-1,) + (1,) * (d.ndim - 1)
        a, b, w = a.reshape(shape), b.reshape(shape), w0.reshape(shape)
        return -a * np.sin(d) + b * np.cos(d) - V * omega * np.sin(w + omega * d)

    grid = np.arange(STEP, LONGEST, STEP)
    back = s[:, None] * speed(np.broadcast_to(grid, (len(w0), len(grid)))) < 0.0
    assert back.any(axis=1).all(), "a slide is longer than the grid"
    high = grid[np.argmax(back, axis=1)]
    low = high - STEP
    for _ in range(50):
        middle = 0.5 * (low + high)
        on = s * speed(middle) > 0.0
        low, high = np.where(on, middle, low), np.where(on, high, middle)
    return 0.5 * (low + high)


def position(w0, x0, s, d, omega: float, S: float) -> FloatArray:
    V = 1.0 / (1.0 - omega**2)
    free = (x0 - V * np.cos(w0) + s * S) * np.cos(d) + V * omega * np.sin(w0) * np.sin(d)
    return free + V * np.cos(w0 + omega * d) - s * S


def held(w: FloatArray, x: FloatArray, S0: float) -> tuple[FloatArray, FloatArray]:
    """Return the phase (radians, after w) at which a stick is left, and the direction of the slide."""
    best, side = np.full(len(w), np.inf), np.zeros(len(w))
    for direction, level in ((-1.0, x - S0), (1.0, x + S0)):
        inside = np.abs(level) <= 1.0
        angle = np.arccos(np.clip(level, -1.0, 1.0))
        # the load grows through S0 where f falls, and falls through -S0 where f grows
        root = angle if direction < 0 else -angle
        at = w + (root - w) % TURN
        at = np.where(inside, at, np.inf)
        side, best = np.where(at < best, direction, side), np.minimum(at, best)
    return best, side


def returns(phases: FloatArray, params: dict[str, float], periods: int, stops: int):
    """Yield, for every walk, the phases after each return to a release at u = S0 (NaN: no such walk)."""
    omega, S, S0 = params["Omega"], params["S"], params["S0"]
    w, x = TURN * phases, np.cos(TURN * phases) + S0
    s = np.full(len(w), -1.0)
    walk = np.zeros(len(w), dtype=np.int64)
    for _ in range(stops):
        live = np.isfinite(w) & (w < TURN * (phases + periods + 0.5))
        w = np.where(live, w, np.nan)
        d = np.zeros(len(w))
        d[live] = slide(w[live], x[live], s[live], omega, S)
        x = position(w, x, s, d, omega, S)
        w = w + omega * d
        load = x - np.cos(w)
        sticks = np.abs(load) < S0
        after, side = held(w, x, S0)
        w = np.where(sticks, after, w)
        s = np.where(sticks, side, -np.sign(load))
        walk = 4 * walk + 2 * sticks + (s > 0)
        released = sticks & (s < 0) & np.isfinite(w)
        yield np.where(released, w / TURN, np.nan), walk


def scanned(params: dict[str, float], periods: int, stops: int) -> list[tuple[int, float]]:
    """Return (periods, phase) of all releases at u = S0 of orbits that stick."""
    # off the ends of the arc, where a release is tangential
    phases = 0.5 * (np.arange(6000) + 0.5) / 6000
    found = []
    for after, walk in returns(phases, params, periods, stops):
        gap = after - phases
        for p in range(1, periods + 1):
            low, high = gap[:-1] - p, gap[1:] - p
            same = (walk[1:] == walk[:-1]) & (np.abs(high - low) < SMOOTH)
            for i in np.flatnonzero(same & (low * high <= 0.0)):
                share = low[i] / (low[i] - high[i])
                found.append((p, float(phases[i] + share * (phases[i + 1] - phases[i]))))
    return found


def listed(census: cf.Census, periods: int) -> list[tuple[int, float]]:
    """Return the same of the orbits of a census, their mirror images and repetitions."""
    found = []
    for orbit in census:
        images = [orbit] if orbit.symmetric else [orbit, orbit.mirror()]
        for image in images:
            at = [i for i, pair in enumerate(image.itinerary) if pair == ("stick", "F+")]
            for phase in image.ends[at, 0] * image.params["Omega"] / TURN:
                for times in range(1, periods // orbit.periods + 1):
                    found.append((times * orbit.periods, float(phase % 1.0)))
    return found


SCENES = {
    "1a and 2s": ({"Omega": 0.5, "S": 0.32, "S0": 0.4}, 2, 4),
    "two 1a": ({"Omega": 0.5376, "S": 0.32, "S0": 0.4}, 2, 4),
    "2a and 2s": ({"Omega": 0.4905, "S": 0.32, "S0": 0.4}, 2, 4),
    "chaos": ({"Omega": 0.6542, "S": 0.1913, "S0": 1.4024}, 3, 8),
    "short slides": ({"Omega": 0.2731, "S": 0.0827, "S0": 0.6333}, 2, 6),
}


@pytest.mark.parametrize("scene", SCENES)
def test_orbits_that_stick_are_those_of_a_scan(scene: str) -> None:
    params, periods, stops = SCENES[scene]
    census = cf.census("coulomb", params, periods=periods, stops=stops)
    # a scan follows repetitions up to its own number of stops only
    wanted = [
        (p, phase) for p, phase in listed(census, periods) if not _too_many(census, p, phase, stops)
    ]
    seen = scanned(params, periods, stops)
    assert len(seen) == len(wanted) > 0
    for p, phase in wanted:
        nearest = min(abs(phase - other) for q, other in seen if q == p)
        assert nearest < 2e-5, (p, phase)  # the grid's chord against the curve


def _too_many(census: cf.Census, periods: int, phase: float, stops: int) -> bool:
    """Tell whether the repetition of an orbit that has this release makes too many stops."""
    for orbit in census:
        for image in [orbit] if orbit.symmetric else [orbit, orbit.mirror()]:
            own = image.ends[:, 0] * image.params["Omega"] / TURN % 1.0
            if periods % orbit.periods == 0 and np.min(np.abs(own - phase)) < 1e-12:
                return len(orbit.stops) * (periods // orbit.periods) > stops
    raise AssertionError("no such release")


# ------------------------------------------------------------------------------- known families


def names(census: cf.Census) -> list[tuple[str, bool]]:
    return [(orbit.name, orbit.stable) for orbit in census]


@pytest.mark.parametrize(
    ("omega", "expected"),
    [
        (0.4905, [("2a", True), ("2s", False)]),
        (0.5, [("1a", True), ("2s", False)]),
        (0.53, [("1a", True), ("2s", False)]),
        (0.5376, [("0s", True), ("1a", False), ("1a", True)]),
        (0.55, [("0s", True)]),
    ],
)
def test_families_of_fig_5(omega: float, expected: list[tuple[str, bool]]) -> None:
    """Between the bifurcations of Fig. 5 (BP 0.48874, CS_s 0.53529, SN 0.54191)."""
    found = cf.census("coulomb", {"Omega": omega, "S": 0.32, "S0": 0.4})
    assert names(found) == expected
    assert found.complete


ONE_A = (("slide+", "v"), ("slide-", "v"), ("stick", "F-"))
TWO_A = (("slide+", "v"), ("stick", "F+"), ("slide-", "v"), ("stick", "F-"))


def test_period_adding_between_2a_and_1a() -> None:
    """Between the ends of 1a and 2a the orbits walk 2a once and 1a n - 1 times in n periods."""
    model = cf.load_model("coulomb")
    lengths = []
    for omega in (0.49176, 0.4918, 0.49181):
        found = cf.census("coulomb", {"Omega": omega, "S": 0.32, "S0": 0.4}, periods=5, stops=10)
        for orbit in found.stable:
            added = TWO_A + ONE_A * (orbit.periods - 1)
            mirrored = TWO_A + tuple(mirror_pair(pair, model) for pair in ONE_A) * (
                orbit.periods - 1
            )
            itineraries = {canonical_pair(model, added), canonical_pair(model, mirrored)}
            assert canonical_pair(model, orbit.itinerary) in itineraries
            lengths.append(orbit.periods)
    assert lengths == [2, 3, 4, 5]


@pytest.mark.parametrize(("omega", "S"), [(0.7, 0.1), (0.8, 0.3), (1.4, 0.2), (2.5, 0.3)])
def test_den_hartog(omega: float, S: float) -> None:
    """The symmetric orbit without a stick in closed form: x_max and the determinant."""
    found = [o for o in cf.census("coulomb", {"Omega": omega, "S": S, "S0": S}) if o.name == "0s"]
    assert len(found) == 1
    V = 1.0 / (1.0 - omega**2)
    U = math.sin(math.pi / omega) / (omega * (1.0 + math.cos(math.pi / omega)))
    x_max = math.sqrt(V**2 - S**2 * U**2)
    assert found[0].x_max == pytest.approx(x_max, rel=1e-12)
    half = (omega**2 * x_max - S) / (omega**2 * x_max + S)
    assert float(np.prod(found[0].multipliers).real) == pytest.approx(half**2, rel=1e-9)


def test_continuum_is_said() -> None:
    """At Omega = 1/2 and S = S0 asymmetric orbits form a continuum."""
    found = cf.census("coulomb", {"Omega": 0.5, "S": 0.3, "S0": 0.3})
    assert any("continuum" in line for line in found.limits)
    assert any("marginal" in line for line in found.table().splitlines())


def test_nothing_moves_under_a_large_limit() -> None:
    """With S0 above the amplitude of the load everything comes to rest."""
    found = cf.census("coulomb", {"Omega": 0.7, "S": 1.5, "S0": 1.6})
    assert len(found) == 0 and found.complete
    assert any("come to rest for ever" in line for line in found.limits)


# ----------------------------------------------------------------------- conditions, by themselves


def test_arcs_of_two_harmonics() -> None:
    """At rest u' = Omega (sin w + 3 h sin 3 w): it is met at F+ where that is positive."""
    h = 0.5
    model = cf.load_model("coulomb")
    arcs = exit_arcs(model, model.vector({"h": h}))["stick", "F+"]
    # sin 3w = 3 sin w - 4 sin^3 w, so that the rate vanishes at sin^2 w = (1 + 9 h) / (12 h), too
    inner = math.asin(math.sqrt((1.0 + 9.0 * h) / (12.0 * h))) / TURN
    expected = [(0.0, inner), (0.5 - inner, 0.5), (0.5 + inner, 1.0 - inner)]
    assert np.allclose(arcs, expected, rtol=0.0, atol=1e-12)


def test_every_orbit_is_found_once_by_any_net() -> None:
    params = SCENES["chaos"][0]
    found = cf.census("coulomb", params, periods=4, stops=8)
    other = cf.census("coulomb", params, periods=4, stops=8, finer=1, seed=1)
    assert names(found) == names(other)
    for i, one in enumerate(found):
        for known in found.orbits[:i]:
            if one.periods == known.periods and identity(one) == identity(known):
                assert stops_distance(one.stops, known.stops, True) > 1e-6
