"""Periodic orbits of friction and other piecewise-smooth oscillators, continued through every event.

A periodic orbit is a declarative signature; the program finds the next signature itself.

>>> import contfric as cf
>>> cf.load_model("coulomb").defaults["S0"]
0.4

Nothing heavy is imported until it is used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from contfric.base.lazy import lazily

if TYPE_CHECKING:
    from contfric.adding.windows import Window as Window
    from contfric.adding.windows import period_adding as period_adding
    from contfric.atlas.diagram import Diagram as Diagram
    from contfric.atlas.explore import explore as explore
    from contfric.atlas.plane.explore import explore_plane as explore_plane
    from contfric.atlas.plane.plane import Plane as Plane
    from contfric.atlas.starts.seeds import Seeds as Seeds
    from contfric.censuses.census import census as census
    from contfric.censuses.result import Census as Census
    from contfric.certify.census import certify_census as certify_census
    from contfric.certify.census_result import CensusCertificate as CensusCertificate
    from contfric.chaos.compute import lyapunov_map as lyapunov_map
    from contfric.chaos.exponents import LyapunovExponents as LyapunovExponents
    from contfric.chaos.exponents import lyapunov_exponent as lyapunov_exponent
    from contfric.chaos.map import LyapunovMap as LyapunovMap
    from contfric.chaos.status import Motion as Motion
    from contfric.continuation.branch import Branch as Branch
    from contfric.continuation.trace import continue_orbit as continue_orbit
    from contfric.curves.curve import Curve as Curve
    from contfric.curves.of_quantities.curve import QuantityCurve as QuantityCurve
    from contfric.curves.of_quantities.extremum import ExtremumCurve as ExtremumCurve
    from contfric.curves.of_quantities.extremum import continue_extremum as continue_extremum
    from contfric.curves.of_quantities.homoclinic import HomoclinicCurve as HomoclinicCurve
    from contfric.curves.of_quantities.homoclinic import continue_homoclinic as continue_homoclinic
    from contfric.curves.of_quantities.trace import continue_quantity as continue_quantity
    from contfric.curves.special import CodimTwo as CodimTwo
    from contfric.curves.trace import continue_bifurcation as continue_bifurcation
    from contfric.ensembles.compute import ensemble as ensemble
    from contfric.ensembles.ensemble import Ensemble as Ensemble
    from contfric.equilibria.branch import EquilibriumBranch as EquilibriumBranch
    from contfric.equilibria.events import BoundaryPoint as BoundaryPoint
    from contfric.equilibria.events import EquilibriumEvent as EquilibriumEvent
    from contfric.equilibria.events import HopfPoint as HopfPoint
    from contfric.equilibria.explore import EquilibriumDiagram as EquilibriumDiagram
    from contfric.equilibria.explore import explore_equilibria as explore_equilibria
    from contfric.equilibria.find import find_equilibria as find_equilibria
    from contfric.equilibria.result import Equilibria as Equilibria
    from contfric.equilibria.result import Equilibrium as Equilibrium
    from contfric.equilibria.result import EquilibriumSet as EquilibriumSet
    from contfric.equilibria.trace import continue_equilibrium as continue_equilibrium
    from contfric.errors import AperiodicError as AperiodicError
    from contfric.errors import ContfricError as ContfricError
    from contfric.errors import ConvergenceError as ConvergenceError
    from contfric.errors import ModelError as ModelError
    from contfric.errors import NotationError as NotationError
    from contfric.errors import ParameterError as ParameterError
    from contfric.errors import ResultFileError as ResultFileError
    from contfric.errors import StudyError as StudyError
    from contfric.events.bifurcation import Bifurcation as Bifurcation
    from contfric.events.bifurcation import EndReason as EndReason
    from contfric.events.bifurcation import Kind as Kind
    from contfric.fitting.data import Jump as Jump
    from contfric.fitting.data import Measured as Measured
    from contfric.fitting.data import Series as Series
    from contfric.fitting.fit import fit as fit
    from contfric.fitting.result import Fit as Fit
    from contfric.models import Model as Model
    from contfric.models import load_model as load_model
    from contfric.models import model_names as model_names
    from contfric.models.check import ModelReport as ModelReport
    from contfric.models.check import check_model as check_model
    from contfric.models.reading.mechanism import Mechanism as Mechanism
    from contfric.models.reading.oscillator import OscillatorModel as OscillatorModel
    from contfric.models.two_folds import TwoFold as TwoFold
    from contfric.models.two_folds import find_two_folds as find_two_folds
    from contfric.orbit.finding.find import find_orbit as find_orbit
    from contfric.orbit.gradient import Gradient as Gradient
    from contfric.orbit.orbit import Orbit as Orbit
    from contfric.orbit.positions.resting import RestingPosition as RestingPosition
    from contfric.orbit.solve import solve_orbit as solve_orbit
    from contfric.quantities.registry import quantity_names as quantity_names
    from contfric.response.basin_map import basins as basins
    from contfric.response.basins import Basins as Basins
    from contfric.response.outcome import Outcome as Outcome
    from contfric.response.poincare import poincare as poincare
    from contfric.response.release import release_map as release_map
    from contfric.response.returns import ReleaseMap as ReleaseMap
    from contfric.response.returns import Returns as Returns
    from contfric.response.stable_set import StableSet as StableSet
    from contfric.response.stable_set import stable_set as stable_set
    from contfric.response.sweep import Sweep as Sweep
    from contfric.response.sweeping import sweep as sweep
    from contfric.results import load as load
    from contfric.results import save as save
    from contfric.results.export import export as export
    from contfric.signature import Signature as Signature
    from contfric.signature import load_signature as load_signature
    from contfric.signature import signature_names as signature_names
    from contfric.signature import transition_graph as transition_graph
    from contfric.simulation.simulate import simulate as simulate
    from contfric.study import run_study as run_study

_names, _find, _ = lazily(__name__)
#: All public names; linters take a list without a star in it.
__all__ = [*_names, "__version__"]  # noqa: PLE0604


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("contfric")
    globals()[name] = found = _find(name)  # the next look-up costs nothing
    return found


def __dir__() -> list[str]:
    return sorted(__all__)
