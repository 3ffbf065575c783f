"""``contfric verify FILE``: the independent check of a certificate."""

from __future__ import annotations

import argparse

from contfric.cli.exits import Exit


def verify(options: argparse.Namespace) -> int:
    """Print yes or no, with what was checked or what does not hold; the exit code is 0 or 1."""
    from contfric.base.extras import need_flint

    need_flint()
    from contfric.certify.diagram_certificate import UNCHECKED
    from contfric.certify.files import left_out
    from contfric.certify.files import verify as check

    answer = check(options.file)
    if answer.yes:
        print(f"yes: {', '.join(answer.statements)} ({answer.bits} bits)")
        if any(text.endswith("open ends") for text in answer.statements):
            print(f"not checked: {UNCHECKED}")
        for text in left_out(options.file):
            print(f"not in the file: {_plain(text)}")
        return Exit.DONE
    print(f"no: {_plain(answer.why)}")
    return Exit.FAILED


def _plain(text: str) -> str:
    """Return a text of the file as one line: control characters could overwrite the answer."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
