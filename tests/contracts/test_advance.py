"""What is computed in advance on another core: asked for once, the same bits, the same counts, Ctrl-C."""

from __future__ import annotations

import _thread
import threading
import time
from collections import deque
from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.collect import Event
from contfric.atlas.leaving import departures
from contfric.atlas.leaving.departures import foresee_departures
from contfric.base.tally import Counts, counts, tally
from contfric.events.bifurcation import Kind
from contfric.remember import advance
from contfric.remember.advance import foresee, foreseeable, heed, in_advance

CALLS: list[tuple[int, str]] = []


@foreseeable(without=("told",))
def square(number: int, told: bool = False) -> int:
    CALLS.append((number, threading.current_thread().name))
    time.sleep(0.05)
    tally()[0] += number
    if number < 0:
        raise ValueError("negative")
    return number * number


@foreseeable()
def endless(number: int) -> str:
    try:
        while True:
            heed()
            time.sleep(0.01)
    except KeyboardInterrupt:
        return f"{number}, cut short"


@pytest.fixture(autouse=True)
def at_once(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(advance, "_PATIENCE", -1.0)
    monkeypatch.setattr(advance, "processors", lambda: 2)
    CALLS.clear()
    yield


def begun(number: int) -> None:
    """Begin a call, and wait until it is at work."""
    assert foresee(square, number)
    until = time.monotonic() + 10.0
    while not CALLS and time.monotonic() < until:
        time.sleep(0.001)
    assert CALLS


def solves() -> int:
    return counts().newton_solves


def test_a_call_that_was_begun_is_not_made_again() -> None:
    before = solves()
    with in_advance():
        begun(7)
        assert square(7, told=True) == 49
    assert len(CALLS) == 1 and CALLS[0][1].startswith("contfric-advance")
    assert solves() - before == 7


def test_what_nobody_asks_for_counts_nothing() -> None:
    before = solves()
    with in_advance():
        begun(5)
        assert square(3) == 9
    assert solves() - before == 3


def test_what_is_being_computed_is_not_begun() -> None:
    with in_advance():
        assert square(4) == 16
        assert foresee(square, 4)
    assert [(4, threading.current_thread().name)] == CALLS


@foreseeable()
def twice(number: int) -> int:
    return square(number) + square(number)


def test_a_call_made_twice_in_advance_is_made_twice() -> None:
    with in_advance():
        assert foresee(twice, 3)
        time.sleep(0.3)
        assert twice(3) == 18
    assert len(CALLS) == 2


def test_what_follows_from_a_call_that_is_wanted_is_left_to_who_wants_it() -> None:
    def both() -> None:
        square(square(2))

    with in_advance():
        assert square(2) == 4
        assert foresee(both)
        time.sleep(0.2)
    assert [number for number, _ in CALLS] == [2]


def test_of_events_in_pairs_the_first_are_begun(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Event] = []
    monkeypatch.setattr(
        departures, "foresee", lambda begin, state, event: asked.append(event) or True
    )
    kinds = [Kind.PD] * 5 + [Kind.BP]
    events = [Event(SimpleNamespace(kind=kind), [0]) for kind in kinds]  # type: ignore[arg-type]
    waiting = deque(events)
    while waiting:
        followed = waiting.popleft()
        foresee_departures(SimpleNamespace(waiting=waiting), followed)  # type: ignore[arg-type]
    assert [events.index(e) for e in asked] == [2, 4, 5]


def test_an_error_is_that_of_the_call_itself() -> None:
    with in_advance():
        begun(-2)
        with pytest.raises(ValueError, match="negative"):
            square(-2)
    assert len(CALLS) == 2


def test_no_more_is_begun_than_one_that_waits() -> None:
    with in_advance():
        assert [foresee(endless, k) for k in range(4)] == [True, True, False, False]
    with pytest.raises(AssertionError):
        begun(1)  # outside of a block nothing is


def test_ctrl_c_ends_what_is_waited_for_as_it_would_end_it_here() -> None:
    with in_advance():
        assert foresee(endless, 1)
        time.sleep(0.2)
        timer = threading.Timer(0.3, _thread.interrupt_main)
        timer.start()
        assert endless(1) == "1, cut short"


def test_nothing_is_begun_on_one_core(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(advance, "processors", lambda: 1)
    with in_advance():
        assert not foresee(square, 2)


def explored(
    model: str, params: dict[str, float], parameter: str, bounds: tuple[float, float]
) -> cf.Diagram:
    return cf.explore(cf.find_orbit(model, params), parameter, bounds)


SCENES = [
    ("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4}, "Omega", (0.4, 0.6)),
    ("popp", {"omega": 1.72, "F": 0.1}, "omega", (1.6, 1.9)),
    ("impact", {}, "A", (0.01, 1.0)),
]


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene[0])
def test_a_diagram_is_the_same_to_the_last_bit(
    scene: tuple[str, dict[str, float], str, tuple[float, float]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found: list[tuple[cf.Diagram, Counts]] = []
    for cores in (1, 2):
        monkeypatch.setattr(advance, "processors", lambda cores=cores: cores)
        before = counts()
        found.append((explored(*scene), counts() - before))
    (alone, its_counts), (beside, counts_beside) = found
    assert counts_beside == its_counts
    assert len(alone.branches) == len(beside.branches) > 1
    for a, b in zip(alone.branches, beside.branches, strict=True):
        assert np.array_equal(a.joints, b.joints) and np.array_equal(a.values, b.values)
        assert [e.kind for e in a.bifurcations] == [e.kind for e in b.bifurcations]


def test_a_task_among_many_begins_nothing_in_advance() -> None:
    from contfric.remember import advance

    with advance.cores_are_busy(), advance.in_advance():
        assert advance._HERE.get() is None
        assert not advance.foresee(lambda: None)
    with advance.in_advance(), advance.cores_are_busy():
        assert advance._HERE.get() is None
    assert not advance._BESIDE.get()
