"""Generated modules on disk: written once, named by what they depend on, imported when they are needed.

A module lies in a folder of its own below the cache of compiled kernels, so that numba's cache of its
kernels is renewed exactly when the module is. Its name carries a digest of the definition and of all
compiled sources of contfric; what generates it is among those. It is written under another name and moved
into place: two processes that build the same model at once do not disturb each other. One that is damaged is
generated again.
"""

from __future__ import annotations

import atexit
import hashlib
import shutil
import sys
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from contfric.checked import read_sealed, write_sealed
from contfric.errors import ResultFileError

if TYPE_CHECKING:
    from contfric.flow.interface import CompiledFlow


@dataclass(frozen=True)
class GeneratedFlow:
    """Factory of the compiled flow of a description; it can be pickled, for other processes."""

    definition: str

    def __call__(self) -> CompiledFlow:
        """Return the compiled functions; the module is generated if that was never done."""
        module = load_module(self.definition)
        return module.compiled_flow()  # type: ignore[no-any-return]


@cache
def load_module(definition: str) -> ModuleType:
    """Import the generated module of a definition."""
    path = module_path(definition)
    name = path.stem
    # from the text that was checked: Python's own copy of it (.pyc) could be damaged unseen
    code = compile(read_sealed(path), str(path), "exec")
    module = ModuleType(name)
    module.__file__ = str(path)
    sys.modules[name] = module
    exec(code, module.__dict__)
    return module


@cache
def module_path(definition: str) -> Path:
    """Return the file of the generated module; it is written if it is not there, or damaged."""
    from contfric import compiled

    sources = compiled.cache_folder(Path(__file__))  # of the package, with what generates modules
    digest = hashlib.sha256(f"{sources.name}\n{definition}".encode()).hexdigest()[:16]
    path = sources / "models" / digest / f"contfric_model_{digest}.py"
    with suppress(ResultFileError):
        read_sealed(path)
        return path
    text = _generated(definition, f"{sources.name} {digest}")
    for folder in (path.parent, _temporary_folder()):
        try:
            folder.mkdir(parents=True, exist_ok=True)
            write_sealed(folder / path.name, text)
        except (OSError, ResultFileError):
            continue  # no such folder can be written: this process has one of its own
        return folder / path.name
    raise ResultFileError("no folder can be written, not even a temporary one: free some space")


def _generated(definition: str, digest: str) -> str:
    from contfric.models.describe import from_text
    from contfric.models.generate import module_source

    return module_source(from_text(definition), digest)


@cache
def _temporary_folder() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="contfric-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder
