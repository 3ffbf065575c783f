"""In which mode a solution begins, compiled."""

from __future__ import annotations

from contfric.compiled import helper
from contfric.simulation.leaving_side import side_ahead, size_of

#: A state lies on a surface within this share of what its observable is summed up from, as in
#: :mod:`contfric.simulation.entered_domain`.
_ON = 16.0 * 2.0**-52


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
def code_on(functions, tables, starting, exact, t, y, p, workspace):  # type: ignore[no-untyped-def]
    """Return (row of a state, with zeros for the surfaces that it lies on to rounding; these as bits)."""
    code, place, on = exact, 1, 0
    for k in range(tables.observables.shape[0]):
        if starting.fixed_sides[k] == 0:
            c = tables.observables[k]
            value = functions.observe(c, t, y, p, workspace.none, workspace.empty)
            value -= functions.level(k, p, workspace.none, workspace.empty)
            size = size_of(functions, c, k, t, y, starting.widths, p, workspace)
            if abs(value) <= _ON * size:
                code += place * (1 - (exact // place) % 3)
                on |= 1 << k
        place *= 3
    return code, on


@helper
def fits_domain(starting, d, code):  # type: ignore[no-untyped-def]
    """Tell whether a domain is on the sides of all surfaces that a state is not on."""
    rest = code
    for k in range(starting.fixed_sides.shape[0]):
        side = starting.fixed_sides[k] if starting.fixed_sides[k] != 0 else rest % 3 - 1
        if side != 0 and side != starting.sides[d, k]:
            return False
        rest //= 3
    return True


@helper
def is_entered(functions, tables, starting, d, on, standing, t, y, p, unit, workspace):  # type: ignore[no-untyped-def]
    """Tell whether the solution of a domain keeps to its sides of the surfaces that a state is on."""
    mode = starting.own[d]
    for k in range(tables.observables.shape[0]):
        side = starting.sides[d, k]
        if side == 0 or on >> k & 1 == 0 or (starting.cuts[k] == 0 and tables.bounds[mode, k] == 0):
            continue
        c = tables.observables[k]
        size = size_of(functions, c, k, t, y, starting.widths, p, workspace)
        ahead = side_ahead(functions, mode, c, t, y, p, unit, size, workspace)
        if ahead == -side or (ahead == 0 and not standing):
            return False
    return True


@helper
def entered_mode(functions, tables, starting, code, on, standing, t, y, p, workspace):  # type: ignore[no-untyped-def]
    """Return the mode that the solution goes into from surfaces; -1 if none is found.

    The same as :func:`contfric.simulation.entered_domain.entered_domain`: first what the sides say, then the
    domains next to the state, those first that lie on most surfaces.
    """
    period = functions.period(p, workspace.none, workspace.empty)
    unit = period if period > 0.0 else starting.unit
    for i in range(-1, starting.own.shape[0]):
        d = starting.first[code] if i < 0 else i
        if d < 0 or (i >= 0 and not fits_domain(starting, d, code)):
            continue
        if is_entered(functions, tables, starting, d, on, standing, t, y, p, unit, workspace):
            return starting.own[d]
    return -1


@helper
def bounding(tables, mode, on):  # type: ignore[no-untyped-def]
    """Return those of some surfaces that bound a mode, as bits."""
    found = 0
    for k in range(tables.observables.shape[0]):
        if on >> k & 1 == 1 and tables.bounds[mode, k] != 0:
            found |= 1 << k
    return found


@helper
def mode_of_signs(functions, tables, starting, code, t, y, p, workspace):  # type: ignore[no-untyped-def]
    """Return (mode, surfaces that it leaves as bits) by the exact signs; (-1, 0) without one.

    A state on surfaces that the signs alone do not decide goes to the side that its rates lead to.
    """
    observables, bounds = tables.observables, tables.bounds
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


@helper
def start_mode(functions, tables, starting, t, y, p, workspace):  # type: ignore[no-untyped-def]
    """Return (mode, surfaces that it leaves as bits) of an initial state; (-1, 0) if it is in no domain.

    As where a simulation starts (:func:`contfric.simulation.starts.start_of`): on surfaces, to rounding, what
    the solution goes into, else what the signs say as they are.
    """
    exact = start_code(functions, tables.observables, t, y, p, workspace)
    code, on = code_on(functions, tables, starting, exact, t, y, p, workspace)
    if on == 0:
        return starting.mode[exact], starting.on[exact]
    mode = entered_mode(functions, tables, starting, code, on, False, t, y, p, workspace)
    if mode >= 0:
        return mode, bounding(tables, mode, on)
    mode, left = mode_of_signs(functions, tables, starting, exact, t, y, p, workspace)
    if mode >= 0:
        return mode, left
    mode = entered_mode(functions, tables, starting, code, on, True, t, y, p, workspace)
    return (mode, bounding(tables, mode, on)) if mode >= 0 else (-1, 0)
