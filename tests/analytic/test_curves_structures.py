"""Curves in two parameters of models with impacts, without excitation, and of Filippov's kind.

Each against equations that share nothing with the library (closed forms, matrix exponentials, another
integrator) or, where there are none, against fine runs in one parameter.
"""

from __future__ import annotations

from functools import cache
from math import cos, pi, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from by_scipy import slip, slower_than_the_belt
from scipy.linalg import expm
from scipy.optimize import brentq, fsolve

import contfric as cf
from contfric.continuation.points import PointRows, Settings
from contfric.continuation.singular_points.switching import leave_along, null_direction
from contfric.curves.points import first_curve_point, march_rows
from contfric.curves.trace import continue_bifurcation
from tests.curve_check import miss

#: Integrated models from end to end: minutes of processor time, run by `make test-all`.
pytestmark = pytest.mark.slow

SWITCHED = str(Path(__file__).parents[1] / "models" / "switched.yaml")

#: Where each model's diagram starts: parameters, start of the simulation, and the range.
STARTS: dict[str, tuple[dict[str, float], dict[str, Any], tuple[str, float, float]]] = {
    "impact-friction": ({"k": 5.2}, {"state": [-0.08, 0.0], "time": -1.5}, ("k", 4.0, 7.0)),
    "impact": ({}, {}, ("A", 0.01, 1.0)),
    "popp": ({"omega": 1.72}, {}, ("omega", 1.6, 1.9)),
    "belt": ({"vb": 0.2}, {}, ("vb", 0.02, 10.0)),
    "dead-band": ({"delta": 0.1}, {}, ("alpha", 0.5, 4.0)),
    SWITCHED: ({"A": 0.75}, {"state": [-1.0, 0.0, 0.2]}, ("A", 0.5, 1.2)),
}
PLANES: dict[str, dict[str, tuple[float, float]]] = {
    "impact-friction": {"k": (2.0, 20.0), "b": (0.5, 1.2)},
    "impact": {"w": (0.4, 2.5), "A": (0.01, 2.0)},
    "popp": {"omega": (1.4, 2.0), "F": (0.03, 0.2)},
    "belt": {"vb": (0.05, 10.0), "delta": (0.2, 10.0)},
    "dead-band": {"alpha": (0.3, 6.0), "delta": (0.03, 0.6)},
    SWITCHED: {"A": (0.4, 1.0), "C": (0.7, 1.3)},
}


@cache
def diagram(name: str) -> cf.Diagram:
    params, start, (parameter, low, high) = STARTS[name]
    orbit = cf.find_orbit(name, params, **start)
    return cf.explore(orbit, parameter, (low, high), max_periods=4, bridges=False)


@cache
def curve(name: str, kind: str, orbits: str, value: float | None = None) -> cf.Curve:
    """Return the curve of a kind of the orbits of a name, through the event nearest to a value."""
    parameter = STARTS[name][2][0]
    found = [
        e
        for branch in diagram(name).branches
        for e in branch.bifurcations
        if e.kind.value == kind and branch.name == orbits
    ]
    event = min(found, key=lambda e: 0.0 if value is None else abs(e.params[parameter] - value))
    plane = PLANES[name]
    return continue_bifurcation(event, tuple(plane), plane)


def some(found: cf.Curve, count: int = 12) -> list[int]:
    """Return inner points of a curve, evenly."""
    return np.linspace(0, len(found) - 1, count + 2).astype(int)[1:-1].tolist()


def point_of(found: cf.Curve, name: str) -> cf.SpecialPoint:
    return next(s for s in found.special if s.name == name)


# ------------------------------------------------------------------- impacts: closed forms

FF, E = 0.7961, 0.9
SHARE = (1 + E) ** 2


def test_switching_of_impact_with_friction_in_closed_form() -> None:
    """The mass stops at x = -Ff/k after the impact: ``16 Ff^2 / k = (1 + e)^2 (1 - (b - Ff/k)^2)``."""
    found = curve("impact-friction", "SS", "1a, 5seg, 1imp", 5.57)
    k, b = found.values.T
    gap = SHARE * (1.0 - (b - FF / k) ** 2) - 16.0 * FF**2 / k
    assert len(found) > 60 and np.max(np.abs(gap)) < 1e-12
    multiplier = SHARE * (b - FF / k) / (4.0 * FF)
    computed = np.concatenate([part.turn_multipliers[:, 0].real for part in found.parts])
    assert computed == pytest.approx(multiplier, abs=1e-9)


