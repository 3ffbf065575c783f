"""Estimates of how long kernels take to compile, if they were never compiled on this machine.

Seconds on one core of an AMD EPYC of 2.6 GHz, all kernels of the package one after the other
(``contfric doctor --compile --workers 1``): which kernel comes first pays for the helpers that others share.
On another machine they are multiplied by a common factor (:mod:`contfric.compiling.announced`).
"""

SECONDS = {
    "contfric.bvp.blocks.linearise": 2.0,
    "contfric.bvp.joint_derivatives.move_joints": 2.5,
    "contfric.bvp.monitor.examine": 1.1,
    "contfric.bvp.newton.solve": 2.0,
    "contfric.censuses.sweep.sweep": 3.7,
    "contfric.chaos.cells.follow_cells": 13.0,
    "contfric.continuation.core.locate.locate": 13.7,
    "contfric.continuation.core.march.march": 6.7,
    "contfric.curves.bracket.locate_on_curve": 14.3,
    "contfric.curves.march.march_curve": 9.7,
    "contfric.flow.chattering.flow": 4.2,
    "contfric.flow.chattering.hit": 1.0,
    "contfric.flow.chattering.stationary": 1.1,
    "contfric.flow.general.flow-plain": 19.1,
    "contfric.flow.general.flow-stiff": 7.1,
    "contfric.flow.general.hit-plain": 18.8,
    "contfric.flow.general.hit-stiff": 4.8,
    "contfric.flow.general.stationary-plain": 16.0,
    "contfric.flow.general.stationary-stiff": 3.1,
    "contfric.flow.oscillator.flow.flow": 2.5,
    "contfric.flow.oscillator.flow.hit": 2.4,
    "contfric.flow.oscillator.second.second": 1.2,
    "contfric.flow.oscillator.together.together": 1.7,
    "contfric.orbit.integral_states.carry": 4.8,
    "contfric.orbit.integral_states.field": 1.4,
    "contfric.orbit.integrals.integrate": 5.2,
    "contfric.orbit.peak.measure_extreme": 2.0,
    "contfric.response.capture.capture": 2.5,
    "contfric.response.section.cut_solutions": 3.3,
}
#: Of a kernel that is not in the list: all others took less than a second.
OTHER = 0.5
