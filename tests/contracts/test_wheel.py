"""What is installed is enough: the wheel, without the checkout, runs the bundled study."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from contfric.compiling.targets import shipped_target

ROOT = Path(__file__).parents[2]
#: Kernels that come with the wheel of these tests: those of the models, and some of the engine.
SHIPPED = (
    "contfric_model_*.functions",
    *("contfric.flow.oscillator.flow.period", "contfric.flow.oscillator.flow.level"),
    "contfric.orbit.measured.extent.extent",
)


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder that the wheel, and nothing else of this checkout, is installed in."""
    folder = tmp_path_factory.mktemp("wheel")
    environment = {**os.environ, "CONTFRIC_WHEEL_KERNELS": " ".join(SHIPPED)}
    for step in (
        ["wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", str(folder), str(ROOT)],
        ["install", "--no-deps", "--no-index", "--target", str(folder / "site"), "--find-links"],
    ):
        command = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", *step]
        if step[0] == "install":
            command += [str(folder), "contfric"]
        subprocess.run(
            command, check=True, cwd=folder, env=environment, capture_output=True, timeout=600
        )
    return folder / "site"


def run_installed(installed: Path, code: str, cache: Path) -> str:
    """Run code with what is installed, in a folder of its own; return what it prints."""
    empty = installed.parent / "empty"
    empty.mkdir(exist_ok=True)
    done = subprocess.run(
        check=True,
        args=[sys.executable, "-P" if sys.version_info >= (3, 11) else "-B", "-c", code],
        cwd=empty,
        env={**os.environ, "PYTHONPATH": str(installed), "CONTFRIC_CACHE_DIR": str(cache)},
        capture_output=True,
        text=True,
        timeout=300,
    )
    return done.stdout


@pytest.mark.slow
def test_wheel_runs_fig05_from_an_empty_folder(installed: Path, tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    code = (
        "import contfric, sys; from contfric.cli import main;print(contfric.__file__, "
        "file=sys.stderr);sys.exit(main(['run', 'fig05', '--out', 'results']))"
    )
    done = subprocess.run(
        check=False,
        args=[sys.executable, "-P" if sys.version_info >= (3, 11) else "-B", "-c", code],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=600,  # compiles the kernels: their cache belongs to the place of the files
    )
    assert done.returncode == 0, done.stderr
    assert str(installed) in done.stderr
    written = {path.name for path in (tmp_path / "results").iterdir()}
    assert {"points.csv", "bifurcations.csv", "diagram.npz", "run.json", "diagram.png"} <= written
    table = (tmp_path / "results" / "bifurcations.csv").read_text()
    assert "SN" in table
    assert "BP" in table


def test_wheel_ships_models_signatures_and_studies(installed: Path) -> None:
    data = installed / "contfric" / "_data"
    assert (installed / "contfric" / "models" / "bundled" / "belt.yaml").is_file()
    assert (data / "signatures" / "2s.yaml").is_file()
    for number in ("03", "04", "05", "06", "07", "13"):
        assert (data / "studies" / f"fig{number}.yaml").is_file()


@pytest.mark.slow
@pytest.mark.skipif(
    shipped_target() is None, reason="this processor cannot run what a wheel carries"
)
def test_the_kernels_in_the_wheel_are_used_where_nothing_can_be_written(installed: Path) -> None:
    (wheel,) = installed.parent.glob("*.whl")
    assert not wheel.name.endswith("-none-any.whl")  # it is for one Python and one platform
    code = f"""if True:
        import logging
        from contfric.shipping.ahead import every_kernel, models_kernels
        from contfric.shipping.shipped import describe
        print(describe())
        said = []
        logging.getLogger("contfric.compiled").addFilter(said.append)
        logging.getLogger("contfric.compiled").setLevel(logging.INFO)
        for kernel in [*models_kernels().values(), *map(every_kernel().get, {SHIPPED[1:]!r})]:
            assert kernel.dispatcher is not None
            print(kernel.kept(), len(said))
    """
    before = sorted(path for path in installed.rglob("*") if path.suffix != ".pyc")
    nowhere = installed / "contfric" / "py.typed" / "cache"  # below a file: no folder
    said, *lines = run_installed(installed, code, nowhere).splitlines()
    assert said.startswith(f"{len(lines)} kernels for ")
    assert said.endswith(", used")
    assert len(lines) > len(SHIPPED)
    for line in lines:
        assert line.startswith(str(installed))
        assert line.endswith(" 0")  # loaded, not compiled
    assert sorted(path for path in installed.rglob("*") if path.suffix != ".pyc") == before
