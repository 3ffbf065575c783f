"""A diagram does not depend on where it was started, and its indices balance.

Random scenes in all five parameters (``benchmarks/stress/restarts.py`` draws them, and says which classes
are degenerate), and the scenes whose diagrams once differed.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
import restarts
from report import Tally

import contfric as cf
from contfric.atlas.completeness.verification import differences
from contfric.events.incident.conditions import possible, relation_of
from contfric.events.incident.incident import incident_forms
from contfric.events.incident.sequences import count, lengths, necklaces
from contfric.orbit.index import index_at_infinity, index_of, opening_sign

#: Of the first 66 scenes of seed 7: those that are cut at 60 branches, so that nothing is held against
#: anything, and the three largest ones (33 to 60 branches), three quarters of the time of all.
CUT, LARGE = (12, 51, 54), (23, 33, 52)
#: The other 60, in parts that processes divide among themselves.
SHARES = {
    **{
        f"{start}-{end - 1}": [k for k in range(start, end) if k not in (*CUT, *LARGE)]
        for start, end in ((0, 15), (15, 30), (30, 45), (45, 66))
    },
    "large": list(LARGE),
}
EQUAL_MAXIMA = "a hold is left where its load has an equal maximum, which is no event"
#: Scenes that gave different diagrams from different starts: S, S0, Omega, zeta, h; what varies, its range.
CAUGHT = {
    "a one-hold bridge met a symmetric pair": (
        {"Omega": 0.31, "S": 0.06, "S0": 0.18, "h": 0.0, "zeta": 0.06},
        "h",
        (-0.15026364205774628, 0.11978325412211589),
    ),
    "a restart from a bridge lost PD": (
        {
            "Omega": 0.28518652907865744,
            "S": 0.016843376032476123,
            "S0": 0.0854840441104789,
            "h": 0.0,
            "zeta": 0.010074902253449593,
        },
        "S0",
        (0.05235108330322144, 0.10748913795236487),
    ),
    "a fold just after a touch of rest was overshot, a branch of two periods arrived late": (
        {
            "Omega": 0.12784125417014755,
            "S": 0.020945700324858936,
            "S0": 0.04634510276660679,
            "h": 0.04157323245145339,
            "zeta": 0.004829303425705549,
        },
        "zeta",
        (-0.0524787394622068, 0.07329936289463754),
    ),
    "the symmetric bridge was not found from the asymmetric one that crosses its fold": (
        {
            "Omega": 0.13870175018603437,
            "S": 0.05997546520205335,
            "S0": 0.4265967581702046,
            "h": -0.47423794965322696,
            "zeta": 0.06418157867620426,
        },
        "h",
        (-0.6142997405765306, -0.41986921609223227),
    ),
    "a regular branch of two points between two SS, 3e-8 of the range wide": (
        {
            "Omega": 0.456335871020349,
            "S": 0.018941530492988287,
            "S0": 0.02293698700719782,
            "h": 0.35854040045793123,
            "zeta": 0.07183180275484914,
        },
        "Omega",
        (0.4082753582408252, 0.5198415555197237),
    ),
    "a doubled branch is 5e-10 of the range wide, between a doubling and a crossing that is known to 6e-9": (
        {"Omega": 0.27913139027746076, "S": 0.047032795367651294, "S0": 0.1946105906990455},
        "h",
        (-0.038285131522884853, 0.08811813294417477),
    ),
    "what leaves an event changes the parameter by the square of the distance, by rounding in short steps": (
        {
            "Omega": 0.0962982025516357,
            "S": 0.04368564349816659,
            "S0": 0.0457320716739423,
            "h": -0.10168439555447883,
            "zeta": 1.133909093793713e-05,
        },
        "zeta",
        (-0.03761426489112284, 0.04014072549999835),
    ),
    EQUAL_MAXIMA: (
        {
            "Omega": 0.08480765440122788,
            "S": 0.15705218456394032,
            "S0": 0.21671017753854144,
            "h": -0.15446417988348338,
            "zeta": 0.0014557001118207622,
        },
        "h",
        (-0.212482322652623, -0.08062492770669732),
    ),
    "a step off an event went to a symmetric branch that ends 2e-6 of the range away": (
        {"Omega": 1.0 / 3.0, "S": 0.05, "S0": 0.06, "zeta": 0.0},
        "h",
        (-0.05, 0.15),
    ),
    "the stop of a hold depends on its length twice": (
        {"Omega": 0.43, "S": 0.17605, "S0": 0.219291},
        "Omega",
        (0.42, 0.44),
    ),
}


@pytest.mark.parametrize("name", CAUGHT)
def test_the_same_from_every_branch(name: str) -> None:
    params, vary, bounds = CAUGHT[name]
    diagram = cf.explore(cf.find_orbit("coulomb", params), vary, bounds)
    assert diagram.verified is None
    found = diagram.verify(restarts=4)
    assert found.passed, str(found)
    assert diagram.verified
    assert len(found.restarts) >= 3
    assert sum(b.below is not None for b in found.balances) >= 2


def test_the_first_point_at_an_event_that_another_curve_crosses_is_admissible() -> None:
    """Of an asymmetric bridge from a symmetric event stops are known to 5e-7: it is singular there."""
    params = {
        "Omega": 0.16742068370826402,
        "S": 0.07384486161575685,
        "S0": 0.08595331380687442,
        "h": 0.18445708029357755,
        "zeta": 1e-9,
    }
    bounds = (0.14973615465637774, 0.17677309246138423)
    diagram = cf.explore(cf.find_orbit("coulomb", params), "Omega", bounds)
    points = [orbit for b in diagram.branches if not b.mirrored for orbit in b]
    assert [orbit.violations() for orbit in points if not orbit.admissible] == []


def test_what_leaves_where_no_first_point_is_found_at_the_event_itself() -> None:
    """A slide of no length at an AS: the equations were singular there from one start only."""
    params = {
        "Omega": 0.31242610984038927,
        "S": 0.08102347855961815,
        "S0": 0.1864180921912119,
        "h": 0.041746373454093044,
        "zeta": 1e-9,
    }
    bounds = (0.0005565498964693605, 0.18542434685558723)
    diagram = cf.explore(cf.find_orbit("coulomb", params), "h", bounds)
    bridge = next(b for b in diagram.branches if b.name == "0s, 16seg, 2hold")
    again = cf.explore(bridge[len(bridge) // 2], "h", bounds, max_step=0.0031)
    assert list(differences(diagram, again)) == list(differences(again, diagram)) == []


def test_a_margin_that_vanishes_all_along_gives_no_accuracy() -> None:
    """A load with equal maxima touches its limit twice: the event is where the slide after it vanishes."""
    params, vary, bounds = CAUGHT[EQUAL_MAXIMA]
    diagram = cf.explore(cf.find_orbit("coulomb", params), vary, bounds)
    (event,) = (b for b in diagram.of_kind("AS") if abs(b.params["h"] + 0.136152696511) < 1e-9)
    assert len(event.tests) > 1
    assert event.accuracy < 1e-9


def test_a_start_that_is_symmetric_but_for_rounding_is_a_symmetric_branch() -> None:
    """With damping 1e-9 at Omega = 1/2 a multiplier is 1 - 1e-8, and the asymmetry rounding over that."""
    params = {"Omega": 0.5, "S": 0.0439970781077225, "S0": 0.058912052048617, "zeta": 1e-9}
    diagram = cf.explore(cf.find_orbit("coulomb", params), "Omega", (0.45, 0.54))
    (branch,) = diagram.branches
    assert branch.system.half


@pytest.mark.parametrize("share", SHARES)
def test_random_scenes(share: str) -> None:
    """No difference outside of the degenerate classes; most scenes have something to restart."""
    tally, scenes = Tally(), SHARES[share]
    for index in scenes:
        tally.index = index
        restarts.one_scene(tally, restarts.scene(7, index), most=1, branches=60)
    assert not tally.failed, tally.failed
    assert tally.counts["restarts"] > 2 * len(scenes) // 3
    assert tally.counts["balances"] > len(scenes) // 2


def test_a_sum_tells_of_another_component() -> None:
    """Between the ends of the window of a fold that no event joins: the sum is not that of the whole."""
    params = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
    diagram = cf.explore(cf.find_orbit("coulomb", params), "Omega", (0.4, 0.6))
    whole = diagram.verify(restarts=0)
    assert whole.sums
    assert not whole.missing
    part = cf.explore(cf.find_orbit("coulomb", params), "Omega", (0.4, 0.6), bridges=False)
    assert not part.verify(restarts=0).sums  # without bridges nothing adds up, and nothing is asked


@pytest.mark.parametrize("refused", [1, 3])
def test_a_restart_that_cannot_start_is_told(refused: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """It starts elsewhere on the branch; where it can start nowhere, that is what differs, and no error."""
    module = import_module("contfric.atlas.explore")  # the package has a function of that name
    params = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
    diagram = cf.explore(cf.find_orbit("coulomb", params), "Omega", (0.45, 0.56))
    explore, asked = module.explore, []

    def sometimes(start: cf.Orbit, *args: object, **kwargs: object) -> cf.Diagram:
        asked.append(start.params["Omega"])
        if len(asked) <= refused:
            raise cf.ConvergenceError("singular there", start)
        return explore(start, *args, **kwargs)

    monkeypatch.setattr(module, "explore", sometimes)
    found = diagram.verify(restarts=1)
    assert len(found.restarts) == 1
    assert found.same is (refused == 1)
    assert len(set(asked)) == len(asked) == min(refused + 1, 3)
    if refused == 3:
        assert "without any continuation: singular there" in str(found)


# ------------------------------------------------------------------------------------ sequences


@pytest.mark.parametrize("letters", [1, 2, 3, 4])
@pytest.mark.parametrize("length", range(1, 7))
def test_necklaces(letters: int, length: int) -> None:
    """As many as Moebius counts; aperiodic, each in its least rotation, no two the same up to rotation."""
    found = list(necklaces(letters, length))
    assert len(found) == count(letters, length)
    rotations = [{w[k:] + w[:k] for k in range(length)} for w in found]
    assert all(
        len(turned) == length and min(turned) == w
        for turned, w in zip(rotations, found, strict=True)
    )
    assert len(set().union(*rotations)) == length * len(found) if found else True


def test_lengths_of_a_symmetric_motion() -> None:
    assert lengths(1, True, 4) == [1, 2, 3, 4, 6, 8]
    assert lengths(3, True, 2) == [1, 2]


# ------------------------------------------------------------------------- indices and conditions


@pytest.mark.parametrize("seed", range(8))
def test_the_index_of_a_regular_orbit_is_that_of_its_multipliers(seed: int) -> None:
    """``sign det(I - M)`` from the pencil's multipliers, and the product over several turns."""
    rng = np.random.default_rng(seed)
    params = {"Omega": rng.uniform(0.3, 0.8), "S": 0.2, "S0": rng.uniform(0.21, 0.4)}
    orbit = cf.find_orbit("coulomb", params, longest=1000)
    for times in (1, 2, 3):
        wanted = np.sign(np.real(np.prod(1.0 - orbit.multipliers**times)))
        assert index_of(orbit, times) == wanted
    wanted = np.sign(np.real(np.prod(1.0 + orbit.turn_multipliers)))
    assert opening_sign(orbit) == wanted


