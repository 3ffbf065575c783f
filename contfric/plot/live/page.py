"""The file: bokeh's figures, the data and the script, in one page that asks nothing of other machines."""

from __future__ import annotations

import json
import re
from html import escape
from importlib.resources import files
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from contfric.base.extras import need_bokeh
from contfric.base.files import replacing
from contfric.errors import ParameterError
from contfric.plot.appearance.names import parameter_label
from contfric.plot.appearance.style import (
    BLACK,
    BLUE,
    BRIDGE_WIDTH,
    GREEN,
    LINE_WIDTH,
    MARKERS,
    ORANGE,
    PURPLE,
    SKY,
    UNKNOWN_WIDTH,
    VERMILLION,
)
from contfric.plot.diagrams.diagram import fixed_parameters
from contfric.plot.live.collect import Detail, collect, symbol

if TYPE_CHECKING:
    from contfric.atlas.diagram import Diagram

#: Bytes of a page: what may be sent by mail and opens at once. bokeh itself takes 1.3 million of them.
LARGEST = 2_000_000
#: From the finest to the coarsest: the first whose page is not too large is written.
_DETAILS = (
    Detail(600, 0.0),
    Detail(400, 1e-5),
    Detail(250, 1e-4),
    Detail(120, 5e-4),
    Detail(50, 2e-3),
    Detail(20, 5e-3),
    Detail(20, 2e-2),
)
#: Dashes of the lines, in pixels; a stable line is solid.
_DASHES = {"stable": "solid", "unstable": "7 4", "unknown": "solid", "bridge": "2 3"}
_WIDTHS = {"bridge": BRIDGE_WIDTH, "unknown": UNKNOWN_WIDTH}
#: Markers of bokeh for those of matplotlib, and their angles in degrees.
_SHAPES = {
    "o": ("circle", 0),
    "D": ("diamond", 0),
    "s": ("square", 0),
    "p": ("hex", 0),
    "^": ("triangle", 0),
    "v": ("inverted_triangle", 0),
    "<": ("triangle", 90),
    ">": ("triangle", -90),
    "|": ("dash", 90),
}
_STATE_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)
_TOOLS = "pan,wheel_zoom,box_zoom,reset,save"


def write_page(diagram: Diagram, path: str | PathLike[str]) -> Path:
    """Write a diagram as one HTML file of at most 2 MB, if the coarsest detail is that small.

    A large diagram is shown with fewer orbits to click on, and with lines without those of their
    points that cannot be seen.

    Raises
    ------
    MissingPackageError
        If bokeh is not installed.
    ResultFileError
        If the file cannot be written.
    ParameterError
        If its name does not end with .html or .htm.
    """
    file = Path(path)
    if file.suffix not in (".html", ".htm"):
        raise ParameterError(f"a page ends with .html or .htm, got {file}")
    text = page_of(diagram)
    with replacing(file) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return file


def page_of(diagram: Diagram) -> str:
    """Return the text of the page; see :func:`write_page`."""
    need_bokeh()
    text = ""
    orbits: dict[tuple[int, int], dict[str, Any]] = {}
    for detail in _DETAILS:
        text = _page(diagram, collect(diagram, detail, orbits))
        if len(text.encode()) <= LARGEST:
            break
    return text


def _page(diagram: Diagram, data: dict[str, Any]) -> str:
    """Return the text of the page."""
    from bokeh.document import Document
    from bokeh.embed import file_html
    from bokeh.resources import INLINE

    document = Document()
    fill(document, diagram, data)
    variables = document.template_variables
    return str(
        file_html(
            document,
            INLINE,
            title=document.title,
            template=str(document.template),
            template_variables=variables,
        )
    )


def fill(document: Any, diagram: Diagram, data: dict[str, Any]) -> None:
    """Give a document of bokeh its figures, its script and its template."""
    from bokeh.models import CustomJS

    data["looks"] = _looks()
    data["state_colours"] = [_STATE_COLOURS[k % 7] for k in range(len(data["states"]))]
    figures, sources = _figures(diagram, data)
    for figure in figures.values():
        document.add_root(figure)
    script = CustomJS(args={**figures, **sources}, code=resource("page.js"))
    document.js_on_event("document_ready", script)
    document.title = f"{diagram.model.name}: {diagram.parameter}"
    document.template = resource("page.html")
    document.template_variables.update(
        heading=escape(f"{diagram.model.title or diagram.model.name}"),
        fixed=escape(fixed_text(diagram)),
        data=_embedded(data),
    )


def fixed_text(diagram: Diagram) -> str:
    """Return the fixed parameters of a diagram, but zeros, in one line."""
    values = fixed_parameters(diagram.branches).items()
    return _plain(", ".join(f"{parameter_label(name)} = {value:.6g}" for name, value in values))


def _plain(mathematics: str) -> str:
    r"""Return names of parameters without TeX.

    Examples
    --------
    >>> _plain("$S_{0}$ = 0.4, $\\Omega$ = 1")
    'S0 = 0.4, Ω = 1'
    """
    text = re.sub(r"\\mathrm\{(\w+)\}", r"\1", mathematics)
    text = re.sub(r"\\(\w+)", lambda m: symbol(m[1]), text)
    return re.sub(r"[${}_]", "", text)


