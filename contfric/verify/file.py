"""A certificate file, read and checked."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from flint import arb, ctx

from contfric.verify.box import Box
from contfric.verify.law import check_admissible, check_multipliers
from contfric.verify.solution import Refused, Scene, Undecided, ball, decided, number
from contfric.verify.tube import check_event, check_tube

BITS = (106, 212, 424, 848)  # asked for one after the other, until all is decided
CHECKED_MODELS = ("coulomb",)
_STATED = ("exists", "unique", "admissible", "stable")


@dataclass(frozen=True)
class Answer:
    """Whether all statements of a file hold; if not, why; those that hold; the bits asked for."""

    yes: bool
    why: str
    statements: tuple[str, ...] = ()
    bits: int = 0


def check_text(text: str) -> Answer:
    """Check the text of a certificate file."""
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        return Answer(False, f"cannot be read: {error}")
    cap, ctx.cap = ctx.cap, 3
    try:
        statements, bits = _check(data, (*CHECKS, "diagram"))
        return Answer(True, "", statements, bits)
    except Refused as error:
        return Answer(False, str(error))
    except (AttributeError, LookupError, TypeError, ValueError, ArithmeticError) as error:
        return Answer(False, f"damaged: {type(error).__name__}: {error}")
    finally:
        ctx.cap = cap


def _check(data: dict[str, Any], kinds: tuple[str, ...]) -> tuple[tuple[str, ...], int]:
    """Return what holds, and the bits that were needed; each part of a diagram asks for its own."""
    kind, why = data.get("certificate"), ""
    if kind not in kinds or data.get("format") != 1:
        raise Refused("it is no certificate of format 1")
    if kind == "diagram":
        found = [(part["certificate"], *_check(part, tuple(CHECKS))) for part in data["checkable"]]
        names = [name for name, *_ in found]
        words = [word for _, words, _ in found for word in words if word.endswith("open ends")]
        counts = tuple(f"{names.count(name)} {name}s" for name in CHECKS)
        return (*counts, f"{sum(int(w.split()[0]) for w in words)} open ends"), max(
            b for *_, b in found
        )
    if data.get("model") not in CHECKED_MODELS:
        raise Refused(f"the checker does not know the model {str(data.get('model'))[:40]}")
    for bits in BITS:
        with ctx.workprec(bits):
            try:
                return tuple(CHECKS[kind](data)), bits
            except (Undecided, ZeroDivisionError) as error:
                why = str(error)
    raise Refused(f"not decided with {BITS[-1]} bits: {why}")


def _check_orbit(data: dict[str, Any]) -> list[str]:
    claims, scene = dict(data["statements"]), Scene(data)
    known = {name: {"proved", "undecided"} for name in _STATED} | {"exists": {"proved"}}
    known["stable"] |= {"refuted"}
    if set(claims) != set(known) or not all(claims[name] in known[name] for name in known):
        raise Refused("its statements are not those of an orbit")
    joints, radii = ([[number(c) for c in row] for row in data[k]] for k in ("joints", "radius"))
    if len(joints) != scene.count or not all(r > 0 for row in radii for r in row):
        raise Refused("there is not one joint with its box for each segment")
    for (_, _, v), (_, _, wide) in zip(joints, radii, strict=True):
        decided(abs(v) <= wide, abs(v) > wide, "the printed velocity is 0 within its box")
    printed, wide = ([c for t, x, _ in rows for c in (t, x)] for rows in (joints, radii))
    own = {**data, "parameter": "S"}  # at one value of it
    _, zero = Box(own, [*printed, scene.s]).proved().orbits(0)
    for off, r in ((abs(z - p), r) for z, p, r in zip(zero, printed, wide, strict=True)):
        decided(off < r, off > r, "the solution lies in the box around the printed joints")
    if claims["unique"] == "proved":
        Box(own, [*printed, scene.s]).proved(wide)
    for i, row in zip(range(scene.count), data["enclosure"], strict=True):
        for held, value in zip(map(ball, row), (*scene.joint(zero, i), arb(0)), strict=True):
            decided(held.contains(value), not held.overlaps(value), "balls hold the joints")
    if claims["admissible"] == "proved":
        check_admissible(scene, zero)
    done = check_multipliers(scene, data, zero, claims["stable"])
    return [name for name in _STATED[:3] if claims[name] == "proved"] + done


CHECKS = {"event": check_event, "orbit": _check_orbit, "tube": check_tube}
