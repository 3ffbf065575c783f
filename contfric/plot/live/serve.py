"""The page with sliders: a local server explores the diagram anew while a parameter is dragged."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from contfric.base.extras import need_bokeh
from contfric.errors import ContfricError
from contfric.plot.appearance.style import ROWS
from contfric.plot.live.collect import Detail, collect, lines_and_marks, symbol
from contfric.plot.live.page import fill, fixed_text, resource

if TYPE_CHECKING:
    from contfric.atlas.diagram import Diagram

#: While a parameter is dragged no orbit is sampled; when it is released, so many.
_QUICK, _FULL = Detail(0, 0.0), Detail(150, 1e-4)
#: A slider goes this far from a parameter that is zero.
_FROM_ZERO = 0.1

Again = Callable[["Diagram", Mapping[str, float]], "Diagram"]


@dataclass(frozen=True, repr=False)
class Live:
    """A live diagram with sliders, served to this machine only.

    Attributes
    ----------
    url : where a browser on this machine finds it
    server : bokeh's server
    height : of the frame in a notebook, in pixels
    """

    url: str
    server: Any
    height: int

    def run(self) -> None:
        """Serve until Ctrl-C; a notebook serves by itself."""
        try:
            self.server.io_loop.start()
        except KeyboardInterrupt:
            pass
        finally:
            self.stop()

    def stop(self) -> None:
        """End the server."""
        self.server.unlisten()
        self.server.stop()

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.url}" width="100%" height="{self.height}" style="border: 0"></iframe>'

    def __repr__(self) -> str:
        return f"<live diagram at {self.url}; stop() ends it>"


def serve(diagram: Diagram, again: Again, height: int = 950) -> Live:
    """Start a server of one page on a free port of this machine.

    Parameters
    ----------
    again : callable
        Explores the diagram anew with other fixed parameters.

    Raises
    ------
    MissingPackageError
        If bokeh is not installed.
    """
    need_bokeh()
    from bokeh.server.server import Server

    with suppress(ContfricError):  # whatever is loaded at first use is loaded before anyone drags
        again(diagram, {s["name"]: s["value"] for s in _sliders(diagram)})

    def page(document: Any) -> None:
        _steered(document, diagram)

    answering = _answering(lambda question: answered(diagram, again, question))
    server = Server(
        {"/": page}, port=0, address="127.0.0.1", extra_patterns=[("/again", answering)]
    )
    server.start()
    return Live(f"http://localhost:{server.port}/", server, height)  # the origin that bokeh accepts


def _steered(document: Any, diagram: Diagram) -> None:
    """Fill the page of one visitor."""
    from bokeh.models import CustomJS

    fill(document, diagram, collect(diagram, _FULL, {}) | {"steer": _sliders(diagram)})
    document.js_on_event("document_ready", CustomJS(code=resource("steer.js")))


def _answering(answer: Callable[[dict[str, Any]], dict[str, Any]]) -> type:
    """Return the handler of the questions that the page asks.

    They do not go through bokeh's socket: its messages have three parts, and Nagle's algorithm holds the
    second one back until the browser acknowledges the first. That takes 40 ms, longer than the exploration.
    """
    from tornado.web import HTTPError, RequestHandler

    class Answering(RequestHandler):
        def post(self) -> None:
            port = self.request.host.rpartition(":")[2]
            if self.request.headers.get("Origin") != f"http://localhost:{port}":
                raise HTTPError(403)  # a page of somebody else
            self.write(json.dumps(answer(json.loads(self.request.body)), allow_nan=False))

    return Answering


def answered(diagram: Diagram, again: Again, question: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the page shows for other parameters, or what is wrong with them."""
    try:
        found = again(diagram, question["params"])
    except ContfricError as error:
        return {"trouble": str(error)}
    rows = tuple(ROWS)
    if question["quick"]:
        shown = lines_and_marks(
            found, _QUICK, (question["row"],) if question["row"] in rows else rows
        )
    else:
        shown = collect(found, _FULL, {})
    return {**shown, "fixed": fixed_text(found)}


def _sliders(diagram: Diagram) -> list[dict[str, Any]]:
    """Return the fixed parameters, each with its range: what the model allows, at most twice the value."""
    model, first = diagram.model, diagram.branches[0]
    values = model.mapping(first.vector)
    found = []
    for name, value in values.items():
        if name == diagram.parameter:
            continue
        bottom, top, *_ = model.limits(name, values | {diagram.parameter: diagram.range[0]})
        reach = abs(value) or _FROM_ZERO
        low, high = max(bottom, value - reach), min(top, value + reach)
        found.append(
            {"name": name, "label": symbol(name), "value": value, "low": low, "high": high}
        )
    return found
