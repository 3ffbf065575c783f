"""``contfric signatures list|show|check``; each command returns its exit code."""

from __future__ import annotations

import argparse
import json
import sys

from contfric.cli.commands import say
from contfric.cli.exits import Exit
from contfric.errors import ContfricError, NotationError


def list_all(options: argparse.Namespace) -> int:
    """``contfric signatures list``."""
    from contfric.base.shown import aligned
    from contfric.signature import load_signature, signature_names

    rows = [["name", "model", "periods", "segments"]]
    for name in signature_names(options.model):
        try:
            signature = load_signature(name, options.model)
        except NotationError as error:
            say(f"skipped: {error}")
            continue
        rows.append([name, signature.model.name, str(signature.periods), str(signature)])
    print(*aligned(rows), sep="\n")
    return Exit.DONE


def show(options: argparse.Namespace) -> int:
    """``contfric signatures show NAME``."""
    from contfric.signature import load_signature

    signature = load_signature(options.name)
    lines = [
        f"name: {json.dumps(signature.name or str(signature), ensure_ascii=False)}",
        f"model: {signature.model.name}",
        f"periods: {signature.periods}",
        f"segments: {signature}",
    ]
    if signature.symmetric is not None:
        lines.append(f"symmetric: {str(signature.symmetric).lower()}")
    if signature.example:
        values = ", ".join(f"{name}: {value!r}" for name, value in signature.example.items())
        lines.append(f"example: {{{values}}}")
    print(*lines, sep="\n")
    return Exit.DONE


def check(options: argparse.Namespace) -> int:
    """``contfric signatures check FILE...``: every file is checked, also after a wrong one."""
    from contfric.signature.schema import read_signature

    wrong = 0
    for path in options.files:
        try:
            signature = read_signature(path)
        except ContfricError as error:
            wrong += 1
            print(f"contfric: error: {error}", file=sys.stderr)
        else:
            print(f"{path}: {signature.name}, {len(signature.segments)} segments: fine")
    return Exit.BAD_INPUT if wrong else Exit.DONE
