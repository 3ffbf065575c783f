"""Initial states: the domain that a state is in or goes on into, and a start where none is given."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from contfric.base.arrays import FloatArray
from contfric.errors import ParameterError, did_you_mean, shown
from contfric.models.check.probe import Probe
from contfric.models.definition import Domain, Model, Surface
from contfric.models.deriving.growing_model import ComposedModel
from contfric.models.mode_domains import cut_bounds
from contfric.models.parts import Chatter
from contfric.models.shorthand.clocks import TICK, is_clock
from contfric.models.structures.contacts import ContactKind
from contfric.simulation.entered_domain import StartState, entered_domain
from contfric.simulation.excitation import check_excitation
from contfric.simulation.tables import bits_of

#: Displacements that a start is looked for at, in half-widths of the model: where the first is in no
#: domain (after a wall, or on a surface that motion does not leave), the next.
_PLACES = (1.0, -1.0, 0.5, -0.5, 0.25, -0.25, 0.0)
#: Half-widths of a range that the first state is displaced by at most: at its ends motion may stay.
_WITHIN = 0.5
#: Random states at which a rate that is 0 is so everywhere, but for a set of measure 0.
_DRAWN = 3
#: States that are drawn where none of these is: enough to hit a region of a hundredth of the spread, which
#: nobody may have written, and then further out.
_DRAWS, _WIDER = 1000, (1.0, 3.0, 10.0, 100.0)
#: A state this far beyond a surface, relative to 1 + the states, is not on it by rounding.
_OUTSIDE = 1e-6
#: Surfaces that an error names: more are no line to read.
_SURFACES_SHOWN = 8


def signs_at(
    model: Model, t: float, y: FloatArray, vector: FloatArray, within: float = 0.0
) -> dict[str, int]:
    """Return the sign of (observable - level) for every surface at a state; 0 within a distance."""
    flow, signs = model.view(vector), {}
    for surface in model.surfaces:
        apart = flow.height(surface.name, t, y)
        signs[surface.name] = (
            int(np.sign(apart)) if abs(apart) > within else 0
        )  # also where it is no number
    return {**signs, **model.fixed_sides}


def left_through(model: Model, mode: str, t: float, y: FloatArray, vector: FloatArray) -> str:
    """Return the surface through which a solution has left the region of its mode; nothing if it has not."""
    within = _OUTSIDE * (1.0 + float(np.max(np.abs(y))))
    own = model.domains_of(model.whole_mode(mode))
    for surface, side in signs_at(model, t, y, vector, within).items():
        if surface in model.fixed_sides:  # at rest on a wall it is on either side
            continue
        if side and {d.signs.get(surface, 0) for d in own} == {-side}:
            return surface
    return ""


@np.errstate(over="ignore", invalid="ignore")  # what comes of it is refused
def start_of(
    model: Model, t: float, y: FloatArray, vector: FloatArray, domain: str | None
) -> tuple[int, int]:
    """Return (mode, surfaces that the start lies on and leaves, as bits) of an initial state."""
    start = StartState(model, t, y, vector)
    if undefined := [k for k, h in start.heights.items() if not math.isfinite(h)]:
        raise ParameterError(
            f"how far the state {y.tolist()} at t = {t!r} is from the surface '{undefined[0]}' of "
            f"{model.name} is no finite number: its parameters or the state are too large, or a formula "
            "has no value there. Choose others (params, state=...)"
        )
    exact = {k: int(np.sign(h)) for k, h in start.heights.items()} | model.fixed_sides
    signs = exact | {k: 0 for k in exact if k not in model.fixed_sides and start.lies_on(k)}
    given: object = domain  # whatever the user gave
    if given is not None and not (isinstance(given, str) and given in model.domain_by_name):
        raise ParameterError(
            f"unknown domain {shown(given)}{did_you_mean(given, model.domain_by_name)}"
        )
    named = _at_phase(start, domain, signs)
    name = named or entered_domain(start, signs)
    if name is None or (named and start.left_by(model.domain_by_name[named])):
        met, signs = signs, exact  # a surface that is met at once is not one that the start leaves
        name = name or model.domain_of(exact, t, y, vector)
        name = name or _side_of_rates(model, t, y, vector, exact)
        if name is None and (name := entered_domain(start, met, standing=True)):
            signs = met
    if name is None or (named is None and _is_beyond(model, start, exact)):
        nearest = sorted(start.heights.items(), key=lambda item: abs(item[1]))[:_SURFACES_SHOWN]
        heights = ", ".join(f"{k}: {h:+.3g}" for k, h in nearest)
        raise ParameterError(
            f"the state {y.tolist()} at t = {t!r} is in no domain of {model.name}. Its distances from the "
            f"surfaces are {heights}; no mode holds on these sides, or a solution cannot start there"
        )
    mode = model.domain_by_name[name].own_mode
    rest = model.chatter_by_mode.get(mode) if domain is None else None
    if rest is not None:
        mode = _let_go(model, rest, t, y, vector, signs) or mode
    on = bits_of(model, (k for k in cut_bounds(model)[mode] if signs.get(k, 1) == 0))
    return model.mode_index[mode], on


def _is_beyond(model: Model, start: StartState, exact: dict[str, int]) -> bool:
    """Tell whether a Jenkins element is stretched beyond its limit, where modes are made when visited."""
    if not isinstance(model, ComposedModel):
        return False
    return any(
        exact[f"{c.name}{sign}"] == side and not start.lies_on(f"{c.name}{sign}")
        for c in model.composition.acting
        if c.kind is ContactKind.JENKINS
        for sign, side in (("+", 1), ("-", -1))
    )


def _at_phase(start: StartState, domain: str | None, signs: dict[str, int]) -> str | None:
    """Return the domain that a user names, on the side of the phase that the time is on or goes on to.

    A mode that the phase divides has its own name on the first side only.
    """
    model = start.model
    if domain is None or not model.phase:
        return domain
    side = signs[model.phase] or start.side_ahead(model.domain_by_name[domain].mode, model.phase)
    if side == 0:
        return domain
    if model.domain_by_name[domain].signs.get(model.phase, side) == side:
        return domain
    here = {**model.domain_by_name[domain].signs, model.phase: side}
    mode = model.domain_by_name[domain].mode
    return next((d.name for d in model.domains_of(mode) if d.signs == here), domain)


def _let_go(
    model: Model, rest: Chatter, t: float, y: FloatArray, vector: FloatArray, signs: dict[str, int]
) -> str:
    """Return the mode of a state on a wall that does not press it; nothing if it does."""
    for lift, flight in rest.ways:
        if model.view(vector).height(lift, t, y) * model.fixed_sides[lift] < 0.0:
            side = model.domains_of(flight)[0].signs[rest.surface]
            domain = model.domain_at({**signs, rest.surface: side}, flight)
            return model.domain_by_name[domain].own_mode if domain else ""
    return ""


def _side_of_rates(
    model: Model, t: float, y: FloatArray, vector: FloatArray, signs: dict[str, int]
) -> str | None:
    """Return the domain that a state on some surfaces goes on into: those that its rates lead to.

    Any side of a transparent surface will do.
    """
    flow = model.view(vector)

    def ends(domain: Domain, surface: Surface) -> bool:
        own = {d.signs[surface.name] for d in model.domains if d.own_mode == domain.own_mode}
        bounds = model.cuts(surface.name) or surface.name in cut_bounds(model)[domain.own_mode]
        return bounds or (bool(domain.declared) and len(own) == 1)

    def enters(domain: Domain, surface: Surface) -> bool:
        lies_on = domain.signs[surface.name] == 0  # where a contact sticks
        if signs[surface.name] != 0 or lies_on or not ends(domain, surface):
            return True
        rate = flow.rate(domain.mode, surface.observable, t, y)
        return domain.signs[surface.name] * rate > 0.0

    nearby = [
        d for d in model.domains if all(sign in (0, d.signs[name]) for name, sign in signs.items())
    ]
    return next((d.name for d in nearby if all(enters(d, s) for s in model.surfaces)), None)


@np.errstate(over="ignore", invalid="ignore")  # what comes of it is refused
def displaced(model: Model, vector: FloatArray) -> FloatArray:
    """Return the initial state by default: displaced from rest, else drawn; in a domain.

    Raises
    ------
    ParameterError
        If no state that was tried is in a domain.
    """
    half_width: FloatArray = model.spread(model.mapping(vector))
    low, high = model.region(vector)
    rest = _at_a_tick(model, vector) + 0.5 * (low + high)
    kept = [k for k in _kept_zeros(model) if rest[k] == 0.0]
    rest[kept] = _WITHIN * half_width[kept]
    moved = half_width[0] if low[0] == -high[0] else _WITHIN * half_width[0]
    for place in _PLACES:
        y = rest.copy()
        y[0] += place * moved
        if _is_start(model, y, vector):
            return y
    rng = np.random.default_rng(1)  # always the same start
    clocks = np.array([is_clock(state) for state in model.states])
    for wider in _WIDER:
        for _ in range(_DRAWS // len(_WIDER)):
            low, high = model.region(vector, wider)
            y = 0.5 * (low + high) + rng.uniform(-0.5, 0.5, half_width.shape) * (high - low)
            y = np.where(clocks, rest, y)
            if _is_start(model, y, vector):
                return y
    within = ", ".join(
        f"{low:g} <= {state} <= {high:g}"
        for state, low, high in zip(model.states, *model.region(vector), strict=True)
    )
    raise ParameterError(
        f"no start was found: of {_DRAWS} states of '{model.name}' at t = 0 with {within}, its 'spread', and "
        f"up to {_WIDER[-1]:g} times as far where it is no range, none is in a domain. "
        "Give one (state=...), or correct 'spread' or the sides of the modes"
    )


@lru_cache(maxsize=64)
def _kept_zeros(model: Model) -> tuple[int, ...]:
    """Return the states (not the first) that stay 0 for ever if they are 0: infectives, a mass."""
    if model.composed or not model.definition:
        return ()
    probe = Probe(model, model.defaults)  # which compiles no flow
    return tuple(k for k in range(1, len(model.states)) if _stays_zero(probe, k))


def _stays_zero(probe: Probe, k: int) -> bool:
    """Tell whether a state that is 0 stays so for ever, in all modes and resets."""
    model, rng = probe.model, np.random.default_rng(1)
    modes = [m.name for m in model.modes if m.name not in model.chatter_by_mode]
    for _ in range(_DRAWN):
        t, y = rng.uniform(), rng.uniform(*model.region(probe.vector))
        y[k] = 0.0
        if any(probe.field(mode, t, y)[k] != 0.0 for mode in modes):
            return False
        if any(probe.reset(reset.surface, t, y)[k] != 0.0 for reset in model.resets):
            return False
    return True


def _at_a_tick(model: Model, vector: FloatArray) -> FloatArray:
    """Return the state at rest; clocks that are ahead of the first are so by what its tick says."""
    rest = np.zeros(len(model.states))
    clocks = [is_clock(state) for state in model.states]
    if sum(clocks) < 2:
        return rest
    return np.where(clocks, model.view(vector).reset(TICK, 0.0, rest), rest)


def _is_start(model: Model, y: FloatArray, vector: FloatArray) -> bool:
    """Tell whether a state at time 0 is in a domain, or leads into one, and is no equilibrium of it."""
    signs = signs_at(model, 0.0, y, vector)
    name = model.domain_of(signs, 0.0, y, vector)
    name = name or _side_of_rates(model, 0.0, y, vector, signs)
    if not name or not model.autonomous:
        return bool(name)
    domain = model.domain_by_name[name]
    moves = model.view(vector).jacobian(domain.mode, 0.0, y, 0.0)[:, 1 + len(y)]
    return bool(np.any(moves != 0.0)) or model.mode_by_name[domain.own_mode].sliding


def checked_state(model: Model, vector: FloatArray, state: ArrayLike | None) -> FloatArray:
    """Return the initial state that a user gave, or the one by default.

    Raises
    ------
    ParameterError
        If it is not a state of the model, or none is given and none is found; or if the period of the
        excitation is not positive and finite, or not that of all that depends on time.
    """
    period = model.view(vector).period
    if not (model.autonomous or 0.0 < period < np.inf):
        values = ", ".join(f"{name} = {value:g}" for name, value in model.mapping(vector).items())
        raise ParameterError(
            f"the period of the excitation of '{model.name}' is {period:g} at {values}: it has to be above 0 "
            "and finite; a line of 'constraints' keeps parameters from such values"
        )
    check_excitation(model, vector)
    if state is None:
        # away from rest, so that symmetric and asymmetric attractors can both be reached
        return displaced(model, vector)
    try:
        y = np.array(state, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        y = np.empty(0)
    y = with_clocks(model, vector, y)
    if y.shape != (len(model.states),) or not np.all(np.isfinite(y)):
        raise ParameterError(
            f"a state of '{model.name}' is {len(model.states)} finite numbers "
            f"({', '.join(model.states)}), got {shown(state)}"
        )
    return within_a_turn(model, vector, y)


def within_a_turn(model: Model, vector: FloatArray, states: FloatArray) -> FloatArray:
    """Return states whose angles lie between the two places at which they are cut, shape (..., n)."""
    found, view = states.copy(), model.view(vector)
    for k in model.angles:
        ends = [r.surface for r in model.resets if r.wraps and model.states[k] in r.changes]
        low, high = sorted(view.level(surface) for surface in ends)
        y = found[..., k]
        found[..., k] = np.where((y < low) | (y > high), low + (y - low) % (2.0 * np.pi), y)
    return found


def with_clocks(model: Model, vector: FloatArray, y: FloatArray) -> FloatArray:
    """Return a state without its clocks, as a file declares it, with them: just after a tick."""
    clocks = [is_clock(name) for name in model.states]
    if not any(clocks) or y.shape != (clocks.count(False),):
        return y
    whole = np.zeros(len(clocks))
    whole[~np.array(clocks)] = y
    begun = model.view(vector).reset(TICK, 0.0, whole)
    return np.where(clocks, begun, whole)
