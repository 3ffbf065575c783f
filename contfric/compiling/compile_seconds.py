"""Estimates of how long kernels take to compile, if they were never compiled on this machine.

Seconds on one core of an AMD EPYC of 2.6 GHz, all kernels of the package one after the other
(``contfric doctor --compile --workers 1``): which kernel comes first pays for the helpers that others share.
On another machine they are multiplied by a common factor (:mod:`contfric.compiling.announced`).
"""

SECONDS = {
    "contfric.censuses.sweep.sweep": 1.4,
    "contfric.chaos.cells.follow_cells": 10.6,
    "contfric.continuation.bracket.locate": 14.1,
    "contfric.continuation.march.march": 8.4,
    "contfric.curves.bracket.locate_on_curve": 9.8,
    "contfric.curves.march.march_curve": 12.0,
    "contfric.flow.chattering.flow": 5.2,
    "contfric.flow.chattering.hit": 1.2,
    "contfric.flow.chattering.stationary": 1.2,
    "contfric.flow.forced_oscillator.flow": 2.7,
    "contfric.flow.forced_oscillator.hit": 3.0,
    "contfric.flow.general.flow-plain": 10.2,
    "contfric.flow.general.flow-stiff": 9.0,
    "contfric.flow.general.hit-plain": 7.3,
    "contfric.flow.general.hit-stiff": 5.3,
    "contfric.flow.general.stationary-plain": 4.9,
    "contfric.flow.general.stationary-stiff": 3.5,
    "contfric.flow.second.second": 2.0,
    "contfric.orbit.blocks.linearise": 2.6,
    "contfric.orbit.monitor.examine": 1.2,
    "contfric.orbit.newton.solve": 2.1,
    "contfric.orbit.trajectory.simulate": 1.6,
    "contfric.response.section.cut_solutions": 3.4,
}
#: Of a kernel that is not in the list: all others took less than a second.
OTHER = 0.5
