"""Estimates of how long kernels take to compile, if they were never compiled on this machine.

Seconds on one core of an AMD EPYC of 2.6 GHz, all kernels of the package one after the other
(``contfric doctor --compile --workers 1``): which kernel comes first pays for the helpers that others share.
On another machine they are multiplied by a common factor (:mod:`contfric.compiling.announced`).
"""

SECONDS = {
    "contfric.censuses.sweep.sweep": 1.2,
    "contfric.chaos.cells.follow_cells": 10.7,
    "contfric.continuation.bracket.locate": 11.9,
    "contfric.continuation.march.march": 6.5,
    "contfric.curves.bracket.locate_on_curve": 12.7,
    "contfric.curves.march.march_curve": 9.2,
    "contfric.flow.chattering.flow": 3.6,
    "contfric.flow.chattering.stationary": 1.0,
    "contfric.flow.forced_oscillator.flow": 2.6,
    "contfric.flow.forced_oscillator.hit": 2.4,
    "contfric.flow.general.flow-plain": 16.2,
    "contfric.flow.general.flow-stiff": 6.9,
    "contfric.flow.general.hit-plain": 11.0,
    "contfric.flow.general.hit-stiff": 5.0,
    "contfric.flow.general.stationary-plain": 10.3,
    "contfric.flow.general.stationary-stiff": 3.0,
    "contfric.flow.second.second": 1.2,
    "contfric.flow.together.together": 1.6,
    "contfric.orbit.blocks.linearise": 2.1,
    "contfric.orbit.carried.carry": 4.6,
    "contfric.orbit.carried.field": 1.2,
    "contfric.orbit.integrals.integrate": 4.9,
    "contfric.orbit.moved.move_joints": 2.1,
    "contfric.orbit.newton.solve": 2.0,
    "contfric.orbit.peak.measure_extreme": 2.1,
    "contfric.orbit.trajectory.simulate": 3.2,
    "contfric.response.capture.capture": 2.5,
    "contfric.response.section.cut_solutions": 3.2,
}
#: Of a kernel that is not in the list: all others took less than a second.
OTHER = 0.5
