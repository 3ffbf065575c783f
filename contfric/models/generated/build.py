"""Generated modules on disk: written once, named by their code, imported when they are needed.

A module lies in a folder of its own below the cache of compiled kernels; those of bundled models may come
with the wheel, as kernels do. It is found by a digest of the definition, of all
compiled sources of contfric, and of what generates it. It is written under another name and moved
into place: two processes that build the same model at once do not disturb each other. One that is damaged is
generated again.
"""

from __future__ import annotations

import atexit
import hashlib
import json
import shutil
import sys
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from contfric.base.checked import read_sealed, write_sealed
from contfric.base.resources import SHIPPED_KERNELS, user_cache
from contfric.base.sources import kernels_digest
from contfric.errors import ResultFileError
from contfric.models.described.reading_back import from_text
from contfric.models.generated.formula_tables import forms_of
from contfric.models.generated.table_flow import coded_flow

if TYPE_CHECKING:
    from contfric.compiled import Kernel
    from contfric.flow.interface import CompiledFlow


@dataclass(frozen=True)
class GeneratedFlow:
    """Factory of the compiled flow of a description; it can be pickled, for other processes."""

    definition: str

    def __call__(self) -> CompiledFlow:
        """Return the compiled functions; a module is generated if one is needed and was never written."""
        coded = coded_flow(self.definition)
        if coded is None:
            tolerance = json.loads(self.definition)["integration"]["tolerance"]
            found: CompiledFlow = load_module(self.definition).compiled_flow(tolerance)
        else:
            found = coded.flow
        if '"chatters":' not in self.definition:
            return found
        return _with_chatter(found, self.definition)


def _with_chatter(flow: CompiledFlow, definition: str) -> CompiledFlow:
    """Return the flow of a model whose modes of chatter are contact alone, with their impacts."""
    from contfric.flow.chattering import ChatterMode, with_chatter
    from contfric.models.described.regions import engine_order

    description = from_text(definition)
    modes = [mode.name for mode in description.modes]
    observables = [o.name for o in description.observables]
    surfaces = engine_order(description)
    walls = {s.name: (k, observables.index(s.observable)) for k, s in enumerate(surfaces)}
    chatters = []
    for own in description.chatters:
        wall, gap = walls[own.surface]
        flight = modes.index(own.flight)
        side = description.modes[flight].sides[own.surface]
        row = modes.index(own.mode), flight, gap, wall, side, observables.index(own.lift)
        other = (modes.index(own.other), observables.index(own.other_lift)) if own.other else ()
        chatters.append(ChatterMode(*row, *other))
    return with_chatter(flow, len(modes), chatters)


def kernels_of(flow: GeneratedFlow) -> list[Kernel]:
    """Return what is compiled of a model, all at once; nothing where its formulas are tables."""
    return [] if forms_of(flow.definition) is not None else [load_module(flow.definition).unit]


def prepare(definition: str) -> None:
    """Write the module of a definition, if it has one and that was never done.

    Raises
    ------
    ModelError
        For a formula that has no value, with its place.
    """
    if forms_of(definition) is None:
        module_path(definition)


def load_module(definition: str) -> ModuleType:
    """Import the generated module of a definition."""
    try:
        return _imported(module_path(definition))
    except ResultFileError:
        # its file was fine when it was looked for: it was removed, or damaged, since then
        module_path.cache_clear()
        return _imported(module_path(definition))


@cache
def _imported(path: Path) -> ModuleType:
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
    """Return the file of the generated module; it is written if it is not there, or damaged.

    A small file, named by the definition, has the name of the module: definitions that differ in defaults or
    tolerances have one module.
    """
    sources = kernels_digest()  # what generates modules has digests of its own
    models = Path(sources, "models")
    name = f"{_digest(sources, _generator(), definition)}.name"
    for root in (SHIPPED_KERNELS, user_cache()):
        with suppress(ResultFileError):
            path = root / models / read_sealed(root / models / name).strip()
            read_sealed(path)
            return path
    text = _generated(definition, sources)
    code = _digest(text)
    own = Path(code, f"contfric_model_{code}.py")
    for folder in (user_cache() / models, _temporary_folder()):
        with suppress(
            OSError, ResultFileError
        ):  # no such folder can be written: try one of this process
            (folder / code).mkdir(parents=True, exist_ok=True)
            write_sealed(folder / own, text)
            write_sealed(folder / name, f"{own.as_posix()}\n")
            return folder / own
    raise ResultFileError("no folder can be written, not even a temporary one: free some space")


def _digest(*texts: str) -> str:
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()[:16]


@cache
def _generator() -> str:
    """Return a digest of the sources that modules are generated by."""
    content = hashlib.sha256()
    here = Path(__file__).parent
    for folder in (here, here.parent / "language"):  # which writes formulas
        for file in sorted(folder.glob("*.py")):
            content.update(file.read_bytes())
    return content.hexdigest()


def _generated(definition: str, digest: str) -> str:
    from contfric.models.generated.generate import module_source

    return module_source(from_text(definition), digest)


@cache
def _temporary_folder() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="contfric-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder
