"""House rules: a light import, the import contracts, documented and short modules."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

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


@pytest.mark.parametrize("module", MODULES, ids=name_of)
def test_no_model_is_named_outside_of_models_and_flows(module: Path) -> None:
    """Examples in docstrings, and the name of a default, need some model; nothing else does."""
    if module.relative_to(PACKAGE).parts[0] in (*OF_MODELS, CHECKER):
        return
    lines = module.read_text(encoding="utf-8").splitlines()
    code = [line for line in lines if not line.lstrip().startswith((">>>", "..."))]
    named = [line.strip() for line in code if re.search("coulomb|lugre", line, re.IGNORECASE)]
    assert not named, named


def test_modules_are_found() -> None:
    assert PACKAGE / "errors.py" in MODULES


@pytest.mark.parametrize("module", MODULES, ids=name_of)
def test_module_has_docstring(module: Path) -> None:
    docstring = ast.get_docstring(ast.parse(module.read_text(encoding="utf-8")))
    assert docstring, f"{name_of(module)} does not say what it is"


@pytest.mark.parametrize("module", MODULES, ids=name_of)
def test_module_is_short(module: Path) -> None:
    lines = len(module.read_text(encoding="utf-8").splitlines())
    assert lines < MAX_LINES, f"{name_of(module)} has {lines} lines: split it"
