"""House rules that no linter has: a light import, short modules, no model named outside of models."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "contfric"
MODULES = sorted(PACKAGE.rglob("*.py"))
MAX_LINES = 400
#: Modules in one folder: more of them get folders of their own, by the questions that they answer.
MAX_MODULES = 25

#: Loaded by those functions that need them, never by `import contfric`.
HEAVY = (
    *("bokeh", "matplotlib", "mpmath", "networkx", "numba", "pandas", "pydantic", "scipy.optimize"),
    *("sympy", "yaml"),
)


def run_python(*args: str) -> subprocess.CompletedProcess[str]:
    """Run a Python process in the project folder and capture what it prints."""
    env = {**os.environ, "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}
    return subprocess.run(
        [sys.executable, *args], cwd=ROOT, env=env, capture_output=True, text=True, check=False
    )


def name_of(module: Path) -> str:
    return module.relative_to(ROOT).as_posix()


def test_import_is_light() -> None:
    code = f"import sys, contfric; print(*[m for m in {HEAVY!r} if m in sys.modules])"
    done = run_python("-c", code)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [], "`import contfric` loads what it may not need"


#: Where models and their flows are defined.
OF_MODELS = ("models", "flow")
#: States the equation that it checks: the checker of certificates shares no code with the models.
CHECKER = "verify"


def test_no_model_is_named_outside_of_models_and_flows() -> None:
    """Examples in docstrings, and the name of a default, need some model; nothing else does."""
    named = [
        f"{name_of(module)}: {line.strip()}"
        for module in MODULES
        if module.relative_to(PACKAGE).parts[0] not in (*OF_MODELS, CHECKER)
        for line in module.read_text(encoding="utf-8").splitlines()
        if not line.lstrip().startswith((">>>", "..."))
        and re.search("coulomb|lugre", line, re.IGNORECASE)
    ]
    assert not named


def test_modules_are_found() -> None:
    assert PACKAGE / "errors.py" in MODULES


def test_modules_are_short() -> None:
    lines = {
        name_of(module): len(module.read_text(encoding="utf-8").splitlines()) for module in MODULES
    }
    assert not {name: count for name, count in lines.items() if count >= MAX_LINES}, "split them"


def test_folders_are_short() -> None:
    counts = Counter(name_of(module.parent) for module in MODULES)
    assert not {name: count for name, count in counts.items() if count > MAX_MODULES}, "split them"