def test_index_at_infinity() -> None:
    """With the closed form of the linear oscillator: det(I - exp(A T)) = 1 - 2 e^-a cos b + e^-2a."""
    model = cf.load_model("coulomb")
    for zeta, omega in ((0.0, 0.4), (0.1, 0.7), (-0.05, 0.3)):
        vector = model.vector({"Omega": omega, "S": 0.1, "S0": 0.2, "zeta": zeta})
        period = 2.0 * np.pi / omega
        a, b = zeta * period, np.sqrt(1.0 - zeta**2) * period
        wanted = np.sign(1.0 - 2.0 * np.exp(-a) * np.cos(b) + np.exp(-2.0 * a))
        assert index_at_infinity(model, vector) == wanted
    assert index_at_infinity(cf.load_model("belt"), cf.load_model("belt").vector({})) is None


def test_local_conditions_agree_with_what_is_solved() -> None:
    """Where the conditions say that a form exists on a side, its branch leaves to that side."""
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    diagram = cf.explore(orbit, "Omega", (0.4, 0.6))
    active, checked = orbit.model.index_of("Omega"), 0
    for event in diagram.events:
        b = event.bifurcation
        if b.kind.value not in ("SS", "CS", "AS", "GS"):
            continue
        incident = incident_forms(b)
        relations = [relation_of(f, active, incident.least) for f in incident.forms]
        assert all(r is not None for r in relations)
        sides = possible(
            [r for r in relations if r is not None], [(k,) for k in range(len(relations))]
        )
        leaving = set()
        for i in event.branches:
            branch = diagram.branches[i]
            at = (
                0
                if branch.ends[0].bifurcation is b
                or abs(branch.values[0] - b.params["Omega"]) < 1e-9
                else -1
            )
            beside = branch.values[1 if at == 0 else -2]
            leaving.add(bool(beside > b.params["Omega"]))
        told = {above for below, above in sides if below != above}
        assert told <= leaving
        checked += len(told)
    assert checked >= 4


