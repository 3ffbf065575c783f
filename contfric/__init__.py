"""Periodic orbits of friction and other piecewise-smooth oscillators, continued through every event.

A periodic orbit is a declarative signature; the program finds the next signature itself.

>>> import contfric as cf
>>> cf.load_model("coulomb").defaults["S0"]
0.4

Nothing heavy is imported until it is used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from contfric.atlas.diagram import Diagram
    from contfric.atlas.explore import explore
    from contfric.atlas.plane import Plane
    from contfric.atlas.plane_explore import explore_plane
    from contfric.atlas.seeds import Seeds
    from contfric.censuses.census import census
    from contfric.censuses.result import Census
    from contfric.certify.census import certify_census
    from contfric.certify.census_result import CensusCertificate
    from contfric.chaos.compute import lyapunov_map
    from contfric.chaos.exponents import LyapunovExponents, lyapunov_exponent
    from contfric.chaos.map import LyapunovMap
    from contfric.chaos.status import Motion
    from contfric.continuation.adding import Window, period_adding
    from contfric.continuation.branch import Branch
    from contfric.continuation.events import Bifurcation, EndReason, Kind
    from contfric.continuation.trace import continue_orbit
    from contfric.curves.curve import Curve
    from contfric.curves.extremum import ExtremumCurve, continue_extremum
    from contfric.curves.homoclinic import HomoclinicCurve, continue_homoclinic
    from contfric.curves.quantity_curve import QuantityCurve
    from contfric.curves.quantity_trace import continue_quantity
    from contfric.curves.special import CodimTwo
    from contfric.curves.trace import continue_bifurcation
    from contfric.ensembles.compute import ensemble
    from contfric.ensembles.ensemble import Ensemble
    from contfric.equilibria.branch import EquilibriumBranch
    from contfric.equilibria.events import BoundaryPoint, EquilibriumEvent, HopfPoint
    from contfric.equilibria.explore import EquilibriumDiagram, explore_equilibria
    from contfric.equilibria.find import find_equilibria
    from contfric.equilibria.result import Equilibria, Equilibrium, EquilibriumSet
    from contfric.equilibria.trace import continue_equilibrium
    from contfric.errors import (
        AperiodicError,
        ContfricError,
        ConvergenceError,
        ModelError,
        NotationError,
        ParameterError,
        ResultFileError,
        StudyError,
    )
    from contfric.fitting.data import Jump, Measured, Series
    from contfric.fitting.fit import fit
    from contfric.fitting.result import Fit
    from contfric.models import Model, load_model, model_names
    from contfric.models.check import ModelReport, check_model
    from contfric.models.mechanism import Mechanism
    from contfric.models.oscillator import OscillatorModel
    from contfric.models.two_folds import TwoFold, find_two_folds
    from contfric.orbit.find import find_orbit
    from contfric.orbit.gradient import Gradient
    from contfric.orbit.orbit import Orbit
    from contfric.orbit.simulation import simulate
    from contfric.orbit.solve import solve_orbit
    from contfric.quantities.registry import quantity_names
    from contfric.response.basin_map import basins
    from contfric.response.basins import Basins
    from contfric.response.outcome import Outcome
    from contfric.response.poincare import poincare
    from contfric.response.release import release_map
    from contfric.response.returns import ReleaseMap, Returns
    from contfric.response.stable_set import StableSet, stable_set
    from contfric.response.sweep import Sweep
    from contfric.response.sweeping import sweep
    from contfric.results import load, save
    from contfric.results.export import export
    from contfric.signature import Signature, load_signature, signature_names, transition_graph
    from contfric.study import run_study

#: Where each public name lives; imported at first use.
_HOMES = {
    "AperiodicError": "contfric.errors",
    "Basins": "contfric.response.basins",
    "Bifurcation": "contfric.continuation.events",
    "BoundaryPoint": "contfric.equilibria.events",
    "Branch": "contfric.continuation.branch",
    "Census": "contfric.censuses.result",
    "CensusCertificate": "contfric.certify.census_result",
    "CodimTwo": "contfric.curves.special",
    "ContfricError": "contfric.errors",
    "ConvergenceError": "contfric.errors",
    "Curve": "contfric.curves.curve",
    "Diagram": "contfric.atlas.diagram",
    "Fit": "contfric.fitting.result",
    "Measured": "contfric.fitting.data",
    "Series": "contfric.fitting.data",
    "Jump": "contfric.fitting.data",
    "StableSet": "contfric.response.stable_set",
    "stable_set": "contfric.response.stable_set",
    "fit": "contfric.fitting.fit",
    "EndReason": "contfric.continuation.events",
    "Ensemble": "contfric.ensembles.ensemble",
    "ensemble": "contfric.ensembles.compute",
    "Equilibria": "contfric.equilibria.result",
    "Equilibrium": "contfric.equilibria.result",
    "EquilibriumBranch": "contfric.equilibria.branch",
    "EquilibriumDiagram": "contfric.equilibria.explore",
    "EquilibriumEvent": "contfric.equilibria.events",
    "EquilibriumSet": "contfric.equilibria.result",
    "HopfPoint": "contfric.equilibria.events",
    "Gradient": "contfric.orbit.gradient",
    "Kind": "contfric.continuation.events",
    "LyapunovExponents": "contfric.chaos.exponents",
    "LyapunovMap": "contfric.chaos.map",
    "Model": "contfric.models",
    "ModelError": "contfric.errors",
    "ModelReport": "contfric.models.check",
    "Motion": "contfric.chaos.status",
    "NotationError": "contfric.errors",
    "Orbit": "contfric.orbit.orbit",
    "OscillatorModel": "contfric.models.oscillator",
    "Mechanism": "contfric.models.mechanism",
    "Outcome": "contfric.response.outcome",
    "ParameterError": "contfric.errors",
    "Plane": "contfric.atlas.plane",
    "ExtremumCurve": "contfric.curves.extremum",
    "QuantityCurve": "contfric.curves.quantity_curve",
    "ReleaseMap": "contfric.response.returns",
    "ResultFileError": "contfric.errors",
    "Returns": "contfric.response.returns",
    "Seeds": "contfric.atlas.seeds",
    "Signature": "contfric.signature",
    "StudyError": "contfric.errors",
    "Sweep": "contfric.response.sweep",
    "TwoFold": "contfric.models.two_folds",
    "Window": "contfric.continuation.adding",
    "basins": "contfric.response.basin_map",
    "census": "contfric.censuses.census",
    "certify_census": "contfric.certify.census",
    "check_model": "contfric.models.check",
    "continue_bifurcation": "contfric.curves.trace",
    "continue_equilibrium": "contfric.equilibria.trace",
    "continue_orbit": "contfric.continuation.trace",
    "explore_equilibria": "contfric.equilibria.explore",
    "HomoclinicCurve": "contfric.curves.homoclinic",
    "continue_extremum": "contfric.curves.extremum",
    "continue_homoclinic": "contfric.curves.homoclinic",
    "continue_quantity": "contfric.curves.quantity_trace",
    "export": "contfric.results.export",
    "explore": "contfric.atlas.explore",
    "explore_plane": "contfric.atlas.plane_explore",
    "find_equilibria": "contfric.equilibria.find",
    "find_two_folds": "contfric.models.two_folds",
    "find_orbit": "contfric.orbit.find",
    "load": "contfric.results",
    "load_model": "contfric.models",
    "load_signature": "contfric.signature",
    "lyapunov_exponent": "contfric.chaos.exponents",
    "lyapunov_map": "contfric.chaos.compute",
    "model_names": "contfric.models",
    "period_adding": "contfric.continuation.adding",
    "poincare": "contfric.response.poincare",
    "quantity_names": "contfric.quantities.registry",
    "release_map": "contfric.response.release",
    "run_study": "contfric.study",
    "save": "contfric.results",
    "signature_names": "contfric.signature",
    "simulate": "contfric.orbit.simulation",
    "solve_orbit": "contfric.orbit.solve",
    "sweep": "contfric.response.sweeping",
    "transition_graph": "contfric.signature",
}

__all__ = [
    "AperiodicError",
    "Basins",
    "Bifurcation",
    "BoundaryPoint",
    "Branch",
    "Census",
    "CensusCertificate",
    "CodimTwo",
    "ContfricError",
    "ConvergenceError",
    "Curve",
    "Diagram",
    "EndReason",
    "Ensemble",
    "Equilibria",
    "Equilibrium",
    "EquilibriumBranch",
    "EquilibriumDiagram",
    "EquilibriumEvent",
    "EquilibriumSet",
    "ExtremumCurve",
    "Fit",
    "Gradient",
    "HomoclinicCurve",
    "HopfPoint",
    "Jump",
    "Kind",
    "LyapunovExponents",
    "LyapunovMap",
    "Measured",
    "Mechanism",
    "Model",
    "ModelError",
    "ModelReport",
    "Motion",
    "NotationError",
    "Orbit",
    "OscillatorModel",
    "Outcome",
    "ParameterError",
    "Plane",
    "QuantityCurve",
    "ReleaseMap",
    "ResultFileError",
    "Returns",
    "Seeds",
    "Series",
    "Signature",
    "StableSet",
    "StudyError",
    "Sweep",
    "TwoFold",
    "Window",
    "__version__",
    "basins",
    "census",
    "certify_census",
    "check_model",
    "continue_bifurcation",
    "continue_equilibrium",
    "continue_extremum",
    "continue_homoclinic",
    "continue_orbit",
    "continue_quantity",
    "ensemble",
    "explore",
    "explore_equilibria",
    "explore_plane",
    "export",
    "find_equilibria",
    "find_orbit",
    "find_two_folds",
    "fit",
    "load",
    "load_model",
    "load_signature",
    "lyapunov_exponent",
    "lyapunov_map",
    "model_names",
    "period_adding",
    "poincare",
    "quantity_names",
    "release_map",
    "run_study",
    "save",
    "signature_names",
    "simulate",
    "solve_orbit",
    "stable_set",
    "sweep",
    "transition_graph",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("contfric")
    if name in _HOMES:
        from contfric.base.interrupts import held_back

        with held_back():
            home = import_module(_HOMES[name])
        globals()[name] = found = getattr(home, name)  # the next look-up costs nothing
        return found
    raise AttributeError(f"module 'contfric' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(__all__)
