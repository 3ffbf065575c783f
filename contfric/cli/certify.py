"""``contfric certify DIR``: the diagram of a run, proved."""

from __future__ import annotations

import argparse
from contextlib import nullcontext
from pathlib import Path

from contfric.cli.exits import Exit
from contfric.cli.progress import ProgressLine
from contfric.errors import ResultFileError


def certify(options: argparse.Namespace) -> int:
    """Write the certificate next to the results, a column into their table; the summary to stdout."""
    from contfric.base.extras import need_flint

    need_flint()  # before anything is read
    from concurrent.futures import ProcessPoolExecutor

    from contfric.study.certified import certify_folder

    folder: Path = options.folder
    if not folder.is_dir():
        raise ResultFileError(f"{folder} is not the folder of a run")
    pool = ProcessPoolExecutor(options.jobs) if options.jobs > 1 else nullcontext()
    with pool as executor, ProgressLine(options.quiet) as show:
        found = certify_folder(
            folder, executor=executor, time_limit=options.time_limit, progress=show
        )
    print(found)
    return Exit.INTERRUPTED if found.ended.startswith("interrupted") else Exit.DONE
