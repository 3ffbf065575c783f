"""Results drawn on matplotlib axes.

Every function takes the axes (or the figure) to draw on, makes new ones if there are none, returns
what it drew on and never shows anything. What is drawn is taken from the results and from the
definition of their model alone.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from contfric.plot.basins import plot_basins
    from contfric.plot.branch_graph import plot_branch_graph
    from contfric.plot.diagram import plot_branches, plot_diagram, plot_diagram_row
    from contfric.plot.ensemble import plot_ensemble
    from contfric.plot.graph import plot_transition_graph
    from contfric.plot.lyapunov import plot_lyapunov_map
    from contfric.plot.orbit import plot_orbit, plot_orbit_in_time, plot_orbit_panels
    from contfric.plot.plane import plot_curves, plot_plane
    from contfric.plot.response import plot_sweep
    from contfric.plot.returns import plot_release_map, plot_returns
    from contfric.plot.save import journal, new_figure, save_figure
    from contfric.plot.style import ROWS

#: Where each public name lives; imported at first use.
_HOMES = {
    "ROWS": "contfric.plot.style",
    "journal": "contfric.plot.save",
    "new_figure": "contfric.plot.save",
    "plot_basins": "contfric.plot.basins",
    "plot_branch_graph": "contfric.plot.branch_graph",
    "plot_branches": "contfric.plot.diagram",
    "plot_curves": "contfric.plot.plane",
    "plot_diagram": "contfric.plot.diagram",
    "plot_diagram_row": "contfric.plot.diagram",
    "plot_ensemble": "contfric.plot.ensemble",
    "plot_lyapunov_map": "contfric.plot.lyapunov",
    "plot_orbit": "contfric.plot.orbit",
    "plot_orbit_in_time": "contfric.plot.orbit",
    "plot_orbit_panels": "contfric.plot.orbit",
    "plot_plane": "contfric.plot.plane",
    "plot_release_map": "contfric.plot.returns",
    "plot_returns": "contfric.plot.returns",
    "plot_sweep": "contfric.plot.response",
    "plot_transition_graph": "contfric.plot.graph",
    "save_figure": "contfric.plot.save",
}

__all__ = [
    "ROWS",
    "journal",
    "new_figure",
    "plot_basins",
    "plot_branch_graph",
    "plot_branches",
    "plot_curves",
    "plot_diagram",
    "plot_diagram_row",
    "plot_ensemble",
    "plot_lyapunov_map",
    "plot_orbit",
    "plot_orbit_in_time",
    "plot_orbit_panels",
    "plot_plane",
    "plot_release_map",
    "plot_returns",
    "plot_sweep",
    "plot_transition_graph",
    "save_figure",
]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'contfric.plot' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(__all__)
