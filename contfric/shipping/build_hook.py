"""Compile the kernels when a wheel is built.

Run by hatchling, never by contfric. Such a wheel is for one Python and one platform, and its kernels for one
numba and one llvmlite: those of the environment that it is built in, so without build isolation
(``make wheel``). With other ones kernels are compiled on the user's machine. Where numba is missing, or
``CONTFRIC_WHEEL_KERNELS`` is ``none``, the wheel is a pure one.
"""

from __future__ import annotations

import atexit
import os
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

#: Names of the kernels that come with the wheel, as patterns with blanks between; all by default, or "none".
_CHOICE = "CONTFRIC_WHEEL_KERNELS"


class KernelsHook(BuildHookInterface[Any]):
    """Puts a folder of compiled kernels into the wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile the kernels, unless the wheel is a link to the sources or is to be pure."""
        patterns = os.environ.get(_CHOICE, "*").split()
        if version == "editable":
            return
        if patterns == ["none"]:
            self.app.display_info(f"a pure wheel: {_CHOICE}=none")
            return
        folder = Path(mkdtemp(prefix="contfric-kernels-"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        try:
            count = _compiled(Path(self.root), folder, patterns)
        except ImportError as error:
            self.app.display_warning(
                f"a pure wheel: {error}. For one with compiled kernels build it where contfric's "
                "dependencies are installed, without isolation: make wheel"
            )
            return
        self.app.display_info(f"{count} compiled kernels go into the wheel")
        build_data["force_include"][str(folder)] = "contfric/_data/kernels"
        build_data["pure_python"], build_data["infer_tag"] = False, True


def _compiled(root: Path, folder: Path, patterns: list[str]) -> int:
    """Compile kernels into a folder; return their number.

    Raises
    ------
    ImportError
        If they cannot be compiled here; the message says why.
    """
    sys.path.insert(0, str(root))
    try:
        from contfric.compiling.targets import baseline, environment_of
    finally:
        sys.path.remove(str(root))
    base = baseline()
    if base is None:
        raise ImportError("there is no common processor for this kind of machine")
    environment = environment_of(base) | {
        "CONTFRIC_CACHE_DIR": str(folder),
        "PYTHONPATH": str(root),
    }
    command = [sys.executable, "-m", "contfric.shipping.shipped", *patterns]
    done = subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE, text=True)
    return int(done.stdout)
