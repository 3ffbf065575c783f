"""One orbit: in the phase plane, in the plane of the observables, and in time."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import ScaledTranslation

from contfric.errors import ParameterError
from contfric.plot.appearance.labels import Anchor, lay_out, place_labels
from contfric.plot.appearance.names import fixed_text, parameter_label, parameters_to_show
from contfric.plot.appearance.save import axes_or_new, figure_or_new, name_axes
from contfric.plot.appearance.style import NEXT_TO, SMALL, TEXT, sized
from contfric.plot.orbits.orbit_artists import (
    BAND,
    along,
    draw_arrow,
    draw_levels,
    draw_moving_surfaces,
    draw_pieces,
    draw_rest_bands,
    draw_stops,
    draw_surfaces,
    legend_handles,
)
from contfric.plot.orbits.pieces import DomainPiece, pieces_of, rest_bounds

if TYPE_CHECKING:
    from contfric.orbit.orbit import Orbit

#: Workspace in a legend (inches, at the small size): an entry with its line, and each letter of its text.
_ENTRY, _LETTER = 0.45, 0.06


def plot_orbit(
    orbit: Orbit,
    ax: Axes | None = None,
    *,
    plane: tuple[str, str] | None = None,
    legend: bool = True,
) -> Axes:
    """Draw an orbit in a plane, coloured by domain, with its stops and surfaces.

    A surface whose observable is on an axis is a line. One that moves in the plane is a short tick
    where the orbit crosses it, in its position at that moment; the band on which a stick rests is
    drawn at the moment at which it begins.

    Parameters
    ----------
    orbit : Orbit
    ax : Axes, optional
        Where to draw; new axes by default.
    plane : (str, str), optional
        States or observables on the two axes; the first two states by default (one alone: over
        time). In the plane of the observables, ``("u", "v")`` for dry friction, every surface is at rest.
    legend : bool
        Whether to draw the legend of the domains.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> plot_orbit(orbit).get_xlabel()
    '$x$'
    """
    new = axes_or_new(ax, 6.4, 4.4)
    named = _draw_plane(new, orbit, plane)
    if legend:
        handles = legend_handles(orbit, pieces_of(orbit))
        if ax is None:
            look = {**NEXT_TO, "bbox_transform": new.transAxes + _beyond_labels(new)}
            new.legend(handles=handles, fontsize=sized(SMALL), frameon=False, **look)
        else:
            new.legend(handles=handles, fontsize=sized(SMALL - 1.0), loc="best")
    lay_out(new)
    place_labels(new, named)
    return new


def _beyond_labels(ax: Axes) -> ScaledTranslation:
    """Return the way to the right that a legend next to the axes goes, beyond the names of levels there."""
    figure = ax.figure
    right = max((text.get_window_extent().x1 for text in ax.texts), default=-np.inf)
    inches = max(0.0, right - ax.bbox.x1) / figure.dpi
    return ScaledTranslation(inches, 0.0, figure.dpi_scale_trans)


def _draw_plane(new: Axes, orbit: Orbit, plane: tuple[str, str] | None) -> list[Anchor]:
    """Draw an orbit in a plane and return the labels that are to be placed when all is drawn."""
    pieces = pieces_of(orbit)
    if plane is None and len(orbit.model.states) == 1:
        return _draw_in_time(new, orbit, pieces)
    across, up = plane or (orbit.model.states[0], orbit.model.states[1])
    draw_rest_bands(new, orbit, pieces, across, up)
    path = [along(orbit, pieces, quantity) for quantity in (across, up)]
    draw_pieces(new, orbit.model, pieces, *path)
    draw_arrow(new, *path)
    new.margins(0.08)
    draw_surfaces(new, orbit, across, up)
    named = [] if plane else draw_moving_surfaces(new, orbit, pieces, across, up)
    draw_stops(new, orbit, across, up)
    name_axes(new, parameter_label(across), parameter_label(up))
    return named


def _draw_in_time(new: Axes, orbit: Orbit, pieces: Sequence[DomainPiece]) -> list[Anchor]:
    """Draw the only state of an orbit over one period."""
    times = [(p.times - float(orbit.cycle[0, 0])) / orbit.period for p in pieces]
    state = orbit.model.states[0]
    draw_pieces(new, orbit.model, pieces, times, along(orbit, pieces, state))
    if state in orbit.model.observable_index:
        draw_levels(new, orbit, state, vertical=False)
    name_axes(new, "time / period of the orbit", parameter_label(state))
    return []


def plot_orbit_in_time(orbit: Orbit, axes: Sequence[Axes] | None = None) -> list[Axes]:
    """Draw the observables of an orbit over one period, with the levels that are surfaces.

    Parameters
    ----------
    orbit : Orbit
    axes : sequence of Axes, optional
        One for each observable of the model; new axes by default.

    Returns
    -------
    list of Axes
        One for each observable.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> [ax.get_ylabel() for ax in plot_orbit_in_time(orbit)]
    ['$u$', '$v$']
    """
    observables = orbit.model.observables
    if axes is None:
        fig = figure_or_new(None, 6.4, 1.0 + 1.9 * len(observables))
        axes = list(fig.subplots(len(observables), 1, sharex=True, squeeze=False)[:, 0])
    if len(axes) != len(observables):
        raise ParameterError(f"{len(observables)} axes are needed, one for each observable")
    pieces = pieces_of(orbit)
    start = float(orbit.cycle[0, 0])
    times = [(p.times - start) / orbit.period for p in pieces]
    for ax, observable in zip(axes, observables, strict=True):
        for low, high in rest_bounds(orbit, observable.name):
            ax.axhspan(low, high, color=BAND, zorder=0, linewidth=0.0)
        draw_pieces(ax, orbit.model, pieces, times, along(orbit, pieces, observable.name))
        draw_levels(ax, orbit, observable.name, vertical=False)
        name_axes(ax, "", parameter_label(observable.name))
        ax.set_xlim(0.0, 1.0)
    axes[-1].set_xlabel("time / period of the orbit", fontsize=sized(TEXT))
    return list(axes)


def _columns(labels: Sequence[str], width: float) -> int:
    """Return the columns of a legend below a figure: as few rows as its width (inches) allows."""
    letters = sum(len(re.sub(r"[$^_{}]|\\[a-z]+", "", label)) for label in labels)
    rows = math.ceil((_ENTRY * len(labels) + _LETTER * letters) / width)
    return math.ceil(len(labels) / rows)


def panels_height(orbit: Orbit) -> float:
    """Return the height of a figure of an orbit (inches): each observable in time has a panel."""
    return max(6.2, 1.0 + 1.1 * len(orbit.model.observables))


def plot_orbit_panels(orbit: Orbit, fig: Figure | None = None) -> list[Axes]:
    """Draw an orbit in the phase plane, next to the load plane and its observables in time.

    Parameters
    ----------
    orbit : Orbit
    fig : Figure, optional
        An empty figure to draw in; a new one by default.

    Returns
    -------
    list of Axes
        The phase plane; the plane of the first two observables, if the model has two; then one for
        each observable in time.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> len(plot_orbit_panels(orbit))
    4
    """
    names = [o.name for o in orbit.model.observables]
    fig = figure_or_new(fig, 9.0, panels_height(orbit))
    planes = 2 if len(names) > 1 else 1
    grid = fig.add_gridspec(1, 2)
    left, right = (
        [fig.add_subplot(column[k, 0]) for k in range(count)]
        for count, column in (
            (count, grid[0, side].subgridspec(count, 1))
            for side, count in enumerate((planes, len(names)))
        )
    )
    shown = [None, (names[0], names[1])] if planes == 2 else [None]
    named = [_draw_plane(ax, orbit, plane) for ax, plane in zip(left, shown, strict=True)]
    plot_orbit_in_time(orbit, right)
    for ax in right[:-1]:
        ax.tick_params(labelbottom=False)
    fixed = fixed_text(parameters_to_show(orbit.params, orbit.model.defaults))
    fig.suptitle(f"{orbit.name}:  {fixed}", fontsize=sized(TEXT))
    handles = legend_handles(orbit, pieces_of(orbit, points=40))
    fig.legend(
        handles=handles,
        fontsize=sized(SMALL),
        ncols=_columns([str(handle.get_label()) for handle in handles], fig.get_figwidth()),
        loc="outside lower center" if fig.get_layout_engine() is not None else "lower center",
        frameon=False,
        handlelength=1.5,
        columnspacing=1.3,
    )
    lay_out(left[0])
    for ax, labels in zip(left, named, strict=True):
        place_labels(ax, labels)
    return [*left, *right]