# ---------------------------------------------------------------------------- kept and in studies


def test_a_study_verifies_and_keeps_it(tmp_path: Path) -> None:
    text = (
        "title: verified\nmodel: coulomb\nparams: {Omega: 0.5, S: 0.32, S0: 0.4}\nstart: simulate\n"
        "explore: {parameter: Omega, range: [0.48, 0.55], copies: 1, verify: true}\n"
    )
    path = tmp_path / "study.yaml"
    path.write_text(text, encoding="utf-8")
    result = cf.run_study(path, out=tmp_path / "out")
    loaded = cf.load(tmp_path / "out" / "diagram.npz")
    assert isinstance(loaded, cf.Diagram)
    assert loaded.verified is True
    assert loaded.settings == cf.load(tmp_path / "out" / "diagram.npz").settings
    assert loaded.settings.copies == 1
    assert loaded.verification is not None
    assert str(loaded.verification) in "\n".join(result.info["verification"])


def test_a_start_of_a_longer_period_raises_it() -> None:
    params = {"Omega": 0.31, "S": 0.06, "S0": 0.18, "zeta": 0.06, "h": -0.093}
    orbit = cf.find_orbit("coulomb", params)
    assert orbit.periods == 3
    diagram = cf.explore(orbit, "h", (-0.0935, -0.0925), max_periods=1)
    assert diagram.settings.max_periods == diagram.settings.copies == 3
    assert any("max_periods raised to 3" in note for note in diagram.notes)
