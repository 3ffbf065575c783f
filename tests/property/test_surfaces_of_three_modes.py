"""A surface on which some modes slide and others, behind a second surface, pass: against small steps.

Above ``x = 0`` hold two modes, divided by ``y = c``; below it one. Sliding is derived between each pair for
which it is possible. Solutions are compared with Euler steps of the discontinuous field, whose chatter
about the surface is of the size of the step. Where a and b lead to ``y = c`` from both sides no mode follows,
and a simulation says so (it went on beyond the surface, in a mode that does not hold there).
"""

from __future__ import annotations

import numpy as np

import contfric as cf
from contfric.models.reading.files import from_data

#: Euler's step, how far its chatter and drift let a state be (relative to 1 + the state), and the time.
_STEP, _NEAR, _END = 2e-4, 5e-3, 4.0


def fields(seed: int, passed: bool) -> tuple[np.ndarray, np.ndarray, float]:
    """Return matrices and constants of the modes a, b (above) and c, and where a and b part."""
    rng = np.random.default_rng(seed)
    matrices = rng.uniform(-1, 1, (3, 3, 3)) - 0.5 * np.eye(3)
    constants = rng.uniform(-1, 1, (3, 3))
    if seed % 2:  # one of the modes above is that below: nothing happens between these
        matrices[1], constants[1] = matrices[2], constants[2]
    if passed:  # a and b lead to their surface alike
        matrices[1, 1], constants[1, 1] = matrices[0, 1], constants[0, 1]
    return matrices, constants, float(rng.uniform(-0.3, 0.3))


def model_of(seed: int, passed: bool) -> cf.Model:
    matrices, constants, parted = fields(seed, passed)
    names = ["x", "y", "z"]

    def field(k: int) -> dict[str, str]:
        rows = (
            " + ".join(
                [*(f"({a!r})*{n}" for a, n in zip(row.tolist(), names, strict=True)), f"({b!r})"]
            )
            for row, b in zip(matrices[k], constants[k].tolist(), strict=True)
        )
        return dict(zip(names, rows, strict=True))

    return from_data(
        {
            "name": "three",
            "states": names,
            "parameters": {"unused": 1.0},
            "autonomous": True,
            "surfaces": {
                "h": {"observable": "x", "sliding": "filippov"},
                "g": {"observable": "y", "level": repr(parted)},
            },
            "modes": {
                "a": {"in": {"h": "+", "g": "+"}, "field": field(0)},
                "b": {"in": {"h": "+", "g": "-"}, "field": field(1)},
                "c": {"in": {"h": "-"}, "field": field(2)},
            },
        }
    )


def by_steps(seed: int, passed: bool, states: np.ndarray, step: float) -> np.ndarray:
    """Return where Euler's steps lead from some states, shape (k, 3)."""
    matrices, constants, parted = fields(seed, passed)
    y = states.copy()
    for _ in range(round(_END / step)):
        k = np.where(y[:, 0] < 0.0, 2, np.where(y[:, 1] > parted, 0, 1))
        y = y + step * (np.einsum("nij,nj->ni", matrices[k], y) + constants[k])
    return y


def compared(seed: int, passed: bool) -> int:
    """Compare solutions of a model from four starts, and return how many went on to the end."""
    model, rng, count = model_of(seed, passed), np.random.default_rng(100 + seed), 0
    states = rng.uniform(-1, 1, (4, 3))
    beside = np.concatenate([states, states + 1e-4, states - 1e-4])
    ends = by_steps(seed, passed, beside, _STEP).reshape(3, 4, 3)
    longer = by_steps(seed, passed, states, 2.0 * _STEP)
    for k, state in enumerate(states):
        found = cf.simulate(model, state=state, periods=_END)
        near = _NEAR * (1.0 + np.max(np.abs(ends[0, k])))
        others = np.array([ends[1, k], ends[2, k], longer[k]])
        if found.end.name != "TIME" or np.max(np.abs(others - ends[0, k])) > near:
            continue  # no mode follows; or next to what is not unique, or steps that are too long
        count += 1
        assert np.max(np.abs(found.last[2] - ends[0, k])) < near, (seed, state)
    return count


def test_solutions_are_those_of_small_steps() -> None:
    assert sum(compared(seed, passed=True) for seed in range(4)) >= 10


def test_what_no_mode_follows_ends() -> None:
    assert sum(compared(seed, passed=False) for seed in range(4)) >= 6
