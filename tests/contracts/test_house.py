"""House rules: a light import, the import contracts, documented and short modules."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "contfric"
MODULES = sorted(PACKAGE.rglob("*.py"))
MAX_LINES = 400

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


def test_import_contracts_hold() -> None:
    code = "from importlinter.cli import lint_imports_command as run; run()"
    done = run_python("-c", code, "--no-cache")
    assert done.returncode == 0, done.stdout + done.stderr


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


def test_modules_have_docstrings() -> None:
    silent = [
        name_of(module)
        for module in MODULES
        if not ast.get_docstring(ast.parse(module.read_text(encoding="utf-8")))
    ]
    assert not silent, "they do not say what they are"


def test_modules_are_short() -> None:
    lines = {
        name_of(module): len(module.read_text(encoding="utf-8").splitlines()) for module in MODULES
    }
    assert not {name: count for name, count in lines.items() if count >= MAX_LINES}, "split them"
