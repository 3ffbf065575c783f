"""What the file of a tube states, decided by brute force; and ways to falsify it.

Next to each knot, and between each two, an orbit is solved in 60 digits (:mod:`tests.certificate_oracle`),
at its parameter or, about a fold, where the number that changes most is kept. It must be admissible but
beyond an end; multipliers must pass 1, -1 and the circle between those knots where the file says so, and
there only.
"""

from __future__ import annotations

import copy
from itertools import pairwise
from typing import Any

import numpy as np
from mpmath import mp, mpf

from tests.certificate_oracle import DIGITS, PAIRS, SMALL, Truth

#: Orbits between two knots at which signs are looked at.
BETWEEN = 1


def solved(data: dict[str, Any], row: list[mpf], kept: int) -> tuple[Truth, list[mpf]]:
    """Return the orbit next to a row of joints and parameter, of which one number is kept."""

    def residuals(x: list[mpf]) -> tuple[Truth, list[mpf]]:
        truth = Truth({**data, "params": {**data["params"], data["parameter"]: x[-1]}})
        ends = [
            [*truth.joint(x[:-1], i), *truth.joint(x[:-1], i + 1)]
            for i in range(len(truth.segments))
        ]
        return truth, [r for i, args in enumerate(ends) for r in truth.residuals(i, *args)]

    free = [k for k in range(len(row)) if k != kept]
    for _ in range(12):
        _, base = residuals(row)
        jacobian = mp.zeros(len(free))
        for column, k in enumerate(free):
            moved = [c + (SMALL if j == k else 0) for j, c in enumerate(row)]
            for i, (r, b) in enumerate(zip(residuals(moved)[1], base, strict=True)):
                jacobian[i, column] = (r - b) / SMALL
        change = mp.lu_solve(jacobian, mp.matrix(base))
        for column, k in enumerate(free):
            row = [c - (change[column] if j == k else 0) for j, c in enumerate(row)]
        if max(abs(c) for c in change) < mpf(10) ** -40:
            return residuals(row)[0], row
    raise ValueError("Newton's method does not converge")


def _tests(data: dict[str, Any], truth: Truth, row: list[mpf]) -> dict[str, mpf]:
    one, other = truth.multipliers(row[:-1])
    pair = mp.re(one * other) - 1 if abs(mp.im(one)) > mpf(10) ** -18 else mpf(-1)
    flip = "BP" if data["half"] else "PD"
    return {
        "SN": mp.re((1 - one) * (1 - other)),
        flip: mp.re((1 + one) * (1 + other)),
        "NS": pair,
    }


def _load(truth: Truth, row: list[mpf], i: int, level: int) -> mpf:
    t, x = truth.joint(row[:-1], i + 1)
    return x - truth.force(t) - level * truth.s0


def _ends_so(found: list[tuple[Truth, list[mpf]]], end: list[Any]) -> bool:
    """Tell whether loads at stops pass their limit between the first and the last of some orbits."""
    kind, places = end
    (first, a), (last, b) = found[0], found[-1]
    passed = False
    for i, level in places:
        if first.segments[i][0] == "stick" or kind not in ("CS", "SS"):
            return False
        low, high = _load(first, a, i, level), _load(last, b, i, level)
        moving = -level * last.force(last.joint(b[:-1], i + 1)[0], 1)
        if (abs(high) > abs(low) and low * high > 0) or (moving > 0) != (kind == "CS"):
            return False
        passed = passed or low * high < 0
    return passed and first.admissible(a[:-1]) and not last.admissible(b[:-1])


def false_tube(data: dict[str, Any]) -> bool:
    """Tell whether what a file states of a tube is not so; its ends are CS or SS."""
    with mp.workdps(DIGITS):
        try:
            return _false(data)
        except (ValueError, ZeroDivisionError):
            return True


def _false(data: dict[str, Any]) -> bool:
    if data["half"] and data["periods"] % 2 == 0:
        return True
    stated, pieces = sorted(data["events"]), list(pairwise(data["knots"]))
    found: list[list[Any]] = []
    for k, piece in enumerate(pieces):
        end = data["ends"][0] if k == 0 else None
        a, b = piece[::-1] if end else piece
        end = end or (data["ends"][1] if k == len(pieces) - 1 else None)
        about = data["knots"][max(k - 1, 0)], data["knots"][min(k + 2, len(pieces))]
        changes = np.min([np.abs(np.subtract(y, x)) for x, y in ((a, b), about)], axis=0)
        steep = changes[-1] < 0.02 * np.max(changes)  # about a fold
        kept = int(np.argmax(changes)) if steep else len(a) - 1
        shares = [mpf(j) / (BETWEEN + 1) for j in range(BETWEEN + 2)]
        rows = [[x + s * (mpf(y) - x) for x, y in zip(map(mpf, a), b, strict=True)] for s in shares]
        orbits = [solved(data, row, kept) for row in rows]
        if end and not _ends_so(orbits, end):
            return True
        if not end and not all(truth.admissible(row[:-1]) for truth, row in orbits):
            return True
        signs = [_tests(data, truth, row) for truth, row in orbits]
        for low, high in pairwise(signs):
            found += [[k, kind] for kind in low if low[kind] * high[kind] < 0]
    return sorted(found) != stated


