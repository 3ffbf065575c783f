"""A branch of a million points: written by one fresh process, read by another.

``python scale_memory.py write FILE`` and ``python scale_memory.py read FILE`` each print what they
measured as JSON; ``scale.py`` runs both.
"""

from __future__ import annotations

import hashlib
import json
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

#: Points wanted, and the memory that they may take (MB).
POINTS, WANTED = 1_000_000, 400
#: Largest step of the branch that tells how many points a step makes: their number goes with 1/step.
TRIAL = 1e-4
PARAMS, RANGE = {"Omega": 0.5, "S": 0.32, "S0": 0.4}, (0.4, 0.6)
ARRAYS = ("values", "joints", "arc", "labels", "turn_multipliers")


def peak() -> float:
    """Largest memory of this process so far, MB.

    By ``/proc``, where there is one: the resource usage of a child counts its parent's memory too, which
    it shares until it runs a program of its own.
    """
    status = Path("/proc/self/status")
    if status.is_file():
        (line,) = (s for s in status.read_text().splitlines() if s.startswith("VmHWM"))
        return int(line.split()[1]) * 1024 / 1e6
    unit = 1 if sys.platform == "darwin" else 1024  # macOS counts in bytes, others in kB
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6


def digest(branch: Any) -> str:
    """Digest of all numbers of a branch."""
    content = hashlib.sha256()
    for name in ARRAYS:
        content.update(memoryview(getattr(branch, name)).cast("B"))
    return content.hexdigest()


def write(path: Path) -> dict[str, Any]:
    """Continue, save, and report."""
    found: dict[str, Any] = {"python": peak()}
    import numpy as np  # noqa: F401

    found["numpy"] = peak()
    import numba  # noqa: F401

    found["numba"] = peak()
    import contfric as cf

    orbit = cf.solve_orbit("coulomb", "1a", PARAMS)
    trial = cf.continue_orbit(orbit, "Omega", RANGE, max_step=TRIAL, max_points=POINTS)
    found["kernels"] = peak()
    start = time.perf_counter()
    step = TRIAL * len(trial) / POINTS
    branch = cf.continue_orbit(orbit, "Omega", RANGE, max_step=step, max_points=POINTS)
    found |= {"points": len(branch), "seconds": time.perf_counter() - start, "branch": peak()}
    found["arrays"] = sum(getattr(branch, name).nbytes for name in ARRAYS) / 1e6
    start = time.perf_counter()
    cf.save(branch, path)
    found |= {"save": time.perf_counter() - start, "saved": peak(), "max_step": step}
    return found | {"file": path.stat().st_size / 1e6, "digest": digest(branch)}


def read(path: Path) -> dict[str, Any]:
    """Load, and report."""
    import contfric as cf

    cf.load_model("coulomb")
    start = time.perf_counter()
    branch = cf.load(path)
    seconds = time.perf_counter() - start
    return {"load": seconds, "loaded": peak(), "digest": digest(branch)}


def fresh(what: str, path: Path) -> dict[str, Any]:
    """Run this file in a process of its own."""
    command = [sys.executable, __file__, what, str(path)]
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)


def run(folder: Path) -> dict[str, Any]:
    """Write and read; the file is removed."""
    path = folder / "million.npz"
    written = fresh("write", path)
    loaded = fresh("read", path)
    path.unlink()
    equal = written.pop("digest") == loaded.pop("digest")
    return written | loaded | {"equal": equal}


def table(m: dict[str, Any]) -> str:
    """What was measured."""
    rows = {
        "points": f"{m['points']:,} (largest step {m['max_step']:.3g} of the range)",
        "time": f"{m['seconds']:.2f} s, {m['seconds'] / m['points'] * 1e6:.2f} us a point",
        "arrays of the branch": f"{m['arrays']:.0f} MB, {m['arrays'] / m['points'] * 1e6:.0f} bytes a point",
        "memory before (Python, + numpy, + numba, + kernels)": ", ".join(
            f"{m[k]:.0f} MB" for k in ("python", "numpy", "numba", "kernels")
        ),
        "peak of the whole process": f"{m['branch']:.0f} MB",
        "growth over what it was before": f"{m['branch'] - m['kernels']:.0f} MB",
        "written": f"{m['save']:.2f} s, {m['file']:.0f} MB; peak then {m['saved']:.0f} MB",
        "read, in another process": f"{m['load']:.2f} s; peak of that process {m['loaded']:.0f} MB",
        "equal to the last bit": "yes" if m["equal"] else "NO",
    }
    return "\n".join(["| what | |", "|---|---|", *(f"| {k} | {v} |" for k, v in rows.items())])


def verdict(m: dict[str, Any]) -> str:
    """Say whether the memory is what is asked for."""
    growth, whole = m["branch"] - m["kernels"], m["branch"]
    if whole <= WANTED:
        return f"Asked for: at most {WANTED} MB; held by the whole process ({whole:.0f} MB)."
    if growth <= WANTED:
        return (
            f"Asked for: at most {WANTED} MB; held by the branch itself ({growth:.0f} MB), NOT HELD by "
            f"the whole process ({whole:.0f} MB)."
        )
    return f"Asked for: at most {WANTED} MB; NOT HELD."


if __name__ == "__main__":
    print(json.dumps({"write": write, "read": read}[sys.argv[1]](Path(sys.argv[2]))))
