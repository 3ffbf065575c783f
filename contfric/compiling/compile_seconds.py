"""Estimates of how long kernels take to compile, if they were never compiled on this machine.

Seconds on one core of an AMD EPYC of 2.6 GHz, all kernels of the package one after the other
(``contfric doctor --compile --workers 1``): which kernel comes first pays for the helpers that others share.
On another machine they are multiplied by a common factor (:mod:`contfric.compiling.announced`).
"""

SECONDS = {
    "contfric.censuses.sweep.sweep": 1.4,
    "contfric.chaos.cells.follow_cells": 12.2,
    "contfric.continuation.bracket.locate": 12.9,
    "contfric.continuation.march.march": 7.0,
    "contfric.curves.bracket.locate_on_curve": 13.4,
    "contfric.curves.march.march_curve": 9.5,
    "contfric.flow.chattering.flow": 4.1,
    "contfric.flow.chattering.stationary": 1.1,
    "contfric.flow.forced_oscillator.flow": 3.4,
    "contfric.flow.forced_oscillator.hit": 3.4,
    "contfric.flow.general.flow-plain": 15.7,
    "contfric.flow.general.flow-stiff": 8.3,
    "contfric.flow.general.hit-plain": 9.8,
    "contfric.flow.general.hit-stiff": 5.6,
    "contfric.flow.general.stationary-plain": 11.7,
    "contfric.flow.general.stationary-stiff": 3.1,
    "contfric.flow.second.second": 1.5,
    "contfric.flow.together.together": 2.0,
    "contfric.orbit.blocks.linearise": 2.7,
    "contfric.orbit.carried.carry": 5.0,
    "contfric.orbit.carried.field": 1.6,
    "contfric.orbit.integrals.integrate": 5.9,
    "contfric.orbit.monitor.examine": 1.2,
    "contfric.orbit.moved.move_joints": 2.2,
    "contfric.orbit.newton.solve": 2.2,
    "contfric.orbit.peak.measure_extreme": 1.9,
    "contfric.orbit.trajectory.simulate": 3.3,
    "contfric.response.capture.capture": 4.2,
    "contfric.response.section.cut_solutions": 3.9,
}
#: Of a kernel that is not in the list: all others took less than a second.
OTHER = 0.5
