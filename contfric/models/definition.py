"""The definition of a model: its parameters, observables, surfaces, modes, domains, resets and symmetry.

A model is defined once, here, and everything else derives from it: the transition graph, the
simulation, the boundary-value problem, admissibility and the drawings.

* An **observable** is a scalar function of time and state, such as the load ``u = x - f(t)``.
* A **surface** is a level set of an observable: ``F+`` is ``u = S0``.
* A **mode** is one smooth vector field; a **domain** is the part of a mode between surfaces.
* A **transition** leads from a domain through a surface into the next domain.
* A **reset** maps the state where it meets a surface: an impact.

Transitions are derived from the signs of the domains (:attr:`Model.transitions`): crossing a
transparent surface flips its sign; at a switching surface the solution stays on the surface if a
domain exists there (a stick), leaves it as the model's departures say if one of them does, and
otherwise goes through to the other side. After a reset the signs of the mapped state decide, so that
several domains can follow (:attr:`Model.targets`).

Solutions are cut at switching surfaces and at resets, and only there: each has a mode of its own on each
side. Where cycles may be smooth, the surface of the stops (``v = 0``) has two modes of the same field on its
sides: it is a section (:mod:`contfric.models.maps.section_maps`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, fields
from functools import cache, cached_property
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.named import Named
from contfric.base.shown import Shown
from contfric.errors import ParameterError, did_you_mean, mapping_of, shown
from contfric.models.maps.transition_maps import TransitionMaps
from contfric.models.parts import (
    Chatter,
    Constraint,
    Departure,
    Domain,
    Mode,
    Observable,
    Parameter,
    Reset,
    Surface,
    Symmetry,
)
from contfric.remember.stored import given, made_of

if TYPE_CHECKING:
    from contfric.flow.interface import CompiledFlow
    from contfric.models.balls.model import BallModel
    from contfric.models.described.description import Description
    from contfric.models.view import FlowView

__all__ = ["Domain", "Model", "Surface"]

#: A parameter with a smaller default is compared with its default: 1 is far from all its values.
_SMALL = 0.02


@dataclass(frozen=True, eq=False, repr=False)
class Model(Shown, TransitionMaps):
    """A piecewise-smooth oscillator: its definition, and a factory of its compiled flow.

    Attributes
    ----------
    states : tuple of str
        Names of the n states; the first is the displacement that diagrams show.
    surfaces : tuple of Surface
        Those of one observable from the highest level down.
    stop_surface : str
        Surface (or kink) on which the displacement is stationary: stops lie on it; empty without one.
    flow_factory : callable
        Returns the :class:`~contfric.flow.interface.CompiledFlow`; called at first use only.
    spread : callable
        ``spread(params)`` returns the half-width of the region that starts are drawn from,
        shape (n,), nondimensional.
    ranges : callable or None
        ``ranges(params)`` returns the lowest and highest value of each state, shape (n, 2), NaN without one.
    resets : tuple of Reset
        Surfaces at which the state is mapped.
    chatters : tuple of Chatter
        Modes that begin with infinitely many impacts (:mod:`contfric.models.shorthand.chatter`).
    autonomous : bool
        Whether there is no excitation: the flow's ``period`` returns 0, the period of an orbit is found
        with it, and ``periods`` of a simulation are units of time.
    kinks : tuple of str
        Observables at whose zeros the fields have kinks and no jumps: no joints, labels or events
        (:mod:`contfric.flow.integration.kinked`).
    filippov : bool
        Whether rest is left without acceleration everywhere (static and kinetic limit agree): slides may then
        shrink to nothing.
    turned : frozenset of (str, str)
        (mode, surface): a solution that enters the mode where it meets the surface turns back, as that of
        a thermostat when its heater is switched off.
    turned_at_times : frozenset of (str, str)
        The same, where it turns back from some states and goes on from others.
    max_step : float or None
        Largest step of a continuation, as a share of the range; None for that of the engine.
    rounding : float
        Relative rounding of its solutions, the floor of what Newton's method can reach; that of integration.
    displacement : str
        The displacement as an observable, where it may have extrema inside of segments; else empty.
    phase : str
        The surface of the phase that divides modes in which orbits may stay
        (:mod:`contfric.models.deriving.phases`).
    quantities : tuple of (str, str)
        Name and expression of each quantity of its own (:mod:`contfric.quantities`), such as an energy.
    ball_factory : callable or None
        ``ball_factory(params, free)`` returns the model in balls (:mod:`contfric.models.balls`), of a
        model that is not declared by its equations; None if it has none.
    units : tuple of (str, float)
        The unit of each state, and of the time ``t``, that has one: results are numbers in these units.
    origins : tuple of (str, str)
        What states are measured from that a symmetry shifts, expressions of parameters.
    definition : str
        Text from which the model can be built; empty if it is known by its name only.

    Examples
    --------
    >>> import contfric as cf
    >>> model = cf.load_model("coulomb")
    >>> model.states, model.defaults["S0"]
    (('x', 'v'), 0.4)
    """

    name: str
    title: str
    states: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    constraints: tuple[Constraint, ...]
    observables: tuple[Observable, ...]
    surfaces: tuple[Surface, ...]
    modes: tuple[Mode, ...]
    domains: tuple[Domain, ...]
    departures: tuple[Departure, ...]
    symmetry: Symmetry | None
    stop_surface: str
    flow_factory: Callable[[], CompiledFlow] = field(repr=False)
    spread: Callable[[Mapping[str, float]], FloatArray] = field(repr=False)
    ranges: Callable[[Mapping[str, float]], FloatArray] | None = field(default=None, repr=False)
    references: tuple[str, ...] = ()
    resets: tuple[Reset, ...] = ()
    chatters: tuple[Chatter, ...] = ()
    autonomous: bool = False
    kinks: tuple[str, ...] = ()
    filippov: bool = False
    turned: frozenset[tuple[str, str]] = frozenset()
    turned_at_times: frozenset[tuple[str, str]] = frozenset()
    max_step: float | None = None
    rounding: float = 1e-13
    displacement: str = ""
    phase: str = ""
    quantities: tuple[tuple[str, str], ...] = ()
    units: tuple[tuple[str, float], ...] = ()
    origins: tuple[tuple[str, str], ...] = ()
    ball_factory: Callable[[Mapping[str, Any], str | None], BallModel] | None = field(
        default=None, repr=False
    )
    definition: str = field(default="", repr=False)

    def __post_init__(self) -> None:
        for reset in self.resets:
            surface = next((s for s in self.surfaces if s.name == reset.surface), None)
            if surface is None or surface.switching:
                raise ParameterError(
                    f"model '{self.name}': the reset at '{reset.surface}' needs a surface of that "
                    "name that is not switching (the state is mapped there, and stays on its side)"
                )

    @cached_property
    def description(self) -> Description:
        """The declaration as plain data (of a model that is declared by its equations)."""
        from contfric.models.described.reading_back import from_text

        return from_text(self.definition)

    @cached_property
    def integrated(self) -> dict[str, str]:
        """Modes that are integrated numerically, and why (of a model that is declared by its equations)."""
        if not self.definition:
            return {}
        from contfric.models.generated.formula_tables import forms_of
        from contfric.models.generated.symbols import integrated_modes

        if forms_of(self.definition) is not None:
            return {}
        found = integrated_modes(self.description)
        return {mode: why for mode, why in found.items() if mode not in self.phase_parts}

    @property
    def closed_form(self) -> tuple[str, ...]:
        """Modes whose solution is a closed form, of a model that is declared by its equations."""
        if not self.definition:
            return ()
        names = (mode.name for mode in self.modes if mode.name not in self.integrated)
        return tuple(name for name in names if name not in self.phase_parts)

    def __repr__(self) -> str:
        """Say what the model is, and how its modes move."""
        values = ", ".join(f"{p.name} = {p.default:g}" for p in self.parameters)
        lines = [f"Model {self.name}: {self.title}", f"  states: {', '.join(self.states)}"]
        if self.units:
            lines.append(f"  in units of: {', '.join(f'{n} {u:g}' for n, u in self.units)}")
        if self.origins:
            lines.append(f"  measured from: {', '.join(f'{n} from {c}' for n, c in self.origins)}")
        closed = [f"  closed form: {', '.join(self.closed_form)}"] if self.closed_form else []
        rest = [f"  integrated: {mode} ({reason})" for mode, reason in self.integrated.items()]
        return "\n".join([*lines, f"  parameters: {values}", *closed, *rest])

    def __getstate__(self) -> dict[str, Any]:
        # what is derived, compiled code above all, belongs to this process
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @cached_property
    def flow(self) -> CompiledFlow:
        """The compiled flow of this model (loads numba at first use)."""
        return self.flow_factory()

    def view(self, vector: FloatArray) -> FlowView:
        """Return the flow at some parameters, to be asked by names."""
        from contfric.models.view import FlowView

        return FlowView(self, vector)

    def periods_along(self, vector: FloatArray, name: str, values: FloatArray) -> FloatArray:
        """Return the period of the excitation at values of one parameter."""
        moved, active, period = vector.copy(), self.index_of(name), self.flow.period
        which, grad, found = np.empty(0, dtype=np.int64), np.empty(0), np.empty(len(values))
        for k, value in enumerate(values.tolist()):
            moved[active] = value
            found[k] = period(moved, which, grad)
        return found

    @property
    def directions(self) -> int:
        """Number of multipliers of an orbit: one less than states without excitation (a shift in time)."""
        return len(self.states) - int(self.autonomous)

    @property
    def defaults(self) -> dict[str, float]:
        """A fresh mapping of every parameter to its default value."""
        return Named({p.name: p.default for p in self.parameters})

    def size_of(self, index: int, value: float) -> float:
        """Return the size that differences of a parameter are compared with, where it has a value.

        It is 1 + the value. Of a parameter that is far smaller than 1, such as a frequency where times are in
        microseconds, the default stands for 1.
        """
        usual = abs(self.parameters[index].default)
        return abs(value) + (usual if 0.0 < usual < _SMALL else 1.0)

    def index_of(self, name: str) -> int:
        """Return the position of a parameter in the engine's vectors.

        Raises
        ------
        ParameterError
            If the model has no such parameter.
        """
        try:
            return self._parameter_index[name]
        except (KeyError, TypeError):  # whatever the user gave
            names, given = self.parameter_names, shown(name)
        raise ParameterError(
            f"model '{self.name}' has no parameter {given}{did_you_mean(name, names)}"
        )

    @cached_property
    def _parameter_index(self) -> dict[str, int]:
        return {name: k for k, name in enumerate(self.parameter_names)}

    def given_params(self, params: object) -> Mapping[str, Any]:
        """Return the parameters that a user gave, not checked one by one; none if nothing was given."""
        example = ", ".join(f"'{p.name}': {p.default:g}" for p in self.parameters[:2])
        return mapping_of("params", {} if params is None else params, f"{{{example}}}")

    def check_params(self, params: Mapping[str, Any]) -> dict[str, float]:
        """Return all parameters as floats, defaults filled in.

        Raises
        ------
        ParameterError
            For an unknown name, a value that is no finite number, or a violated constraint.
        """
        values = self.defaults
        for name, value in self.given_params(params).items():
            self.index_of(name)
            if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
                raise ParameterError(
                    f"parameter '{name}' must be a number, got {shown(value)} ({type(value).__name__})"
                )
            try:
                number = float(value)
            except (OverflowError, TypeError):  # a whole number of 400 digits; a complex one
                number = math.inf
            if not math.isfinite(number):
                raise ParameterError(f"parameter '{name}' must be finite, got {shown(value)}")
            values[name] = number
        for constraint in self.constraints:
            left = constraint.value(values)
            if left < 0 or (constraint.strict and left == 0):
                here = ", ".join(f"{n} = {values[n]!r}" for n in constraint.coefficients)
                got = f"got {here}" if here else "which never holds"
                raise ParameterError(
                    f"model '{self.name}' needs {constraint.text}, {got}. "
                    + (constraint.meaning or "Choose a value that obeys it.")
                )
        return values

    def region(self, vector: FloatArray, wider: float = 1.0) -> tuple[FloatArray, FloatArray]:
        """Return the lowest and highest states where motion is looked for: within ranges, else about 0.

        Parameters
        ----------
        wider : half-widths to go to, of states that have no range

        Examples
        --------
        >>> import contfric as cf
        >>> model = cf.load_model("coulomb")
        >>> low, high = model.region(model.vector({}), 2.0)
        >>> bool((low == -high).all())
        True
        """
        params = self.mapping(vector)
        half = wider * np.abs(self.spread(params))
        if self.ranges is None:
            return -half, half
        low, high = self.ranges(params).T
        return np.where(np.isfinite(low), low, -half), np.where(np.isfinite(high), high, half)

    def vector(self, params: Mapping[str, Any]) -> FloatArray:
        """Return the checked parameters as the engine's vector, shape (parameters,)."""
        values = self.check_params(params)
        return np.array([values[name] for name in self.parameter_names], dtype=np.float64)

    def mapping(self, vector: FloatArray) -> dict[str, float]:
        """Return the engine's vector as a mapping name -> float."""
        return Named(zip(self.parameter_names, vector.tolist(), strict=True))

    def columns(
        self, vector: FloatArray, varied: Mapping[str, FloatArray]
    ) -> dict[str, FloatArray]:
        """Return all parameters at the points of a branch or curve, along which some are varied."""
        count = len(next(iter(varied.values())))
        fixed = {name: np.full(count, value) for name, value in self.mapping(vector).items()}
        return Named({**fixed, **varied})

    def limits(self, name: str, params: Mapping[str, float]) -> tuple[float, float, str, str]:
        """Return the interval that the constraints leave to one parameter, others fixed.

        Returns
        -------
        tuple
            (lower, upper, reason of the lower end, reason of the upper end).
        """
        low, high, why_low, why_high = -math.inf, math.inf, "", ""
        for constraint in self.constraints:
            c = constraint.coefficients.get(name, 0.0)
            if c == 0.0:
                continue
            bound = -(constraint.value(params) - c * params[name]) / c
            if c > 0 and bound >= low:
                low, why_low = bound, constraint.text
            elif c < 0 and bound <= high:
                high, why_high = bound, constraint.text
        return low, high, why_low, why_high


def _told_apart(model: Model) -> tuple[Any, ...]:
    """Return what tells a model from others: its definition, or its name and the file that makes its flow."""
    code = getattr(model.flow_factory, "__code__", None)
    source = "" if code is None or model.definition else code.co_filename
    return model.name, model.definition, model.parameter_names, _digest_of(source)


@cache
def _digest_of(source: str) -> str:
    """Return the digest of a file of the program, which stays what it was loaded from; of none without it."""
    content = b""
    with suppress(OSError):
        content = Path(source).read_bytes() if source else content
    return sha256(content).hexdigest()


given(Model, _told_apart)
made_of(Named, lambda names: tuple(names.items()), lambda *items: Named(items))
