"""Kernels and helpers: helpers are parts of kernels, and nothing by themselves."""

from __future__ import annotations

import ast
import logging
import math
import os
import subprocess
import sys
from fnmatch import fnmatch
from pathlib import Path

import numba
import numpy as np
import pytest
import yaml
from numba.core import config

import contfric as cf
from contfric.cli.progress import compiling_shown
from contfric.compiled import allocating_helper, f8, helper, kernel
from contfric.compiling import announced
from contfric.compiling.inlined import part_options
from contfric.models.generated import build
from contfric.models.reading.describe import describe
from contfric.shipping import ahead
from contfric.shipping.ahead import every_kernel

PACKAGE = Path(cf.__file__).parent
MODELS = Path(__file__).parents[1] / "models"


@helper
def square(x):
    return x * x


@helper
def fourth(x):
    return square(square(x))


@allocating_helper
def total(n, x):
    values = np.empty(n)
    for i in range(n):
        values[i] = fourth(x) + i
    return values.sum()


def twice(x):
    """Stand for an entry point."""
    return 2.0 * total(3, x) + math.sqrt(square(x))


@pytest.fixture
def fresh_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("CONTFRIC_CACHE_DIR", str(tmp_path))
    return tmp_path


def test_a_kernel_contains_its_helpers(fresh_cache):
    first, second = kernel(f8(f8))(twice), kernel(f8(f8))(twice)
    assert first(1.5) == 2.0 * (3 * 1.5**4 + 3) + 1.5
    assert any(fresh_cache.rglob("*.kernel"))
    assert second(1.5) == first(1.5)  # this one is loaded
    assert sum(second.dispatcher.stats.cache_hits.values()) == 1


def test_a_loaded_kernel_imports_no_module_of_the_functions_inside(fresh_cache):
    """Numba keeps an environment for each of them, and with it the name of a module."""
    assert kernel(f8(f8))(twice)(1.5) == kernel(f8(f8))(twice)(1.5)
    loaded = kernel(f8(f8))(twice).dispatcher
    assert sum(loaded.stats.cache_hits.values()) == 1
    (result,) = loaded.overloads.values()
    assert result.referenced_envs == ()


def test_a_loaded_kernel_cannot_be_linked_into_other_code(fresh_cache):
    """It has no code for that: linked, it would do nothing."""
    assert kernel(f8(f8))(twice)(1.5) == kernel(f8(f8))(twice)(1.5)
    loaded = kernel(f8(f8))(twice).dispatcher
    assert sum(loaded.stats.cache_hits.values()) == 1
    with pytest.raises(Exception, match="unfit for linking"):
        numba.njit(f8(f8))(lambda x: loaded(x) + 1.0)


@pytest.mark.parametrize("told", [{"CPU_NAME": "generic"}, {"CPU_FEATURES": "-avx2"}], ids=str)
def test_what_is_compiled_for_another_processor_does_not_count(fresh_cache, monkeypatch, told):
    here = kernel(f8(f8))(twice)
    value = here(1.5)
    files = sorted(fresh_cache.rglob("*.kernel"))
    assert [here.kept()] == files
    for name, text in told.items():
        monkeypatch.setattr(config, name, text)
    assert kernel(f8(f8))(twice).kept() is None
    monkeypatch.undo()
    monkeypatch.setenv("CONTFRIC_CACHE_DIR", str(fresh_cache))
    assert sorted(fresh_cache.rglob("*.kernel")) == files  # and nothing was thrown away
    again = kernel(f8(f8))(twice)
    assert again.kept() and again(1.5) == value
    assert sum(again.dispatcher.stats.cache_hits.values()) == 1


def test_what_is_compiled_is_logged_and_what_is_loaded_is_not(fresh_cache, caplog):
    caplog.set_level(logging.INFO, logger="contfric")
    assert kernel(f8(f8))(twice)(1.0) == kernel(f8(f8))(twice)(1.0)  # compiled, loaded
    begin, end = caplog.records
    assert begin.getMessage().startswith(f"compiling {twice.__module__}.twice, once: about ")
    assert end.getMessage().startswith(f"compiled {twice.__module__}.twice: ")
    assert end.seconds > 0.0


def test_a_terminal_shows_what_is_compiled(fresh_cache, monkeypatch, capsys):
    name = f"{twice.__module__}.twice"
    kernel(f8(f8))(twice)(1.0)
    assert capsys.readouterr().err == ""  # a library is silent by itself
    for quiet, lines in ((True, 0), (False, 1)):
        monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
        next(fresh_cache.rglob("*.kernel")).unlink()
        with compiling_shown(quiet=quiet):
            kernel(f8(f8))(twice)(1.0)
        shown = capsys.readouterr().err
        assert shown.count(f"compiling {name}, once") == lines
        assert shown.endswith("\r\x1b[K" if lines else "")
    assert logging.getLogger("contfric").handlers == []


