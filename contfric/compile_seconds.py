"""How long kernels take to compile, where that is known of no earlier time.

Seconds on one core of an AMD EPYC of 2.6 GHz, all kernels of the package one after the other
(``contfric doctor --compile --workers 1``): which kernel comes first pays for the helpers that others share.
On another machine they are multiplied by a common factor (:mod:`contfric.announced`).
"""

SECONDS = {
    "contfric.atlas.census_sweep.sweep": 2.8,
    "contfric.chaos.cells.follow_cells": 11.7,
    "contfric.continuation.bracket.locate": 18.8,
    "contfric.continuation.march.march": 9.1,
    "contfric.curves.bracket.locate_on_curve": 10.0,
    "contfric.curves.march.march_curve": 8.3,
    "contfric.flow.coded.values.observe": 1.2,
    "contfric.flow.coded.values.onto": 1.2,
    "contfric.flow.coded.values.rate": 1.3,
    "contfric.flow.forced_oscillator.flow": 8.1,
    "contfric.flow.forced_oscillator.hit": 7.6,
    "contfric.flow.general.flow-plain": 9.5,
    "contfric.flow.general.flow-stiff": 10.0,
    "contfric.flow.general.hit-plain": 8.3,
    "contfric.flow.general.hit-stiff": 5.7,
    "contfric.flow.general.stationary-plain": 6.0,
    "contfric.flow.general.stationary-stiff": 3.8,
    "contfric.flow.second.second": 1.6,
    "contfric.orbit.blocks.linearise": 2.5,
    "contfric.orbit.monitor.examine": 1.2,
    "contfric.orbit.newton.solve": 2.1,
    "contfric.orbit.trajectory.simulate": 1.4,
    "contfric.response.section.cut_solutions": 3.5,
}
#: Of a kernel that is not in the list: all others took less than a second.
OTHER = 0.5
