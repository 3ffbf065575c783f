"""A bifurcation diagram: branches joined by bifurcations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING

from contfric.base.extras import need_flint
from contfric.base.shown import Shown
from contfric.base.tabled import stacked
from contfric.continuation.branch import Branch
from contfric.errors import number_and
from contfric.events.bifurcation import Bifurcation, End, Kind, Proposal
from contfric.models.definition import Model
from contfric.quantities.registry import QuantityLike

if TYPE_CHECKING:
    from collections.abc import Callable
    from concurrent.futures import Executor
    from os import PathLike
    from pathlib import Path

    import networkx as nx
    import pandas as pd
    from matplotlib.axes import Axes

    from contfric.atlas.completeness.verification import Verification
    from contfric.atlas.scenario import Scenario
    from contfric.certify.diagram_certificate import DiagramCertificate
    from contfric.plot.diagrams.look import LineStyle
    from contfric.plot.live.frame import Frame
    from contfric.plot.live.serve import Live
    from contfric.response.sweep import Sweep


@dataclass(frozen=True, eq=False)
class Node:
    """A bifurcation of the diagram and the branches that meet there.

    Attributes
    ----------
    bifurcation : Bifurcation
        As located on the first branch that reached it.
    branches : tuple of int
        Indices of the branches that meet there.
    mirrored : bool
        Whether it is the mirror image of another node: the same values, on the mirror branches.
    """

    bifurcation: Bifurcation
    branches: tuple[int, ...]
    mirrored: bool = False

    @property
    def proposals(self) -> tuple[Proposal, ...]:
        """What was proposed to follow it, and what became of each."""
        return self.bifurcation.proposals

    def __str__(self) -> str:
        return f"{self.bifurcation!r}: {len(self.branches)} branches"


@dataclass(frozen=True)
class LooseEnd:
    """An end of a branch that nothing follows, with its reason."""

    branch: int
    side: int
    end: End

    def __str__(self) -> str:
        return (
            f"branch {self.branch + 1}, {'first' if self.side == 0 else 'last'} point: {self.end}"
        )


@dataclass(frozen=True)
class Asked:
    """What an exploration was asked for; a restart asks for the same.

    Attributes
    ----------
    max_step : largest step, as a share of the range; None for that of the model
    stability : whether multipliers were evaluated
    bridges : whether jumps were bridged
    max_periods : longest orbits, in periods; raised to that of a longer start
    copies : most copies of the shortest period that were tried at sliding events
    max_branches, max_points : most branches, and most points of each half-branch
    stop_at : quantities, and the value at which a branch ends
    """

    max_step: float | None = None
    stability: bool = True
    bridges: bool = True
    max_periods: int = 4
    copies: int = 1
    max_branches: int = 200
    max_points: int = 20_000
    stop_at: tuple[tuple[QuantityLike, float], ...] = ()


@dataclass(frozen=True, eq=False)
class Diagram(Shown):
    """What :func:`contfric.explore` found.

    Attributes
    ----------
    model : Model
    parameter : str
        The parameter that varies.
    range : (float, float)
        Where it was followed.
    branches : tuple of Branch
        Computed branches and the mirror images of asymmetric ones.
    nodes : tuple of Node
        Bifurcations, each once, with the branches that meet there.
    loose_ends : tuple of LooseEnd
        Ends that nothing follows, each with its reason.
    complete : bool
        False if the exploration was stopped before it was done.
    notes : tuple of str
        What the user should know of the run.
    settings : Asked
        What was asked for.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> diagram = cf.explore(orbit, "Omega", (0.5, 0.55))
    >>> [event.label for event in diagram.bifurcations], diagram.loose_ends
    (['CS_s', 'SN_1a'], ())
    """

    model: Model
    parameter: str
    range: tuple[float, float]
    branches: tuple[Branch, ...]
    nodes: tuple[Node, ...]
    loose_ends: tuple[LooseEnd, ...]
    complete: bool = True
    notes: tuple[str, ...] = field(default=())
    settings: Asked = field(default=Asked())
    verification: Verification | None = field(default=None, repr=False)

    @property
    def width(self) -> float:
        """Width of the range: what lengths along the parameter are compared with."""
        return self.range[1] - self.range[0]

    @property
    def events(self) -> tuple[Node, ...]:
        """Every event once (symmetry images are not listed), in the order of the parameter."""
        found = [node for node in self.nodes if not node.mirrored]
        return tuple(sorted(found, key=lambda node: node.bifurcation.params[self.parameter]))

    def scenario(self, event: Node) -> Scenario | None:
        """Return what a non-smooth event is for nearby orbits: persistence, a fold, or a jump.

        None for a smooth event, and for one of orbits with a hold only.
        """
        from contfric.atlas.scenario import scenario_of

        return scenario_of(self, event)

    def verify(self, restarts: int = 6, step: float | None = None) -> Verification:
        """Explore again from the diagram's own branches, and check the sums of indices.

        Without ``stability`` branch points may be seen from one side only, and restarts differ.

        Parameters
        ----------
        restarts : int
            Most branches that it is explored again from.
        step : float, optional
            Largest step of the restarts, in largest steps of the diagram; 0.31 by default.

        Returns
        -------
        Verification
            ``passed``, and ``faults`` that name what differs; kept in ``diagram.verification``.

        Examples
        --------
        >>> import contfric as cf
        >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
        >>> cf.explore(orbit, "Omega", (0.48, 0.55)).verify(restarts=2).passed
        True
        """
        from contfric.atlas.completeness.verification import STEP, verify

        found = verify(self, restarts, STEP if step is None else step)
        object.__setattr__(self, "verification", found)
        return found

    @property
    def verified(self) -> bool | None:
        """Whether :meth:`verify` found nothing that differs; None before it was asked."""
        return None if self.verification is None else self.verification.passed

    def certify(
        self,
        *,
        executor: Executor | None = None,
        time_limit: float | None = None,
        progress: Callable[[str], None] | None = None,
    ) -> DiagramCertificate:
        """Prove the diagram: a tube along every branch, every event to 30 digits (needs python-flint).

        Mirror images of branches are not proved again, and not counted.

        Parameters
        ----------
        executor : any :class:`concurrent.futures.Executor` of processes; by default one after the other here
        time_limit : seconds after which what is left is listed as not reached
        progress : called with one line of text now and then

        Raises
        ------
        ParameterError
            If proofs are not offered for the model, or a setting is wrong.

        Examples
        --------
        >>> import contfric as cf
        >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.6, "S": 0.3, "S0": 0.4})
        >>> cf.explore(orbit, "Omega", (0.59, 0.61)).certify().covered > 0.99
        True
        """
        need_flint()
        from contfric.certify.diagram import certify_diagram

        return certify_diagram(self, executor, time_limit, progress)

    @property
    def bifurcations(self) -> tuple[Bifurcation, ...]:
        """Every bifurcation once (mirror images are not listed), in the order of the parameter."""
        found = [node.bifurcation for node in self.nodes if not node.mirrored]
        return tuple(sorted(found, key=lambda b: b.params[self.parameter]))

    def of_kind(self, kind: Kind | str) -> tuple[Bifurcation, ...]:
        """Return the bifurcations of one kind.

        Raises
        ------
        ParameterError
            If there is no such kind.
        """
        wanted = Kind.named(kind)
        return tuple(b for b in self.bifurcations if b.kind is wanted)

    @cached_property
    def graph(self) -> nx.MultiGraph[int]:
        """Branches as nodes; an edge for each pair that meets at a bifurcation (networkx)."""
        import networkx as nx

        graph: nx.MultiGraph[int] = nx.MultiGraph()
        for i, branch in enumerate(self.branches):
            graph.add_node(i, name=branch.name, branch=branch)
        for node in self.nodes:
            for one, other in combinations(node.branches, 2):
                graph.add_edge(
                    one, other, kind=node.bifurcation.kind.value, bifurcation=node.bifurcation
                )
        return graph

    @property
    def connected(self) -> bool:
        """Whether events join all branches, a branch and its mirror image counted as one."""
        import networkx as nx

        graph = self.graph.copy()
        for i in range(1, len(self.branches)):
            if self.branches[i].mirrored:  # it stands after the branch that it is the image of
                graph.add_edge(i - 1, i)
        return len(graph) == 0 or bool(nx.is_connected(graph))

    def to_dataframe(self, quantities: Sequence[QuantityLike] = ()) -> pd.DataFrame:
        """Return the points of all branches as one table, with the branch's number and name.

        Parameters
        ----------
        quantities : sequence of str or callable
            More columns: quantities by name, as expressions, or as functions of an orbit.
        """
        return stacked(
            ({"branch": i + 1, "signature": branch.name}, branch.to_dataframe(quantities))
            for i, branch in enumerate(self.branches)
        )

    def plot(
        self,
        ax: Axes | None = None,
        row: QuantityLike = "x_max",
        overlay: Sweep | None = None,
        *,
        legend: bool = True,
        names: Mapping[str, str] | None = None,
        colours: Mapping[str, str] | None = None,
        linestyles: Mapping[str, LineStyle] | None = None,
        inset: bool | tuple[float, float] = False,
    ) -> Axes:
        """Draw one quantity of all branches with the bifurcations; after them the points of a sweep.

        ``names`` and ``colours`` say what branches are called in the legend, and their colours, by their
        signature's name; ``linestyles`` how ``"stable"``, ``"unstable"``, ``"unknown"`` parts and a
        ``"bridge"`` are drawn. ``inset`` draws a part once more, larger: where events crowd, or (low, high).
        """
        from contfric.plot.diagrams.diagram import plot_diagram_row

        return plot_diagram_row(
            self,
            row,
            ax=ax,
            overlay=overlay,
            legend=legend,
            names=names,
            colours=colours,
            linestyles=linestyles,
            inset=inset,
        )

    def show(self, height: int = 900) -> Frame:
        """Return the live diagram for a notebook (needs bokeh: the extra ``live``).

        Parameters
        ----------
        height : int
            Height of the frame in pixels.

        Raises
        ------
        MissingPackageError
            If bokeh is not installed.
        """
        from contfric.plot.live.frame import Frame

        return Frame.of(self, height)

    def live(self, height: int = 950) -> Live:
        """Serve the live diagram with a slider for every fixed parameter (needs bokeh: the extra ``live``).

        Whoever drags one has the diagram explored anew, again and again. A notebook shows it in a frame;
        elsewhere open ``live.url`` in a browser of this machine, and call ``live.run()``.

        Parameters
        ----------
        height : int
            Height of the frame in pixels.

        Raises
        ------
        MissingPackageError
            If bokeh is not installed.
        """
        from contfric.atlas.other_parameters import anew
        from contfric.plot.live.serve import serve

        return serve(self, anew, height)

    def to_html(self, path: str | PathLike[str]) -> Path:
        """Write the diagram as one page for a browser (needs bokeh: the extra ``live``).

        A click on a point shows its orbit, signature, multipliers and smallest margin. Rows are chosen, and
        branches, events and bridges switched on and off. The file holds everything that it needs, in at
        most 2 MB: of a large diagram not every orbit can be clicked on.

        Parameters
        ----------
        path : path
            The file; one that exists is replaced.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        MissingPackageError
            If bokeh is not installed.
        ResultFileError
            If the file cannot be written.
        ParameterError
            If its name does not end with .html or .htm.
        """
        from contfric.plot.live.page import write_page

        return write_page(self, path)

    def __repr__(self) -> str:
        low, high = self.range
        return (
            f"<Diagram of {self.model.name}: {number_and(len(self.branches), 'branch', 'branches')}, "
            f"{number_and(len(self.bifurcations), 'bifurcation')}, {self.parameter} in [{low:g}, {high:g}]>"
        )
