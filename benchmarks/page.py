"""Tables, sentences and pictures of what was measured."""

from __future__ import annotations

import math
from pathlib import Path

import matplotlib as mpl
from measuring import Row

from contfric.plot.appearance.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION

mpl.use("Agg")
import matplotlib.pyplot as plt

#: Errors for which the fastest setting of each method is looked up.
WANTED = (1e-3, 1e-6, 1e-9, 1e-12)
#: The one that the sentence above each table speaks of: nine digits, as tables of bifurcations have.
SPOKEN_OF = 1e-9
#: The least error drawn: half a unit of double precision for a quantity of size 0.5.
LEAST = 5e-17

#: Marker and colour of each method: one colour for each package, red for contfric.
STYLES = {
    "contfric": ("o", VERMILLION),
    "contfric, reduced form": ("o", VERMILLION),
    "contfric, no multipliers": ("<", VERMILLION),
    "contfric, full form": ("s", VERMILLION),
    "DOP853, secant": ("v", SKY),
    "DOP853": ("^", BLUE),
    "DOP853, stops refined": ("d", BLUE),
    "heyoka": ("D", GREEN),
    "CVODE": ("X", ORANGE),
    "diffrax": ("h", "0.5"),
    "solve_bvp": ("P", PURPLE),
    "closed form, interpreted": ("*", BLACK),
}


def duration(seconds: float) -> str:
    """Return a time with its unit."""
    if seconds < 1e-3:
        return f"{seconds * 1e6:.3g} us"
    return f"{seconds * 1e3:.4g} ms" if seconds < 1 else f"{seconds:.3g} s"


def table(rows: list[Row]) -> str:
    """All settings, failures too."""
    lines = [
        "| method | setting | time (median) | time (minimum) | error | remark |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        error = "-" if row.failed else f"{row.error:.1e}"
        lines.append(
            f"| {row.case.method} | {row.case.setting} | {duration(row.median)} "
            f"| {duration(row.least)} | {error} | {row.remark} |"
        )
    return "\n".join(lines)


def methods(rows: list[Row]) -> list[str]:
    """Names in their order."""
    return list(dict.fromkeys(row.case.method for row in rows))


def fastest(rows: list[Row], method: str, wanted: float) -> float:
    """Time of the fastest setting of a method whose error is small enough, or infinity."""
    good = [r.median for r in rows if r.case.method == method and r.error <= wanted]
    return min(good, default=math.inf)


def summary(rows: list[Row]) -> str:
    """The fastest setting of each method for an error wanted."""
    lines = [
        "| error at most | " + " | ".join(f"{w:.0e}" for w in WANTED) + " |",
        "|---" * (len(WANTED) + 1) + "|",
    ]
    for method in methods(rows):
        times = [fastest(rows, method, wanted) for wanted in WANTED]
        cells = ["not reached" if math.isinf(t) else duration(t) for t in times]
        lines.append(f"| {method} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def verdict(rows: list[Row]) -> str:
    """Say which method is the fastest for SPOKEN_OF, and how the other side compares."""
    times = {m: fastest(rows, m, SPOKEN_OF) for m in methods(rows)}
    first = min(times, key=lambda m: times[m])
    lead = f"Fastest for an error of at most {SPOKEN_OF:.0e}: {first}, {duration(times[first])}."
    own = first.startswith("contfric")
    others = {m: t for m, t in times.items() if m.startswith("contfric") != own}
    second = min(others, key=lambda m: others[m])
    if math.isinf(others[second]):
        return lead
    form = second.removeprefix("contfric, ")
    whose = f"The best peer ({second})" if own else f"The best of contfric ({form})"
    return f"{lead} {whose} takes {others[second] / times[first]:.2g} times as long."


def draw(rows: list[Row], title: str, axes: tuple[str, str], path: Path) -> None:
    """Error against time, one line for each method; failures are left out."""
    figure, ax = plt.subplots(figsize=(7.6, 4.6), layout="constrained")
    for method in methods(rows):
        marker, colour = STYLES[method]
        good = [r for r in rows if r.case.method == method and not r.failed]
        own = method.startswith("contfric")
        ax.loglog(
            [r.median for r in good],
            [max(r.error, LEAST) for r in good],
            marker=marker,
            color=colour,
            markersize=9 if own or method.startswith("closed") else 5,
            markerfacecolor="none" if method == "DOP853, stops refined" else colour,
            linewidth=1.2,
            linestyle="none" if len(good) == 1 or own else "-",
            label=method,
            zorder=3 if own else 2,
        )
    ax.set(xlabel=axes[0], ylabel=axes[1], title=title)
    ax.grid(True, which="major", linewidth=0.4, alpha=0.6)
    figure.legend(*ax.get_legend_handles_labels(), loc="outside right upper", fontsize=9)
    figure.savefig(path, dpi=150)
    plt.close(figure)
