"""The explicit method of order 8 of Dormand and Prince, with Hairer's pair of error estimates.

Twelve stages; the estimate combines one of order 5 with one of order 3 to one that falls like the
eighth power of the step::

    error = |h| e5^2 / sqrt(e5^2 + 0.01 e3^2)

Source of the method, of its coefficients and of the estimate: E. Hairer, S. P. Norsett, G. Wanner,
"Solving Ordinary Differential Equations I", 2nd edition, Springer 1993, section II.5 (method) and II.10
(estimate), and the code DOP853 by the same authors. Stages are numbered from 0, columns that are not
named are zero.
"""

from __future__ import annotations

import math

import numpy as np

from contfric.compiled import helper
from contfric.flow.integration.variations import slope

#: Number of stages, and the power of the step with which the error estimate falls.
STAGES, POWER = 12, 8

#: Where in the step each stage is.
_NODES = np.array(
    [
        0.0,
        0.05260015195876773,
        0.0789002279381516,
        0.1183503419072274,
        0.2816496580927726,
        0.3333333333333333,
        0.25,
        0.3076923076923077,
        0.6512820512820513,
        0.6,
        0.8571428571428571,
        1.0,
    ]
)
#: Coefficients of the stages by the stages before them.
_ROWS = {
    1: {0: 0.05260015195876773},
    2: {0: 0.0197250569845379, 1: 0.0591751709536137},
    3: {0: 0.02958758547680685, 2: 0.08876275643042054},
    4: {0: 0.2413651341592667, 2: -0.8845494793282861, 3: 0.924834003261792},
    5: {0: 0.037037037037037035, 3: 0.17082860872947386, 4: 0.12546768756682242},
    6: {0: 0.037109375, 3: 0.17025221101954405, 4: 0.06021653898045596, 5: -0.017578125},
    7: {
        0: 0.03709200011850479,
        3: 0.17038392571223998,
        4: 0.10726203044637328,
        5: -0.015319437748624402,
        6: 0.008273789163814023,
    },
    8: {
        0: 0.6241109587160757,
        3: -3.3608926294469414,
        4: -0.868219346841726,
        5: 27.59209969944671,
        6: 20.154067550477894,
        7: -43.48988418106996,
    },
    9: {
        0: 0.47766253643826434,
        3: -2.4881146199716677,
        4: -0.590290826836843,
        5: 21.230051448181193,
        6: 15.279233632882423,
        7: -33.28821096898486,
        8: -0.020331201708508627,
    },
    10: {
        0: -0.9371424300859873,
        3: 5.186372428844064,
        4: 1.0914373489967295,
        5: -8.149787010746927,
        6: -18.52006565999696,
        7: 22.739487099350505,
        8: 2.4936055526796523,
        9: -3.0467644718982196,
    },
    11: {
        0: 2.273310147516538,
        3: -10.53449546673725,
        4: -2.0008720582248625,
        5: -17.9589318631188,
        6: 27.94888452941996,
        7: -2.8589982771350235,
        8: -8.87285693353063,
        9: 12.360567175794303,
        10: 0.6433927460157636,
    },
}
#: Weights of the stages, those of the estimate of order 5, and of the solution that is compared at order
#: 3.
_WEIGHTS = {
    0: 0.054293734116568765,
    5: 4.450312892752409,
    6: 1.8915178993145003,
    7: -5.801203960010585,
    8: 0.3111643669578199,
    9: -0.1521609496625161,
    10: 0.20136540080403034,
    11: 0.04471061572777259,
}
_FIFTH = {
    0: 0.01312004499419488,
    5: -1.2251564463762044,
    6: -0.4957589496572502,
    7: 1.6643771824549864,
    8: -0.35032884874997366,
    9: 0.3341791187130175,
    10: 0.08192320648511571,
    11: -0.022355307863886294,
}
_THIRD = {0: 0.2440944881889764, 8: 0.7338466882816118, 11: 0.022058823529411766}


def _table(rows: dict[int, dict[int, float]]) -> np.ndarray:
    """Return rows of named columns as a full table."""
    table = np.zeros((STAGES, STAGES))
    for i, row in rows.items():
        for j, value in row.items():
            table[i, j] = value
    return table


_STAGE = _table(_ROWS)
_WEIGHT, _ERROR5 = _table({0: _WEIGHTS, 1: _FIFTH})[:2].copy()
_ERROR3 = _WEIGHT - _table({0: _THIRD})[0]


@helper
def explicit_step(motion, mode, c, t, h, p, which, workspace, target):  # type: ignore[no-untyped-def]
    """Step from ``workspace.start``, where the slope is ``workspace.slopes[0]``; write to ``target``."""
    start, stage, slopes = workspace.start, workspace.stage, workspace.slopes
    size = start.shape[0]
    for i in range(1, STAGES):
        for k in range(size):
            stage[k] = start[k]
        for j in range(i):
            a = h * _STAGE[i, j]
            if a != 0.0:
                for k in range(size):
                    stage[k] += a * slopes[j, k]
        slope(motion, mode, c, t + h * _NODES[i], stage, p, which, workspace, slopes[i])
    for k in range(size):
        target[k] = start[k]
    for j in range(STAGES):
        b = h * _WEIGHT[j]
        if b != 0.0:
            for k in range(size):
                target[k] += b * slopes[j, k]


@helper
def explicit_error(motion, h, workspace):  # type: ignore[no-untyped-def]
    """Return the error of the last step, of its worst component, in units of what is allowed."""
    start, end, slopes, allowed = (
        workspace.start,
        workspace.end,
        workspace.slopes,
        workspace.allowed,
    )
    worst = 0.0
    for k in range(start.shape[0]):
        fifth, third = 0.0, 0.0
        for j in range(STAGES):
            fifth += _ERROR5[j] * slopes[j, k]
            third += _ERROR3[j] * slopes[j, k]
        both = fifth * fifth + 0.01 * third * third
        here = allowed[k] + motion.relative * max(abs(start[k]), abs(end[k]))
        error = abs(h) * fifth * fifth / (math.sqrt(both) * here) if both > 0.0 else 0.0
        if not error <= worst:  # also where it is no number
            worst = error
        if not math.isfinite(end[k]):
            return np.inf
    return worst
