"""Figures: new ones, and files that are the same whenever the same figure is saved."""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rc_context, rcParams, rcParamsDefault
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, SubFigure
from matplotlib.font_manager import get_font_names
from PIL import Image

from contfric.base.interrupts import held_back
from contfric.errors import ParameterError, did_you_mean
from contfric.models import Model
from contfric.plot.appearance.names import full_title, parameters_to_show
from contfric.plot.appearance.style import SMALL, TEXT, sized

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

#: Widths of a figure in a journal (mm): of one column and of the page, as Springer and Elsevier have them.
JOURNALS = {"single": 88.0, "double": 180.0}
#: Size of text there (points): captions have 8 to 9.
_JOURNAL_TEXT = 8.0
#: A figure gets lower by less than it gets narrower.
_LOWEST = 0.6
#: Width of a column of a legend (inches), at the size of its text for journals.
_COLUMN = 1.7
#: Lengths in a legend of columns, in units of its text: a column of a journal is as wide as two of them.
_TIGHT = {"columnspacing": 1.0, "handlelength": 1.6, "handletextpad": 0.6}

#: Numbers that differ by less, relative to their size, are one: events are located to 1e-12. It is drawn on
#: axes that reach so far around it, as a share of its size: their ticks have four digits.
_ROUNDING, _AROUND = 1e-11, 1e-3

_width: ContextVar[float | None] = ContextVar("width", default=None)


@contextmanager
def journal(width: str) -> Iterator[None]:
    """Make the figures that are drawn inside of a ``with`` as wide as a journal asks for.

    Text has 8 points and stays text in SVG, as it does in PDF; legends stand below. Axes that are given keep
    their size.

    Parameters
    ----------
    width : str
        ``single``, a column of 88 mm, or ``double``, 180 mm.

    Raises
    ------
    ParameterError
        For any other width.

    Examples
    --------
    >>> with journal("single"):
    ...     print(new_figure(7, 4).get_size_inches().round(2))
    [3.46 2.4 ]
    """
    if width not in JOURNALS:
        raise ParameterError(f"no width '{width}' of a journal{did_you_mean(width, [*JOURNALS])}")
    before = _width.set(JOURNALS[width] / 25.4)
    try:
        with rc_context({"font.size": _JOURNAL_TEXT, "svg.fonttype": "none"}):
            yield
    finally:
        _width.reset(before)


@contextmanager
def installed_fonts() -> Iterator[None]:
    """Let text be measured and drawn in a ``with`` by those fonts of ``font.sans-serif`` that there are.

    Matplotlib looks for each of them again for each size of text, and skips those that are not installed.
    """
    known = set(get_font_names())
    found = [name for name in rcParams["font.sans-serif"] if name in known]
    with rc_context({"font.sans-serif": found} if found else {}):
        yield


def _size(width: float, height: float) -> tuple[float, float]:
    """Return the size of a new figure: that of a journal, if one is asked for."""
    asked = _width.get()
    return (width, height) if asked is None else (asked, max(_LOWEST, asked / width) * height)


def for_journal() -> bool:
    """Tell whether figures are drawn for a journal: with legends below, in columns."""
    return _width.get() is not None


def legend_of(fig: Figure, handles: Sequence[Any]) -> None:
    """Write the legend of a figure next to its axes, in a journal below them."""
    where: dict[str, Any] = {"loc": "outside right upper"}
    if for_journal():
        columns = max(1, int(float(fig.get_figwidth()) / _COLUMN))
        where = {"loc": "outside lower center", "ncols": columns, **_TIGHT}
    fig.legend(handles=handles, fontsize=sized(SMALL), frameon=False, **where)


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
    figure = Figure(figsize=_size(width, height), layout="constrained", dpi=DPI)
    FigureCanvasAgg(figure)  # texts are measured as they are saved, once
    return figure


