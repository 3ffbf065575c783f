"""Functions that have another name elsewhere, or are no function of the language: what to write instead."""

from __future__ import annotations

from collections.abc import Sequence

from contfric.errors import did_you_mean

_STEP = "a unit step is where(x > 0, 1, 0), with a surface at x = 0 and a mode on each side"
_SATURATION = "a saturation is max(-1, min(1, x)), with surfaces at x = 1 and x = -1"
_JUMP = "every jump needs a surface with a mode on each side, of the time there is mod(t, T)"
#: By name, also in capitals. (A small theta before a parenthesis is an angle.)
_INSTEAD: dict[str, str] = {
    **{"ln": "write log(x)", "log10": "write log(x)/log(10)", "log2": "write log(x)/log(2)"},
    **{f"arc{name}": f"write a{name}(x)" for name in ("sin", "cos", "tan")},
    **{
        "pow": "write x**y",
        "cot": "write 1/tan(x)",
        "sec": "write 1/cos(x)",
        "csc": "write 1/sin(x)",
    },
    **dict.fromkeys(("sgn", "signum"), "write sign(x)"),
    **dict.fromkeys(("H", "Theta", "heaviside", "step"), _STEP),
    **dict.fromkeys(("sat", "clip", "clamp"), _SATURATION),
    **dict.fromkeys(("pos", "relu"), "a positive part is max(x, 0)"),
    **dict.fromkeys(("ifelse", "piecewise"), "write where(condition, a, b)"),
    **dict.fromkeys(
        ("delta", "dirac"), "an impulse is a reset, at a surface or at the tick of a clock"
    ),
    **dict.fromkeys(("floor", "ceil", "round", "frac", "fmod", "rint", "trunc"), _JUMP),
}


def advice_on(name: str, known: Sequence[str]) -> str:
    """Return what to write for a function that there is not.

    Examples
    --------
    >>> advice_on("ln", ["log"]), advice_on("sine", ["sin"])
    ('; write log(x)', "; did you mean 'sin'? Valid: sin")
    """
    instead = _INSTEAD.get(name) or _INSTEAD.get(name.lower())
    return f"; {instead}" if instead else did_you_mean(name, known)
