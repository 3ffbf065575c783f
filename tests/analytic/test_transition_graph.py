"""The transition graph and the published signatures against Table 1 and section 2 of the paper."""

from __future__ import annotations

import pytest

from contfric.errors import NotationError
from contfric.models import load_model
from contfric.signature import (
    NEVER,
    is_closed_walk,
    load_signature,
    mirror_itinerary,
    parse_signature,
    reduce_signature,
    reduced_itinerary,
    successors,
    swap_stops,
    transition_graph,
)

COULOMB = load_model("coulomb")

UP, DOWN = ("slide+", "v"), ("slide-", "v")
HELD_HIGH, HELD_LOW = ("stick", "F+"), ("stick", "F-")
WORD_0S = (UP, DOWN)
WORD_1A = (UP, DOWN, HELD_LOW)
WORD_2S = (UP, HELD_HIGH, DOWN, HELD_LOW)

#: Section 2: where each domain leads. At rest with |u| > S0 the solution reverses.
PUBLISHED = {
    "x+v+": {"F+": "x0v+", "v": "x+v-"},
    "x0v+": {"F+": "x+v+", "F-": "x-v+", "v": "stick"},
    "x-v+": {"F-": "x0v+"},
    "x+v-": {"F+": "x0v-"},
    "x0v-": {"F+": "x+v-", "F-": "x-v-", "v": "stick"},
    "x-v-": {"F-": "x0v-", "v": "x-v+"},
    "stick": {"F+": "x+v-", "F-": "x-v+"},
}

#: name -> (segments, periods, sticks, reduced itinerary)
TYPES = {
    "2s": (6, 1, 2, WORD_2S),
    "2a": (6, 1, 2, WORD_2S),
    "0s": (6, 1, 0, WORD_0S),
    "1a": (6, 1, 1, WORD_1A),
    "2a, 14seg": (14, 2, 2, WORD_1A * 2),
    "1a, 9seg": (9, 1, 1, (UP, DOWN, UP, HELD_LOW)),
}


@pytest.mark.parametrize("domain", PUBLISHED)
def test_successors_are_those_of_the_paper(domain: str) -> None:
    assert successors(COULOMB, domain) == PUBLISHED[domain]


def test_graph_has_the_seven_domains_and_their_surfaces() -> None:
    graph = transition_graph(COULOMB)
    edges = {(a, data["surface"]): b for a, b, data in graph.edges(data=True)}
    assert edges == {(a, s): b for a, exits in PUBLISHED.items() for s, b in exits.items()}
    assert graph.nodes["stick"] == {"mode": "stick", "label": "stick"}
    assert graph.nodes["x0v+"]["mode"] == "slide+"


def test_unknown_domain_is_named() -> None:
    with pytest.raises(NotationError, match=r"no domain 'stik'; did you mean 'stick'"):
        successors(COULOMB, "stik")


@pytest.mark.parametrize("name", TYPES)
def test_published_types(name: str) -> None:
    segments, periods, stops, itinerary = TYPES[name]
    signature = load_signature(name)
    assert (len(signature.segments), signature.periods, signature.stops) == (
        segments,
        periods,
        stops,
    )
    assert signature.symmetric is (name[1] == "s")
    assert signature.auto_name(bool(signature.symmetric)) == name
    assert reduced_itinerary(signature) == itinerary


def test_same_orbit_type_written_from_another_segment() -> None:
    """Section 3.1 writes 1a from x+v+, section 3.2 from x0v+."""
    first = "x+v+ → x+v- → x0v- → x0v0 → x-v+ → x0v+"
    assert parse_signature(first, COULOMB) == load_signature("1a")


def test_symmetry_of_the_published_types() -> None:
    assert load_signature("2s").is_mirror_symmetric
    assert load_signature("0s").half() == ("x0v+", "x+v+", "x+v-")
    assert load_signature("2s").half() == ("x0v+", "stick", "x+v-")
    for name in ("1a", "2a, 14seg", "1a, 9seg"):
        assert not load_signature(name).is_mirror_symmetric
        assert load_signature(name).mirror() != load_signature(name)
    # the mirror image of a stop at x > 0 is one at x < 0
    assert mirror_itinerary(WORD_1A, COULOMB) == (UP, HELD_HIGH, DOWN)


