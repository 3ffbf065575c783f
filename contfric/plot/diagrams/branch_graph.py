"""The graph of a diagram: its branches are the nodes, its bifurcations the edges between them.

A branch and its mirror image are one node, so what the drawing shows is the diagram up to the symmetry:
a bifurcation and its mirror image are one edge. Folds and tangencies join no two branches and are left
out. Where more than two branches meet, the edge has as many arms, from its middle to each of them.

The nodes stand where springs along the shortest paths would pull them (T. Kamada and S. Kawai,
Inf. Process. Lett. 31 (1989) 7-15), which needs no random start.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from contfric.base.arrays import FloatArray
from contfric.plot.appearance.labels import Anchor, lay_out, place_labels
from contfric.plot.appearance.names import event_label, parameter_label
from contfric.plot.appearance.save import axes_or_new
from contfric.plot.appearance.style import BRIDGE_COLOUR, GREY, branch_colours
from contfric.plot.diagrams.events import draw_event
from contfric.plot.graph import draw_node, frame_nodes

if TYPE_CHECKING:
    from contfric.atlas.diagram import Diagram
    from contfric.continuation.branch import Branch
    from contfric.events.bifurcation import Bifurcation

#: Relative: bifurcations of one kind this near in the parameter, on the same branches, are mirror images.
_SAME = 1e-9
#: Marks are at least so far apart, where neighbouring nodes are about 1 apart; one that would be nearer is
#: moved by this share of the way to one of its nodes.
_APART, _ASIDE = 0.25, 0.4

_Place = tuple[float, float]


@dataclass(frozen=True)
class _Joint:
    """A bifurcation and the nodes that it joins."""

    event: Bifurcation
    value: float
    nodes: tuple[int, ...]


def plot_branch_graph(diagram: Diagram, ax: Axes | None = None) -> Axes:
    """Draw how the branches of a diagram are joined by its bifurcations, up to mirror images.

    Parameters
    ----------
    diagram : Diagram
    ax : Axes, optional
        Where to draw; new axes by default.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> ax = plot_branch_graph(cf.explore(orbit, "Omega", (0.4, 0.6)))
    """
    new = axes_or_new(ax, 8.4, 5.6)
    new.set_axis_off()
    branches, node_of = _nodes(diagram.branches)
    joints = _joints(diagram, node_of)
    places = _places(len(branches), joints)
    middles = _middles(joints, places)
    for joint, middle in zip(joints, middles, strict=True):
        for start, end in _lines(joint, places, middle):
            new.plot(*zip(start, end, strict=True), color=GREY, linewidth=1.0, zorder=1)
    colours = branch_colours(b.name for b in branches if not b.bridge)
    for branch, place in zip(branches, places, strict=True):
        colour = BRIDGE_COLOUR if branch.bridge else colours[branch.name]
        draw_node(new, branch.name, place, colour, faded=False)
    anchors = _events(new, joints, middles, diagram.parameter)
    frame_nodes(new, places)
    lay_out(new)
    place_labels(new, anchors)
    return new


def _nodes(branches: Sequence[Branch]) -> tuple[list[Branch], list[int]]:
    """Return the branches that are nodes, and the node of each branch: images follow originals."""
    nodes: list[Branch] = []
    node_of: list[int] = []
    for branch in branches:
        if not branch.mirrored:
            nodes.append(branch)
        node_of.append(len(nodes) - 1)
    return nodes, node_of


def _joints(diagram: Diagram, node_of: Sequence[int]) -> list[_Joint]:
    """Return every bifurcation that joins two nodes or more, each once."""
    found: list[_Joint] = []
    for node in diagram.nodes:
        event, nodes = node.bifurcation, tuple(sorted({node_of[i] for i in node.branches}))
        value = event.params[diagram.parameter]
        known = any(
            j.nodes == nodes
            and j.event.kind.value == event.kind.value
            and abs(j.value - value) <= _SAME * abs(value)
            for j in found
        )
        if len(nodes) > 1 and not known:
            found.append(_Joint(event, value, nodes))
    return found


def _places(count: int, joints: Sequence[_Joint]) -> list[_Place]:
    """Return where the nodes stand; parts that nothing joins stand side by side."""
    import networkx as nx

    graph: nx.Graph[int] = nx.Graph()
    graph.add_nodes_from(range(count))
    for joint in joints:
        graph.add_edges_from(combinations(joint.nodes, 2))
    places: dict[int, _Place] = {}
    left = 0.0
    for part in nx.connected_components(graph):
        nodes = sorted(part)
        at = nx.kamada_kawai_layout(graph.subgraph(nodes), scale=float(len(nodes)) ** 0.5)
        points = _lying(np.array([at[k] for k in nodes]))
        points[:, 0] += left - points[:, 0].min()
        left = float(points[:, 0].max()) + 1.0
        places |= {k: (float(x), float(y)) for k, (x, y) in zip(nodes, points, strict=True)}
    return [places[k] for k in range(count)]


def _lying(points: np.ndarray) -> np.ndarray:
    """Return points turned so that their longest extent lies, the first of them to the left."""
    centred = points - points.mean(axis=0)
    turned = np.asarray(centred @ np.linalg.svd(centred, full_matrices=False)[2].T)
    if turned.shape[1] < 2:
        turned = np.column_stack([turned, np.zeros(len(turned))])
    return np.asarray(turned * np.where(turned[0] > 0.0, -1.0, 1.0))


def _lines(joint: _Joint, places: Sequence[_Place], middle: _Place) -> list[tuple[_Place, _Place]]:
    """Return the lines of an edge: one between two nodes, an arm to each of more."""
    ends = [places[k] for k in joint.nodes]
    if len(ends) == 2:
        return [(ends[0], ends[1])]
    return [(middle, end) for end in ends]


def _middles(joints: Sequence[_Joint], places: Sequence[_Place]) -> list[_Place]:
    """Return where each bifurcation is marked: in the middle of what it joins, or nearer to one of its ends.

    Edges that cross in their middles would else have one mark, as if all of their branches met there.
    """
    taken: list[FloatArray] = []
    lines = {
        k: (np.array(places[j.nodes[0]]), np.array(places[j.nodes[1]]))
        for k, j in enumerate(joints)
        if len(j.nodes) == 2
    }
    for index, joint in enumerate(joints):
        ends = np.array([places[k] for k in joint.nodes])
        twins = [k for k, other in enumerate(joints) if other.nodes == joint.nodes]
        if len(twins) > 1:  # they share a line
            w = (twins.index(index) + 1.0) / (len(twins) + 1.0)
            tried = [ends[0] + w * (ends[1] - ends[0])]
        else:
            middle = ends.mean(axis=0)
            tried = [middle, *(middle + _ASIDE * (end - middle) for end in ends)]
        others = [(at, at) for at in taken]
        others += [(p, p) for k, p in enumerate(map(np.array, places)) if k not in joint.nodes]
        others += [
            lines[k] for k, other in enumerate(joints) if other.nodes != joint.nodes and k in lines
        ]
        free = [min((_distance(at, *o) for o in others), default=np.inf) for at in tried]
        first = next((k for k, far in enumerate(free) if far > _APART), int(np.argmax(free)))
        taken.append(tried[first])
    return [(float(x), float(y)) for x, y in taken]


def _distance(at: FloatArray, one: FloatArray, other: FloatArray) -> float:
    """Return the distance of a point from a line between two points."""
    way = other - one
    share = float(np.clip(np.dot(at - one, way) / max(float(np.dot(way, way)), 1e-300), 0.0, 1.0))
    return float(np.hypot(*(at - one - share * way)))


def _events(
    ax: Axes, joints: Sequence[_Joint], middles: Sequence[_Place], parameter: str
) -> list[Anchor]:
    """Mark each bifurcation, and return its label."""
    anchors: list[Anchor] = []
    for joint, middle in zip(joints, middles, strict=True):
        draw_event(ax, joint.event, middle)
        name = f"{event_label(joint.event.label)}\n{parameter_label(parameter)} = {joint.value:.5g}"
        anchors.append(Anchor(*middle, name))
    return anchors
