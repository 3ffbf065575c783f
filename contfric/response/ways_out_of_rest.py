"""Ways out of rest: where rest on a surface is left, and with which state at which time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.errors import ParameterError, did_you_mean, shown
from contfric.models.definition import Model
from contfric.models.mode_domains import mirror_mode
from contfric.models.view import FlowView
from contfric.simulation.tables import tables

#: A release counts if the surfaces are met to this (relative to 1 + state).
_MET = 1e-12


@dataclass(frozen=True, eq=False)
class WayOutOfRest:
    """A way out of rest in a model of two states.

    Attributes
    ----------
    mode, surface, following : numbers of the mode of rest, of the surface that ends it, of what follows
    on : surfaces that the mode after it starts on, as bits
    rests : the surface that it rests on
    """

    model: Model
    mode: int
    surface: int
    following: int
    on: int
    rests: str

    @property
    def names(self) -> tuple[str, str]:
        """The mode and the surface."""
        return self.model.modes[self.mode].name, self.model.surfaces[self.surface].name

    @property
    def image(self) -> tuple[int, int] | None:
        """Mode and surface of the image under the symmetry; None if there is no other."""
        mode, name = self.names
        symmetry = self.model.symmetry
        image = name if symmetry is None else symmetry.surfaces.get(name, name)
        if image == name:
            return None
        return self.model.mode_index[mirror_mode(self.model)[mode]], self.model.surface_index[image]

    def state_at(self, view: FlowView, t: float) -> FloatArray | None:
        """Return the state with which rest comes to its limit at a time, from within; None if it does not."""
        mode, name = self.names
        found = view.landed((name, self.rests), t, np.zeros(len(self.model.states)), _MET)
        if found is None or not np.all(np.isfinite(found)):
            return None
        domain = next(d for d in self.model.domains if d.mode == mode)
        rate = view.rate(domain.mode, self.model.surface_by_name[name].observable, t, found)
        return found if -domain.signs[name] * rate > 0.0 else None

    def shifts(self, view: FlowView, times: FloatArray, states: FloatArray) -> FloatArray:
        """Return the shift in time of each release: none at the surface itself, that of the symmetry else."""
        symmetry, image = self.model.symmetry, self.image
        if symmetry is None or image is None:
            return np.zeros(len(times))
        names = [self.model.surfaces[k].name for k in (self.surface, image[1])]
        rows = zip(times.tolist(), states, strict=True)
        apart = np.abs([[view.height(name, t, y) for name in names] for t, y in rows])
        own, other = apart.reshape(-1, 2).T
        return np.where(own <= other, 0.0, symmetry.fraction * view.period)


def release_of(model: Model, surface: str | None) -> WayOutOfRest:
    """Return the way out of rest at a surface, the first one by default.

    Raises
    ------
    ParameterError
        If a release of the model is not known by its phase, or rest is not left at the surface.
    """
    wanted = [m for m in model.modes if m.sliding]
    if model.autonomous or len(model.states) != 2 or not wanted:
        raise ParameterError(
            f"model '{model.name}' has no release map: that takes two states, a mode of rest and an "
            "excitation, so that a release is known by its phase; cf.poincare(..., section='releases') "
            "takes any model with a mode of rest"
        )
    surfaces = [s.name for s in model.surfaces]
    ways = {
        exit_: (domain, target)
        for (domain, exit_), target in model.transitions.items()
        if model.domain_by_name[domain].mode == wanted[0].name
    }
    surface = next((name for name in surfaces if name in ways), "") if surface is None else surface
    if surface not in [*ways]:
        raise ParameterError(
            f"surface is one that rest is left at, one of {', '.join(ways)}, got {shown(surface)}"
            f"{did_you_mean(surface, ways)}"
        )
    domain, target = (model.domain_by_name[name] for name in ways[surface])
    rests = next((n for n, sign in domain.signs.items() if sign == 0), surface)
    mode, k, found = model.mode_index[domain.mode], model.surface_index[surface], tables(model)
    on = int(found.landed[mode, k] | (found.lies_on[mode] & found.kept[mode, k]))
    return WayOutOfRest(model, mode, k, model.mode_index[target.mode], on, rests)
