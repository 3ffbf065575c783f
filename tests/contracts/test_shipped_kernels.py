"""Kernels that come with the wheel: used where they fit, and nowhere else."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict

import pytest

from contfric import compiled
from contfric.base.sources import kernels_digest
from contfric.cli import main
from contfric.compiled import f8, kernel
from contfric.compiling import targets
from contfric.compiling.kept import file_name
from contfric.compiling.targets import shipped_target
from contfric.shipping import shipped

pytestmark = pytest.mark.skipif(
    shipped_target() is None, reason="this processor cannot run what a wheel carries"
)


def thrice(x):
    """Stand for an entry point."""
    return 3.0 * x


@pytest.fixture
def wheel(tmp_path, monkeypatch):
    """Return the folder of a wheel's kernels with the code of one kernel; the cache is empty."""
    folder = tmp_path / "wheel"
    monkeypatch.setenv("CONTFRIC_CACHE_DIR", str(folder))
    first = kernel(f8(f8))(thrice)
    first(1.0)
    here = first.kept()
    here.rename(here.with_name(file_name(thrice, f8(f8), shipped_target())))
    monkeypatch.setenv("CONTFRIC_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(compiled, "SHIPPED_KERNELS", folder)
    monkeypatch.setattr(shipped, "SHIPPED_KERNELS", folder)
    return folder


def kernels_in(folder):
    return sorted(folder.rglob("*.kernel"))


def hits(used):
    return sum(used.dispatcher.stats.cache_hits.values())


def test_a_shipped_kernel_is_loaded_and_nothing_is_written(wheel, tmp_path):
    used = kernel(f8(f8))(thrice)
    assert [used.kept()] == kernels_in(wheel)
    assert used(1.5) == 4.5
    assert hits(used) == 1
    assert not (tmp_path / "cache").exists()


@pytest.mark.parametrize(
    "damage", [lambda b: b"", lambda b: b[:-9], lambda b: b[:99] + b"x" + b[100:]]
)
def test_a_damaged_shipped_kernel_is_compiled_into_the_cache(wheel, tmp_path, damage):
    (file,) = kernels_in(wheel)
    file.write_bytes(content := damage(file.read_bytes()))
    used, later = kernel(f8(f8))(thrice), kernel(f8(f8))(thrice)
    assert used(1.5) == later(1.5) == 4.5
    assert (hits(used), hits(later)) == (0, 1)
    assert [later.kept()] == kernels_in(tmp_path / "cache")
    assert file.read_bytes() == content  # what is installed is left as it is


@pytest.mark.parametrize("told", [{"CPU_NAME": "generic"}, {"CPU_FEATURES": "-avx2"}], ids=str)
def test_shipped_kernels_are_not_used_where_numba_is_told_of_another_processor(
    wheel, monkeypatch, told
):
    for name, text in told.items():
        monkeypatch.setattr(targets.config, name, text)
    assert shipped_target() is None
    assert kernel(f8(f8))(thrice).kept() is None


def test_shipped_kernels_are_not_used_on_a_processor_without_a_feature(wheel, monkeypatch):
    every = targets.get_host_cpu_features()
    for feature in targets.baseline().features:
        monkeypatch.setattr(
            targets, "get_host_cpu_features", lambda f=feature: every.replace(f"+{f},", f"-{f},")
        )
        targets._shipped_target.cache_clear()
        assert shipped_target() is None, feature
    monkeypatch.undo()
    targets._shipped_target.cache_clear()
    assert shipped_target() is not None


def test_the_environment_for_the_baseline_makes_what_is_shipped(monkeypatch):
    told = targets.environment_of(targets.baseline())
    here = shipped_target()
    monkeypatch.setattr(targets.config, "CPU_NAME", told["NUMBA_CPU_NAME"])
    monkeypatch.setattr(targets.config, "CPU_FEATURES", told["NUMBA_CPU_FEATURES"])
    assert targets.target() == here


def test_the_doctor_says_what_came_with_the_wheel(wheel, capsys):
    def said():
        assert main(["doctor"]) == 0
        return capsys.readouterr().out

    assert "no kernels came with this installation" in said()
    facts = {**asdict(shipped_target()), "sources": kernels_digest(), "kernels": 1}
    (wheel / "target.json").write_text(json.dumps(facts))
    assert f"1 kernels for {facts['processor']}, used\n" in said()
    (wheel / "target.json").write_text(json.dumps({**facts, "numba": "0.1"}))
    assert f"not used: numba is {facts['numba']}, not 0.1\n" in said()


def test_a_pattern_that_no_kernel_has_is_refused(monkeypatch, wheel):
    monkeypatch.setattr(shipped, "models_kernels", dict)
    with pytest.raises(
        SystemExit, match=r"no kernel is called contfric\.orbits\.\*: names are such"
    ):
        shipped.make(["contfric.orbits.*"])


class Heard:
    """Stands for hatchling's application."""

    def __init__(self):
        self.said = []

    def display_info(self, text):
        self.said.append(text)

    display_warning = display_info


@pytest.mark.parametrize("without", ["the choice", "numba"])
def test_a_wheel_without_kernels_is_a_pure_one_and_says_so(monkeypatch, tmp_path, without):
    from contfric.shipping import build_hook

    if without == "numba":
        monkeypatch.delitem(sys.modules, "contfric.compiling.targets")
        monkeypatch.setitem(sys.modules, "numba", None)
    else:
        monkeypatch.setenv("CONTFRIC_WHEEL_KERNELS", "none")
    root, app = build_hook.Path(build_hook.__file__).parents[1], Heard()
    hook = build_hook.KernelsHook(str(root), {}, None, None, str(tmp_path), "wheel", app)
    before = {"force_include": {}, "pure_python": True, "infer_tag": False}
    data = {**before, "force_include": {}}
    hook.initialize("standard", data)
    assert data == before
    assert len(app.said) == 1
    assert "a pure wheel" in app.said[0]
    assert without == "the choice" or "make wheel" in app.said[0]
