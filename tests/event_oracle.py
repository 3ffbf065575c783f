"""What a certificate of an event states, decided by brute force; and ways to falsify it.

Orbits next to the event are solved in 60 digits (:mod:`tests.certificate_oracle`); what vanishes must have
another sign a little to each side of the stated ball.
"""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from mpmath import mp, mpf

from tests.certificate_oracle import DIGITS, PAIRS, Truth, ball, other_turn
from tests.tube_oracle import other_params, solved

#: How far to each side of the ball: multipliers are differences that are known to 1e-22.
BESIDE = mpf(10) ** -18
#: What is touched within a segment, by kind: whether it slides, and the surface.
_TOUCHES = {"GS": (True, "v"), "T": (True, "F"), "AS": (False, "F")}


def _at(data: dict[str, Any], value: mpf, start: list[mpf]) -> tuple[Truth, list[mpf]] | None:
    truth = Truth({**data, "params": {**data["params"], data["parameter"]: value}})
    try:
        return truth, truth.newton(start, steps=60)
    except (ValueError, ZeroDivisionError):
        return None


def _vanishing(data: dict[str, Any], truth: Truth, z: list[mpf]) -> mpf:
    if data["kind"] in ("CS", "SS"):
        i, level = data["at"]
        t, x = truth.joint(z, i + 1)
        return x - truth.force(t) - level * truth.s0
    if data["kind"] in _TOUCHES:
        return _touched(data, truth, z)
    one, other = truth.multipliers(z)
    return mp.re(one * other - 1 if data["kind"] == "NS" else (1 + one) * (1 + other))


def _touched(data: dict[str, Any], truth: Truth, z: list[mpf]) -> mpf:
    """Return an observable where its rate vanishes, by Newton's method with differences."""
    i, surface, text = data["at"]
    (t, x), mode = truth.joint(z, i), truth.segments[i][0]
    sign = {"slide+": 1, "slide-": -1, "stick": 0}[mode]
    level = {"v": 0, "F+": truth.s0, "F-": -truth.s0}[surface]

    def observed(tau: mpf) -> mpf:
        y, v, _ = truth.slide(sign, t, x, tau) if sign else (x, mpf(0), [])
        return v if surface == "v" else y - truth.force(t + tau) - level

    tau, step = ball(text)[0], mpf(10) ** -15
    for _ in range(6):
        low, here, high = (observed(tau + k * step) for k in (-1, 0, 1))
        tau -= (high - low) * step / 2 / (high - 2 * here + low)
    return observed(tau)


def _is_fold(data: dict[str, Any], value: mpf, radius: mpf) -> bool:
    """Tell whether a multiplier passes 1 between two orbits, whose parameter is in the ball."""
    rows = [[ball(text)[0] for text in knot] for knot in data["knots"]]
    kept = max(range(len(rows[0])), key=lambda k: abs(rows[1][k] - rows[0][k]))
    try:
        ends = [solved(data, row, kept) for row in rows]
    except (ValueError, ZeroDivisionError):
        return False
    if not all(
        abs(row[-1] - value) <= radius and truth.admissible(row[:-1]) for truth, row in ends
    ):
        return False
    pairs = [truth.multipliers(row[:-1]) for truth, row in ends]
    low, high = (mp.re((1 - one) * (1 - other)) for one, other in pairs)
    return bool(low * high < 0)


def _obeys(data: dict[str, Any], truth: Truth, z: list[mpf]) -> bool:
    """Tell whether the orbit is admissible a little next to the limit that it meets."""
    if data["kind"] in _TOUCHES:
        i, surface, _ = data["at"]
        slides = truth.segments[i][0] != "stick"
        if (slides, surface[0]) != _TOUCHES[data["kind"]]:
            return False
    if data["kind"] == "NS" and not abs(mp.im(truth.multipliers(z)[0])) > 0:
        return False  # a neutral saddle
    if data["kind"] not in ("CS", "SS"):
        return truth.admissible(z)
    i, level = data["at"]
    t, _ = truth.joint(z, i + 1)
    moving = -level * truth.force(t, 1)
    if truth.segments[i][0] == "stick" or (moving > 0) != (data["kind"] == "CS"):
        return False
    after = truth.segments[(i + 1) % len(truth.segments)][0]
    limit = truth.s0
    truth.s0 = limit + (1 if after == "stick" else -1) * mpf(10) ** -12
    found = truth.admissible(z)
    truth.s0 = limit
    return found