def test_fold_of_impact_with_friction_in_closed_form() -> None:
    found = curve("impact-friction", "SN", "1a, 5seg, 1imp")
    k, b = found.values.T
    x = 4 * FF / SHARE - b
    expected = 8 * FF**2 / (SHARE * (1 - (x + b) ** 2) + 8 * FF * x)
    assert len(found) > 60 and k == pytest.approx(expected, rel=1e-11)


def test_fold_meets_switching() -> None:
    """Where the multiplier is 1 on SS: ``b - Ff/k = s = 4 Ff / (1 + e)^2``."""
    s = 4 * FF / SHARE
    k = 16 * FF**2 / (SHARE * (1 - s * s))
    b = s + FF / k
    on_fold = point_of(curve("impact-friction", "SN", "1a, 5seg, 1imp"), "SN-SS")
    on_switching = point_of(curve("impact-friction", "SS", "1a, 5seg, 1imp", 5.57), "SS-SN")
    assert on_switching.params["k"] == pytest.approx(k, abs=1e-10)
    assert on_switching.params["b"] == pytest.approx(b, abs=1e-12)
    assert on_fold.params["k"] == pytest.approx(k, abs=1e-8)
    assert on_fold.params["b"] == pytest.approx(b, abs=1e-9)


def test_curve_of_the_other_event_starts_at_the_point() -> None:
    """Its first orbit stops on the surface to rounding, and has a name all the same."""
    found = point_of(curve("impact-friction", "SS", "1a, 5seg, 1imp", 5.57), "SS-SN")
    event, plane = found.bifurcation(), PLANES["impact-friction"]
    assert event is not None and event.kind is cf.Kind.SN
    fold = continue_bifurcation(event, tuple(plane), plane)
    assert fold.label == "SN_1a, 5seg, 1imp" and len({orbit.name for orbit in fold}) <= 2


def test_switching_ends_where_the_wall_grazes_the_flight() -> None:
    """In closed form: up from x = -Ff/k with the speed after the impact, and the wall is just touched."""
    found = point_of(curve("impact-friction", "SS", "1a, 5seg, 1imp", 5.57), "SS-GS")

    def conditions(u: Any) -> list[float]:
        k, b, t = u
        w = sqrt(k)
        x = -FF / k
        begin = float(np.arcsin(x + b))
        speed = (1 + E) * cos(begin)
        d = t - begin
        if d < pi / (2 * w):  # up
            place, rate = x + speed / w * sin(w * d), speed * cos(w * d)
        else:  # and back
            top, d = x + speed / w, d - pi / (2 * w)
            place = FF / k + (top - FF / k) * cos(w * d)
            rate = -(top - FF / k) * w * sin(w * d)
        stops = SHARE * (1.0 - (b - FF / k) ** 2) - 16.0 * FF**2 / k
        return [stops, place - (sin(t) - b), rate - cos(t)]

    test = next(t for t in found.tests if t.surface == "wall")
    orbit = found.orbit
    start = float(orbit.cycle[test.segment, 0])
    times = np.linspace(start, float(orbit.ends[test.segment, 0]), 2001)[1:-1]
    near = min(times, key=lambda t: orbit.state(t)[0] - (sin(t) - found.params["b"]))
    shift = 2 * pi * round((near - 1.0) / (2 * pi))
    k, b, _ = fsolve(conditions, [found.params["k"], found.params["b"], near - shift], xtol=1e-13)
    assert found.params["k"] == pytest.approx(k, abs=1e-9)
    assert found.params["b"] == pytest.approx(b, abs=1e-10)


def response(w: Any) -> Any:
    """Return the amplitude of the force for an amplitude 1 of the response."""
    return np.sqrt((1.0 - w * w) ** 2 + 0.01 * w * w)


