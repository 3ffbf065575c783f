"""Figures: new ones, and files that are the same whenever the same figure is saved."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from contfric.interrupts import held_back

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Resolution of saved figures, dots per inch.
DPI = 200

#: What matplotlib would write of the day, of the machine and of itself.
_ANONYMOUS: dict[str, dict[str, Any]] = {
    ".png": {"Software": None},
    ".pdf": {"Creator": None, "Producer": None, "CreationDate": None},
    ".svg": {"Creator": None, "Date": None},
}


def new_figure(width: float = 7.0, height: float = 4.3) -> Figure:
    """Return a figure that pyplot does not know of, with a layout that avoids overlaps.

    Parameters
    ----------
    width, height : float
        Size in inches.

    Examples
    --------
    >>> new_figure(6, 4).get_size_inches()
    array([6., 4.])
    """
    return Figure(figsize=(width, height), layout="constrained")


def save_figure(fig: Figure, path: str | PathLike[str], dpi: float = DPI) -> Path:
    """Write a figure to a file; the same figure gives the same bytes.

    Parameters
    ----------
    path : path
        Its ending decides on the format: png, pdf, svg and others that matplotlib knows.
    dpi : float
        Resolution, dots per inch.

    Returns
    -------
    Path
        The file.
    """
    import matplotlib as mpl

    file = Path(path)
    metadata = _ANONYMOUS.get(file.suffix.lower())
    with mpl.rc_context({"svg.hashsalt": "contfric"}):
        fig.savefig(file, dpi=dpi, metadata=metadata)
    return file


def axes_or_new(ax: Axes | None, width: float = 7.0, height: float = 4.3) -> Axes:
    """Return the axes given, or those of a new pyplot figure."""
    if ax is not None:
        return ax
    with held_back():
        from matplotlib import pyplot

    fig = pyplot.figure(figsize=(width, height), layout="constrained")
    return fig.add_subplot()


def figure_or_new(fig: Figure | None, width: float, height: float) -> Figure:
    """Return the figure given, or a new one of pyplot."""
    if fig is not None:
        return fig
    with held_back():
        from matplotlib import pyplot

    return pyplot.figure(figsize=(width, height), layout="constrained")
