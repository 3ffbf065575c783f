"""What is installed is enough: the wheel, without the checkout, runs the bundled study."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder that the wheel, and nothing else of this checkout, is installed in."""
    folder = tmp_path_factory.mktemp("wheel")
    for step in (
        ["wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", str(folder), str(ROOT)],
        ["install", "--no-deps", "--no-index", "--target", str(folder / "site"), "--find-links"],
    ):
        command = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", *step]
        if step[0] == "install":
            command += [str(folder), "contfric"]
        subprocess.run(command, check=True, cwd=folder, capture_output=True, timeout=300)
    return folder / "site"


@pytest.mark.slow
def test_wheel_runs_fig05_from_an_empty_folder(installed: Path, tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    code = (
        "import contfric, sys; from contfric.cli import main;"
        "print(contfric.__file__, file=sys.stderr);"
        "sys.exit(main(['run', 'fig05', '--out', 'results']))"
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
