"""In which mode a solution begins, compiled."""

from __future__ import annotations

from contfric.compiled import helper


@helper
def start_code(functions, observables, t, y, p, workspace):  # type: ignore[no-untyped-def]
    """Return the row of an initial state in the table of starts: the signs as digits."""
    code, place = 0, 1
    for k in range(observables.shape[0]):
        value = functions.observe(observables[k], t, y, p, workspace.none, workspace.empty)
        value -= functions.level(k, p, workspace.none, workspace.empty)
        code += place * (1 if value == 0.0 else (2 if value > 0.0 else 0))
        place *= 3
    return code


@helper
def start_mode(functions, tables, starting, t, y, p, workspace):  # type: ignore[no-untyped-def]
    """Return (mode, surfaces that it leaves as bits) of an initial state; (-1, 0) if it is in no domain.

    A state on surfaces that the signs alone do not decide goes to the side that its rates lead to.
    """
    observables, bounds = tables.observables, tables.bounds
    code = start_code(functions, observables, t, y, p, workspace)
    if starting.mode[code] >= 0:
        return starting.mode[code], starting.on[code]
    count = observables.shape[0]
    for choice in range(1 << count):
        other, place, fits, rest = code, 1, True, code
        for k in range(count):
            side = 1 if (choice >> k) & 1 == 1 else -1
            if rest % 3 == 1:
                other += side * place
            elif side < 0:
                fits = False  # a sign that is given: counted once
            rest //= 3
            place *= 3
        mode = starting.mode[other] if fits else -1
        if mode < 0:
            continue
        on, rest = 0, code
        for k in range(count):
            if rest % 3 == 1 and bounds[mode, k] != 0:
                sense = 1.0 if (choice >> k) & 1 == 1 else -1.0
                rate = functions.rate(
                    mode, observables[k], t, y, p, workspace.none, workspace.empty
                )
                fits = fits and sense * rate > 0.0
                on |= 1 << k
            rest //= 3
        if fits:
            return mode, on
    return -1, 0
