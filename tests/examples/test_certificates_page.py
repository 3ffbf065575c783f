"""The page on proofs: its code runs, and its numbers are those of the proofs."""

from __future__ import annotations

import re
from typing import Any

import pytest
from pages import run, text_of

from contfric.certify.files import verify

TEXT = text_of("certificates")


@pytest.fixture(scope="module")
def scope() -> dict[str, Any]:
    return run("certificates")


def test_what_the_page_proves(scope: dict[str, Any]) -> None:
    assert scope["certificate"].proved
    assert scope["proof"].proved
    assert scope["proof"].radius < 1e-30


@pytest.mark.parametrize("file", ["path", "law_file"])
def test_its_files_are_verified(scope: dict[str, Any], file: str) -> None:
    answer = verify(scope[file])
    assert answer.yes
    assert f"yes: {', '.join(answer.statements)} ({answer.bits} bits)" in TEXT


def test_its_digits_are_those_of_the_proof(scope: dict[str, Any]) -> None:
    digits = re.search(r"The fold of 1a in Fig. 5 is at Omega = ([\d.]+?)\.\.\.", TEXT)
    assert digits is not None
    value = scope["proof"].value.str(60, more=True)
    assert value.strip("[]").startswith(digits[1])


def test_the_certificate_is_printed_as_on_the_page(scope: dict[str, Any]) -> None:
    shown = TEXT.split("```text\n")[1].split("```")[0].splitlines()
    own = str(scope["certificate"]).splitlines()
    # radii and enclosures are rounding; all else is the same
    assert [line[:20] for line in shown] == [line[:20] for line in own]
