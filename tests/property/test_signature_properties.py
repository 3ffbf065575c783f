"""Properties of signatures over random closed walks of the transition graph."""

from __future__ import annotations

import networkx as nx
from hypothesis import given, settings
from hypothesis import strategies as st

from contfric.errors import NotationError
from contfric.models import load_model
from contfric.signature import (
    Signature,
    canonical_itinerary,
    crossing,
    double,
    is_closed_walk,
    mirror_itinerary,
    parse_signature,
    reduce_signature,
    reduced_itinerary,
    successors,
    swap_stops,
    transition_graph,
)
from contfric.signature.cyclic import least_rotation, primitive_length, rotated

COULOMB = load_model("coulomb")
BACK = dict(nx.all_pairs_shortest_path(nx.DiGraph(transition_graph(COULOMB))))


@st.composite
def walks(draw: st.DrawFn) -> Signature:
    """A random walk of up to 12 transitions, closed by the shortest way back, maybe repeated."""
    path = [draw(st.sampled_from([domain.name for domain in COULOMB.domains]))]
    for _ in range(draw(st.integers(1, 12))):
        path.append(draw(st.sampled_from(sorted(successors(COULOMB, path[-1]).values()))))
    path = path[:-1] + BACK[path[-1]][path[0]][:-1]
    if not path:
        path = BACK["x0v+"]["x+v+"]
    times = draw(st.integers(1, 3))
    return Signature(COULOMB, tuple(path * times), periods=draw(st.integers(1, 3)))


letters = st.lists(st.integers(0, 2), min_size=1, max_size=14).map(tuple)


@settings(max_examples=40)
@given(letters, st.integers(-20, 20))
def test_least_rotation_is_the_least(items: tuple[int, ...], k: int) -> None:
    every = [rotated(items, i) for i in range(len(items))]
    least = rotated(items, least_rotation(items))
    assert least == min(every)
    turned = rotated(items, k)
    assert rotated(turned, least_rotation(turned)) == least


@given(letters, st.integers(1, 4))
def test_primitive_length(items: tuple[int, ...], times: int) -> None:
    length = primitive_length(items)
    assert items[:length] * (len(items) // length) == items
    assert all(items[:n] * (len(items) // n) != items for n in range(1, length))
    assert primitive_length(items * times) == length


@given(walks(), st.integers(-30, 30))
def test_rotation_is_the_same_signature(signature: Signature, k: int) -> None:
    turned = signature.rotate(k)
    assert turned == signature
    assert hash(turned) == hash(signature)
    assert turned.is_mirror_symmetric == signature.is_mirror_symmetric
    assert reduce_signature(turned) == reduce_signature(signature)


@given(walks())
def test_notation_round_trip(signature: Signature) -> None:
    assert parse_signature(str(signature), COULOMB, signature.periods) == signature
    assert parse_signature(str(signature).replace(" -> ", "\n→"), COULOMB).segments == (
        signature.segments
    )


@given(walks())
def test_surfaces_lead_along_the_walk(signature: Signature) -> None:
    following = rotated(signature.segments, 1)
    assert len(signature.surfaces) == len(signature.segments)
    for source, surface, target in zip(
        signature.segments, signature.surfaces, following, strict=True
    ):
        assert crossing(COULOMB, source, target) == surface
        assert COULOMB.transitions[source, surface] == target


@given(walks())
def test_mirror_is_an_involution(signature: Signature) -> None:
    image = signature.mirror()
    assert image.mirror().segments == signature.segments
    assert image.stops == signature.stops
    if signature.is_mirror_symmetric:
        assert image == signature
        assert len(signature.half()) * 2 == len(signature.segments)


@given(walks())
def test_symmetric_itinerary_is_its_half_and_the_mirror_of_it(signature: Signature) -> None:
    image = signature.mirror()
    try:
        glued = Signature(COULOMB, signature.segments + image.segments)
    except NotationError:
        return  # the end of the walk does not lead to the start of its image
    assert glued.is_mirror_symmetric
    assert glued.half() == signature.segments


@given(walks())
def test_reduced_pieces_are_the_walk(signature: Signature) -> None:
    pieces = reduce_signature(signature)
    joined = tuple(name for piece in pieces for name in piece.domains)
    assert Signature(COULOMB, joined, signature.periods) == signature
    modes = {name: COULOMB.domain_by_name[name].mode for name in joined}
    for piece in pieces:
        assert {modes[name] for name in piece.domains} == {piece.mode}
    itinerary = reduced_itinerary(signature)
    assert is_closed_walk(itinerary, COULOMB)
    assert canonical_itinerary(itinerary, COULOMB) == itinerary


@given(walks())
def test_reducing_commutes_with_mirror_and_doubling(signature: Signature) -> None:
    itinerary = reduced_itinerary(signature)
    assert reduced_itinerary(signature.mirror()) == mirror_itinerary(itinerary, COULOMB)
    assert mirror_itinerary(mirror_itinerary(itinerary, COULOMB), COULOMB) == itinerary
    assert reduced_itinerary(signature.doubled()) == double(itinerary)
    assert signature.doubled().periods == 2 * signature.periods


@given(walks())
def test_swapping_a_stop_twice_changes_nothing(signature: Signature) -> None:
    itinerary = reduced_itinerary(signature)
    for joint in range(len(itinerary)):
        following = itinerary[(joint + 1) % len(itinerary)]
        here = COULOMB.mode_by_name[itinerary[joint][0]]
        if here.sliding or not COULOMB.mode_by_name[following[0]].sliding:
            continue
        try:
            swapped = swap_stops(itinerary, {joint: following[1]}, COULOMB)
        except NotationError:
            continue  # the slide cannot reverse into the direction in which the stick is left
        # the stick at the seam was itinerary[0]: its removal moves the joint
        moved = joint - 1 if joint == len(itinerary) - 1 else joint
        back = swap_stops(swapped, {moved: following[1]}, COULOMB)
        assert canonical_itinerary(back, COULOMB) == itinerary
