"""What a degenerate event explains of a difference: itself, and what is joined to the start by it alone."""

from __future__ import annotations

from dataclasses import replace

import networkx as nx
import numpy as np
import pytest

import contfric as cf
from contfric.atlas.degenerate import Degenerate, joined_surely
from contfric.atlas.verification import _told_apart

PARAMS = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
RANGE = (0.47, 0.56)


@pytest.fixture(scope="module")
def diagram() -> cf.Diagram:
    """Branches with and without holds, asymmetric ones and their images."""
    found = cf.explore(cf.find_orbit("coulomb", PARAMS), "Omega", RANGE, max_periods=1)
    assert len(found.events) > 5 and any(b.mirrored for b in found.branches)
    return found


def at(diagram: cf.Diagram, k: int) -> Degenerate:
    """One event of a diagram, as if it were degenerate."""
    value = diagram.events[k].bifurcation.params[diagram.parameter]
    return Degenerate("not to be told apart", value - 1e-12, value + 1e-12)


def test_all_of_a_diagram_is_joined(diagram: cf.Diagram) -> None:
    """By definition it is one component."""
    for first in range(len(diagram.branches)):
        events, branches = joined_surely(diagram, first, ())
        assert len(events) == len(diagram.nodes)
        assert len(branches) == sum(not b.mirrored for b in diagram.branches)


@pytest.mark.parametrize("seed", range(12))
def test_what_is_joined_is_a_component_of_the_graph_without_degenerate_events(
    diagram: cf.Diagram, seed: int
) -> None:
    """The same by networkx, with branches and their images as one."""
    rng = np.random.default_rng(seed)
    gone = [at(diagram, int(k)) for k in rng.choice(len(diagram.events), 2, replace=False)]
    first = int(rng.integers(len(diagram.branches)))
    graph = nx.Graph()
    names = [i - b.mirrored for i, b in enumerate(diagram.branches)]
    graph.add_nodes_from(names)
    for n, node in enumerate(diagram.nodes):
        if not any(d.holds(node.bifurcation.params["Omega"]) for d in gone):
            graph.add_edges_from((f"event {n}", names[i]) for i in node.branches)
    wanted = nx.node_connected_component(graph, names[first])
    events, branches = joined_surely(diagram, first, gone)
    assert {id(b) for b in branches} == {
        id(diagram.branches[i]) for i in wanted if isinstance(i, int)
    }
    assert len(events) == sum(isinstance(name, str) for name in wanted)


@pytest.mark.parametrize("seed", range(12))
def test_a_missing_event_is_explained_by_itself_only(diagram: cf.Diagram, seed: int) -> None:
    """A degenerate event somewhere else in the diagram is no excuse for it."""
    rng = np.random.default_rng([1, seed])
    lost, other = (int(k) for k in rng.choice(len(diagram.events), 2, replace=False))
    node = diagram.events[lost]
    first = node.branches[0]
    without = replace(diagram, nodes=tuple(n for n in diagram.nodes if n is not node))
    assert not _told_apart(diagram, first, without, (at(diagram, lost),))
    assert _told_apart(diagram, first, without, (at(diagram, other),))


@pytest.mark.parametrize("seed", range(6))
def test_a_missing_branch_is_explained_where_all_its_events_are(
    diagram: cf.Diagram, seed: int
) -> None:
    """From the first branch: it is joined by its own events, and by nothing else."""
    rng = np.random.default_rng([2, seed])
    own = [i for i, b in enumerate(diagram.branches) if not b.mirrored]
    lost = int(rng.choice(own[1:]))
    ends = [at(diagram, k) for k, node in enumerate(diagram.events) if lost in node.branches]
    images = {lost, lost + 1} - set(own) | {lost}
    kept = {i: n for n, i in enumerate(i for i in range(len(diagram.branches)) if i not in images)}
    nodes = tuple(
        replace(node, branches=tuple(kept[i] for i in node.branches if i in kept))
        for node in diagram.nodes
    )
    without = replace(diagram, branches=tuple(diagram.branches[i] for i in kept), nodes=nodes)
    assert _told_apart(diagram, 0, without, ())
    assert not _told_apart(diagram, 0, without, tuple(ends))
