r"""Derivatives of a quantity of an orbit by the parameters.

A quantity Q depends on the joints z and on the parameters p, and z on p through the equations of the orbit:

.. math:: \frac{dQ}{dp} = Q_p + Q_z \frac{dz}{dp}, \qquad F_z \frac{dz}{dp} = -F_p .

The derivatives dz/dp are solved for once an orbit, by one elimination, that of Newton's method with the
columns of F_p as right-hand sides. Every quantity is differentiated in those directions
(:mod:`contfric.quantities`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.named import Named
from contfric.base.tabled import Columns, Tabled
from contfric.errors import ConvergenceError
from contfric.orbit.orbit import Orbit
from contfric.quantities.at_once import differentiated_at_once
from contfric.quantities.measure import NumberWithGradient, differentiated
from contfric.quantities.motion import Directions, along_parameters
from contfric.quantities.registry import QuantityLike, many, number_quantity

#: A margin below this (nondimensional) vanishes: the orbit is at an event. Located events are good to 1e-12.
_AT_EVENT = 1e-9
#: Joints that move this much faster than a parameter (relative): a fold, where they have no derivative.
_FOLD = 1e9


@dataclass(frozen=True, repr=False)
class Gradient(Tabled, Mapping[str, float]):
    """Derivatives of a quantity by every parameter; a mapping of names to numbers.

    Attributes
    ----------
    quantity : str
        What is differentiated.
    value : float
        The quantity itself.
    ahead : dict
        Derivatives as each parameter grows: those of the mapping.
    behind : dict
        Derivatives seen from smaller values; the same where the quantity is smooth.
    notes : tuple of str
        Where the derivatives are those of one side only, and why; empty where they are not.

    Examples
    --------
    >>> Gradient("x_max", 1.4, {"S": -2.0}, {"S": -2.0})["S"]
    -2.0
    """

    quantity: str
    value: float
    ahead: Mapping[str, float]
    behind: Mapping[str, float]
    notes: tuple[str, ...] = ()

    @property
    def one_sided(self) -> bool:
        """Whether there is no derivative, but one on each side, or one only."""
        return bool(self.notes)

    def columns(self) -> Columns:
        """Return one row for each parameter: its name, and the derivatives of both sides."""
        sides = {"ahead": self.ahead, "behind": self.behind}
        numbers = {name: np.array([side[n] for n in self]) for name, side in sides.items()}
        return {"parameter": np.array(list(self)), **numbers}

    def __getitem__(self, name: str) -> float:
        return self.ahead[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.ahead)

    def __len__(self) -> int:
        return len(self.ahead)

    def __repr__(self) -> str:
        slopes = ", ".join(f"{name}: {slope:.6g}" for name, slope in self.items())
        return f"<Gradient of {self.quantity} = {self.value:.6g}: {slopes}>"


def gradient_of(orbit: Orbit, name: QuantityLike) -> Gradient:
    """Return the derivatives of a quantity by every parameter; see :meth:`contfric.Orbit.gradient`."""
    quantity = number_quantity(name, orbit.model, "a gradient")
    found = differentiated(quantity, orbit, by_parameters(orbit))
    return _gradient(orbit, quantity.name, found, _events(orbit))


def gradients_of(orbit: Orbit, names: Iterable[QuantityLike]) -> dict[str, Gradient]:
    """Return the derivatives of several quantities; see :meth:`contfric.Orbit.gradients`."""
    every = many("gradients", names)
    quantities = [number_quantity(name, orbit.model, "a gradient") for name in every]
    found = differentiated_at_once(quantities, orbit, by_parameters(orbit))
    events = _events(orbit)
    return Named(
        (q.name, _gradient(orbit, q.name, g, events))
        for q, g in zip(quantities, found, strict=True)
    )


def _gradient(
    orbit: Orbit, name: str, found: NumberWithGradient, events: tuple[str, ...]
) -> Gradient:
    names = orbit.model.parameter_names
    ahead = _named(names, found.ahead)
    behind = ahead if found.behind is found.ahead else _named(names, found.behind)
    return Gradient(name, found.value, ahead, behind, (*found.kinks, *events))


def by_parameters(orbit: Orbit) -> Directions:
    """Return how an orbit moves with each of its parameters.

    Raises
    ------
    ConvergenceError
        If it has no derivative.
    """
    known: Directions | None = vars(orbit).get("_by_parameters")
    if known is None:
        known = along_parameters(joint_sensitivities(orbit))
        vars(orbit)["_by_parameters"] = known  # as a cached property of the orbit
    return known


def joint_sensitivities(orbit: Orbit) -> FloatArray:
    """Return the derivatives of the joints by every parameter, shape (N, 1 + n, parameters).

    Raises
    ------
    ConvergenceError
        If the orbit is not solved, or has no derivative: at a fold, or as one of a continuum.
    """
    if not orbit.converged:
        raise ConvergenceError(f"the orbit is not solved: {orbit.status.value}", orbit)
    from contfric.bvp.joint_derivatives import move_joints

    system, vector = orbit.system, orbit.vector
    moved = np.empty((*orbit.joints.shape, len(vector)))
    if not move_joints(system.functions(), system.layout, orbit.joints, vector, moved) < _FOLD:
        raise ConvergenceError(
            "the orbit has no derivative by its parameters: it is at a fold or branch point, or one of a "
            "continuum. Move along the branch and ask again",
            orbit,
        )
    return moved


def _named(names: tuple[str, ...], slopes: FloatArray) -> dict[str, float]:
    return Named(zip(names, slopes.tolist(), strict=True))


def _events(orbit: Orbit) -> tuple[str, ...]:
    """Return the margins that vanish: orbits of the signature exist on one side only."""
    vanish = np.abs(orbit.margins) < _AT_EVENT
    if not np.count_nonzero(vanish):
        return ()
    tests = orbit.system.tests
    return tuple(
        f"the orbit is at an event: the {tests[k].margin.value} margin at {tests[k].surface} of segment "
        f"{tests[k].segment + 1} vanishes, and orbits of this signature exist on one side"
        for k in np.flatnonzero(vanish)
    )