@pytest.mark.parametrize("orbits", ["0a, 2seg", "0a, 2seg, 1imp"])
def test_grazing_impact_in_closed_form(orbits: str) -> None:
    """The response without an impact has the amplitude d = 1: from either side of the grazing."""
    found = curve("impact", "GS", orbits)
    w, force = found.values.T
    assert len(found) > 100 and force == pytest.approx(response(w), rel=1e-12)
    assert [str(end) for end in found.ends] == ["end of the range asked for"] * 2


def fold_force(w: float) -> float:
    """Return the force at the fold of the orbit with one impact.

    With the speed u at the stop, ``(1 - P) x_p = (1, u) - P (1, -e u)``, P the free motion over a period:
    the square of the response's amplitude is a parabola in u.
    """
    z, d = 0.05, 2 * pi / w
    free = expm(np.array([[0.0, 1.0], [-1.0, -2 * z]]) * d)
    inverse = np.linalg.inv(np.eye(2) - free)
    scale = np.array([1.0, 1.0 / w])
    base = scale * (inverse @ (np.array([1.0, 0.0]) - free @ [1.0, 0.0]))
    slope = scale * (inverse @ (np.array([0.0, 1.0]) - free @ [0.0, -0.8]))
    u = -(base @ slope) / (slope @ slope)
    return float(response(w) * np.linalg.norm(base + u * slope))


def test_fold_of_impact_in_closed_form() -> None:
    found = curve("impact", "SN", "0a, 2seg, 1imp")
    w, force = found.values.T
    chosen = np.linspace(0, len(found) - 1, 30).astype(int)
    assert force[chosen] == pytest.approx([fold_force(x) for x in w[chosen]], rel=1e-10)


def test_fold_of_impact_begins_on_grazing_at_the_natural_frequency() -> None:
    """A disturbance of the speed has no effect on the place a period later: ``w^2 = k - c^2 / 4``."""
    point = point_of(curve("impact", "SN", "0a, 2seg, 1imp"), "SN-GS")
    assert point.params["w"] == pytest.approx(sqrt(1.0 - 0.0025), abs=1e-8)
    assert point.params["A"] == pytest.approx(0.1 * sqrt(1.0 - 0.03 / 16), abs=1e-9)


# ------------------------------------------------------------------------------ Filippov


POPP = [("PD", "0a, 4seg", None), ("GS", "0a, 4seg", None), ("SN", "1a, 5seg", None)]


@pytest.mark.parametrize("kind, orbits, value", POPP)
def test_popp_against_runs_in_one_parameter(kind: str, orbits: str, value: float | None) -> None:
    found = curve("popp", kind, orbits, value)
    for i in some(found):
        assert miss(found[i], found.kinds[i], "omega") < 1e-9, found[i].params


def test_popp_curve_of_doublings_by_the_values_of_the_page() -> None:
    """Doublings in omega at given F, by another integrator."""
    found = curve("popp", "PD", "0a, 4seg")
    table = {0.09: 1.67255088341, 0.1: 1.71298103623, 0.12: 1.76610218792, 0.15: 1.82335414075}
    for force, omega in table.items():
        k = int(np.argmin(np.abs(found.values[:, 1] - force)))
        start = found[k].state(4 * pi / found.values[k, 0])
        solved = fsolve(lambda u, f=force: doubled(u[:2], u[2], f), [*start, omega], xtol=1e-13)
        assert omega == pytest.approx(solved[2], abs=1e-10)
        assert crossing(found, force) == pytest.approx(
            omega, abs=1e-6
        )  # of the cubic between points


def crossing(found: cf.Curve, force: float) -> float:
    from scipy.interpolate import CubicSpline

    return float(CubicSpline(found.arc, found.values[:, 0])(arc_at(found, force)))


def arc_at(found: cf.Curve, force: float) -> float:
    from scipy.interpolate import CubicSpline

    place = CubicSpline(found.arc, found.values[:, 1] - force)
    return float(brentq(place, found.arc[0], found.arc[-1], xtol=1e-14))


