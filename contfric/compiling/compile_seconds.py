"""Estimates of how long kernels take to compile, if they were never compiled on this machine.

Seconds on one core of an AMD EPYC of 2.6 GHz, all kernels of the package one after the other
(``contfric doctor --compile --workers 1``): which kernel comes first pays for the helpers that others share.
On another machine they are multiplied by a common factor (:mod:`contfric.compiling.announced`).
"""

SECONDS = {
    "contfric.censuses.sweep.sweep": 1.4,
    "contfric.chaos.cells.follow_cells": 10.8,
    "contfric.continuation.core.locate.locate": 11.1,
    "contfric.continuation.core.march.march": 6.3,
    "contfric.curves.bracket.locate_on_curve": 12.8,
    "contfric.curves.march.march_curve": 9.2,
    "contfric.flow.chattering.flow": 3.7,
    "contfric.flow.chattering.hit": 1.1,
    "contfric.flow.oscillator.flow.flow": 2.5,
    "contfric.flow.oscillator.flow.hit": 2.3,
    "contfric.flow.general.flow-plain": 15.3,
    "contfric.flow.general.flow-stiff": 6.9,
    "contfric.flow.general.hit-plain": 10.0,
    "contfric.flow.general.hit-stiff": 4.7,
    "contfric.flow.general.stationary-plain": 9.9,
    "contfric.flow.general.stationary-stiff": 2.8,
    "contfric.flow.oscillator.second.second": 1.1,
    "contfric.flow.oscillator.together.together": 1.6,
    "contfric.bvp.blocks.linearise": 2.2,
    "contfric.orbit.integral_states.carry": 4.8,
    "contfric.orbit.integral_states.field": 1.2,
    "contfric.orbit.integrals.integrate": 4.6,
    "contfric.bvp.joint_derivatives.move_joints": 2.0,
    "contfric.bvp.newton.solve": 1.9,
    "contfric.orbit.peak.measure_extreme": 1.8,
    "contfric.simulation.march.simulate": 2.9,
    "contfric.response.capture.capture": 2.6,
    "contfric.response.section.cut_solutions": 3.2,
}
#: Of a kernel that is not in the list: all others took less than a second.
OTHER = 0.5
