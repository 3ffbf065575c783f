"""One bridge of each kind, and how well both ends of bridges meet other branches (docs/bridges.md).

python docs/gallery/bridges.py writes docs/images/bridge_*.png and prints the table of the page.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

import contfric as cf
from contfric.plot.appearance.names import parameter_label
from contfric.plot.appearance.save import new_figure, save_figure
from contfric.plot.appearance.style import BLACK, BLUE, GREEN, ORANGE, VERMILLION

IMAGES = Path(__file__).parents[1] / "images"

#: Scenes: start, parameter, range.
SCENES = {
    "one hold": ({"Omega": 0.5, "S": 0.32, "S0": 0.4}, "Omega", (0.4, 0.6)),
    "two mirrored holds": ({"Omega": 0.44, "S": 0.17605, "S0": 0.219291}, "Omega", (0.42, 0.44)),
    "up to three holds": ({"Omega": 0.5, "S": 0.2, "S0": 0.4}, "S", (0.0, 0.4)),
    "third harmonic": ({"Omega": 0.5, "S": 0.3, "S0": 0.4, "h": 0.28}, "h", (0.2385, 0.3)),
}
#: Figure -> scene, kind at which the bridge begins and ends, title.
FIGURES = {
    "SS": ("two mirrored holds", "SS: held at both stops, on $F^-$ and on $F^+$"),
    "AS": ("third harmonic", "AS: held after a touch of the limit"),
    "GS": ("third harmonic", "GS: held at a touch of rest"),
}
#: Tips this near to each other (of the range) are at one event.
NEAR = 1e-6


@cache
def diagram(scene: str) -> cf.Diagram:
    """The diagram of a scene."""
    params, parameter, bounds = SCENES[scene]
    return cf.explore(cf.find_orbit("coulomb", params), parameter, bounds)


def bridge_of(scene: str, kind: str) -> cf.Branch:
    """The first bridge of a scene that begins and ends at events of a kind."""
    return next(
        b
        for b in diagram(scene).branches
        if b.bridge and {end.reason.name for end in b.ends} == {kind}
    )


def apart(one: cf.Orbit, other: cf.Orbit) -> float:
    """Distance of two solutions, up to whole periods and the mirror image."""
    if other.periods > one.periods:
        one, other = other, one
    forcing = one.period / one.periods
    times = np.linspace(0.0, one.period, 40)
    wanted = np.array([one.state(t) for t in times])
    return min(
        float(np.max(np.abs(np.array([image.state(t + k * forcing) for t in times]) - wanted)))
        for image in (other, other.mirror())
        for k in range(other.periods)
    )


def meeting(found: cf.Diagram, bridge: cf.Branch, side: int) -> tuple[cf.Branch, float, float]:
    """The branch that a bridge meets at an end, with the distances in parameter and motion."""
    tip, width = bridge[-side], found.range[1] - found.range[0]
    met = []
    for branch in found.branches:
        for k in (0, 1):
            gap = abs(branch.values[-k] - bridge.values[-side]) / width
            if gap < NEAR and (branch is not bridge or k != side) and not branch.mirrored:
                met.append((branch.bridge, apart(branch[-k], tip), gap, branch))
    _, motion, gap, branch = min(met, key=lambda found: found[:2])  # a regular one, if there is one
    return branch, gap, motion


def located_again(found: cf.Diagram, branch: cf.Branch, tip: cf.Orbit) -> cf.Orbit:
    """The end of a branch near an orbit, traced anew from its middle: from its own side of the event."""
    middle = branch[len(branch) // 2]
    again = cf.continue_orbit(middle, found.parameter, found.range, stability=False)
    ends = [again[0], again[-1]]
    near = [abs(end.params[found.parameter] - tip.params[found.parameter]) for end in ends]
    return ends[int(np.argmin(near))]


def rows() -> list[tuple[str, str, str, str, str, float, float]]:
    """Scene, bridge, event, value, met branch and distances, for each end of the bridges once."""
    table = []
    for scene in SCENES:
        found = diagram(scene)
        for bridge in found.branches:
            if not bridge.bridge or bridge.mirrored:
                continue
            for side, end in enumerate(bridge.ends):
                if end.bifurcation is None:
                    continue
                branch, _, _ = meeting(found, bridge, side)
                if branch.bridge and found.branches.index(branch) < found.branches.index(bridge):
                    continue  # that end of both is listed
                tip, other = (located_again(found, b, bridge[-side]) for b in (bridge, branch))
                width = found.range[1] - found.range[0]
                gap = abs(tip.params[found.parameter] - other.params[found.parameter]) / width
                motion = apart(tip, other)
                value = f"{bridge.values[-side]:.10g}"
                name = f"{bridge.name}"
                table.append((scene, name, end.reason.name, value, branch.name, gap, motion))
    return table


def figure(kind: str) -> None:
    """Draw the branches around a bridge, and the load along one of its orbits."""
    scene, title = FIGURES[kind]
    found, bridge = diagram(scene), bridge_of(scene, kind)
    fig = new_figure(9.0, 3.6)
    left, right = fig.subplots(1, 2)
    _branches(left, found, bridge)
    _load(right, bridge[len(bridge) // 2])
    fig.suptitle(title)
    save_figure(fig, IMAGES / f"bridge_{kind.lower()}.png")


def _branches(ax, found: cf.Diagram, bridge: cf.Branch) -> None:  # type: ignore[no-untyped-def]
    low, high = bridge.values.min(), bridge.values.max()
    rim = 0.5 * (high - low)
    met = [meeting(found, bridge, side)[0] for side in (0, 1)]
    for branch, colour in zip((*met, bridge), (BLUE, GREEN, VERMILLION), strict=True):
        size = np.max(np.abs(branch.stops), axis=1)
        for stable in (True, False):
            shown = np.where(branch.stable == stable, size, np.nan)
            style = "-" if stable else "--"
            width = 1.0 if branch.bridge else 1.8
            drawn = np.isfinite(shown).any()
            unseen = branch.stable.any() and not stable
            label = branch.name if drawn and not unseen else None
            ax.plot(branch.values, shown, style, color=colour, lw=width, label=label)
    for side in (0, 1):
        size = np.max(np.abs(bridge[-side].stops))
        ax.plot(bridge.values[-side], size, "o", color=BLACK, ms=4)
    inside = np.concatenate(
        [
            np.max(np.abs(b.stops), axis=1)[(b.values > low - rim) & (b.values < high + rim)]
            for b in (*met, bridge)
        ]
    )
    ax.set_xlim(low - rim, high + rim)
    ax.set_ylim(
        *(np.array([inside.min(), inside.max()]) + 0.08 * np.ptp(inside) * np.array([-1, 1]))
    )
    ax.set_xlabel(parameter_label(bridge.parameter))
    ax.set_ylabel("max |x| at the stops")
    ax.ticklabel_format(useOffset=False)
    ax.locator_params(axis="x", nbins=4)
    ax.legend(fontsize=8)


def _load(ax, orbit: cf.Orbit) -> None:  # type: ignore[no-untyped-def]
    p = orbit.params
    times, states, _ = orbit.trajectory(1200)
    phase = p["Omega"] * times
    u = states[:, 0] - np.cos(phase) - p["h"] * np.cos(3.0 * phase)
    ax.plot(times, u, color=BLUE, lw=1.2, label="u")
    ax.plot(times, states[:, 1], color=ORANGE, lw=1.0, label="v")
    for level, name, side in ((p["S0"], "$S_0$", "bottom"), (p["S"], "$S$", "top")):
        for sign in (1.0, -1.0):
            ax.axhline(sign * level, color=BLACK, lw=0.5, ls=":")
        ax.annotate(name, (times[-1], level), fontsize=8, va=side, ha="right")
    for k, hold in enumerate(orbit.as_whole().system.holds):
        start, end = orbit.cycle[hold.segment, 0], orbit.ends[hold.segment, 0]
        ax.axvspan(start, end, color=VERMILLION, alpha=0.3, label="" if k else "hold", lw=0)
    ax.set_xlabel("t")
    ax.legend(fontsize=8, loc="lower left")


def table() -> str:
    """The table of the page."""
    lines = [
        "| scene | bridge | event | value | meets | difference in the parameter | in the solution |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {scene} | {name} | {kind} | {value} | {other} | {gap:.0e} | {motion:.0e} |"
        for scene, name, kind, value, other, gap, motion in rows()
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    for one in FIGURES:
        figure(one)
    print(table())
