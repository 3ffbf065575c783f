"""Estimates of how long kernels take to compile, if they were never compiled on this machine.

Seconds on one core of an AMD EPYC of 2.6 GHz, all kernels of the package one after the other
(``contfric doctor --compile --workers 1``): which kernel comes first pays for the helpers that others share.
On another machine they are multiplied by a common factor (:mod:`contfric.compiling.announced`).
"""

SECONDS = {
    "contfric.bvp.blocks.linearise": 1.8,
    "contfric.bvp.joint_derivatives.move_joints": 2.5,
    "contfric.bvp.monitor.examine": 2.9,
    "contfric.bvp.newton.solve": 2.5,
    "contfric.bvp.spectrum.stability": 1.1,
    "contfric.chaos.cells.follow_cells": 8.6,
    "contfric.continuation.core.locate.locate": 4.7,
    "contfric.continuation.core.march.march": 5.6,
    "contfric.curves.core.bracket.locate_on_curve": 10.3,
    "contfric.curves.core.march.march_curve": 7.0,
    "contfric.flow.chattering.flow": 2.8,
    "contfric.flow.general.flow-plain": 11.3,
    "contfric.flow.general.flow-stiff": 5.3,
    "contfric.flow.general.hit-plain": 12.4,
    "contfric.flow.general.hit-stiff": 3.5,
    "contfric.flow.general.stationary-plain": 10.2,
    "contfric.flow.general.stationary-stiff": 2.2,
    "contfric.flow.oscillator.flow.flow": 2.0,
    "contfric.flow.oscillator.flow.hit": 1.8,
    "contfric.flow.oscillator.together.together": 1.2,
    "contfric.orbit.functionals.integral_states.carry": 3.5,
    "contfric.orbit.functionals.integrals.integrate": 3.6,
    "contfric.orbit.functionals.peak.measure_extreme": 1.4,
    "contfric.response.capture.capture": 2.0,
    "contfric.response.section.cut_solutions": 2.5,
    "contfric.simulation.march.simulate": 2.2,
}
#: Of a kernel that is not in the list: all others took less than a second.
OTHER = 0.5
