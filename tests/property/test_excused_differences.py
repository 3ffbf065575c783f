"""What a degenerate event explains of a difference: itself, and what is joined to the start by it alone."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import networkx as nx
import numpy as np
import pytest

import contfric as cf
from contfric.atlas.completeness import verification
from contfric.atlas.completeness.degenerate import Degenerate, degenerate_events, joined_surely
from contfric.atlas.completeness.verification import _told_apart

sys.path.insert(0, FOLDER := str(Path(__file__).parents[2] / "benchmarks" / "stress"))
from restarts import Scene, excuses

sys.path.remove(FOLDER)

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


@pytest.mark.parametrize("seed", range(6))
def test_what_is_known_excuses_nothing_elsewhere(
    diagram: cf.Diagram, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A restart lacks an event: that is explained where the equations are degenerate at its own value."""
    rng = np.random.default_rng([3, seed])
    lost, other = (int(k) for k in rng.choice(len(diagram.events), 2, replace=False))
    node = diagram.events[lost]
    without = replace(diagram, nodes=tuple(n for n in diagram.nodes if n is not node))
    monkeypatch.setattr(verification, "_explored", lambda *_: without)
    for known in ((), (at(diagram, other),)):
        found = verification.verify(diagram, 3, known=known)
        assert not found.same and not found.explained
    assert verification.verify(diagram, 3, known=(at(diagram, lost),)).explained


@pytest.mark.parametrize("seed", range(6))
def test_an_event_that_is_not_located_excuses_nothing(diagram: cf.Diagram, seed: int) -> None:
    """What rounding moves by more than any located event would be degenerate all over the range."""
    rng = np.random.default_rng([5, seed])
    unknown = float(10.0 ** rng.uniform(-1.0, 1.0))
    k = int(rng.choice([i for i, b in enumerate(diagram.branches) if not b.mirrored]))
    branch = diagram.branches[k]
    changed = {id(b): replace(b, bound=unknown) for b in branch.bifurcations}
    ends = tuple(
        replace(end, bifurcation=changed.get(id(end.bifurcation), end.bifurcation))
        for end in branch.ends
    )
    events = tuple(changed[id(b)] for b in branch.bifurcations)
    lost = replace(branch, bifurcations=events, ends=ends)
    branches = (*diagram.branches[:k], lost, *diagram.branches[k + 1 :])
    before = {str(found) for found in degenerate_events(diagram)}
    assert {
        str(found) for found in degenerate_events(replace(diagram, branches=branches))
    } <= before


@pytest.mark.parametrize("seed", range(20))
def test_random_studies_are_excused_only_where_their_equations_are_degenerate(seed: int) -> None:
    """Omega = 1/n without damping: at no other damping, and for no other reason such as equal limits."""
    rng = np.random.default_rng([4, seed])
    n, friction = int(rng.integers(1, 12)), float(rng.uniform(0.05, 1.0))
    base = {"Omega": 1.0 / n, "S": friction, "S0": friction * rng.uniform(1.1, 2.0), "h": 0.1}
    damped, undamped = {**base, "zeta": float(rng.uniform(0.001, 0.1))}, {**base, "zeta": 0.0}
    (found,) = excuses(Scene(damped, "zeta", (-0.02, 0.2)))
    assert found.holds(0.0) and not found.holds(damped["zeta"])
    (found,) = excuses(Scene(undamped, "h", (0.0, 0.2)))
    assert found.holds(0.1)
    assert not excuses(Scene(damped, "h", (0.0, 0.2)))
    between = {"Omega": 1.0 / (n + 0.3)}
    assert not excuses(Scene({**undamped, **between}, "h", (0.0, 0.2)))
    equal = {"S0": friction}
    assert not excuses(Scene({**undamped, **between, **equal}, "h", (0.0, 0.2)))
    near = 0.9 / n, 1.01 / n
    assert not excuses(Scene(undamped, "Omega", near))
    found = excuses(Scene({**undamped, **equal}, "Omega", near))
    assert any(d.holds(1.0 / n) for d in found) and not any(d.holds(0.97 / n) for d in found)