def false_event(data: dict[str, Any]) -> bool:
    """Tell whether what a file states of an event is not so."""
    with mp.workdps(DIGITS):
        value, radius = ball(data["value"])
        sides = zip(*data["knots"], strict=True)
        *start, _ = [sum(ball(text)[0] for text in side) / 2 for side in sides]
        if data["half"] and data["periods"] % 2 == 0:
            return True
        if data["kind"] == "SN":
            return not _is_fold(data, value, radius)
        if data["kind"] in ("PD", "BP") and data["half"] != (data["kind"] == "BP"):
            return True
        ends = [_at(data, value + side * (radius + BESIDE), start) for side in (-1, 1)]
        if None in ends:
            return True
        low, high = (_vanishing(data, *end) for end in ends if end)
        return low * high > 0 or not all(_obeys(data, *end) for end in ends if end)


# ------------------------------------------------------------------------- false certificates


def changed(data: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Return the certificate of an event that states something else."""
    found = copy.deepcopy(data)
    _CHANGES[int(rng.integers(len(_CHANGES)))](found, rng)
    return found


def _move_value(data: dict[str, Any], rng: np.random.Generator) -> None:
    with mp.workdps(DIGITS):
        centre, radius = ball(data["value"])
        off = rng.choice([-1, 1]) * mpf(10) ** rng.uniform(-35, -2)
        data["value"] = _text(centre + off, radius)
        if rng.uniform() < 0.7:  # and the piece of the curve with it
            for knot in data["knots"]:
                centre, radius = ball(knot[-1])
                knot[-1] = _text(centre + off, radius)


def _text(centre: mpf, radius: mpf) -> str:
    return f"{mp.nstr(centre, 45)} +/- {mp.nstr(radius, 5)}"


def _move_knot(data: dict[str, Any], rng: np.random.Generator) -> None:
    knot = data["knots"][int(rng.integers(2))]
    k = int(rng.integers(len(knot)))
    with mp.workdps(DIGITS):
        centre, radius = ball(knot[k])
        knot[k] = _text(centre + rng.choice([-1, 1]) * mpf(10) ** rng.uniform(-35, 0), radius)


def _other_kind(data: dict[str, Any], rng: np.random.Generator) -> None:
    data["kind"] = str(rng.choice(["SN", "PD", "BP", "NS", "CS", "SS", "AS", "T"]))
    if data["at"] is None and rng.uniform() < 0.5:
        data["at"] = [int(rng.integers(len(data["segments"]))), int(rng.choice([-1, 1]))]


def _other_stop(data: dict[str, Any], rng: np.random.Generator) -> None:
    data["at"] = [int(rng.integers(-1, len(data["segments"]) + 1)), int(rng.choice([-1, 0, 1]))]


def _other_segment(data: dict[str, Any], rng: np.random.Generator) -> None:
    i = int(rng.integers(len(data["segments"])))
    if rng.uniform() < 0.5 or len(data["segments"]) == 1:
        data["segments"][i] = [*PAIRS[int(rng.integers(4))]]
    else:
        del data["segments"][i]
        for knot in data["knots"]:
            del knot[2 * i : 2 * i + 2]


def _other_parameter(data: dict[str, Any], rng: np.random.Generator) -> None:
    name, value = str(rng.choice(list(data["params"]))), float(ball(data["value"])[0])
    data["params"] = {**data["params"], data["parameter"]: value}
    del data["params"][name]
    data["parameter"] = name


_CHANGES = (
    *(_move_value, other_params, _other_kind, _other_stop, _other_segment, other_turn),
    *(_other_parameter, _move_knot),
)
