"""Estimates of how long kernels take to compile, if they were never compiled on this machine.

Seconds on one core of an AMD EPYC of 2.6 GHz, all kernels of the package one after the other
(``contfric doctor --compile --workers 1``): which kernel comes first pays for the helpers that others share.
On another machine they are multiplied by a common factor (:mod:`contfric.compiling.announced`).
"""

SECONDS = {
    "contfric.bvp.blocks.linearise": 1.9,
    "contfric.bvp.joint_derivatives.move_joints": 2.5,
    "contfric.bvp.monitor.examine": 2.8,
    "contfric.bvp.newton.solve": 2.5,
    "contfric.chaos.cells.follow_cells": 8.7,
    "contfric.continuation.core.locate.locate": 4.6,
    "contfric.continuation.core.march.march": 5.1,
    "contfric.curves.core.bracket.locate_on_curve": 9.6,
    "contfric.curves.core.march.march_curve": 7.1,
    "contfric.flow.chattering.flow": 2.9,
    "contfric.flow.general.flow-plain": 12.4,
    "contfric.flow.general.flow-stiff": 5.9,
    "contfric.flow.general.hit-plain": 12.7,
    "contfric.flow.general.hit-stiff": 3.6,
    "contfric.flow.general.stationary-plain": 11.6,
    "contfric.flow.general.stationary-stiff": 2.3,
    "contfric.flow.oscillator.flow.flow": 2.1,
    "contfric.flow.oscillator.flow.hit": 1.9,
    "contfric.flow.oscillator.together.together": 1.3,
    "contfric.orbit.functionals.integral_states.carry": 3.7,
    "contfric.orbit.functionals.integrals.integrate": 3.7,
    "contfric.orbit.functionals.peak.measure_extreme": 1.6,
    "contfric.response.capture.capture": 1.9,
    "contfric.response.section.cut_solutions": 2.5,
    "contfric.simulation.march.simulate": 2.4,
}
#: Of a kernel that is not in the list: all others took less than a second.
OTHER = 0.5
