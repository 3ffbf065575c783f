"""A certificate file, read and checked."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import reduce
from typing import Any

from flint import arb, ctx

from contfric.verify.box import Box
from contfric.verify.law import check_admissible, check_multipliers
from contfric.verify.scene import Refused, Scene, Undecided, ball, number, phases, positive

BITS = (106, 212, 424, 848)  # asked for one after the other, until all is decided
CHECKED_MODELS = ("coulomb",)
_DAMAGED = AttributeError, LookupError, TypeError, ValueError, ArithmeticError, RecursionError
_STATED = ("exists", "unique", "admissible", "stable")


@dataclass(frozen=True)
class Answer:
    """Whether all statements of a file hold; if not, why; those that hold; the bits asked for."""

    yes: bool
    why: str
    statements: tuple[str, ...] = ()
    bits: int = 0


def check_text(text: str, checks: Any = None) -> Answer:
    """Check the text of a certificate file; what it may hold may be given, with checks of it."""
    cap, ctx.cap = ctx.cap, 3
    try:
        statements, bits = _check(json.loads(text), checks or CHECKS)
        return Answer(True, "", statements, bits)
    except Refused as error:
        return Answer(False, str(error))
    except _DAMAGED as error:
        return Answer(False, f"damaged: {type(error).__name__}: {error}")
    finally:
        ctx.cap = cap


def _check(data: Any, checks: Any, whole: bool = True) -> tuple[tuple[str, ...], int]:
    """Return what holds, and the bits that were needed; each part of a diagram asks for its own."""
    kind, why = data.get("certificate"), ""
    if data.get("format") != 1 or kind not in ((*checks, "diagram") if whole else checks):
        raise Refused("it is no certificate of format 1")
    if kind == "diagram":
        needed = [_check(part, checks, False)[1] for part in data["checkable"]]
        names = [part["certificate"] for part in data["checkable"]]
        return tuple(f"{names.count(name)} {name}s" for name in checks), max(needed)
    if data.get("model") not in CHECKED_MODELS:
        raise Refused(f"the checker does not know the model {str(data.get('model'))[:40]}")
    for bits in BITS:
        with ctx.workprec(bits):
            try:
                return tuple(checks[kind](data)), bits
            except (Undecided, ZeroDivisionError) as error:
                why = str(error)
    raise Refused(f"not decided with {BITS[-1]} bits: {why}")


def _check_orbit(data: dict[str, Any]) -> list[str]:
    claims, scene, verdicts = data["statements"], Scene(data), ("proved", "undecided", "refuted")
    known = [claims[name] in verdicts[: 2 + (name == "stable")] for name in _STATED]
    if len(claims) != 4 or not all(known) or claims["exists"] != "proved":
        raise Refused("its statements are not those of an orbit")
    joints, radii = ([[number(c) for c in row] for row in data[k]] for k in ("joints", "radius"))
    for (*_, v), row in zip(joints, radii, strict=True):
        positive(reduce(arb.min, row), "its boxes have a width")
        positive(row[-1] - abs(v), "the printed velocity is 0 within its box")
    printed, radius = (phases(rows, scene) for rows in (joints, radii))
    own = {**data, "parameter": "S"}  # at one value of it
    _, z = Box(own, scene.count * 2, [*printed, scene.s]).proved().orbits(0)
    for value, p, r in zip(z, printed, radius, strict=True):
        positive(r - abs(value - p), "the solution lies in the box around the printed joints")
    if claims["unique"] == "proved":
        box = Box(own, scene.count * 2, [*printed, scene.s])
        off = zip(radius, printed, box.middle.entries()[:-1], strict=True)
        box.proved([*(r + abs(p - m) for r, p, m in off), arb(0)])
    for i, row in zip(range(scene.count), data["enclosure"], strict=True):
        phase, x = scene.joint(z, i)
        for held, value in zip(map(ball, row), (phase / scene.omega, x, arb(0)), strict=True):
            if not held.contains(value):
                raise Undecided("balls hold the joints")
    if claims["admissible"] == "proved":
        check_admissible(scene, z)
    proved = [name for name in _STATED[:3] if claims[name] == "proved"]
    return proved + check_multipliers(scene, data, z, claims["stable"])


CHECKS = {"orbit": _check_orbit}
