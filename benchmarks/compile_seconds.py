"""Write contfric/compiling/compile_seconds.py: how long each kernel takes, compiled alone in an empty cache.

``python benchmarks/compile_seconds.py`` takes three minutes on a machine that does nothing else. Kernels are
compiled one after the other in one process. ``--kept`` takes the times that this machine has kept of what was
compiled last, and compiles nothing.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from contfric.base.resources import user_cache
from contfric.compiling import compile_seconds
from contfric.shipping.ahead import every_kernel

FILE = Path(compile_seconds.__file__)
#: What the list stands between; the name of the file with the times of a machine.
BEGIN, END, TIMES = "SECONDS = {\n", "}\n", "compile-times.json"
#: What takes less is not in the list.
LEAST = 1.0


def measured() -> dict[str, float]:
    """Compile all kernels into an empty cache, and return the seconds of each."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "contfric", "doctor", "--compile", "--workers", "1"]
        subprocess.run(command, env={**os.environ, "CONTFRIC_CACHE_DIR": folder}, check=True)
        return dict(json.loads(Path(folder, TIMES).read_text(encoding="utf-8")))


def main() -> None:
    """Measure, or read, and write the module."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--kept", action="store_true", help="those of this machine, nothing compiled"
    )
    options = parser.parse_args()
    kept = user_cache() / TIMES
    times = json.loads(kept.read_text(encoding="utf-8")) if options.kept else measured()
    names = sorted(name for name in every_kernel() if times.get(name, 0.0) >= LEAST)
    head, _, rest = FILE.read_text(encoding="utf-8").partition(BEGIN)
    rows = "".join(f'    "{name}": {times[name]:.1f},\n' for name in names)
    FILE.write_text(f"{head}{BEGIN}{rows}{END}{rest.partition(END)[2]}", encoding="utf-8")
    print(
        f"{len(names)} kernels of {LEAST:g} s or more, {sum(times[name] for name in names):.0f} s"
    )


if __name__ == "__main__":
    main()
