"""Holds: their notation, the edits that put them into itineraries, and the equations of orbits with them."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import contfric as cf
from contfric.bvp.linear import assembled, jacobian_blocks, tangent_of
from contfric.continuation.singular_points.vertices import passed_vertex
from contfric.errors import NotationError
from contfric.events.incident.unit import form_of, pieces, unit_of
from contfric.models import load_model
from contfric.orbit.measured.samples import state_within
from contfric.signature import (
    canonical_itinerary,
    double,
    is_closed_walk,
    mirror_itinerary,
    parse_signature,
    reduced_itinerary,
)
from contfric.signature.edits import Edit, apply_edit, concatenate, drop, insert, split
from contfric.signature.holds import TOUCH, departing_mode, hold_at, is_hold, without_holds

COULOMB = load_model("coulomb")
#: The three kinds: after a stop on a surface (SS), a touch of rest (GS), a touch of the limit (AS).
WITH_HOLD = {
    "SS": "x-v+ -> x0v+ -> x+v+ -> hold@F+ -> x0v- -> x+v- -> x0v- -> stick",
    "GS": "x-v+ -> x0v+ -> hold@touch -> x0v+ -> x+v+ -> x+v- -> x0v- -> stick",
    "AS": "x-v+ -> x0v+ -> stick -> hold@touch -> x0v- -> stick",
}
each_kind = pytest.mark.parametrize("kind", WITH_HOLD)


# -------------------------------------------------------------------------------- notation


@each_kind
def test_notation_round_trip(kind: str) -> None:
    signature = parse_signature(WITH_HOLD[kind], COULOMB)
    assert str(signature) == WITH_HOLD[kind]
    assert parse_signature(str(signature), COULOMB) == signature
    assert parse_signature(WITH_HOLD[kind].replace("->", "→"), COULOMB) == signature
    assert signature.holds == 1
    assert signature.auto_name(False).endswith("1hold")
    for k in range(len(signature.segments)):
        turned = signature.rotate(k)
        assert turned == signature and hash(turned) == hash(signature)
        assert canonical_itinerary(reduced_itinerary(turned), COULOMB) == canonical_itinerary(
            reduced_itinerary(signature), COULOMB
        )


@each_kind
def test_mirror_of_a_hold(kind: str) -> None:
    signature = parse_signature(WITH_HOLD[kind], COULOMB)
    image = signature.mirror()
    assert image != signature
    assert image.mirror() == signature
    assert ("hold@F-" in image.segments) == (kind == "SS")
    assert (TOUCH in image.segments) == (kind != "SS")
    assert reduced_itinerary(image) == mirror_itinerary(reduced_itinerary(signature), COULOMB)


def test_two_mirrored_holds_are_symmetric() -> None:
    half = "x0v- -> x-v- -> hold@F-", "x0v+ -> x+v+ -> hold@F+"
    signature = parse_signature(" -> ".join(half), COULOMB, symmetric=True)
    assert signature.is_mirror_symmetric
    assert signature.auto_name(True) == "0s, 4seg, 2hold"
    assert not signature.doubled().is_mirror_symmetric


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x+v+ -> hold@F+ -> x+v-", "'hold@F+' leads to x0v-, not to x+v-"),
        (
            "x0v- -> x-v- -> hold@v -> x0v+ -> stick",
            "model 'coulomb' has no 'hold@v'; a hold is one of",
        ),
        (
            "x0v+ -> x+v+ -> hold@G -> x0v- -> stick",
            "has no 'hold@G'; a hold is one of hold@touch, hold@F+",
        ),
        ("x0v+ -> x+v+ -> hold@F+ -> hold@F+ -> x0v-", "must stand between two domains"),
        ("x-v+ -> x0v+ -> x+v+ -> hold@F+ -> x0v+ -> stick", "segment 4: "),
        ("x0v+ -> hold@F- -> x0v- -> stick", "segment 2: "),
    ],
)
def test_faults_say_what_is_wrong(text: str, message: str) -> None:
    with pytest.raises(NotationError) as error:
        parse_signature(text, COULOMB)
    assert message in str(error.value)


# ----------------------------------------------------------------------------------- edits


@st.composite
def itineraries(draw: st.DrawFn) -> tuple[tuple[str, str], ...]:
    """A closed itinerary of the oscillator: each stop is a reversal or a stick that goes on either way."""
    segments: list[tuple[str, str]] = []
    direction = "+"
    for _ in range(draw(st.integers(1, 6))):
        segments.append((f"slide{direction}", "v"))
        following = draw(st.sampled_from("+-"))
        if following == direction or draw(st.booleans()):  # a slide can only go on after a stick
            segments.append(("stick", "F-" if following == "+" else "F+"))
        direction = following
    if direction == "-":
        segments += [("slide-", "v"), ("stick", "F-")]
    assume(is_closed_walk(tuple(segments), COULOMB))
    return tuple(segments)


def reversals(itinerary: tuple[tuple[str, str], ...]) -> list[int]:
    return [
        i
        for i, (mode, _) in enumerate(itinerary)
        if mode != "stick" and itinerary[(i + 1) % len(itinerary)][0] not in ("stick", mode)
    ]


def held(itinerary: tuple[tuple[str, str], ...], i: int) -> Edit:
    """A hold at the reversal behind slide i."""
    return insert(i, ("stick", hold_at("F+" if itinerary[i][0] == "slide+" else "F-")))


def same(one: object, other: object) -> bool:
    return canonical_itinerary(one, COULOMB) == canonical_itinerary(other, COULOMB)  # type: ignore[arg-type]


@given(itineraries(), st.data())
def test_edits_stay_closed_walks_and_can_be_undone(itinerary, data) -> None:  # type: ignore[no-untyped-def]
    places = reversals(itinerary)
    assume(places)
    chosen = data.draw(st.lists(st.sampled_from(places), min_size=1, unique=True))
    edit = Edit()
    for i in chosen:
        edit |= held(itinerary, i)
    edited = apply_edit(itinerary, edit, COULOMB)
    assert len(edited) == len(itinerary) + len(chosen)
    assert is_closed_walk(edited, COULOMB)
    assert is_closed_walk(double(edited), COULOMB)
    assert is_closed_walk(concatenate(edited, edited, edited), COULOMB)
    assert is_closed_walk(mirror_itinerary(edited, COULOMB), COULOMB)
    assert same(mirror_itinerary(mirror_itinerary(edited, COULOMB), COULOMB), edited)
    holds = [i for i, (_, exit_) in enumerate(edited) if is_hold(exit_)]
    assert len(holds) == len(chosen)
    assert apply_edit(edited, drop(*holds), COULOMB) == itinerary
    regular = without_holds(edited, COULOMB)
    assert not any(is_hold(exit_) for _, exit_ in regular)
    assert is_closed_walk(regular, COULOMB)
    for i in holds:  # the slide that follows goes where the hold says
        assert edited[(i + 1) % len(edited)][0] == departing_mode(COULOMB, edited[i - 1], edited[i])


@given(itineraries(), st.data())
def test_a_slide_and_a_stick_can_be_split_at_a_touch(itinerary, data) -> None:  # type: ignore[no-untyped-def]
    i = data.draw(st.integers(0, len(itinerary) - 1))
    mode, exit_ = itinerary[i]
    if mode == "stick":
        edited = apply_edit(itinerary, split(i, exit_, ("stick", TOUCH)), COULOMB)
    else:
        edited = apply_edit(itinerary, split(i, "v", ("stick", TOUCH), (mode, exit_)), COULOMB)
    assert is_closed_walk(double(edited), COULOMB)
    k = next(k for k, pair in enumerate(edited) if pair[1] == TOUCH)
    if mode == "stick":
        assert apply_edit(edited, drop(k), COULOMB) == itinerary
    else:
        joined = Edit(frozenset({k, (k + 1) % len(edited)}), {k - 1: exit_})
        assert apply_edit(edited, joined, COULOMB) == itinerary


@given(itineraries(), st.data())
def test_what_the_graph_forbids_is_refused(itinerary, data) -> None:  # type: ignore[no-untyped-def]
    places = reversals(itinerary)
    assume(places)
    i = data.draw(st.sampled_from(places))
    other = "F-" if itinerary[i][0] == "slide+" else "F+"
    with pytest.raises(NotationError, match="two edits change segment"):
        held(itinerary, i) | held(itinerary, i)
    with pytest.raises(NotationError, match="cannot become"):
        apply_edit(
            itinerary, insert(i, ("stick", other)), COULOMB
        )  # released to where it came from


# ------------------------------------------------------------------------------- equations


@cache
def grazing() -> cf.Diagram:
    """SS, AS and GS bridges; one of them ends where the slide after its hold vanishes."""
    params = {"Omega": 0.5, "S": 0.3, "S0": 0.4, "h": 0.28}
    return cf.explore(cf.find_orbit("coulomb", params), "h", (0.2385, 0.3))


def bridges() -> list[cf.Branch]:
    return [b for b in grazing().branches if b.bridge and not b.mirrored]


def residuals(orbit: cf.Orbit, joints: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """The equations as the engine has them (its right-hand side is minus the residual)."""
    from contfric.bvp.blocks import linearise

    count, m = joints.shape
    workspace = np.empty((count, m, m)), np.empty((count, m, m)), np.empty((count, m, len(vector)))
    right = np.empty((count, m, 1))
    system = orbit.system
    at = system.functions(), system.layout, joints, vector, np.arange(len(vector))
    linearise(*at, 1, *workspace, right, np.empty((m, m)))
    return -right.ravel()


def short_slides() -> list[cf.Orbit]:
    """Orbits of bridges in which a slide after a hold is short, and its exit row is a mean rate."""
    found = []
    for branch in bridges():
        for orbit in branch:
            durations = np.roll(orbit.ends[:, 0] - orbit.cycle[:, 0], -1)
            if min(durations[h.segment] for h in orbit.system.holds) < 0.09:
                found.append(orbit)
    return found


def test_there_are_short_slides() -> None:
    lengths = [
        orbit.ends[h.segment + 1, 0] - orbit.cycle[h.segment + 1, 0]
        for orbit in short_slides()
        for h in orbit.system.holds
    ]
    assert len(lengths) >= 5
    assert min(lengths) < 1e-4
    assert max(lengths) > 1e-2


@pytest.mark.parametrize("short", [True, False])
def test_jacobian_against_differences(short: bool) -> None:
    orbits = short_slides() if short else [b[len(b) // 2] for b in bridges()]
    assert orbits
    for orbit in orbits:
        z, p = orbit.joints, orbit.vector
        exact = assembled(orbit.system, z, p)
        step = 1e-5  # error of a central difference: step^2 and 1e-16 / step
        for j in range(z.size):
            move = np.zeros(z.size)
            move[j] = step
            move = move.reshape(z.shape)
            slope = (residuals(orbit, z + move, p) - residuals(orbit, z - move, p)) / (2.0 * step)
            assert np.allclose(slope, exact[:, j], rtol=0, atol=3e-8), (orbit, j)
        _, _, c, _ = jacobian_blocks(orbit.system, z, p, range(len(p)))
        for j in range(len(p)):
            move = np.zeros(len(p))
            move[j] = step
            slope = (residuals(orbit, z, p + move) - residuals(orbit, z, p - move)) / (2.0 * step)
            scale = max(1.0, float(np.max(np.abs(slope))))
            assert np.allclose(slope, c[:, :, j].ravel(), rtol=0, atol=3e-6 * scale), (orbit, j)


def test_the_mean_rate_row_is_the_exit_row_divided_by_the_duration() -> None:
    """v(d) / d by the closed form, where d is long enough for it not to cancel."""
    tried = 0
    for orbit in short_slides():
        for hold in orbit.system.holds:
            i = hold.segment + 1
            m = orbit.joints.shape[1]
            duration = orbit.ends[i, 0] - orbit.cycle[i, 0]
            if not 1e-3 < duration < 0.09 or i + 1 >= len(orbit.joints):
                continue
            tried += 1
            joints = orbit.joints.copy()
            joints[i + 1, 0] += 0.25 * duration  # no orbit any more: the slide is too long
            velocity = state_within(orbit, i, 1.25 * duration)[1]
            row = residuals(orbit, joints, orbit.vector).reshape(-1, m)[i, m - 1]
            assert abs(row) > 1e-8
            assert row == pytest.approx(velocity / (1.25 * duration), abs=1e-12)
    assert tried


@pytest.mark.parametrize("index", range(2))
def test_tangent_of_is_the_direction_of_the_branch(index: int) -> None:
    branch = bridges()[index]
    active = branch.model.index_of(branch.parameter)
    k = len(branch) // 2
    orbit = branch[k]
    tangent, slope = tangent_of(orbit.system, orbit.joints, orbit.vector, active)
    _, _, c, _ = jacobian_blocks(orbit.system, orbit.joints, orbit.vector, (active,))
    left = assembled(orbit.system, orbit.joints, orbit.vector) @ tangent.ravel()
    size = np.hypot(np.linalg.norm(tangent), slope)
    assert np.linalg.norm(left + slope * c.ravel()) < 1e-11 * size
    chord = np.append(
        (branch.joints[k + 1] - branch.joints[k - 1]).ravel(),
        branch.values[k + 1] - branch.values[k - 1],
    )
    along = np.append(tangent.ravel(), slope)
    cosine = abs(along @ chord) / np.linalg.norm(along) / np.linalg.norm(chord)
    assert cosine > 0.99


# -------------------------------------------------------- shorter orbits, leapt vertices


@pytest.mark.parametrize("index", range(2))
def test_the_unit_of_a_doubled_orbit_is_that_of_the_orbit(index: int) -> None:
    branch = bridges()[index]
    orbit = branch[len(branch) // 2]
    unit, doubled = unit_of(orbit.as_whole()), unit_of(orbit.doubled())
    assert unit.periods == doubled.periods == orbit.periods
    assert unit.half == doubled.half == orbit.symmetric
    twice, still = orbit.doubled(), np.zeros(len(orbit.itinerary) * 2)
    copies = pieces(twice, doubled)
    assert len(copies) == (4 if orbit.symmetric else 2)
    for copy in copies:
        again = form_of(twice, still, doubled, copy, "").orbit.as_whole()
        assert same(again.itinerary, orbit.itinerary)
        assert np.allclose(np.sort(again.stops), np.sort(orbit.stops), rtol=0, atol=1e-12)


def test_passed_vertex_finds_the_step() -> None:
    """Points of a branch that goes through its symmetric orbit: the odd part changes sign."""
    found = cf.explore(
        cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4}), "Omega", (0.4, 0.6)
    )
    branch = next(b for b in found.branches if b.name == "2a" and not b.mirrored)
    assert branch.ends[1].reason is cf.EndReason.BP
    joints, image = branch.joints[-6], np.diag([1.0, -1.0, -1.0])
    shift = np.array([0.5 * branch[-6].period, 0.0, 0.0])
    n = len(joints) // 2
    middle = np.concatenate(
        [
            0.5 * (joints[:n] + (joints[n:] - shift) @ image),
            0.5 * (joints[n:] + joints[:n] @ image + shift),
        ]
    )
    odd = joints - middle
    points = np.array([middle + a * odd for a in (2.0, 1.0, -3.0, -4.0)])
    passed = passed_vertex(branch.system, points)
    assert passed is not None
    assert passed[0] == 1
    assert passed[1] == pytest.approx(0.25)
    assert passed_vertex(branch.system, points[:2]) is None
    assert passed_vertex(branch.system, branch.joints[:-1]) is None


# ---------------------------------------------------------------------- orbits with holds


@pytest.mark.parametrize("index", range(2))
def test_saved_and_loaded(index: int, tmp_path: Path) -> None:
    branch = bridges()[index]
    orbit = branch[len(branch) // 2]
    cf.save(orbit, tmp_path / "orbit.npz")
    again = cf.load(tmp_path / "orbit.npz")
    assert again.signature == orbit.signature
    assert again.signature.holds == orbit.signature.holds > 0
    assert again.system.itinerary == orbit.system.itinerary and again.periods == orbit.periods
    assert again.system.holds == orbit.system.holds
    assert np.array_equal(again.joints, orbit.joints)
    assert np.array_equal(again.margins, orbit.margins)


def test_a_diagram_with_bridges_saved_and_loaded(tmp_path: Path) -> None:
    found = grazing()
    cf.save(found, tmp_path / "diagram.npz")
    again = cf.load(tmp_path / "diagram.npz")
    assert [b.bridge for b in again.branches] == [b.bridge for b in found.branches]
    assert [b.name for b in again.branches] == [b.name for b in found.branches]
    for one, other in zip(found.bifurcations, again.bifurcations, strict=True):
        assert [str(p) for p in one.proposals] == [str(p) for p in other.proposals]


def test_an_orbit_with_a_hold_is_unstable_and_has_a_table() -> None:
    for branch in bridges():
        orbit = branch[len(branch) // 2]
        assert np.all(np.isinf(orbit.multipliers))
        assert orbit.stable is False
        assert orbit.admissible and orbit.converged
        table = orbit.to_dataframe()
        assert list(table) == ["t", "x", "v", "domain"]
        assert set(table["domain"]) <= {d.name for d in COULOMB.domains}
        hold = orbit.system.holds[0].segment
        start, end = orbit.cycle[hold, 0], orbit.ends[hold, 0]
        during = table[(table["t"] > start) & (table["t"] < end)]
        assert len(during) and set(during["domain"]) == {"stick"} and not during["v"].any()
        points = branch.to_dataframe()
        assert len(points) == len(branch) and not points["stable"].any()


@pytest.mark.parametrize("index", range(2))
def test_mirror_image_of_an_orbit_with_a_hold(index: int) -> None:
    branch = bridges()[index]
    orbit = branch[len(branch) // 2]
    image = orbit.mirror()
    assert image.signature == orbit.signature.mirror()
    finite = np.isfinite(orbit.margins)
    assert np.max(np.abs(residuals(image, image.joints, image.vector))) < 1e-11
    assert np.allclose(np.sort(image.margins[finite]), np.sort(orbit.margins[finite]), atol=1e-9)
