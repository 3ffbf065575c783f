"""The picture of docs/coulomb-limit.md: Coulomb's branches and bridge, and what tends to them."""

from __future__ import annotations

from typing import Any

import coulomb_limit as limit
import matplotlib as mpl
import numpy as np

import contfric as cf
from contfric.plot.appearance.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION

mpl.use("Agg")
import matplotlib.pyplot as plt

PATH = limit.ROOT / "docs" / "images" / "coulomb_limit.png"
COLOURS = (ORANGE, GREEN, SKY, BLUE, PURPLE)


def draw() -> None:
    """Stribeck's branches on the left, LuGre's on the right."""
    figure, (left, right) = plt.subplots(
        1, 2, figsize=(11.0, 4.6), sharey=True, layout="constrained"
    )
    for (vS, Omega), colour in zip(limit.BRIDGES, COLOURS, strict=False):
        branch = limit.steep(vS, Omega)
        _line(left, limit.curve(branch), branch.stable, colour, f"$v_S$ = {vS:g}")
    for case, colour in zip(limit.BRISTLES, COLOURS, strict=False):
        found = limit.bristled(*case)
        undamped = "" if case[2] else r", $\sigma_1 = 0$"
        name = f"$v_S$ = {case[0]:g}, $\\sigma_0$ = {case[1]:g}{undamped}"
        _line(right, found[:, :3], found[:, 3] < 1.0, colour, name)
    for ax, title in ((left, "friction that falls (stribeck)"), (right, "bristles (lugre)")):
        for branch in limit.diagram().branches:
            if branch.name.startswith(("1a", "2a")):
                _coulomb(ax, branch)
        ax.set(xlim=(0.37, 0.475), ylim=(0.74, 1.24), xlabel=r"$\Omega$", title=title)
        ax.legend(fontsize=8, loc="upper left")
    left.set_ylabel("smaller amplitude")
    figure.savefig(PATH, dpi=140)
    plt.close(figure)


def _smaller(branch: cf.Branch) -> np.ndarray:
    return np.minimum(branch.x_max, -branch.x_min)


def _line(ax: Any, points: np.ndarray, stable: np.ndarray, colour: str, name: str) -> None:
    """One colour, dashed where unstable."""
    size = np.minimum(points[:, 1], points[:, 2])
    ax.plot(points[:, 0], np.where(stable, size, np.nan), color=colour, lw=1.5, label=name)
    ax.plot(points[:, 0], np.where(stable, np.nan, size), "--", color=colour, lw=1.2)


def _coulomb(ax: Any, branch: cf.Branch) -> None:
    """Black; the bridge red and thin."""
    size = _smaller(branch)
    if branch.bridge:
        label = None if branch.mirrored else "bridge (coulomb)"
        ax.plot(branch.values, size, ":", color=VERMILLION, lw=1.6, label=label, zorder=5)
        return
    for stable, style in ((True, "-"), (False, "--")):
        shown = np.where(branch.stable == stable, size, np.nan)
        ax.plot(branch.values, shown, style, color=BLACK, lw=1.3, zorder=4)


if __name__ == "__main__":
    draw()
