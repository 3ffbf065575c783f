"""The functions and tables that compiled code finds after a handle: those of a flow, and of a model.

The signatures of the functions stand in :mod:`contfric.compiled`.
"""

from __future__ import annotations

from numba import types

from contfric.compiled import (
    f8,
    field_signature,
    flow_signature,
    hit_signature,
    i8,
    indices,
    level_signature,
    matrix,
    observe_signature,
    period_signature,
    rate_signature,
    reset_signature,
    scale_signature,
    second_signature,
    stationary_signature,
    together_signature,
    vector,
)
from contfric.handle import ITSELF, TABLE, WEIGHTS, HandleType

#: The functions of a flow, as the engine takes them.
FLOW = {
    "flow": flow_signature,
    "observe": observe_signature,
    "level": level_signature,
    "stationary": stationary_signature,
    "hit": hit_signature,
    "period": period_signature,
    "rate": rate_signature,
    "reset": reset_signature,
}
FlowType = HandleType("flow", FLOW)
#: Its second derivatives, which curves in two parameters take as well.
SECOND = {"second": second_signature}
SecondType = HandleType("second", SECOND)

#: The first hits of many solutions at once.
TOGETHER = {"together": together_signature}
TogetherType = HandleType("together", TOGETHER)

_entries = types.void(i8, vector, indices, vector, matrix)
_audible = types.void(i8, vector, vector)

#: The functions of a model. ``piece`` numbers smooth fields: modes, or the parts that kinks cut them into.
FUNCTIONS = {
    # field(piece, t, y, p, which, out, jac): dy/dt, and its derivatives by t, y and p[which]
    "field": field_signature,
    "observe": observe_signature,
    "rate": rate_signature,
    "period": period_signature,
    # scale(i, p): natural size of state i, the unit of its absolute tolerance; negative where it has none
    "scale": scale_signature,
    # onto(mode, t, y, p, which, y1, jac): the state on the surfaces that a mode slides on
    "onto": field_signature,
}
#: The functions of affine modes (:mod:`contfric.models.generated.linear_code`).
AFFINE = {
    # entries(piece, p, which, co, slopes): the coefficients of a piece, or of
    # an observable, with derivatives by p[which]; frequencies; which of these are heard
    "entries": _entries,
    "entries_seen": _entries,
    "frequencies": types.void(vector, indices, vector, matrix),
    "audible": _audible,
    "audible_seen": _audible,
    # rates(piece, co, y, c, s, out): A y + b; expand(piece, co, y, c, s, w, h, terms, series): its Taylor
    # terms; vary(piece, co, by, z, waves, w, dw, h, terms, series, out): their derivatives
    "rates": types.void(i8, vector, vector, vector, vector, vector),
    "expand": types.void(i8, vector, vector, vector, vector, vector, f8, i8, matrix),
    # carry(piece, co, h, terms, columns): columns of a matrix times exp(A h)
    "carry": types.void(i8, vector, f8, i8, matrix),
    "vary": types.void(i8, vector, vector, vector, matrix, vector, vector, f8, i8, matrix, matrix),
    # sums(piece, co, d, row, column, own): sums of the matrix in units d
    "sums": types.void(i8, vector, vector, vector, vector, vector),
    # look(c, co, cs, sn, w, h, terms, series, poly): Taylor terms of an observable
    "look": types.void(i8, vector, vector, vector, vector, f8, i8, matrix, vector),
}
#: Tables of whole numbers: what is true of a mode, an observable, or a pair (mode * observables + c).
TABLES = (
    "closed",  # of a piece: whether it is affine
    "seen",  # of an observable: whether it is affine
    "slides",  # of a mode: whether it slides on a surface
    "idle",  # of a pair: whether the observable keeps its value along the mode
    "timed",  # of an observable: whether it depends on time alone
    "sides",  # of a pair: the side of its level that segments of the mode leave to; 0: either
    "kink_of",  # of a kink: the observable that vanishes there
)
#: Numbers: tolerances of a step, how much they are looser than 1e-12 in steps, whether all steps are
#: implicit, and counts.
NUMBERS = {
    "relative": f8,
    "absolute": f8,
    "looseness": f8,
    "implicit": i8,
    "kinks": i8,
    "observables": i8,
    "entries_count": i8,
    "waves_count": i8,
    "carries": i8,  # whether there is ``carry``; else ``expand`` does it column by column
}
#: What an integrator knows of a model. A clock is a block along whose field no state moves: zeros of
#: observables of time alone are sought along it. The memory is that of :mod:`contfric.flow.linear.kept`.
MODEL = {
    **FUNCTIONS,
    **AFFINE,
    **dict.fromkeys(TABLES, TABLE),
    **NUMBERS,
    "clock": ITSELF,
    "memory": WEIGHTS,
}
