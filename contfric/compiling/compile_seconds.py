"""Estimates of how long kernels take to compile, if they were never compiled on this machine.

Seconds on one core of an AMD EPYC of 2.6 GHz, all kernels of the package one after the other
(``contfric doctor --compile --workers 1``): which kernel comes first pays for the helpers that others share.
On another machine they are multiplied by a common factor (:mod:`contfric.compiling.announced`).
"""

SECONDS = {
    "contfric.bvp.blocks.linearise": 2.5,
    "contfric.bvp.joint_derivatives.move_joints": 3.2,
    "contfric.bvp.monitor.examine": 3.5,
    "contfric.bvp.newton.solve": 3.2,
    "contfric.bvp.spectrum.stability": 1.1,
    "contfric.censuses.sweep.sweep": 1.2,
    "contfric.chaos.cells.follow_cells": 11.1,
    "contfric.continuation.core.locate.locate": 5.8,
    "contfric.continuation.core.march.march": 6.5,
    "contfric.curves.core.bracket.locate_on_curve": 12.2,
    "contfric.curves.core.march.march_curve": 8.8,
    "contfric.flow.chattering.flow": 3.5,
    "contfric.flow.general.flow-plain": 15.2,
    "contfric.flow.general.flow-stiff": 6.9,
    "contfric.flow.general.hit-plain": 16.0,
    "contfric.flow.general.hit-stiff": 4.7,
    "contfric.flow.general.stationary-plain": 13.1,
    "contfric.flow.general.stationary-stiff": 2.9,
    "contfric.flow.oscillator.flow.flow": 2.6,
    "contfric.flow.oscillator.flow.hit": 2.3,
    "contfric.flow.oscillator.second.second": 1.3,
    "contfric.flow.oscillator.together.together": 1.7,
    "contfric.orbit.functionals.integral_states.carry": 4.8,
    "contfric.orbit.functionals.integral_states.field": 1.3,
    "contfric.orbit.functionals.integrals.integrate": 4.7,
    "contfric.orbit.functionals.peak.measure_extreme": 1.9,
    "contfric.response.capture.capture": 2.5,
    "contfric.response.section.cut_solutions": 3.1,
    "contfric.simulation.march.simulate": 3.1,
}
#: Of a kernel that is not in the list: all others took less than a second.
OTHER = 0.5
