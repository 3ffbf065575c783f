"""What a certificate of an event states, decided by brute force; and ways to falsify it.

Orbits beside the event are solved in 60 digits (:mod:`tests.certificate_oracle`); what vanishes must have
another sign a little to each side of the stated ball.
"""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from mpmath import mp, mpf

from tests.certificate_oracle import DIGITS, Truth, ball

#: How far to each side of the ball: multipliers are differences that are known to 1e-22.
BESIDE = mpf(10) ** -18
#: What is touched within a segment, by kind: whether it slides, and the surface.
_TOUCHES = {"GS": (True, "v"), "T": (True, "F"), "AS": (False, "F")}
#: About a fold, where orbits are the root of it away.
BESIDE_FOLD = mpf(10) ** -14


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


def _is_fold(data: dict[str, Any], value: mpf, radius: mpf, start: list[mpf]) -> bool:
    near = []
    for side in (-1, 1):
        found = _at(data, value + side * (radius + BESIDE_FOLD), start)
        away = found and max(abs(a - b) for a, b in zip(found[1], start, strict=True))
        if found and away < mpf(10) ** -4:
            near.append(max(found[0].multipliers(found[1]), key=abs))
    return len(near) == 1 and abs(near[0] - 1) < mpf(10) ** -3


def _obeys(data: dict[str, Any], truth: Truth, z: list[mpf]) -> bool:
    """Tell whether the orbit is admissible a little beside the limit that it meets."""
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
        start = [ball(row[k])[0] for row in data["near"] for k in (0, 1)]
        if data["half"] and data["periods"] % 2 == 0:
            return True
        if data["kind"] == "SN":
            return not _is_fold(data, value, radius, start)
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
        centre += rng.choice([-1, 1]) * mpf(10) ** rng.uniform(-16, -2)
        data["value"] = f"{mp.nstr(centre, 45)} +/- {mp.nstr(radius, 5)}"


def _other_params(data: dict[str, Any], rng: np.random.Generator) -> None:
    names = [name for name in data["params"] if name != data["parameter"]]
    data["params"][str(rng.choice(names))] += rng.choice([-1, 1]) * 10 ** rng.uniform(-14, -1)


def _other_kind(data: dict[str, Any], rng: np.random.Generator) -> None:
    data["kind"] = str(rng.choice(["SN", "PD", "BP", "NS", "CS", "SS", "AS", "T"]))
    if data["at"] is None and rng.uniform() < 0.5:
        data["at"] = [int(rng.integers(len(data["segments"]))), int(rng.choice([-1, 1]))]


def _other_stop(data: dict[str, Any], rng: np.random.Generator) -> None:
    data["at"] = [int(rng.integers(-1, len(data["segments"]) + 1)), int(rng.choice([-1, 0, 1]))]


def _other_segment(data: dict[str, Any], rng: np.random.Generator) -> None:
    kinds = [["slide+", "v"], ["slide-", "v"], ["stick", "F+"], ["stick", "F-"]]
    i = int(rng.integers(len(data["segments"])))
    if rng.uniform() < 0.5 or len(data["segments"]) == 1:
        data["segments"][i] = kinds[int(rng.integers(4))]
    else:
        del data["segments"][i], data["near"][i]


def _other_turn(data: dict[str, Any], rng: np.random.Generator) -> None:
    if rng.uniform() < 0.5:
        data["half"] = not data["half"]
    else:
        data["periods"] += 1


def _other_parameter(data: dict[str, Any], rng: np.random.Generator) -> None:
    data["parameter"] = str(rng.choice(list(data["params"])))


_CHANGES = (
    *(_move_value, _other_params, _other_kind, _other_stop, _other_segment, _other_turn),
    _other_parameter,
)