def save_figure(fig: Figure | SubFigure, path: str | PathLike[str], dpi: float = DPI) -> Path:
    """Write a figure to a file; the same figure gives the same bytes.

    Parameters
    ----------
    fig : Figure or SubFigure
        Such as ``ax.figure``; of a part of a figure, all of it is written.
    path : path
        Its ending decides on the format: png, pdf, svg and others that matplotlib knows.
    dpi : float
        Resolution, dots per inch.

    Returns
    -------
    Path
        The file.
    """
    file = Path(path)
    while not isinstance(fig, Figure):
        fig = fig.figure
    if file.suffix.lower() == ".png" and _as_drawn(fig, dpi):
        return _save_pixels(fig, file)
    metadata = _ANONYMOUS.get(file.suffix.lower())
    # fonts of type 42: what is text stays text
    with rc_context({"svg.hashsalt": "contfric", "pdf.fonttype": 42}):
        fig.savefig(file, dpi=dpi, metadata=metadata)
    return file


def _as_drawn(fig: Figure, dpi: float) -> bool:
    """Tell whether the pixels of a figure are those of its file: nobody asks matplotlib for more."""
    usual = all(rcParams[k] == rcParamsDefault[k] for k in rcParams if k.startswith("savefig."))
    return usual and type(fig.canvas) is FigureCanvasAgg and fig.dpi == dpi


def _save_pixels(fig: Figure, file: Path) -> Path:
    """Draw a figure once and write its pixels (``savefig`` lays it out and draws it twice)."""
    canvas: Any = fig.canvas
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())
    if pixels[..., 3].min() == 255:  # nothing to be seen through
        pixels = np.ascontiguousarray(pixels[..., :3])
    # lines and even surfaces: runs of bytes are as good as a search for repetitions, in 2/3 of the time
    Image.fromarray(pixels).save(file, dpi=(fig.dpi, fig.dpi), compress_type=zlib.Z_RLE)
    return file


def axes_or_new(ax: Axes | None, width: float = 7.0, height: float = 4.3) -> Axes:
    """Return the axes given, or those of a new pyplot figure.

    Raises
    ------
    ParameterError
        If something else is given, such as the quantity to be drawn.
    """
    if ax is not None:
        if not hasattr(ax, "set_xlim"):
            raise ParameterError(
                f"ax is one pair of axes of matplotlib, got {ax!r}: give what is drawn by its keyword, such "
                "as row='x_max', and of several axes one"
            )
        return ax
    with held_back():
        from matplotlib import pyplot

    fig = pyplot.figure(figsize=_size(width, height), layout="constrained")
    return fig.add_subplot()


def figure_or_new(fig: Figure | None, width: float, height: float) -> Figure:
    """Return the figure given, or a new one of pyplot; ParameterError if it is something else."""
    if fig is not None:
        if not hasattr(fig, "add_subplot"):
            raise ParameterError(f"fig is a figure of matplotlib, got {fig!r}")
        return fig
    with held_back():
        from matplotlib import pyplot

    return pyplot.figure(figsize=_size(width, height), layout="constrained")


def title_axes(ax: Axes, model: Model, fixed: Mapping[str, float], title: str = "") -> None:
    """Write a title, and below it the parameters that have one value all over the axes."""
    text = full_title(title, model.parameter_names, parameters_to_show(fixed, model.defaults))
    ax.set_title(text, fontsize=sized(TEXT))


def name_axes(ax: Axes, across: str | None, up: str) -> None:
    """Label both axes (None leaves a label as it is) and set the look of their ticks."""
    if across is not None:
        ax.set_xlabel(across, fontsize=sized(TEXT + 1))
    ax.set_ylabel(up, fontsize=sized(TEXT + 1))
    ax.tick_params(direction="in", top=True, right=True, labelsize=sized(SMALL + 1))
    _spread_rounding(ax)


def _spread_rounding(ax: Axes) -> None:
    """Let axes of numbers that differ by rounding alone show their value; it is drawn as a level line."""
    corners = ax.dataLim.get_points()
    size, width = np.abs(corners).max(axis=0), np.ptp(corners, axis=0)
    constant = np.isfinite(size) & (width < _ROUNDING * size)
    if np.any(constant):
        by = np.where(constant, _AROUND * size, 0.0)
        ax.update_datalim([corners[0] - by, corners[1] + by])
