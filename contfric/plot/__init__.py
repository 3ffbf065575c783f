"""Results drawn on matplotlib axes.

Every function takes the axes (or the figure) to draw on, makes new ones if there are none, returns
what it drew on and never shows anything. What is drawn is taken from the results and from the
definition of their model alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from contfric.base.lazy import lazily

if TYPE_CHECKING:
    from contfric.plot.appearance.save import journal as journal
    from contfric.plot.appearance.save import new_figure as new_figure
    from contfric.plot.appearance.save import save_figure as save_figure
    from contfric.plot.appearance.style import ROWS as ROWS
    from contfric.plot.basins import plot_basins as plot_basins
    from contfric.plot.diagrams.branch_graph import plot_branch_graph as plot_branch_graph
    from contfric.plot.diagrams.diagram import plot_branches as plot_branches
    from contfric.plot.diagrams.diagram import plot_diagram as plot_diagram
    from contfric.plot.diagrams.diagram import plot_diagram_row as plot_diagram_row
    from contfric.plot.ensemble import plot_ensemble as plot_ensemble
    from contfric.plot.graph import plot_transition_graph as plot_transition_graph
    from contfric.plot.lyapunov import plot_lyapunov_map as plot_lyapunov_map
    from contfric.plot.orbits.orbit import plot_orbit as plot_orbit
    from contfric.plot.orbits.orbit import plot_orbit_in_time as plot_orbit_in_time
    from contfric.plot.orbits.orbit import plot_orbit_panels as plot_orbit_panels
    from contfric.plot.plane import plot_curves as plot_curves
    from contfric.plot.plane import plot_plane as plot_plane
    from contfric.plot.response import plot_sweep as plot_sweep
    from contfric.plot.returns import plot_release_map as plot_release_map
    from contfric.plot.returns import plot_returns as plot_returns

__all__, __getattr__, __dir__ = lazily(__name__)
