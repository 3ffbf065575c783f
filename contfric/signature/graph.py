"""The transition graph of a model: which domain can follow which, and through which surface."""

from __future__ import annotations

from typing import TYPE_CHECKING

from contfric.base.interrupts import held_back
from contfric.errors import NotationError, did_you_mean
from contfric.models import Model, ModelSource, load_model

if TYPE_CHECKING:
    import networkx as nx


def transition_graph(model: ModelSource) -> nx.MultiDiGraph[str]:
    """Return the domains of a model (or of its name) as nodes and its transitions as edges.

    Returns
    -------
    networkx.MultiDiGraph
        Nodes have the attributes ``mode`` and ``label``; edges have ``surface``, which is their
        key as well. ``graph.graph["model"]`` is the name of the model.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> transition_graph(load_model("coulomb")).number_of_edges()
    14
    """
    with held_back():
        import networkx as nx

    model = load_model(model)
    graph: nx.MultiDiGraph[str] = nx.MultiDiGraph(model=model.name)
    for domain in model.domains:
        graph.add_node(domain.name, mode=domain.mode, label=domain.label or domain.name)
    for (source, surface), targets in model.targets.items():
        for target in targets:
            graph.add_edge(source, target, key=surface, surface=surface)
    return graph


def successors(model: Model, domain: str) -> dict[str, str]:
    """Return the next domain for each surface through which a domain can be left; resets are left out.

    Raises
    ------
    NotationError
        If the model has no such domain.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> successors(load_model("coulomb"), "stick")
    {'F+': 'x+v-', 'F-': 'x-v+'}
    """
    if domain not in model.domain_by_name:
        raise NotationError(unknown_domain(model, domain))
    return dict(model.exits_of(domain))


def crossing(model: Model, source: str, target: str) -> str | None:
    """Return the surface that leads from one domain to another, or None.

    Where several surfaces do, the first in the order of the model's surfaces is returned.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> crossing(load_model("coulomb"), "x0v+", "stick")
    'v'
    """
    return next((s for s, after in model.exits_of(source) if after == target), None)


def unknown_domain(model: Model, domain: str) -> str:
    """Return the message for a domain that the model does not have."""
    hint = did_you_mean(domain, model.domain_by_name)
    return f"model '{model.name}' has no domain '{domain}'{hint}"
