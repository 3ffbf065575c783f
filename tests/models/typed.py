"""Models that tests write as a user does: by the text of their file."""

from __future__ import annotations

from pathlib import Path

import contfric as cf


def typed(folder: Path, text: str) -> cf.Model:
    """Return a model from the text of its file."""
    path = folder / "model.yaml"
    path.write_text(text, encoding="utf-8")
    return cf.load_model(path)
