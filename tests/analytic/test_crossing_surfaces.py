"""Sliding where two switching surfaces cross: derived fields, what follows, and what is refused.

The reference is the same system with steep slopes of width eps in the place of its switches, integrated by
scipy (Radau): its solutions come to those of the switched system in proportion to eps.
"""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from by_scipy import after, misses

import contfric as cf
from contfric.models.entries import EntryError
from contfric.models.reading.files import from_data

#: Two blocks on one belt, coupled by a spring: each switch drives its own block only.
BLOCKS = """
name: two-blocks
states: [x, u, y, w]
parameters: {vb: 0.4, S: 1.0, R: 0.7, k: 0.6, q: 0.0}
autonomous: true
constraints: [S > 0, R > 0]
surfaces:
  a: {observable: u, level: vb, sliding: filippov}
  b: {observable: w, level: vb, sliding: filippov}
field:
  x: u
  u: -x - k*(x - y) - S*sign(u - vb)
  y: w
  w: -y - k*(y - x) - R*sign(w - vb) + q*sign(u - vb)*sign(w - vb)
modes:
  pp: {in: {a: "+", b: "+"}}
  pm: {in: {a: "+", b: "-"}}
  mp: {in: {a: "-", b: "+"}}
  mm: {in: {a: "-", b: "-"}}
"""

#: One block on another, which is on a belt: the upper contact drives both blocks.
STACK = (
    BLOCKS.replace("two-blocks", "stack")
    .replace("R: 0.7", "R: 0.35")
    .replace("surfaces:", "observables: {rel: w - u}\nsurfaces:")
    .replace("{observable: w, level: vb", "{observable: rel, level: 0")
    .replace("- k*(x - y) - S*sign(u - vb)", "- S*sign(u - vb) + R*sign(w - u)")
    .replace("-y - k*(y - x) - R*sign(w - vb)", "-k*y - R*sign(w - u)")
)


#: Both rates of the blocks that switch.
SWITCHED = BLOCKS[BLOCKS.index("- S*sign") : BLOCKS.index("\nmodes")]


def switched(strength: int) -> str:
    """Return rates in which each switch drives the other block as well, so many times as strongly."""
    text = SWITCHED.replace("S*sign(u - vb)", f"S*sign(u - vb) - {strength}*S*sign(w - vb)")
    return text.replace("+ q*sign(u - vb)*sign(w - vb)", f"- {strength}*R*sign(u - vb)")


def typed(text: str) -> cf.Model:
    return from_data(yaml.safe_load(text.replace(" + q*sign(u - vb)*sign(w - vb)", "")))


def steep(p: dict[str, float], name: str, eps: float):
    def s(v: float) -> float:
        return float(np.clip(v / eps, -1, 1))

    def blocks(_, z):
        x, u, y, w = z
        a, b = s(u - p["vb"]), s(w - p["vb"])
        return [u, -x - p["k"] * (x - y) - p["S"] * a, w, -y - p["k"] * (y - x) - p["R"] * b]

    def stack(_, z):
        x, u, y, w = z
        a, b = s(u - p["vb"]), s(w - u)
        return [u, -x - p["S"] * a + p["R"] * b, w, -p["k"] * y - p["R"] * b]

    return blocks if name == "two-blocks" else stack


@pytest.mark.parametrize(
    "text", [BLOCKS, pytest.param(STACK, marks=pytest.mark.slow)], ids=["blocks", "stack"]
)
def test_solutions_are_the_limit_of_steep_slopes(text: str) -> None:
    model = typed(text)
    assert model.filippov
    rng, visited = np.random.default_rng(5), set()
    for _ in range(4):
        start = rng.uniform(-1.5, 1.5, 4)
        found = cf.simulate(model, {}, state=start, periods=12.0)
        visited |= {mode for mode, _ in found.itinerary}
        last = len(found) - 1
        errors = []
        for eps in (1e-4, 1e-5):
            rates = steep(model.defaults, model.name, eps)
            span = 0, float(found.times[last])
            end = after(rates, start, span, method="Radau", rtol=1e-8, atol=1e-10)
            errors.append(float(np.max(np.abs(end - found.states[last]))))
        assert errors[1] < 3e-4 and errors[1] < 0.3 * errors[0] + 1e-6, errors
    assert "slide_a_b" in visited  # on both
    assert visited & {"slide_a_b_above", "slide_a_b_below"}
    assert visited & {"slide_b_a_above", "slide_b_a_below"}


