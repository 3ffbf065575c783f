"""Which violated margins of a step are located, where several are."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from contfric.continuation.locating import sliding


@pytest.mark.parametrize(
    ("lost", "last", "asked"),
    [
        (True, 1.0, [0]),  # positive where Newton's method fails: it fails for that one, too
        (True, np.inf, [0]),
        (True, -1e-3, [0, 1]),  # it vanishes before
        (False, -1e-3, [0, 1]),
    ],
)
def test_a_margin_is_not_sought_where_trials_are_lost(
    monkeypatch: pytest.MonkeyPatch, lost: bool, last: float, asked: list[int]
) -> None:
    found: list[int] = []

    def locate(orbit: Any, before: Any, after: Any, settings: Any, kind: int, k: int) -> Any:
        found.append(k)
        tests = np.array([1e-9, last]) if k == 0 else np.array([1e-3, 0.0])
        return SimpleNamespace(arc=0.3 - 0.1 * k, lost=lost and k == 0, tests=tests)

    monkeypatch.setattr(sliding, "locate_change", locate)
    margins = tuple(SimpleNamespace(margin=None) for _ in range(2))
    orbit: Any = SimpleNamespace(system=SimpleNamespace(tests=margins))
    before, after = (SimpleNamespace(tests=np.array(x)) for x in ([1.0, 1.0], [-2.0, -1.0]))
    first = sliding._first_located(orbit, before, after, None)  # type: ignore[arg-type]
    assert found == asked and first is not None and first[0] == asked[-1]