def doubled(start: Any, omega: float, force: float, begin: float = 0.0) -> list[float]:
    """Miss the start, and the multiplier -1, after two periods of motion slower than the belt."""
    end = slower_than_the_belt(start, omega, (begin, begin + 4 * pi / omega), force)
    return [*(end[:2] - start), np.linalg.det(end[2:].reshape(2, 2) + np.eye(2))]


def test_popp_doubling_ends_on_grazing() -> None:
    """From a touch of the belt's speed without acceleration, closed after two periods, multiplier -1."""
    on_doubling = point_of(curve("popp", "PD", "0a, 4seg"), "PD-GS")
    on_grazing = point_of(curve("popp", "GS", "0a, 4seg"), "GS-PD")
    for name in ("omega", "F"):
        assert on_doubling.params[name] == pytest.approx(on_grazing.params[name], abs=1e-11)
    orbit = on_grazing.orbit
    times = np.linspace(0.0, orbit.period, 4001) + orbit.cycle[0, 0]
    top = max(times, key=lambda t: orbit.state(t)[1])

    def conditions(u: Any) -> list[float]:
        t, omega, force = u
        return doubled(np.array([1.5 + force * cos(omega * t), 1.0]), omega, force, t)

    guess = [top, on_grazing.params["omega"], on_grazing.params["F"]]
    _, omega, force = fsolve(conditions, guess, xtol=1e-13)
    assert on_grazing.params["omega"] == pytest.approx(omega, abs=1e-9)
    assert on_grazing.params["F"] == pytest.approx(force, abs=1e-9)


def test_popp_doublings_pass_touches_of_rest_and_end_at_the_belt() -> None:
    """A block that comes to rest for an instant is not at the speed of the belt: nothing changes there."""
    orbit = cf.find_orbit("popp", {"omega": 2.35, "F": 0.83})
    doubling = next(
        b
        for b in cf.continue_orbit(orbit, "omega", (2.3, 2.4)).bifurcations
        if b.kind is cf.Kind.PD
    )
    box = {"omega": (2.3, 2.7), "F": (0.8, 1.5)}
    found = cf.continue_bifurcation(doubling, ("omega", "F"), box)
    touch = min(found.special, key=lambda p: abs(p.params["F"] - 0.8438125))
    assert touch.name == "PD-T" and touch.params["omega"] == pytest.approx(2.356266, abs=1e-6)
    speeds = [touch.orbit.state(t)[1] for t in np.linspace(0.0, touch.orbit.period, 2001)]
    assert max(speeds) < 0.9  # slower than the belt
    (end,) = (p for p in found.special if p.name == "PD-GS")
    speeds = [end.orbit.state(t)[1] for t in np.linspace(0.0, end.orbit.period, 20_001)]
    assert max(speeds) == pytest.approx(1.0, abs=1e-6)
    assert end.params["F"] == pytest.approx(1.32, abs=1e-2)
    start = end.orbit.state(2 * 2 * pi / end.params["omega"])
    force = end.params["F"]
    solved = fsolve(
        lambda u: doubled(u[:2], u[2], force), [*start, end.params["omega"]], xtol=1e-13
    )
    assert end.params["omega"] == pytest.approx(solved[2], abs=1e-9)


def test_popp_grazing_is_one_curve_in_two_itineraries() -> None:
    """Of the orbit without a stick (a touch inside) and of that with one (a tangential stop)."""
    a, b = curve("popp", "GS", "0a, 4seg"), curve("popp", "GS", "1a, 5seg")
    for found in (a, b):
        assert str(found.label) == "GS_a"
    for i in some(b):
        orbit = b[i]
        assert crossing(a, orbit.params["F"]) == pytest.approx(orbit.params["omega"], abs=2e-7)


def test_belt_by_another_integrator() -> None:
    """SS: a slip from x = 1 comes back at x = -1; CS: the next one ahead of the belt ends at x = 1."""
    switching = curve("belt", "SS", "1a, 5seg")
    for i in some(switching):
        vb, delta = switching.values[i]
        assert slip(vb, delta, 1.0, -1.0) == pytest.approx(-1.0, abs=1e-9)
    crossing_ = curve("belt", "CS", "0a, 8seg")
    for i in some(crossing_):
        vb, delta = crossing_.values[i]
        behind = slip(vb, delta, 1.0, -1.0)
        assert slip(vb, delta, behind, 1.0) == pytest.approx(1.0, abs=1e-9)


