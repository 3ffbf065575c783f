"""A simulated trajectory in the plane of two states, coloured by mode; and an orbit that moves."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.errors import ParameterError, path_of, whole_number
from contfric.plot.appearance.names import parameter_label
from contfric.plot.appearance.save import axes_or_new, new_figure
from contfric.plot.appearance.style import BLACK, NEXT_TO, SMALL, branch_colours, sized

if TYPE_CHECKING:
    from contfric.orbit.orbit import Orbit
    from contfric.simulation.simulate import Trajectory

#: Widths of lines; many turns over each other are told apart by thin ones.
_THIN, _POINT = 0.8, 3.0
#: Points between two events, on average, that make curves smooth; how many there are at least and at most.
_EACH, _LEAST_POINTS, _MOST_POINTS = 50, 1000, 100_000
#: Modes that a legend names, of more than these those in which most of the time is spent.
_MOST_NAMED = 12
#: Share of the period that the tail after a moving point shows.
_TAIL = 0.08
#: Frames of an animation: minutes of film, and what a gif of some megabytes holds.
_MOST_FRAMES = 2000


def plot_trajectory(
    trajectory: Trajectory, ax: Axes | None = None, points: int | None = None
) -> Axes:
    """Draw a trajectory in the plane of the first two states (one alone: over time), coloured by mode.

    Parameters
    ----------
    trajectory : Trajectory
    ax : Axes, optional
        Where to draw; new axes by default.
    points : int, optional
        About how many points to draw; by default so many that curves are smooth, up to 100,000.

    Examples
    --------
    >>> import contfric as cf
    >>> found = cf.simulate("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4}, periods=3)
    >>> plot_trajectory(found).get_xlabel()
    '$x$'
    """
    if points is None:
        points = min(_MOST_POINTS, max(_LEAST_POINTS, _EACH * len(trajectory)))
    columns = trajectory.columns(points)
    states = trajectory.model.states
    across, up = ("t", states[0]) if len(states) == 1 else states[:2]
    ax = axes_or_new(ax)
    colours, shares = branch_colours(columns["mode"]), Counter(columns["mode"])
    named = dict(shares.most_common(_MOST_NAMED))
    for mode, rows in groupby(range(len(columns["t"])), key=columns["mode"].__getitem__):
        part = list(rows)
        label = mode if named.pop(mode, 0) else None
        ax.plot(
            columns[across][part], columns[up][part], color=colours[mode], lw=_THIN, label=label
        )
    ax.plot(columns[across][0], columns[up][0], "o", color=BLACK, ms=_POINT, label="start")
    if len(shares) > _MOST_NAMED:
        ax.plot([], [], ls="none", label=f"and {len(shares) - _MOST_NAMED} more modes")
    ax.set_xlabel(parameter_label(across))
    ax.set_ylabel(parameter_label(up))
    ax.legend(fontsize=sized(SMALL), frameon=False, **NEXT_TO)
    return ax


def animate_orbit(orbit: Orbit, path: str | Path, frames: int = 120, rate: int = 30) -> Path:
    """Write one period of an orbit as a gif: the phase plane, and a point that moves along it.

    Parameters
    ----------
    orbit : Orbit
    path : str or Path
        A file that ends in ``.gif``.
    frames, rate : int
        Number of frames, equally spaced in time, and frames a second.

    Raises
    ------
    ParameterError
        If the file is no gif, or its folder does not exist.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from contfric.plot.orbits.orbit import plot_orbit

    path = path_of("the file of an animation", path)
    if path.suffix != ".gif" or not path.absolute().parent.is_dir():
        raise ParameterError(
            f"an animation is a file such as orbit.gif in a folder that is there, got {path}"
        )
    frames = whole_number("frames", frames, least=2, most=_MOST_FRAMES)
    rate = whole_number("rate", rate, least=1, most=100)
    fig = new_figure(5.6, 4.2)
    fig.set_dpi(100)
    ax = plot_orbit(orbit, fig.add_subplot())
    times = float(orbit.cycle[0, 0]) + orbit.period * np.arange(frames) / frames
    at = np.array([_place(orbit, time) for time in times])
    trail = max(1, round(_TAIL * frames))
    canvas = FigureCanvasAgg(fig)
    canvas.draw()  # type: ignore[no-untyped-call]
    still = canvas.copy_from_bbox(fig.bbox)  # type: ignore[no-untyped-call]
    (tail,) = ax.plot([], [], color=BLACK, lw=1.5, alpha=0.5, zorder=6)
    (point,) = ax.plot([], [], "o", color=BLACK, ms=7, zorder=7)

    def shown(frame: int) -> NDArray[np.uint8]:
        """Return the pixels of a frame: all but the point and its tail is drawn once."""
        rows = np.arange(frame - trail, frame + 1) % frames
        tail.set_data(*at[rows].T)
        point.set_data(*at[[frame]].T)
        canvas.restore_region(still)  # type: ignore[no-untyped-call]
        for artist in (tail, point):
            ax.draw_artist(artist)
        pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
        return pixels[..., :3].copy()

    _write_gif(map(shown, range(frames)), path, rate)
    return path


def _write_gif(frames: Iterator[NDArray[np.uint8]], path: Path, rate: int) -> None:
    """Write frames, one at a time, as a gif that repeats; its colours are those of the first frame."""
    from PIL import Image

    first = Image.fromarray(next(frames)).quantize()
    others = (
        Image.fromarray(frame).quantize(palette=first, dither=Image.Dither.NONE) for frame in frames
    )
    first.save(path, save_all=True, append_images=others, duration=1000 / rate, loop=0)


def _place(orbit: Orbit, time: float) -> FloatArray:
    """Return where an orbit is in its phase plane; of one state, the share of the period and the state."""
    state = orbit.state(time)
    if len(state) > 1:
        return state[:2]
    share = (time - float(orbit.cycle[0, 0])) / orbit.period
    return np.array([share, state[0]])
