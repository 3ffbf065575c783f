"""``contfric view DIR``: the diagram of a run as a page for a browser."""

from __future__ import annotations

import argparse
from pathlib import Path

from contfric.cli.exits import Exit
from contfric.errors import ResultFileError


def view(options: argparse.Namespace) -> int:
    """Write the page next to the results, or serve it with sliders; where it is goes to stdout."""
    import webbrowser

    from contfric.atlas.diagram import Diagram
    from contfric.base.extras import need_bokeh
    from contfric.results import load
    from contfric.study.plan import VIEW
    from contfric.study.tasks.diagram import DIAGRAM

    need_bokeh()  # before anything is read
    source: Path = options.folder / DIAGRAM
    if options.folder.is_file():
        raise ResultFileError(f"{options.folder} is a file; give the folder that a run wrote")
    if not source.is_file():
        raise ResultFileError(f"{options.folder} holds no diagram: {source} is missing")
    diagram = load(source)
    if not isinstance(diagram, Diagram):
        raise ResultFileError(f"{source} holds no diagram, but a {type(diagram).__name__.lower()}")
    if options.live:
        live = diagram.live()
        print(live.url, flush=True)
        if options.open:
            webbrowser.open(live.url)
        live.run()
        return Exit.DONE
    path = diagram.to_html(options.folder / VIEW)
    print(path)
    if options.open:
        webbrowser.open(path.resolve().as_uri())
    return Exit.DONE