def test_the_field_on_both_surfaces_keeps_both() -> None:
    """Both blocks of the first model move with the belt; the stack moves as one where none slips."""
    model = typed(BLOCKS)
    flow = model.view(model.vector({}))
    y = np.array([0.1, 0.4, 0.2, 0.4])
    assert np.allclose(flow.state("slide_a_b", 0.0, y, 0.5), [0.3, 0.4, 0.4, 0.4], atol=1e-12)
    stack = typed(STACK)
    flow = stack.view(stack.vector({}))
    assert np.allclose(flow.state("slide_a_b", 0.0, y, 0.5), [0.3, 0.4, 0.4, 0.4], atol=1e-12)
    # the upper contact sticks, the lower one slips backwards: both have the mean acceleration
    beside = np.array([0.3, 0.1, 0.2, 0.1])
    ahead = flow.state("slide_b_a_below", 0.0, beside, 1e-6)
    mean = 0.5 * (-0.3 + 1.0 - 0.6 * 0.2)
    assert (ahead - beside)[[1, 3]] / 1e-6 == pytest.approx([mean, mean], abs=1e-5)


#: Two coordinates whose inertia, coupling and friction depend on the state, and time; the matrix is inverted.
ARM = """
name: arm
states: [x, u, y, w]
parameters: {S: 0.6, R: 0.4, m: 0.5, q: 0.3, A: 1.4, k: 1.5}
period: 2*pi
define:
  c: m*cos(y)
  det: 2 - c**2
  first: A*sin(t) - k*x - 0.3*u + m*sin(y)*w**2 - S*(1 + q*x**2)*sign(u)
  second: A*cos(t) - k*y - 0.3*w - R*(1 + q*sin(t))*sign(w)
surfaces:
  a: {observable: u, sliding: filippov}
  b: {observable: w, sliding: filippov}
field: {x: u, u: (first - c*second)/det, y: w, w: (2*second - c*first)/det}
modes:
  pp: {in: {a: "+", b: "+"}}
  pm: {in: {a: "+", b: "-"}}
  mp: {in: {a: "-", b: "+"}}
  mm: {in: {a: "-", b: "-"}}
"""


def arm(p: dict[str, float], eps: float):
    def rates(t, z):
        x, u, y, w = z
        c = p["m"] * np.cos(y)
        sliding = np.clip(np.array([u, w]) / eps, -1, 1)
        first = p["A"] * np.sin(t) - p["k"] * x - 0.3 * u + p["m"] * np.sin(y) * w**2
        second = p["A"] * np.cos(t) - p["k"] * y - 0.3 * w
        first -= p["S"] * (1 + p["q"] * x**2) * sliding[0]
        second -= p["R"] * (1 + p["q"] * np.sin(t)) * sliding[1]
        rows = np.linalg.solve([[2.0, c], [c, 1.0]], [first, second])
        return [u, rows[0], w, rows[1]]

    return rates