def test_helpers_are_not_compiled_by_themselves(fresh_cache):
    assert part_options(), (
        "numba has changed: helpers are compiled in its own way, in twice the time"
    )
    kernel(f8(f8))(twice).dispatcher  # noqa: B018 (compiles)
    for part in (square, fourth, total):
        (result,) = part.dispatcher.overloads.values()
        assert result.library.get_pointer_to_function(result.fndesc.mangled_name) == 0


def garbled(content, rng):
    """Return bytes with some in the middle changed."""
    damaged = bytearray(content)
    for place in rng.integers(0, len(content), size=8):
        damaged[place] ^= int(rng.integers(1, 256))
    return bytes(damaged)


DAMAGE = {
    "emptied": lambda content, rng: b"",
    "cut": lambda content, rng: content[: int(rng.integers(1, len(content)))],
    "garbled": garbled,
    "garbled again": garbled,
    "of something else": lambda content, rng: b"\x80\x04\x95 no pickle",
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_file_of_the_cache_is_compiled_again(fresh_cache, damage):
    rng = np.random.default_rng(len(damage))
    value = kernel(f8(f8))(twice)(1.5)
    (path,) = fresh_cache.rglob("*.kernel")
    path.write_bytes(DAMAGE[damage](path.read_bytes(), rng))
    again, later = kernel(f8(f8))(twice), kernel(f8(f8))(twice)
    assert again(1.5) == later(1.5) == value
    assert not again.dispatcher.stats.cache_hits
    assert sum(later.dispatcher.stats.cache_hits.values()) == 1  # mended for good


@pytest.mark.parametrize("suffix", [".py", ".name"])
@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_module_of_a_model_is_generated_again(fresh_cache, damage, suffix, monkeypatch):
    from contfric.models.reading.files import read_model

    definition = read_model(MODELS / "bilinear.yaml").definition
    text = build._generated(definition, "x")
    asked = []
    monkeypatch.setattr(build, "_generated", lambda *arguments: asked.append(1) or text)
    path = build.module_path.__wrapped__(definition)
    path.unlink()
    asked.clear()
    assert build.module_path.__wrapped__(definition) == path
    assert build.module_path.__wrapped__(definition) == path
    assert len(asked) == 1
    for file in (p for p in fresh_cache.rglob("*") if p.suffix == suffix):
        file.write_bytes(DAMAGE[damage](file.read_bytes(), np.random.default_rng(len(damage))))
    assert build.module_path.__wrapped__(definition) == path
    assert len(asked) == 2
    assert callable(build._imported.__wrapped__(path).compiled_flow)


@pytest.mark.parametrize("damage", [*DAMAGE, "removed"])
def test_a_module_that_is_damaged_after_it_was_looked_for_is_generated_again(fresh_cache, damage):
    data = yaml.safe_load((MODELS / "bilinear.yaml").read_text(encoding="utf-8"))
    field = {**data["field"], "v": f"{data['field']['v']} + 0*{len(damage)}*x"}  # its own module
    definition = describe({**data, "field": field}).motion
    path = build.module_path(definition)
    if damage == "removed":
        path.unlink()
    else:
        path.write_bytes(DAMAGE[damage](path.read_bytes(), np.random.default_rng(1)))
    assert callable(build.load_module(definition).compiled_flow)
    assert build.module_path(definition) == path


def test_a_model_by_another_name_is_not_compiled_again():
    data = yaml.safe_load((MODELS / "bilinear.yaml").read_text(encoding="utf-8"))
    other = {**data, "name": "mine", "title": "My own", "references": ["a thesis"]}
    assert describe(other).text != describe(data).text
    assert build.module_path(describe(other).motion) == build.module_path(describe(data).motion)
    faster = {**data, "field": {**data["field"], "v": f"2*({data['field']['v']})"}}
    assert describe(faster).motion != describe(data).motion


def test_a_damaged_cache_is_mended_in_a_run_from_the_shell(tmp_path):
    """The whole way, in processes of their own: kernels of a file that has nothing next to it."""
    source = "from contfric.compiled import f8, kernel\n\n\n@kernel(f8(f8))\ndef f(x):\n    return 3 * x\n"
    (tmp_path / "tiny.py").write_text(source)
    cache = tmp_path / "cache"
    environment = {**os.environ, "CONTFRIC_CACHE_DIR": str(cache)}
    code = "import tiny; print(tiny.f(2.0), sum(tiny.f.dispatcher.stats.cache_hits.values()))"
    command = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(tmp_path)!r}); {code}"]

    def printed():
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        return done.stdout.strip()

    assert printed() == "6.0 0"
    for path in [p for p in cache.rglob("*") if p.is_file()]:
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    assert printed() == "6.0 0"
    assert printed() == "6.0 1"


