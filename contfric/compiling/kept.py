"""Machine code on disk: one file a kernel, with a digest in it, read from the first folder that has it sound.

Numba's own cache finds its files by the path and the line of the source, so that what is compiled in one
folder is compiled again in another, and nothing can come with a wheel. Here a file's name says what the code
depends on: function, signature, and what it was compiled for (:mod:`contfric.compiling.targets`). The folder
says what sources it was compiled from, this one and :mod:`contfric.compiled` among them.
"""

from __future__ import annotations

import hashlib
import os
import pickle
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from llvmlite import binding
from numba.core.caching import _Cache
from numba.core.compiler import CompileResult
from numba.core.runtime import rtsys
from numba.core.serialize import dumps

from contfric.base.checked import read_checked, write_checked
from contfric.compiling.targets import Target
from contfric.errors import ResultFileError

SUFFIX = ".kernel"


def file_name(function: Callable[..., Any], signature: Any, target: Target) -> str:
    """Return the name of the file that the code of a function is kept in."""
    code, cells = function.__code__, function.__closure__ or ()
    content = hashlib.sha256(f"{target.digest} {signature} {code.co_firstlineno}".encode())
    content.update(code.co_code)
    content.update(dumps([cell.cell_contents for cell in cells]))
    return content.hexdigest()[:16] + SUFFIX


def writable(folder: Path) -> bool:
    """Tell whether files can be kept in a folder; it is made."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


def _unlinked(parts: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return the parts of compiled code without that for the linker: a kernel is called by its address only.

    It is half of a file, and of the time to load it. What is left says which functions there are. The
    environments of the functions inside, which numba keeps as well, are left out: compiled code asks for one
    where it makes an object of Python, which only a kernel's own wrapper does. To load one imports the module
    of its function, up to a tenth of a second for those of numba's compiler.
    """
    (name, kind, content), entry, *rest, _inside = parts
    if kind == "object" and len(content) == 2:
        functions = (
            entry.llvm_func_name,
            entry.llvm_cpython_wrapper_name,
            entry.llvm_cfunc_wrapper_name,
        )
        text = "\n".join(f'define void @"{function}"() {{ ret void }}' for function in functions)
        content = content[0], binding.parse_assembly(text).as_bitcode()
    return (name, kind, content), entry, *rest, ()


class KernelFiles(_Cache):  # type: ignore[misc]
    """Numba's cache of one function.

    Parameters
    ----------
    files : where the code may be, the first choice first; what is compiled is written to the last
    """

    def __init__(self, files: Sequence[Path]) -> None:
        self._files = tuple(files)

    @property
    def cache_path(self) -> str:
        """The folder that is written to."""
        return str(self._files[-1].parent)

    def found(self) -> Path | None:
        """Return the first file that is there and sound."""
        for file in self._files:
            with suppress(OSError, ResultFileError):
                read_checked(file)
                return file
        return None

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the code, or None."""
        # what is loaded needs numba's runtime, and none of the tables that its compiler fills by ``refresh``:
        # that is a quarter of a second
        rtsys.initialize(target_context)
        for file in self._files:
            # missing, damaged, or what unpickling ends in where numba has changed
            with suppress(Exception):
                parts = pickle.loads(read_checked(file))
                found = CompileResult._rebuild(target_context, *parts)
                found.library._shared_module = None  # whoever links it is told that it cannot be
                return found
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Write the code; where that cannot be done it is compiled in every process."""
        plain = data._replace(type_annotation="")  # it names the path of the source
        with suppress(OSError, ResultFileError):
            self._files[-1].parent.mkdir(parents=True, exist_ok=True)
            write_checked(self._files[-1], dumps(_unlinked(plain._reduce())))

    def flush(self) -> None:
        """Throw away what is kept."""
        with suppress(OSError):
            self._files[-1].unlink(missing_ok=True)

    def enable(self) -> None:
        """Numba asks for it; there is nothing to do."""

    def disable(self) -> None:
        """Numba asks for it; there is nothing to do."""
