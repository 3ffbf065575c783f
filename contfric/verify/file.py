"""A certificate file, read and checked."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from flint import ctx

from contfric.verify.law import check_admissible, check_multipliers
from contfric.verify.solution import Refused, Scene, Undecided

#: Bits that are asked for, one after the other, until all is decided.
BITS = (106, 212, 424, 848)
#: Models whose equation of motion the checker states.
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
        if not isinstance(data, dict):
            raise Refused("it is no certificate")
    except (ValueError, RecursionError, Refused) as error:
        return Answer(False, f"cannot be read: {error}")
    why = ""
    for bits in BITS:
        with ctx.workprec(bits):
            try:
                return Answer(True, "", _check(data), bits)
            except Refused as error:
                return Answer(False, str(error), bits=bits)
            except Undecided as error:
                why = str(error)
            except (KeyError, TypeError, ValueError, IndexError, OverflowError) as error:
                return Answer(False, f"damaged: {type(error).__name__}: {error}", bits=bits)
            except ZeroDivisionError:
                why = "the equations are singular"
    return Answer(False, f"not decided with {BITS[-1]} bits: {why}", bits=BITS[-1])


def _check(data: dict[str, Any]) -> tuple[str, ...]:
    claims = _claims(data)
    scene = Scene(data)
    printed, radii = scene.box(data)
    zero = scene.solution(printed, radii, unique=claims["unique"] == "proved")
    done = ["exists"]
    if claims["unique"] == "proved":
        done.append("unique")
    scene.check_enclosure(data, zero)
    if claims["admissible"] == "proved":
        check_admissible(scene, zero)
        done.append("admissible")
    done += check_multipliers(scene, data, zero, claims["stable"])
    return tuple(done)


def _claims(data: dict[str, Any]) -> dict[str, str]:
    if data.get("certificate") != "orbit" or data.get("format") != 1:
        raise Refused("it is no certificate of an orbit of format 1")
    if data.get("model") not in CHECKED_MODELS:
        raise Refused(f"the checker does not know the model {str(data.get('model'))[:40]}")
    claims = dict(data["statements"])
    if set(claims) != set(_STATED):
        raise Refused("its statements are not those of an orbit")
    for name, claim in claims.items():
        if claim not in ("proved", "undecided") and (name, claim) != ("stable", "refuted"):
            raise Refused(f"it does not state that it {name}")
    if claims["exists"] != "proved":
        raise Refused("it does not state that the orbit exists")
    return claims