def test_2s_and_2a_are_the_same_walk() -> None:
    assert load_signature("2s") == load_signature("2a")
    assert load_signature("2a").mirror() == load_signature("2a")


def test_labels_inside_a_slide_do_not_change_the_reduced_itinerary() -> None:
    """Event T: the slide of 1a that touches F- gains x-v- and x0v-."""
    plain = parse_signature("x0v+ -> stick -> x+v- -> x0v- -> stick -> x-v+", COULOMB)
    touched = "x0v+ -> stick -> x+v- -> x0v- -> x-v- -> x0v- -> stick -> x-v+"
    assert reduced_itinerary(parse_signature(touched, COULOMB)) == reduced_itinerary(plain)


def test_reduced_segments_of_1a() -> None:
    pieces = reduce_signature(load_signature("1a"))
    assert [piece.domains for piece in pieces] == [
        ("x-v+", "x0v+", "x+v+"),
        ("x+v-", "x0v-"),
        ("stick",),
    ]


def test_walk_of_one_mode_is_one_piece() -> None:
    pieces = reduce_signature(parse_signature("x0v+ -> x+v+", COULOMB))
    assert len(pieces) == 1
    assert set(pieces[0].domains) == {"x0v+", "x+v+"}
    assert pieces[0].pair == ("slide+", NEVER)
    assert is_closed_walk([pieces[0].pair], COULOMB)
    assert not is_closed_walk([("stick", NEVER)], COULOMB)
    assert mirror_itinerary((pieces[0].pair,), COULOMB) == (("slide-", NEVER),)


def test_crossing_sliding_connects_0s_1a_2s() -> None:
    """CS_s: 0s on one side; 1a, its mirror image and 2s on the other."""
    one = swap_stops(WORD_0S, {1: "F-"}, COULOMB)
    assert one == WORD_1A
    assert swap_stops(WORD_0S, {0: "F+"}, COULOMB) == mirror_itinerary(WORD_1A, COULOMB)
    assert swap_stops(one, {0: "F+"}, COULOMB) == WORD_2S
    assert swap_stops(WORD_0S, {0: "F+", 1: "F-"}, COULOMB) == WORD_2S
    assert swap_stops(WORD_2S, {0: "F+", 2: "F-"}, COULOMB) == WORD_0S


def test_stick_at_the_seam_is_removed() -> None:
    seam = (HELD_LOW, UP, HELD_HIGH, DOWN)
    assert swap_stops(seam, {3: "F-"}, COULOMB) == (UP, HELD_HIGH, DOWN)


@pytest.mark.parametrize(
    ("itinerary", "joint", "surface", "message"),
    [
        (WORD_0S, 0, "F-", "no stick that ends at F- fits between 'slide\\+' and 'slide-'"),
        (WORD_2S, 0, "F-", "ends at F\\+, not at F-"),
        (WORD_2S, 1, "F+", "does not end at a stop"),
        (WORD_2S, 9, "F+", "no joint 9"),
        (WORD_2S, 0, "F", "no surface 'F'"),
        ((UP, ("stick", "F-")), 0, "F-", "do not allow"),
        ((UP, HELD_HIGH), 0, "F+", "no closed walk"),
    ],
)
def test_impossible_edits(
    itinerary: tuple[tuple[str, str], ...], joint: int, surface: str, message: str
) -> None:
    with pytest.raises(NotationError, match=message):
        swap_stops(itinerary, {joint: surface}, COULOMB)


@pytest.mark.parametrize(
    "itinerary", [(), (("glide", "v"),), (("slide+", "G"),), (UP, UP), (DOWN, DOWN)]
)
def test_what_is_no_closed_walk(itinerary: tuple[tuple[str, str], ...]) -> None:
    assert not is_closed_walk(itinerary, COULOMB)