def _embedded(data: dict[str, Any]) -> str:
    """Return data as JSON that may stand in a page: no tag can end in it."""
    text = json.dumps(data, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return text.replace("</", "<\\/")


def resource(name: str) -> str:
    """Return a file that the page consists of."""
    return files("contfric.plot.live").joinpath(name).read_text(encoding="utf-8")


def _looks() -> dict[str, Any]:
    """Return the marker of every kind of event."""
    found = {}
    for kind, look in MARKERS.items():
        shape, angle = _SHAPES[look.shape]
        found[kind] = {"shape": shape, "angle": angle, "face": look.face, "size": look.size + 3.0}
    found["other"] = {"shape": "star", "angle": 0, "face": "white", "size": 10.0}
    return found


def _figures(diagram: Diagram, data: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the three figures, and the sources of data that the script fills."""
    from bokeh.models import Range1d
    from bokeh.plotting import figure

    common = {"sizing_mode": "stretch_width", "tools": _TOOLS, "active_scroll": "wheel_zoom"}
    low, high = diagram.range
    top = figure(
        name="diagram",
        height=430,
        x_range=Range1d(low, high),
        y_range=Range1d(0.0, 1.0),
        x_axis_label=data["parameter"],
        **common,
    )
    phase = figure(name="phase", height=340, **common)
    series = figure(name="series", height=340, x_axis_label="t", **common)
    for shown in (top, phase, series):
        shown.toolbar.logo = None
    sources = {**_diagram_glyphs(top), **_orbit_glyphs(phase, series)}
    return {"top": top, "phase": phase, "series": series}, sources


def _diagram_glyphs(top: Any) -> dict[str, Any]:
    """Add what the diagram consists of: lines, markers, labels, and the point that was chosen."""
    from bokeh.models import ColumnDataSource, CustomJS, HoverTool, LabelSet

    sources: dict[str, Any] = {}
    kept_here = {"syncable": False}  # filled by the script: nothing of it goes back to a server
    for style, dash in _DASHES.items():
        source = ColumnDataSource(data={"x": [], "y": [], "colour": []}, name=style, **kept_here)
        width = _WIDTHS.get(style, LINE_WIDTH) * 1.2  # a screen is coarser than paper
        top.multi_line(
            "x", "y", source=source, line_color="colour", line_dash=dash, line_width=width
        )
        sources[f"{style}_lines"] = source
    names = ("x", "y", "shape", "angle", "face", "size", "label", "meaning")
    marks = ColumnDataSource(data={name: [] for name in names}, name="marks", **kept_here)
    markers = top.scatter(
        "x",
        "y",
        source=marks,
        marker="shape",
        angle="angle",
        angle_units="deg",
        size="size",
        fill_color="face",
        line_color=BLACK,
    )
    top.add_tools(
        HoverTool(renderers=[markers], tooltips=[("@label", "@meaning"), ("at", "@x{0.000000}")])
    )
    labels = ColumnDataSource(data={"x": [], "y": [], "label": []}, name="labels", **kept_here)
    top.add_layout(
        LabelSet(
            x="x",
            y="y",
            text="label",
            source=labels,
            y_offset=7,
            text_align="center",
            text_font_size="11px",
        )
    )
    chosen = ColumnDataSource(data={"x": [], "y": []}, name="chosen", **kept_here)
    top.scatter("x", "y", source=chosen, size=15, fill_alpha=0, line_color=BLACK, line_width=2)
    top.js_on_event("tap", CustomJS(code="window.contfric.pick(cb_obj.x, cb_obj.y)"))
    top.js_on_event("rangesupdate", CustomJS(code="window.contfric.thin()"))
    return {**sources, "marks": marks, "labels": labels, "chosen": chosen}


def _orbit_glyphs(phase: Any, series: Any) -> dict[str, Any]:
    """Add the curves of an orbit: in the phase plane by domain, against time by state."""
    from bokeh.models import ColumnDataSource, HoverTool

    until = {
        "x": [[0.0, 1.0]],
        "y": [[0.0, 1.0]],
        "colour": ["white"],
    }  # bokeh warns of axes without data
    parts = ColumnDataSource(data={**until, "domain": [""]}, name="parts")
    joints = ColumnDataSource(data={"x": [], "y": [], "colour": [], "domain": []}, name="joints")
    curves = ColumnDataSource(data={**until, "state": [""]}, name="curves")
    line = phase.multi_line("x", "y", source=parts, line_color="colour", line_width=2)
    dots = phase.scatter("x", "y", source=joints, size=7, color="colour")
    phase.add_tools(HoverTool(renderers=[line, dots], tooltips=[("domain", "@domain")]))
    series.multi_line(
        "x", "y", source=curves, line_color="colour", line_width=2, legend_field="state"
    )
    series.legend.background_fill_alpha = 0.6
    return {"parts": parts, "joints": joints, "curves": curves}
