"""The command line: ``contfric run | explain | info | view | ...``.

Data go to stdout, progress and messages to stderr. Exit codes: 0 done, 1 computing or writing
failed, 2 the input is wrong, 130 interrupted (what was found is saved).
"""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import NoReturn

from contfric.cli.exits import Exit
from contfric.errors import ContfricError

#: Objects between two searches for garbage: what a run imports and draws is alive, and with Python's 700 it
#: was looked through for a seventh of the time of a short run. So many take some 20 MB.
_MANY = 200_000


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Parameters
    ----------
    argv : sequence of str, optional
        The arguments; by default those of the process.

    Examples
    --------
    >>> main(["graph"])  # doctest: +ELLIPSIS
    x+v+ -> x0v+ (F+)
    ...
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    try:
        from contfric.cli.parser import parse
        from contfric.cli.progress import compiling_shown

        options = parse(arguments)
        with compiling_shown(quiet=getattr(options, "quiet", False)):
            code: int = options.command(options)
        sys.stdout.flush()
    except BrokenPipeError:
        # whoever read our output has gone, and must not hear of it when Python flushes at its end
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return Exit.BROKEN_PIPE
    except KeyboardInterrupt:
        print("contfric: interrupted", file=sys.stderr)
        return Exit.INTERRUPTED
    except Exception as error:
        if "--debug" in arguments:
            raise
        print(f"contfric: error: {_message(error)}", file=sys.stderr)
        return _code(error)
    return code


def console() -> NoReturn:
    """Run the command line as a process, and leave at once.

    Everything is written and closed by then; taking Python and the compiler apart in order would
    take a quarter of a second.
    """
    gc.set_threshold(_MANY)
    # what pydantic would look for in the metadata of every installed package
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    code = main()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):  # whoever read it has gone, or it is closed
            stream.flush()
    os._exit(code)


def _message(error: Exception) -> str:
    if isinstance(error, (ContfricError, OSError)):
        return str(error)
    name = type(error).__name__
    return f"internal error, {name}: {error} (--debug shows where; please report it)"


def _code(error: Exception) -> Exit:
    # errors with a result come from computing or writing, and so does what the disk refused
    failed = hasattr(error, "result") or isinstance(error.__cause__, OSError)
    if failed or not isinstance(error, ContfricError):
        return Exit.FAILED
    return Exit.BAD_INPUT
