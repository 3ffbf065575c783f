"""Linear algebra of explorations in one thread, and the number of threads as before afterwards."""

from __future__ import annotations

import threading

import pytest

import contfric as cf
from contfric.base import one_thread as module
from contfric.base.one_thread import one_thread

control = module._control()


@pytest.mark.skipif(control is None, reason="numpy has another library here")
def test_one_thread_and_as_many_as_before() -> None:
    assert control is not None
    ask, tell = control
    kept = ask()
    tell(2)
    two = ask()  # 1 where there is one core
    try:
        with pytest.raises(ValueError, match="inside"), one_thread():
            with one_thread():
                assert ask() == 1
            assert ask() == 1  # the outer one is not done
            raise ValueError("inside")
        assert ask() == two
    finally:
        tell(kept)


@pytest.mark.skipif(control is None, reason="numpy has another library here")
def test_threads_that_overlap_give_the_number_back_once() -> None:
    assert control is not None
    ask, _ = control
    before, entered, leave = ask(), threading.Event(), threading.Event()

    def hold() -> None:
        with one_thread():
            entered.set()
            leave.wait(10.0)

    other = threading.Thread(target=hold)
    with one_thread():
        other.start()
        assert entered.wait(10.0)
    assert ask() == 1  # the other thread is inside yet
    leave.set()
    other.join()
    assert ask() == before


@pytest.mark.skipif(control is None, reason="numpy has another library here")
def test_explorations_are_done_in_one_thread() -> None:
    assert control is not None
    ask, seen = control[0], []
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    diagram = cf.explore(orbit, "Omega", (0.49, 0.51), progress=lambda text: seen.append(ask()))
    assert set(seen) == {1} and diagram.branches
