"""A certificate file, read and checked."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from flint import arb, ctx

from contfric.verify.law import check_admissible, check_event, check_multipliers
from contfric.verify.solution import Refused, Scene, Undecided, ball, decided

BITS = (106, 212, 424, 848)  # asked for one after the other, until all is decided
CHECKED_MODELS = ("coulomb",)
KINDS = ("diagram", "event", "orbit")
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
    why = ""
    for bits in BITS:
        with ctx.workprec(bits):
            try:
                return Answer(True, "", _check(data, KINDS), bits)
            except Refused as error:
                return Answer(False, str(error), bits=bits)
            except (Undecided, ZeroDivisionError) as error:
                why = str(error)
            except (AttributeError, LookupError, TypeError, ValueError, OverflowError) as error:
                return Answer(False, f"damaged: {type(error).__name__}: {error}", bits=bits)
    return Answer(False, f"not decided with {BITS[-1]} bits: {why}", bits=BITS[-1])


def _check(data: dict[str, Any], kinds: tuple[str, ...]) -> tuple[str, ...]:
    kind = data.get("certificate")
    if kind not in kinds or data.get("format") != 1:
        raise Refused("it is no certificate of format 1")
    if kind == "diagram":
        parts = [part["certificate"] for part in data["checkable"] if _check(part, kinds[1:])]
        return tuple(f"{parts.count(name)} {name}s" for name in kinds[1:])
    if data.get("model") not in CHECKED_MODELS:
        raise Refused(f"the checker does not know the model {str(data.get('model'))[:40]}")
    return tuple(check_event(data) if kind == "event" else _check_orbit(data))


def _check_orbit(data: dict[str, Any]) -> list[str]:
    claims, scene = dict(data["statements"]), Scene(data)
    known = {name: {"proved", "undecided"} for name in _STATED} | {"exists": {"proved"}}
    known["stable"] |= {"refuted"}
    if set(claims) != set(known) or not all(claims[name] in known[name] for name in known):
        raise Refused("its statements are not those of an orbit")
    printed, radii = scene.box(data)
    zero, _ = scene.enclosed(printed, None, "a solution near the printed joints")
    for off, r in ((abs(z - p), r) for z, p, r in zip(zero, printed, radii, strict=True)):
        decided(off < r, off > r, "the solution lies in the box around the printed joints")
    if claims["unique"] == "proved":
        scene.enclosed(printed, radii, "there is one solution only in the box")
    for i, row in zip(range(scene.count), data["enclosure"], strict=True):
        for wide, value in zip(map(ball, row), (*scene.joint(zero, i), arb(0)), strict=True):
            decided(wide.contains(value), not wide.overlaps(value), "balls hold the joints")
    if claims["admissible"] == "proved":
        check_admissible(scene, zero, -1, 0, {})
    done = check_multipliers(scene, data, zero, claims["stable"])
    return [name for name in _STATED[:3] if claims[name] == "proved"] + done
