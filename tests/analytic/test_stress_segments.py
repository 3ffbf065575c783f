"""Single segments against fifty digits: the short form of benchmarks/stress/segments.py."""

from __future__ import annotations

import pytest

pytest.importorskip("flint")
import segment_flow
import segments
from report import Report, Tally
from segment_cases import draw_graze, draw_root


@pytest.fixture(scope="module")
def report() -> Report:
    return segments.run(70, seed=3)


def test_every_check_passes(report: Report) -> None:
    assert not report.failed, report.failed


def test_every_kind_is_tried(report: Report) -> None:
    kinds = {"state", *(f"derivative by {name}" for name in segment_flow.COLUMNS)}
    kinds |= {"first root of u", "first root of v", "first root of u, tangent"}
    kinds |= {"first root of v, double", "stationary points of u", "stationary points of v"}
    assert kinds <= set(report.tried)
    assert min(report.tried[kind] for kind in kinds) >= 10


def failures(check, case) -> int:
    tally = Tally()
    check(case, tally)
    return len(tally.failed)


def test_a_wrong_first_root_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Missed, invented, or late by 1e-9."""
    cases = [c for c in (draw_root(3, k) for k in range(40)) if c.c == 1]
    assert sum(failures(segments.check_hit, case) for case in cases) == 0
    hit = segments.hit
    for wrong in (lambda tau: -1.0, lambda tau: 0.5 * tau, lambda tau: tau + 1e-9):
        monkeypatch.setattr(segments, "hit", lambda *a, wrong=wrong: wrong(hit(*a)))
        seen = sum(failures(segments.check_hit, case) for case in cases)
        assert seen >= len(cases) // 2


def test_a_missed_or_invented_stationary_point_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    cases = [c for c in (draw_graze(3, k) for k in range(60)) if c is not None]
    found = segments.stationary_times
    for wrong in (lambda times: times[1:], lambda times: [*times, 0.5 * times[0]]):
        several = [case for case in cases if len(found(case)) > 1]
        with monkeypatch.context() as patch:
            patch.setattr(segments, "stationary_times", lambda c, wrong=wrong: wrong(found(c)))
            seen = sum(failures(segments.check_turning, case) for case in several)
        assert several and seen > 0.5 * len(several)  # but for the grazes themselves
