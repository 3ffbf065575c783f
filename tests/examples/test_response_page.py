"""The code of the page on sweeps, return maps and basins runs, and says what the page says."""

from __future__ import annotations

from pages import blocks, run, text_of


def test_the_page_runs() -> None:
    assert len(blocks(text_of("response"))) == 5
    shares = [share.share for share in run("response")["found"].shares]
    assert len(shares) == 3 and abs(sum(shares) - 1.0) < 1e-12