@pytest.mark.slow
def test_what_a_switch_does_may_depend_on_state_and_time() -> None:
    """An arm with dry friction in both joints, at random parameters: one sticks, the other, and both."""
    model = typed(ARM)
    rng, visited = np.random.default_rng(3), set()
    for _ in range(5):
        params = {
            "S": rng.uniform(0.5, 1.5),
            "R": rng.uniform(0.4, 1.3),
            "m": rng.uniform(-0.8, 0.8),
            "q": rng.uniform(0.0, 0.6),
            "A": rng.uniform(0.8, 1.5),
        }
        start = rng.uniform(-1, 1, 4)
        found = cf.simulate(model, params, state=start, periods=2.0)
        visited |= {mode for mode, _ in found.itinerary}
        took = float(np.sum(np.diff(found.times, prepend=0.0) % (2 * np.pi)))  # times are phases
        errors = []
        for eps in (1e-4, 1e-5):
            rates = arm({**model.defaults, **params}, eps)
            end = after(rates, start, (0, took), method="Radau", rtol=1e-8, atol=1e-10)
            errors.append(float(np.max(np.abs(end - found.states[-1]))))
        assert errors[1] < 1e-3 and errors[1] < 0.3 * errors[0] + 1e-6, errors
    assert "slide_a_b" in visited
    assert visited & {"slide_a_b_above", "slide_a_b_below"}
    assert visited & {"slide_b_a_above", "slide_b_a_below"}


@pytest.mark.slow
def test_a_cycle_of_blocks_whose_friction_falls() -> None:
    """Its segments, by scipy along the equations as they are written here, end at the next joints."""
    text = BLOCKS.replace("S*sign(u - vb)", "S/(1 + 3*abs(u - vb))*sign(u - vb)")
    text = text.replace("R*sign(w - vb)", "R/(1 + 3*abs(w - vb))*sign(w - vb)")
    orbit = cf.find_orbit(typed(text), {"vb": 0.1}, state=[0.0, 0.1, 0.1, 0.1])
    assert orbit.converged and orbit.admissible
    modes = [mode for mode, _ in orbit.itinerary]
    assert "slide_a_b" in modes and len(set(modes)) > 2
    p = orbit.params

    def friction(v: float, most: float) -> float:
        return most / (1 + 3 * abs(v - p["vb"])) * np.sign(v - p["vb"])

    def rates(mode: str):
        stuck = [mode.startswith("slide_a"), mode.startswith("slide_b") or mode == "slide_a_b"]

        def field(_, z):
            x, u, y, w = z
            first = 0.0 if stuck[0] else -x - p["k"] * (x - y) - friction(u, p["S"])
            return [
                u,
                first,
                w,
                0.0 if stuck[1] else -y - p["k"] * (y - x) - friction(w, p["R"]),
            ]

        return field

    assert misses(orbit, rates) < 1e-8


def test_limits_of_the_stack_keep_their_order() -> None:
    model = typed(STACK)
    with pytest.raises(cf.ParameterError, match="S - 2\\*R > 0"):
        model.check_params({"R": 0.6})


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("q*sign(u - vb)", "0.2*sign(u - vb)", "do not add up in 'w'"),
        (SWITCHED, switched(1), "singular"),
        (SWITCHED, switched(2), "not driven back"),
        (
            "R*sign(w - vb) + q",
            "R*(y**2 - 1)*sign(w - vb) + 0*q",
            "not driven back to both .* at t = ",
        ),
    ],
)
def test_what_is_not_determined_is_refused(old: str, new: str, says: str) -> None:
    assert old in BLOCKS
    text = BLOCKS.replace(old, new)
    with pytest.raises(EntryError, match=says) as error:
        from_data(yaml.safe_load(text))
    assert error.value.address[:2] == ("surfaces", "a")


def test_a_third_surface_that_slides_is_refused() -> None:
    text = BLOCKS.replace(" + q*sign(u - vb)*sign(w - vb)", "").replace(
        "  b: {", "  c: {observable: x, level: 9, sliding: filippov}\n  b: {"
    )
    for mode in ("pp", "pm", "mp", "mm"):
        text = text.replace(f"  {mode}: {{in: {{", f"  {mode}: {{in: {{c: '-', ")
    text += "  far: {in: {c: '+'}, field: {x: -1, u: 0, y: 0, w: 0}}\n"
    with pytest.raises(EntryError, match="where no others slide"):
        from_data(yaml.safe_load(text))
