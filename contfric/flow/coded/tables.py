"""The tables of models whose formulas are data, as compiled code finds them.

A model of many modes has its matrices as data. The formulas of its parameters are a list of operations
(:mod:`contfric.flow.coded.operations`); a coefficient is a sum of their results times weights; a row of an
affine form lists its coefficients of states and of harmonics. Forms come in *groups*: the rates of a piece
(n rows), an observable (one row), a reset (n rows). What
:class:`contfric.models.generated.formula_tables.Tables` writes::

    operations[4 v : 4 v + 4]  kind, and up to three operands;  numbers[v] its constant
    row_of[g]                  first row of a group;  slope_at[r], wave_at[r] its first slope, and wave
    columns[s], harmonics[s]   state of a slope, frequency of a wave
    term_at[k]                 first term of a coefficient;  operands[j], weights[j] of a term
    places[g]                  first coefficient of a group: its slopes, then cosine and sine of each wave
    group_of[m]                the group of a mode;  observable_of[c] that of an observable
"""

from __future__ import annotations

from numba import types

from contfric.compiled import helper
from contfric.handle import TABLE, WEIGHTS, HandleType

_TABLES = (
    *("operations", "row_of", "slope_at", "wave_at", "columns", "harmonics", "term_at", "operands"),
    *("places", "frequency_at", "level_at", "scale_at", "reset_at", "surface_at", "surfaces"),
    *("observable_of", "seen_at", "group_of"),
)
_NUMBERS = ("values", "states", "waves", "parameters", "coefficients", "period_at")
#: What is after a handle of a model whose formulas are data.
LAYOUT = {
    **dict.fromkeys(_TABLES, TABLE),
    **dict.fromkeys(("numbers", "weights", "returns"), WEIGHTS),
    **dict.fromkeys(_NUMBERS, types.int64),
}
CODED = HandleType("coded", LAYOUT)


@helper
def coefficients_of(model, group, values, by, co, jac):  # type: ignore[no-untyped-def]
    """Write the coefficients of a group, and their derivatives."""
    first = model.places[group]
    for k in range(model.places[group + 1] - first):
        total, begin, end = 0.0, model.term_at[first + k], model.term_at[first + k + 1]
        for j in range(begin, end):
            total += model.weights[j] * values[model.operands[j]]
        co[k] = total
        for q in range(jac.shape[0]):
            total = 0.0
            for j in range(begin, end):
                total += model.weights[j] * by[q, model.operands[j]]
            jac[q, k] = total


@helper
def wave_shift(model, group):  # type: ignore[no-untyped-def]
    """Return the place of the cosine's coefficient of a wave less twice the number of the wave."""
    row, last = model.row_of[group], model.row_of[group + 1]
    return model.slope_at[last] - model.slope_at[row] - 2 * model.wave_at[row]