def test_the_time_that_a_kernel_will_take_is_that_of_the_last_time(fresh_cache, caplog):
    caplog.set_level(logging.INFO, logger="contfric")
    name = f"{twice.__module__}.twice"
    assert announced.expected([name]) == announced.OTHER  # nothing is known of it
    kernel(f8(f8))(twice)(1.0)
    (_, end) = caplog.records
    assert announced.expected([name]) == pytest.approx(end.seconds, abs=0.01)
    assert announced.expected([name, name]) == pytest.approx(2 * end.seconds, abs=0.02)


def test_a_slower_machine_multiplies_the_times_of_the_table(fresh_cache):
    (slow, taken), (other, there), *_ = announced.SECONDS.items()
    announced._keep(slow, 3.0 * taken)
    assert announced.expected([slow]) == pytest.approx(3.0 * taken, abs=0.01)
    assert announced.expected([other]) == pytest.approx(3.0 * there, rel=0.01)
    announced._keep("contfric_model_0123abcd.field", 7.0)  # that of one model tells of others
    assert announced.expected(["contfric_model_4567.field"]) == 7.0
    (file,) = fresh_cache.iterdir()
    file.write_text("[1, 2")
    assert announced.expected([other]) == there


def test_every_time_of_the_table_is_of_a_kernel():
    assert announced.SECONDS.keys() <= every_kernel().keys()


def test_every_group_that_is_compiled_in_one_process_has_kernels():
    short = [name.removeprefix("contfric.") for name in every_kernel()]
    for patterns in ahead.GROUPS:
        for pattern in patterns:
            of_models = pattern.startswith("contfric_model_")
            assert of_models or any(fnmatch(name, f"{pattern}*") for name in short), pattern


def _returned(function: ast.FunctionDef) -> set[str]:
    """Return the names of what is called for a value that a function returns, alone or in a tuple."""
    values = [n.value for n in ast.walk(function) if isinstance(n, ast.Return) and n.value]
    parts = [p for v in values for p in (v.elts if isinstance(v, ast.Tuple) else [v])]
    return {p.func.id for p in parts if isinstance(p, ast.Call) and isinstance(p.func, ast.Name)}


def _called(function: ast.FunctionDef) -> set[str]:
    calls = [n.func for n in ast.walk(function) if isinstance(n, ast.Call)]
    return {called.id for called in calls if isinstance(called, ast.Name)}


def test_what_counts_references_calls_no_helper_that_hands_back_arrays():
    """A helper does not count them: numba would free arrays of a workspace that are in use."""
    arrays, helpers, counting = set(), {}, {}
    texts = ((path, path.read_text(encoding="utf-8")) for path in PACKAGE.rglob("*.py"))
    for path, text in texts:
        if not any(mark in text for mark in ("NamedTuple", "helper", "@kernel(")):
            continue
        for node in ast.parse(text).body:
            if isinstance(node, ast.ClassDef) and "NamedTuple" in map(ast.unparse, node.bases):
                arrays |= {node.name} if "Array" in ast.unparse(node) else set()
            if isinstance(node, ast.FunctionDef):
                marks = [ast.unparse(mark) for mark in node.decorator_list]
                if {"helper", "inlined_helper"} & set(marks):
                    helpers[path, node.name] = node
                elif any(m == "allocating_helper" or m.startswith("kernel(") for m in marks):
                    counting[path, node.name] = node, any("counts=False" in m for m in marks)
    handing: set[str] = set()
    while (
        more := {n for (_, n), h in helpers.items() if _returned(h) & (arrays | handing)} - handing
    ):
        handing |= more
    assert "system_in" in handing
    assert len(counting) > 10
    for (path, name), (function, without) in counting.items():
        wrong = {k for k in _called(function) & handing if not _is_own(path, k, helpers, arrays)}
        assert without or not wrong, f"{name} of {path.name} has to leave {wrong} to a helper"


def _is_own(path, name, helpers, arrays):
    """Tell whether a name is that of another helper, one of the same module that hands nothing back."""
    return (path, name) in helpers and not _returned(helpers[path, name]) & arrays
