"""The animation of README: Fig. 5 as it is explored; part of ``make gallery``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg

import contfric as cf
from contfric.plot import new_figure, plot_diagram_row

FILE = Path(__file__).resolve().parents[1] / "images" / "growing.gif"
#: Frames in all, frames that show the whole at the end, and frames a second.
FRAMES, LAST, RATE = 60, 20, 15


def main() -> None:
    """Draw the finished diagram once, and show more and more of its lines, branch after branch."""
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    diagram = cf.explore(orbit, "Omega", (0.4, 0.6))
    fig = new_figure(6.0, 3.6)
    ax = fig.add_subplot()
    plot_diagram_row(diagram, "x_max", ax, legend=False)
    ax.set_title(r"$S$ = 0.32, $S_{0}$ = 0.4", fontsize=10)
    FigureCanvasAgg(fig).draw()
    fig.set_layout_engine("none")
    # in the order in which the branches were found, mirror images with their originals
    order = {name: k for k, name in enumerate(dict.fromkeys(b.name for b in diagram.branches))}
    found = [line for line in ax.lines if line.get_gid() in order]
    lines = sorted(found, key=lambda line: (order[line.get_gid()], -line.get_linewidth()))
    whole = [np.asarray(line.get_xydata()).copy() for line in lines]
    ends = np.cumsum([len(points) for points in whole])
    marks = [line for line in ax.lines if line.get_gid() not in order]
    marked = [np.asarray(mark.get_xydata()).copy() for mark in marks]

    def show(frame: int) -> list[object]:
        drawn = min(1.0, (frame + 1) / (FRAMES - LAST)) * ends[-1]
        for line, points, end in zip(lines, whole, ends, strict=True):
            count = int(np.clip(drawn - (end - len(points)), 0, len(points)))
            line.set_data(points[:count].T)
        reached = [np.asarray(line.get_xydata()) for line in lines if len(line.get_xdata())]
        seen = np.vstack(reached)
        for mark, places in zip(marks, marked, strict=True):  # seen where a line has come to it
            gaps = [np.hypot(*((seen - place) / (0.2, 0.5)).T).min() for place in places]
            mark.set_data(places[np.less(gaps, 0.01)].T)
        for label in ax.texts:
            label.set_visible(frame >= FRAMES - LAST)
        return []

    animation = FuncAnimation(fig, show, frames=FRAMES, blit=False)
    animation.save(FILE, PillowWriter(fps=RATE), dpi=100)
    print(FILE)


if __name__ == "__main__":
    main()
