"""Forces and dissipated work of contacts: energy balances, closed forms, and scipy's integrator."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import contfric as cf
from contfric.errors import ParameterError


@pytest.mark.slow
def test_elements_dissipate_what_masing_says() -> None:
    """A loop between -A and A of an element with stiffness k and limit S encloses 4 S (A - S/k)."""
    orbit = cf.find_orbit("iwan", {"F": 0.3, "S": 0.05, "W": 1.2}, state=[0.8, 0.0, 0.05, 0.1, 0.2])
    p, largest = orbit.params, 0.5 * (orbit.x_max - orbit.x_min)
    limits = {"weak": p["S"], "middle": p["n"] * p["S"], "strong": p["m"] * p["S"]}
    for name, limit in limits.items():
        loop = 4.0 * limit * (largest - limit / p["kt"])
        assert orbit.quantity(f"work({name})") == pytest.approx(loop, rel=1e-12)
        assert orbit.quantity(f"max(force({name}))") == pytest.approx(limit, rel=1e-12)
    dissipated = orbit.quantity("integral(c*v1**2) + work(weak) + work(middle) + work(strong)")
    assert dissipated == pytest.approx(orbit.quantity("integral(F*cos(W*t)*v1)"), rel=1e-12)


def storeys() -> tuple[cf.Orbit, dict[str, np.ndarray]]:
    orbit = cf.find_orbit("storeys")
    p = orbit.params
    stiffness = np.zeros((6, 6))
    stiffness[:5, :5] = p["k"] * (2.0 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1))
    stiffness[4, 4], stiffness[5, 5] = p["k"], p["kn"]
    braces = np.array(
        [[1.0, 0, 0, 0, 0, 0], [0, -1.0, 1.0, 0, 0, 0], [0, 0, 0, -1.0, 1.0, 0]]
    )  # low, middle, high
    return orbit, {"M": np.array([1.0, 1, 1, 1, 1, p["M"]]), "K": stiffness, "W": braces}


def braced(
    mode: str, t: float, y: np.ndarray, p: dict[str, float], parts: dict[str, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return accelerations and the forces of the braces: multipliers where they stick."""
    mass, braces = parts["M"], parts["W"]
    free = mass * p["F"] * np.cos(p["W"] * t) - parts["K"] @ y[:6] - p["c"] * mass * y[6:]
    forces = np.array([{"s": 0.0, "p": -p["S"], "n": p["S"]}[letter] for letter in mode])
    stuck = [i for i, letter in enumerate(mode) if letter == "s"]
    if stuck:
        held = braces[stuck]
        rest = held @ ((free + braces.T @ forces) / mass)
        forces[stuck] = -np.linalg.solve(held @ (held / mass).T, rest)
    return (free + braces.T @ forces) / mass, forces


def test_five_storeys_against_an_integrator() -> None:
    """Motion, work and forces from matrices that are written here, segment by segment."""
    orbit, parts = storeys()
    p, work, squares = orbit.params, np.zeros(3), np.zeros(3)
    impacts = 0.0
    for i, (mode, exit_) in enumerate(orbit.itinerary):
        (t0, *start), (t1, *end) = orbit.begins[i], orbit.ends[i]
        letters = mode.removesuffix("-")

        def rates(t: float, y: np.ndarray, letters: str = letters) -> np.ndarray:
            accelerations, forces = braced(letters, t, y, p, parts)
            slips = parts["W"] @ y[6:12]
            return np.concatenate([y[6:12], accelerations, -forces * slips, forces**2])

        def moving(t: float, y: np.ndarray) -> np.ndarray:
            return rates(t, y[:12])

        y0 = [*start, *np.zeros(6)]
        found = solve_ivp(moving, (t0, t1), y0, method="DOP853", rtol=1e-12, atol=1e-13)
        assert np.max(np.abs(found.y[:12, -1] - end)) < 1e-9
        work += found.y[12:15, -1]
        squares += found.y[15:, -1]
        if exit_ == "roof":
            before, behind = np.array(end), orbit.begins[(i + 1) % len(orbit.itinerary)][1:]
            assert behind[10] + p["M"] * behind[11] == pytest.approx(
                before[10] + p["M"] * before[11], abs=1e-12
            )
            assert behind[11] - behind[10] == pytest.approx(
                -p["e"] * (before[11] - before[10]), abs=1e-12
            )
            impacts += 0.5 * float(parts["M"] @ (before[6:] ** 2 - behind[6:] ** 2))
    assert impacts > 0.01
    assert orbit.quantity("work(roof)") == pytest.approx(impacts, abs=1e-10)
    for k, name in enumerate(("low", "middle", "high")):
        assert orbit.quantity(f"work({name})") == pytest.approx(work[k], abs=1e-9)
        rms = np.sqrt(squares[k] / orbit.period)
        assert orbit.quantity(f"rms(force({name}))") == pytest.approx(rms, abs=1e-9)


def test_gradients_of_work_and_force_are_those_of_neighbours() -> None:
    orbit, _ = storeys()
    names = ("work(roof)", "work(low) + work(high)", "max(q5)", "rms(force(middle))")
    for parameter, step in (("F", 1e-6), ("e", 1e-6)):
        beside = [
            cf.find_orbit(orbit.model, {parameter: orbit.params[parameter] + side * step})
            for side in (1.0, -1.0)
        ]
        assert {str(other.signature) for other in beside} == {str(orbit.signature)}
        for name in names:
            up, down = (other.quantity(name) for other in beside)
            found = orbit.gradient(name)[parameter]
            assert found == pytest.approx((up - down) / (2.0 * step), rel=1e-7, abs=1e-8)


def test_a_spring_pushes_and_keeps_its_energy() -> None:
    contacts = {"stop": {"kind": "spring", "gap": "0.3 - q1", "stiffness": "ks"}}
    model = cf.Mechanism(
        [[1.0]],
        [[0.1]],
        [[1.0]],
        contacts=contacts,
        force={"q1": "0.5*cos(w*t)"},
        parameters={"w": 0.9, "ks": 4.0},
        period="2*pi/w",
        quantities={"pressed": "max(force(stop))/ks"},
    )
    orbit = cf.find_orbit(model, {})
    assert orbit.quantity("work(stop)") == 0.0
    assert orbit.quantity("max(force(stop))") == pytest.approx(4.0 * (orbit.x_max - 0.3))
    assert cf.quantity_names(model)[-1] == "pressed"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("work(rof)", "no contact 'rof'; did you mean 'roof'"),
        ("max(force(q1))", "no contact 'q1'"),
        ("force(roof)", "varies along an orbit: write a functional of it"),
        ("work(v1 + v2)", "takes the name of a contact"),
        ("max(work(roof))", "cannot stand inside of another one"),
    ],
)
def test_mistakes(text: str, message: str) -> None:
    from contfric.quantities.registry import quantity_of

    with pytest.raises(ParameterError, match=message):
        quantity_of(text, cf.load_model("storeys"))


def test_other_models_have_no_contacts() -> None:
    with pytest.raises(ParameterError, match="those of contacts of a structure"):
        cf.find_orbit("coulomb").quantity("work(brake)")
