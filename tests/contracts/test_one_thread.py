"""Linear algebra of explorations in one thread, and the number of threads as before afterwards."""

from __future__ import annotations

import threading

import pytest

import contfric as cf
from contfric.base.one_thread import libraries, one_thread


def threads() -> int:
    """Return how many threads linear algebra has now."""
    return max(library["num_threads"] for library in libraries().info())


needs_library = pytest.mark.skipif(
    not libraries().select(user_api="blas").info(), reason="numpy has another library here"
)


@needs_library
def test_one_thread_and_as_many_as_before() -> None:
    with libraries().limit(limits=2, user_api="blas"):
        two = threads()  # 1 where there is one core
        with pytest.raises(ValueError, match="inside"), one_thread():
            with one_thread():
                assert threads() == 1
            assert threads() == 1  # the outer one is not done
            raise ValueError("inside")
        assert threads() == two


@needs_library
def test_threads_that_overlap_give_the_number_back() -> None:
    before, entered, leave = threads(), threading.Event(), threading.Event()

    def hold() -> None:
        with one_thread():
            entered.set()
            leave.wait(10.0)

    other = threading.Thread(target=hold)
    with one_thread():
        other.start()
        assert entered.wait(10.0)
        assert threads() == 1
    leave.set()
    other.join()
    assert threads() == before


@needs_library
def test_explorations_are_done_in_one_thread() -> None:
    seen: list[int] = []
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    diagram = cf.explore(orbit, "Omega", (0.49, 0.51), progress=lambda text: seen.append(threads()))
    assert set(seen) == {1} and diagram.branches
