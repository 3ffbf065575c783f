"""Pages of the documentation: their code is run, their tables and the scripts that wrote them are read."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import matplotlib

matplotlib.use("Agg")
ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"


def text_of(name: str) -> str:
    """Return the text of a page, by its name below docs without the suffix."""
    return (DOCS / f"{name}.md").read_text(encoding="utf-8")


def blocks(text: str, language: str = "python") -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def run(name: str) -> dict[str, Any]:
    """Run the code of a page, block after block as a reader would type it; return its names."""
    scope: dict[str, Any] = {}
    found = blocks(text_of(name))
    assert found
    for block in found:
        exec(compile(block, f"docs/{name}.md", "exec"), scope)
    return scope


def part(text: str, marker: str) -> str:
    """Return what stands on a page between a marker and the end of its part."""
    found = re.search(rf"<!-- {marker} -->\n(.*?)\n?<!-- end -->", text, re.DOTALL)
    assert found is not None
    return found[1]


def table(text: str, marker: str) -> list[list[str]]:
    """Return the rows of the table after a marker, without its head."""
    rows = part(text, marker).splitlines()[2:]
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]


def script(path: str) -> ModuleType:
    """Import a script of the documentation."""
    spec = importlib.util.spec_from_file_location(Path(path).stem + "_script", DOCS / path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module