def test_plane_of_the_belt() -> None:
    """Without excitation and of Filippov's kind: both curves, each once, and what lives on both sides."""
    orbit = cf.find_orbit("belt", {"vb": 0.2})
    ranges = {"vb": (0.1, 8.0), "delta": (0.5, 6.0)}
    plane = cf.explore_plane(orbit, ("vb", "delta"), ranges, max_sections=2, max_periods=1)
    labels = sorted(c.label for k, c in enumerate(plane.curves) if plane.twins[k] == k)
    assert labels == ["CS_a", "SS_a"]
    assert len(plane.regions) == 3 and not any(r.disputed for r in plane.regions)
    assert {f.name for r in plane.regions for f in r.families} == {
        "0a, 8seg",
        "1a, 5seg",
        "1a, 8seg",
    }


# ---------------------------------------------------------------------- without excitation


@pytest.mark.parametrize("kind, orbits", [("SN", "0s, 12seg"), ("CS", "0s, 12seg"), ("SS", "2s")])
def test_dead_band_against_runs_in_one_parameter(kind: str, orbits: str) -> None:
    found = curve("dead-band", kind, orbits)
    for i in some(found):
        assert miss(found[i], found.kinds[i], "alpha") < 1e-9, found[i].params


class Pieces:
    """Cycles of ``x''' + A x'' + C x' = |x| - 1`` as products of matrix exponentials.

    Its field is continuous, so the tangent map of a cycle is the product as well.
    """

    def __init__(self, orbit: cf.Orbit) -> None:
        self.signs = [1.0 if mode == "right" else -1.0 for mode, _ in orbit.itinerary]
        self.durations = (orbit.ends[:, 0] - orbit.cycle[:, 0]).tolist()
        self.start = orbit.cycle[0, 2:].tolist()

    def cycle(self, u: Any, c: float) -> tuple[list[float], np.ndarray]:
        """Return what vanishes for a cycle, and its tangent map; u is (x', x'', durations, A)."""
        state, tangent, gaps = np.array([0.0, u[0], u[1], 1.0]), np.eye(3), []
        for sign, d in zip(self.signs, u[2:-1], strict=True):
            field = np.zeros((4, 4))
            field[0, 1] = field[1, 2] = 1.0
            field[2] = [sign, -c, -u[-1], -1.0]
            moved = expm(field * d)
            state, tangent = moved @ state, moved[:3, :3] @ tangent
            gaps.append(state[0])
        return [*gaps, state[1] - u[0], state[2] - u[1]], tangent

    def event(self, c: float, near: float, sign: float) -> float:
        """Return A at which a multiplier is ``sign``, at 1 in addition to the trivial one."""

        def conditions(u: Any) -> list[float]:
            gaps, tangent = self.cycle(u, c)
            polynomial = np.poly(tangent)
            rest = np.polydiv(polynomial, [1.0, -1.0])[0]  # the trivial multiplier is taken away
            return [*gaps, float(np.polyval(rest, sign))]

        return float(fsolve(conditions, [*self.start, *self.durations, near], xtol=1e-13)[-1])


@pytest.mark.parametrize(
    "kind, orbits, value, sign",
    [
        ("PD", "0a, 4seg", 0.7277, -1.0),
        ("PD", "0a, 8seg", 0.6542, -1.0),
        ("SN", "0a, 14seg", 0.5755, 1.0),
    ],
)
def test_autonomous_curves_by_matrix_exponentials(
    kind: str, orbits: str, value: float, sign: float
) -> None:
    found = curve(SWITCHED, kind, orbits, value)
    for i in some(found):
        orbit = found[i]
        expected = Pieces(orbit).event(orbit.params["C"], orbit.params["A"], sign)
        assert orbit.params["A"] == pytest.approx(expected, abs=1e-9), (i, orbit.params)


