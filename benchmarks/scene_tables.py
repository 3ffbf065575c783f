"""Tables of what scenes cost and did."""

from __future__ import annotations

import statistics
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

#: Wall seconds that are asked for: the import, a scene with its figure, one without, the first one.
IMPORT, FIGURE, PLAIN, COLD = 0.15, 2.5, 1.2, 20.0
#: Functions of the model: the other kernels call them, Python need not.
OF_MODEL = {"flow", "observe", "level", "period", "hit", "stationary"}
#: What no scene of the table asks for, if it is loaded.
UNASKED = ("scipy", "mpl_toolkits.mplot3d", "matplotlib.pyplot", "networkx", "pandas")


@dataclass
class Seen:
    """A scene: wall seconds of each run, and what the probe reports."""

    wall: list[float]
    probe: dict[str, Any]

    @property
    def median(self) -> float:
        """Median of the wall seconds."""
        return statistics.median(self.wall)


def breakdown(seen: Seen) -> dict[str, float]:
    """Seconds of each part of a run with the probe."""
    p = seen.probe
    steps, kernels = p["timings"], sum(p["kernels"].values())
    computing = sum(steps.get(k, 0.0) for k in ("orbit", "explore", "continue")) - kernels
    parts = {"starting Python": p["starting"]}
    parts |= {f"import: {k}": v for k, v in p["imports"].items()}
    parts |= {
        "kernels": kernels,
        "computing": computing,
        "drawing": steps.get("figures", 0.0),
        "writing tables and data": steps["tables"] + steps["data"],
        "ending Python": p["ending"],
    }
    return parts | {"rest": p["starting"] + p["inside"] + p["ending"] - sum(parts.values())}


def breakdown_table(columns: Mapping[str, Seen]) -> str:
    """Parts of a run, a scene in each column."""
    parts = {name: breakdown(seen) for name, seen in columns.items()}
    names = list(dict.fromkeys(part for found in parts.values() for part in found))
    last = ["kernels", "computing", "drawing", "writing tables and data", "ending Python", "rest"]
    names = [n for n in names if n not in last] + last
    lines = ["| part, s | " + " | ".join(columns) + " |", "|---" * (len(columns) + 1) + "|"]
    for name in names:
        cells = [f"{f[name]:.3f}" if f.get(name) else "-" for f in parts.values()]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    totals = [f"{sum(f.values()):.3f}" for f in parts.values()]
    return "\n".join([*lines, "| all | " + " | ".join(totals) + " |"])


def kernel_table(warm: Seen, cold: Seen) -> str:
    """Seconds of each kernel, compiled and loaded, and how often Python called it."""
    lines = ["| kernel | compiled, s | loaded, ms | calls in fig05 |", "|---|---|---|---|"]
    for name, seconds in cold.probe["kernels"].items():
        calls = warm.probe["calls"].get(name.rsplit(".", 1)[1], 0)
        lines.append(
            f"| {name} | {seconds:.2f} | {warm.probe['kernels'][name] * 1e3:.1f} | {calls} |"
        )
    compiled, loaded = (sum(s.probe["kernels"].values()) for s in (cold, warm))
    return "\n".join([*lines, f"| all | {compiled:.2f} | {loaded * 1e3:.1f} | |"])


def scene_table(seen: Mapping[str, Seen]) -> str:
    """One row a scene: what it did."""
    lines = [
        "| scene | wall, s | modules | kernels | Newton solves | multipliers | admissibility checks "
        "| simulated events | peak, MB |",
        "|---" * 9 + "|",
    ]
    for name, one in seen.items():
        p, counts = one.probe, one.probe["counts"]
        lines.append(
            f"| {name} | {one.median:.2f} | {p['module_count']} | {len(p['kernels'])} "
            f"| {counts['newton_solves']} | {counts['multiplier_evaluations']} "
            f"| {counts['admissibility_checks']} | {counts['simulated_events']} | {p['peak']:.0f} |"
        )
    return "\n".join(lines)


def skipped_table(seen: Mapping[str, Seen]) -> str:
    """What each scene left out by its own record, and what it loaded without using it."""
    lines = ["| scene | skipped | loaded and not used |", "|---|---|---|"]
    for name, one in seen.items():
        p = one.probe
        called = OF_MODEL | p["calls"].keys()
        idle = [f"kernel {n}" for n in p["kernels"] if n.rsplit(".", 1)[1] not in called]
        idle += [m for m in UNASKED if p["modules"].get(m)]
        skipped = "; ".join(item["what"] for item in p["skipped"])
        lines.append(f"| {name} | {skipped or '-'} | {', '.join(idle) or '-'} |")
    return "\n".join(lines)


def claims(seen: Mapping[str, Seen], cold: Seen, importing: float) -> str:
    """What is asked for, and what is."""
    rows = (
        ("`import contfric`", importing, IMPORT),
        ("`contfric run fig05` with its figures, kernels cached", seen["fig05"].median, FIGURE),
        ("the same without figures", seen["fig05 without figures"].median, PLAIN),
        ("a bare branch", seen["bare branch"].median, PLAIN),
        ("`contfric run fig05`, the very first time", cold.wall[0], COLD),
    )
    lines = ["| what | wall, s | asked for | |", "|---|---|---|---|"]
    for what, seconds, wanted in rows:
        verdict = "held" if seconds <= wanted else "NOT HELD"
        lines.append(f"| {what} | {seconds:.3f} | {wanted} | {verdict} |")
    return "\n".join(lines)