# ------------------------------------------------------------------------- false certificates


def cut(data: dict[str, Any], rng: np.random.Generator, count: int = 3) -> dict[str, Any]:
    """Return a short part of a tube; often about an event or an end of it."""
    last = len(data["knots"]) - count
    where = [0, last, *(k - 1 for k, _ in data["events"]), int(rng.integers(last + 1))]
    first = min(max(int(rng.choice(where)), 0), last)
    ends = [end if first == at else None for end, at in zip(data["ends"], (0, last), strict=True)]
    events = [[k - first, kind] for k, kind in data["events"] if 0 <= k - first < count - 1]
    return data | {"knots": data["knots"][first : first + count], "ends": ends, "events": events}


def changed(data: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Return the certificate of a tube that states something else."""
    found = copy.deepcopy(data)
    _CHANGES[int(rng.integers(len(_CHANGES)))](found, rng)
    return found


def _move_number(data: dict[str, Any], rng: np.random.Generator) -> None:
    knot = data["knots"][int(rng.integers(len(data["knots"])))]
    knot[int(rng.integers(len(knot)))] += float(rng.choice([-1, 1]) * 10 ** rng.uniform(-12, 0))


def _other_knots(data: dict[str, Any], rng: np.random.Generator) -> None:
    knots, k = data["knots"], int(rng.integers(len(data["knots"])))
    ways = (knots[::-1], knots[:k] + knots[k + 1 :], [*knots[:k], knots[k], *knots[k:]])
    mirrored = [[-c if j % 2 else c for j, c in enumerate(knot[:-1])] + knot[-1:] for knot in knots]
    data["knots"] = (*ways, mirrored)[int(rng.integers(4))]


def _other_events(data: dict[str, Any], rng: np.random.Generator) -> None:
    events = data["events"]
    if events and rng.uniform() < 0.7:
        k = int(rng.integers(len(events)))
        if rng.uniform() < 0.4:
            del events[k]
        elif rng.uniform() < 0.5:
            events[k][0] = int(rng.integers(len(data["knots"]) - 1))
        else:
            events[k][1] = str(rng.choice(["SN", "PD", "BP", "NS"]))
    else:
        kind = str(rng.choice(["SN", "PD", "BP", "NS"]))
        events.append([int(rng.integers(len(data["knots"]) - 1)), kind])


def _other_end(data: dict[str, Any], rng: np.random.Generator) -> None:
    ends, k = data["ends"], int(rng.integers(2))
    if ends[k] and rng.uniform() < 0.8:
        if rng.uniform() < 0.5:
            ends[k][0] = str(rng.choice(["CS", "SS", "SN"]))
        else:
            ends[k][1] = [[int(rng.integers(len(data["segments"]))), int(rng.choice([-1, 1]))]]
    elif ends[k]:
        ends[k] = None
    else:
        at = [int(rng.integers(len(data["segments"]))), int(rng.choice([-1, 1]))]
        ends[k] = [str(rng.choice(["CS", "SS"])), [at]]


def other_params(data: dict[str, Any], rng: np.random.Generator) -> None:
    names = [name for name in data["params"] if name != data["parameter"]]
    data["params"][str(rng.choice(names))] += float(
        rng.choice([-1, 1]) * 10 ** rng.uniform(-14, -1)
    )


def _other_itinerary(data: dict[str, Any], rng: np.random.Generator) -> None:
    way = rng.uniform()
    if way < 0.4:
        data["segments"][int(rng.integers(len(data["segments"])))] = [*PAIRS[int(rng.integers(4))]]
    elif way < 0.6:
        data["segments"] = [*data["segments"][1:], data["segments"][0]]
    elif way < 0.8:
        data["half"] = not data["half"]
    else:
        data["periods"] += 1


_CHANGES = (
    *(_move_number, _other_knots, _other_events, _other_end, other_params, _other_itinerary),
    _other_events,
)
