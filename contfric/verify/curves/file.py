"""A certificate file of any kind, read and checked."""

from __future__ import annotations

import json
from dataclasses import replace

from contfric.verify import file
from contfric.verify.curves.event import check_event
from contfric.verify.curves.tube import check_tube

CHECKS = {"event": check_event, **file.CHECKS, "tube": check_tube}


def check_text(text: str) -> file.Answer:
    """Check the text of a certificate file; of a diagram with tubes tell how many ends are open."""
    answer = file.check_text(text, CHECKS)
    if answer.yes and "tubes" in answer.statements[-1]:
        parts = json.loads(text)["checkable"]
        ends = [end for part in parts for end in part.get("ends", ())]
        answer = replace(answer, statements=(*answer.statements, f"{ends.count(None)} open ends"))
    return answer
