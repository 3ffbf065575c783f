"""Where one contact comes to rest the others go on as they did: an element that slips still slips there."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest

import contfric as cf
from contfric.bvp.system import EventFunction, Margin
from contfric.events.bifurcation import Kind
from contfric.events.local.touching import resting_domain
from contfric.models.definition import Domain
from tests.random_structures import drawn

#: Random structures of friction contacts and Jenkins elements, whose modes are all listed.
BOTH = (9, 37, 38, 48, 63, 70)


def rests(model: cf.Model, contacts: list[Any]) -> Iterator[tuple[str, int, Domain]]:
    """Yield the modes in which a contact slides, its index, and where it rests after a stop at its limit."""
    names = [s.name for s in model.surfaces]
    for mode in (m.name for m in model.modes):
        for i, contact in enumerate(contacts):
            limits = [n for n in names if n.startswith((f"c{i + 1}+", f"c{i + 1}-"))]
            for limit in limits if contact.kind == "friction" and mode[i] in "pn" else ():
                system: Any = SimpleNamespace(model=model, itinerary=((mode, f"c{i + 1}"),))
                rest = resting_domain(system, EventFunction(Margin.JOINT, 0, limit))
                if rest is not None:
                    yield mode, i, rest


@pytest.mark.parametrize("seed", BOTH)
def test_elements_keep_their_states_where_a_contact_stops(seed: int) -> None:
    made, stepped, _ = drawn(seed)
    found = list(rests(made(), stepped.contacts))
    assert found
    elements = [i for i, contact in enumerate(stepped.contacts) if contact.kind == "jenkins"]
    for mode, rubs, rest in found:
        assert rest.mode[rubs] == "s"
        assert all(rest.mode[i] == mode[i] for i in elements)


def test_a_stop_at_the_limit_while_an_element_slips_bounds_a_bridge() -> None:
    """The load falls as the element slips on; it would grow if the element stuck, and nothing would jump."""
    orbit = cf.find_orbit(drawn(37)[0]())
    diagram = cf.explore(orbit, "Omega", (1.24, 1.345))
    assert not diagram.loose_ends
    jumps = [e.bifurcation for e in diagram.events if e.bifurcation.kind is Kind.SS]
    assert len(jumps) == 2
    for (
        event
    ) in jumps:  # the stick at whose beginning it happens, with holds as parts of it, has a length
        (test,) = event.tests
        assert event.orbit.durations[(test.segment + 1) % len(event.orbit.itinerary)] > 0.0
    for branch in diagram.branches:
        assert all(point.admissible for point in branch)