def test_autonomous_doubling_changes_its_criticality() -> None:
    """At the degenerate PD the doubled orbits leave to the other side."""
    found = curve(SWITCHED, "PD", "0a, 8seg", 0.6542)
    point = point_of(found, "GPD")
    sides = []
    for offset in (-0.02, 0.02):
        k = int(np.argmin(np.abs(found.arc - point.position - offset)))
        orbit = found[k]
        value = orbit.params["A"]
        settings = Settings("A", value - 0.1, value + 0.1, "", "", 0.2)
        doubled = orbit.doubled()
        departure = leave_along(doubled, settings, null_direction(doubled), 1e-2)
        assert departure is not None
        sides.append(departure.point.value - value)
    assert sides[0] * sides[1] < 0.0


def test_autonomous_cusp_turns_both_parameters() -> None:
    found = curve(SWITCHED, "SN", "0a, 14seg", 0.5755)
    point = point_of(found, "CUSP")
    k = int(np.searchsorted(found.arc, point.position))
    before, after = found.values[k - 1] - found.values[k - 4], found.values[k + 3] - found.values[k]
    assert np.all(before * after < 0.0)
    other = point_of(curve(SWITCHED, "SN", "0a, 14seg", 0.5139), "CUSP")
    for name in ("A", "C"):  # the curve through the fold on the other side of the branch
        assert other.params[name] == pytest.approx(point.params[name], abs=1e-9)


# ------------------------------------------------------------------ gradients of the condition


def tangent_miss(found: cf.Curve, index: int) -> float:
    """Return how far the tangent of a curve, which its gradient gives, is from the chord around it."""
    problem = found.parts[0].problem
    assert problem is not None
    first = first_curve_point(problem, found[index])
    assert first is not None
    start, border = first
    sides = []
    for point in (start, start.reversed()):  # a step of the same length to each side
        rows = PointRows.empty(problem.system, 2, 2)
        rows.put(0, point)
        _, last, _ = march_rows(problem, rows, 0, point, 0, border.copy(), 1e-4, 1e-4)
        assert last == 1
        sides.append(np.concatenate([rows.joints[1].ravel(), rows.w[1]]))
    chord = sides[0] - sides[1]
    tangent = np.concatenate([start.tangent.ravel(), start.direction])
    return float(np.max(np.abs(chord / np.linalg.norm(chord) - tangent / np.linalg.norm(tangent))))


def test_gradient_behind_resets_and_without_excitation() -> None:
    for found in (
        curve("impact-friction", "SN", "1a, 5seg, 1imp"),
        curve("impact", "SN", "0a, 2seg, 1imp"),
        curve("dead-band", "SN", "0s, 12seg"),
        curve(SWITCHED, "PD", "0a, 4seg", 0.7277),
    ):
        assert tangent_miss(found, len(found) // 2) < 1e-6, found


def test_gradient_of_a_divided_exit_row() -> None:
    """A fast cycle has short pieces in fast motion, whose field jumps where they end."""
    event = next(e for e in diagram("dead-band").bifurcations if e.kind is cf.Kind.SN)
    plane = {"alpha": (1.0, 60.0), "delta": (0.005, 0.2)}
    found = continue_bifurcation(event, tuple(plane), plane)
    itineraries = found.parts[0].system.itinerary
    fast = next(i for i, (mode, _) in enumerate(itineraries) if mode.startswith("fast"))
    lasts = [float(orbit.ends[fast, 0] - orbit.cycle[fast, 0]) for orbit in found]
    short = [k for k, d in enumerate(lasts) if 0.02 < d < 0.09]
    assert len(short) > 5
    for k in short[::5]:
        assert tangent_miss(found, k) < 1e-7, lasts[k]


# --------------------------------------------------------------------------------- refusals


def test_degenerate_switching_is_refused_by_name() -> None:
    """x = Ff/k = 1 - b: the wall just reaches the mass, and both slides have no length."""
    events = [b for d in diagram("impact-friction").branches for b in d.bifurcations]
    event = min(events, key=lambda e: abs(e.params["k"] - 5.20667))
    plane = PLANES["impact-friction"]
    with pytest.raises(cf.ConvergenceError, match="no curve with a unique direction"):
        continue_bifurcation(event, tuple(plane), plane)
