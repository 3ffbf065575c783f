"""Figures: what is drawn where, and what a drawing leaves alone."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from itertools import combinations, pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest

mpl.use("Agg")

from matplotlib import pyplot, rc_context
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Annotation, Text

import contfric as cf
from contfric.errors import ParameterError
from contfric.plot import (
    ROWS,
    journal,
    new_figure,
    plot_branch_graph,
    plot_branches,
    plot_diagram,
    plot_diagram_row,
    plot_orbit,
    plot_orbit_in_time,
    plot_orbit_panels,
    plot_transition_graph,
    save_figure,
)
from contfric.plot.appearance.labels import (
    _MEASURE,
    _UPDATE,
    Anchor,
    lay_out,
    line_pixels,
    place_labels,
)
from contfric.plot.appearance.names import event_label, parameter_label, surface_label
from contfric.plot.appearance.style import (
    BRIDGE_COLOUR,
    BRIDGE_NAME,
    UNSTABLE,
    branch_colours,
    domain_colours,
    lighter,
)
from contfric.plot.diagrams.branch_graph import _middles
from contfric.plot.diagrams.events import marks_of
from contfric.plot.diagrams.runs import aligned, stability_runs, threaded
from contfric.plot.orbits.orbit import _columns
from contfric.plot.orbits.pieces import pieces_of

FIG5 = {"Omega": 0.5, "S": 0.32, "S0": 0.4}


@pytest.fixture(autouse=True)
def no_show(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("a drawing called show()")

    monkeypatch.setattr(pyplot, "show", refuse)
    yield
    pyplot.close("all")


def curves(ax: Axes, gid: str) -> list[Line2D]:
    return [line for line in ax.lines if line.get_gid() == gid and line.get_marker() == "None"]


def markers(ax: Axes, gid: str) -> list[Line2D]:
    return [line for line in ax.lines if line.get_gid() == gid and line.get_marker() != "None"]


def texts(ax: Axes) -> list[str]:
    return [t.get_text() for t in ax.texts]


def is_dashed(line: Line2D) -> bool:
    return line.get_linestyle() == "--"


def entries(legend: Any) -> list[str]:
    assert legend is not None
    return [t.get_text() for t in legend.get_texts()]


# ------------------------------------------------------------------------- runs of a branch


def event(position: float, x: float, y: float, before: bool | None, after: bool | None) -> Any:
    return SimpleNamespace(
        kind=SimpleNamespace(value="SN", meaning="fold"),
        params={"p": x},
        orbit=SimpleNamespace(x_max=y, stops=np.array([y, -y]), periods=1),
        label="SN_1a",
        meaning="fold",
        position=position,
        stable_before=before,
        stable_after=after,
    )


def fold(stable: list[bool] | None, events: list[Any]) -> Any:
    """A parabola p = 1 - s^2 with its fold at s = 0, sampled off the fold."""
    s = np.array([-0.9, -0.5, -0.2, 0.3, 0.6, 1.0])
    x_max = 2.0 + s
    return SimpleNamespace(
        parameter="p",
        name="1a",
        system=SimpleNamespace(periods=1),
        mirrored=False,
        bridge=False,
        values=1.0 - s**2,
        arc=s + 0.9,
        x_max=x_max,
        stops=np.column_stack([x_max, -x_max]),
        stable=None if stable is None else np.array(stable),
        turn_multipliers=None if stable is None else np.array(1.0 + s, dtype=complex)[:, None],
        bifurcations=events,
        ends=(SimpleNamespace(bifurcation=None), SimpleNamespace(bifurcation=None)),
    )


HALVES = [True, True, True, False, False, False]


@pytest.mark.parametrize("said", [(True, False), (None, None)])
def test_runs_meet_at_the_located_bifurcation(said: tuple[bool | None, bool | None]) -> None:
    runs = stability_runs(fold(HALVES, [event(0.9, 1.0, 2.0, *said)]), "x_max")
    assert [r.stable for r in runs] == [True, False]
    assert (runs[0].x[-1], runs[0].y[-1, 0]) == (1.0, 2.0)
    assert (runs[1].x[0], runs[1].y[0, 0]) == (1.0, 2.0)
    assert sum(len(r.x) for r in runs) == 6 + 2


def test_a_change_that_no_event_explains_is_interpolated() -> None:
    first, second = stability_runs(fold(HALVES, []), "x_max")
    # |mu| = 1 + s is linear in the arclength: s = 0 exactly
    assert first.y[-1, 0] == second.y[0, 0] == pytest.approx(2.0)


def test_two_changes_within_one_step() -> None:
    events = [event(0.8, 0.99, 1.9, True, False), event(1.0, 0.99, 2.1, False, True)]
    runs = stability_runs(fold([True] * 6, events), "x_max")
    assert [r.stable for r in runs] == [True, False, True]
    np.testing.assert_array_equal(runs[1].y[:, 0], [1.9, 2.1])


def test_unknown_stability_is_one_run() -> None:
    (run,) = stability_runs(fold(None, [event(0.9, 1.0, 2.0, None, None)]), "stops")
    assert run.stable is None
    assert run.y.shape == (7, 2)


def test_stops_of_an_event_join_their_own_lines() -> None:
    """A located orbit may list its stops from another one on than the branch."""
    turned = event(0.9, 1.0, 2.0, None, None)
    turned.orbit.stops = np.array([-2.0, 2.0])
    (run,) = stability_runs(fold(None, [turned]), "stops")
    assert np.all(run.y[:, 0] > 0.0)
    np.testing.assert_array_equal(aligned(np.arange(3.0), np.array([1.1, 2.0, 0.0])), [1, 2, 0])


def test_a_point_at_an_event_gives_way_to_it() -> None:
    """Stability computed exactly at a bifurcation is rounding."""
    bent = fold([True, True, False, True, True, True], [event(0.7, 0.96, 1.8, True, True)])
    assert [r.stable for r in stability_runs(bent, "x_max")] == [True]


def test_an_event_of_another_branch_at_an_end() -> None:
    """A branch that leaves a branch point has that point of its parent as its end."""
    start = event(77.0, 0.19, 1.1, False, True)
    line = fold([True] * 6, [start])
    line.ends = (SimpleNamespace(bifurcation=start), line.ends[1])
    (run,) = stability_runs(line, "x_max")
    assert run.x[0] == 0.19


# ---------------------------------------------------------------------------------- diagrams


def test_stable_is_solid_and_unstable_dashed_up_to_the_fold(branch: Any) -> None:
    ax = plot_branches([branch], "x_max")
    assert isinstance(ax, Axes)
    (sn,) = (b for b in branch.bifurcations if b.kind.value == "SN")
    corner = (sn.params["Omega"], sn.orbit.x_max)
    solid, dashed = curves(ax, branch.name)
    if is_dashed(solid):
        solid, dashed = dashed, solid
    assert is_dashed(dashed)
    assert not is_dashed(solid)
    for line in (solid, dashed):
        ends = {tuple(line.get_xydata()[0]), tuple(line.get_xydata()[-1])}
        assert corner in ends, "a gap or an overlap at the fold"


def test_every_event_is_marked_at_its_coordinates(branch: Any) -> None:
    for row in (*ROWS, "energy"):
        ax = plot_branches([branch], row)
        for bif in branch.bifurcations:
            points = np.vstack([m.get_xydata() for m in markers(ax, bif.label)])
            for value in np.atleast_1d(bif.orbit.quantity(row)):
                distance = np.abs(points - (bif.params["Omega"], value)).max(axis=1)
                assert distance.min() < 1e-7


def test_axes_are_labelled(branch: Any) -> None:
    ax = plot_branches([branch], "stops")
    assert (ax.get_xlabel(), ax.get_ylabel()) == (r"$\Omega$", "$x$ at stops")
    drawn = curves(ax, "1a")  # its stable and its unstable part, each with a piece for each stop
    pieces = [np.count_nonzero(np.isnan(line.get_ydata())) for line in drawn]
    assert pieces == [branch.stops.shape[1]] * 2


def test_stability_that_was_not_computed(orbit: Any) -> None:
    plain = cf.continue_orbit(orbit, "Omega", (0.49, 0.51), stability=False)
    ax = plot_branches([plain])
    assert not any(is_dashed(line) for line in curves(ax, plain.name))
    known = entries(ax.get_legend())
    assert "stability not computed" in known
    assert not {"stable", "unstable"} & set(known)


def test_diagram_rows_share_their_parameter(diagram: Any) -> None:
    axes = plot_diagram(diagram, rows=tuple(ROWS))
    assert [ax.get_ylabel() for ax in axes] == [look.name("x") for look in ROWS.values()]
    assert axes[0].get_ylabel() == r"$x_{\max}$"
    assert {ax.get_xlim() for ax in axes} == {(0.4, 0.6)}
    assert axes[-1].get_xlabel() == r"$\Omega$"
    assert axes[0].get_title() == "$S$ = 0.32, $S_{0}$ = 0.4"


def test_legend_says_branches_lines_and_events(diagram: Any) -> None:
    (legend,) = plot_diagram(diagram)[0].figure.legends
    known = entries(legend)
    assert {b.name for b in diagram.branches if not b.bridge} <= set(known)
    assert {"stable", "unstable", "mirror image: lighter"} <= set(known)
    for bif in diagram.bifurcations:  # the tangencies lie beneath the markers of SS
        assert (f"{bif.kind.value}: {bif.kind.meaning}" in known) == (bif.kind.value != "T")


def test_of_a_part_of_a_figure_all_of_it_is_written(orbit: Any, tmp_path: Path) -> None:
    whole = new_figure(4.0, 3.0)
    ax = whole.subfigures(1, 2)[0].subplots()
    ax.plot([0, 1], [0, 1])
    written = pyplot.imread(save_figure(ax.figure, tmp_path / "part.png", dpi=100))
    assert written.shape[:2] == (300, 400)


def test_the_legend_names_the_widest_of_many_branches(
    diagram: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("contfric.plot.diagrams.legend._MOST", 2)
    known = entries(plot_diagram(diagram)[0].figure.legends[0])
    names = {b.name for b in diagram.branches if not b.bridge}
    assert names & set(known) == {"2s", "0s"}
    assert f"and {len(names) - 2} more branches" in known


@pytest.mark.parametrize("row", ROWS)
def test_events_of_a_diagram_are_labelled_once(diagram: Any, row: str) -> None:
    ax = plot_diagram_row(diagram, row)
    shown = {event_label(b.label) for b in diagram.bifurcations if b.kind.value != "T"}
    assert shown <= set(texts(ax))
    assert texts(ax).count(r"$\mathrm{SN}_{1a}$") == 1, "the mirror image is labelled too"


def test_mirror_images_are_marked_and_drawn_lighter(diagram: Any) -> None:
    ax = plot_diagram_row(diagram, "x_max")
    (folds,) = markers(ax, "SN_1a")
    assert len(folds.get_xdata()) == 2
    colour = branch_colours(["1a"])["1a"]
    assert {line.get_color() for line in curves(ax, "1a")} == {colour, lighter(colour)}
    even = plot_diagram_row(diagram, "psi")
    assert len({line.get_color() for line in curves(even, "1a")}) == 1


def test_labels_do_not_overlap(diagram: Any) -> None:
    fig = new_figure(8.4, 8.4)
    for ax in plot_diagram(diagram, fig=fig):
        boxes = [t.get_window_extent() for t in ax.texts if isinstance(t, Annotation)]
        assert boxes
        assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))
        assert all(ax.bbox.x0 < b.x0 and b.y1 < ax.bbox.y1 for b in boxes)


def test_events_and_legend_can_be_left_out(diagram: Any) -> None:
    ax = plot_diagram_row(diagram, events=False, legend=False)
    assert ax.get_legend() is None
    assert texts(ax) == []


def test_bridges_are_drawn_apart(diagram: Any) -> None:
    ax = plot_diagram_row(diagram, "x_max")
    bridges = {b.name for b in diagram.branches if b.bridge}
    assert bridges
    drawn = [line for name in bridges for line in curves(ax, name)]
    others = [line for b in diagram.branches if not b.bridge for line in curves(ax, b.name)]
    assert len(drawn) == 2, "one line for a bridge, one for its mirror image"
    assert {line.get_color() for line in drawn} == {BRIDGE_COLOUR, lighter(BRIDGE_COLOUR, 0.3)}
    assert max(b.get_zorder() for b in drawn) < min(o.get_zorder() for o in others)
    assert max(b.get_linewidth() for b in drawn) < min(o.get_linewidth() for o in others)
    assert all(is_dashed(line) for line in drawn)
    assert BRIDGE_NAME not in entries(ax.get_legend())  # here they lie beneath the markers
    known = entries(diagram.plot(inset=(0.4916, 0.4919)).get_legend())
    assert known.count(BRIDGE_NAME) == 1
    assert not bridges & set(known)
    plain = plot_branches([b for b in diagram.branches if not b.bridge])
    assert BRIDGE_NAME not in entries(plain.get_legend())


def test_a_bridge_is_one_run(diagram: Any) -> None:
    (bridge,) = (b for b in diagram.branches if b.bridge and not b.mirrored)
    (run,) = stability_runs(bridge, "x_max")
    assert run.stable is False
    assert run.x[[0, -1]] == pytest.approx(bridge.values[[0, -1]], abs=1e-9)


def test_an_event_of_branch_and_bridge_is_one_mark(diagram: Any) -> None:
    events = [b for branch in diagram.branches for b in branch.bifurcations]
    found = marks_of(events, diagram.branches, "x_max", "Omega")
    jumps = [(m.label, round(m.x, 9)) for m in found if m.kind.value == "SS"]
    assert jumps == [("SS_a", 0.49181666), ("SS_a", 0.491748814)]
    assert not any(m.on_bridges for m in found)


def test_what_lies_on_bridges_only_gives_way() -> None:
    start = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.22, "S0": 0.4})
    found = cf.explore(start, "Omega", (0.4, 0.56))
    marks = marks_of(found.bifurcations, found.branches, "psi", "Omega")
    (alone,) = (m for m in marks if m.on_bridges)
    assert alone.kind.value == "T"
    fig = new_figure()
    ax = plot_diagram_row(found, "psi", fig.add_subplot(), legend=False)
    sizes = {m.get_xdata()[0]: m.get_markersize() for m in markers(ax, "T")}
    assert sizes[alone.x] < max(sizes.values())
    labels = [t for t in ax.texts if isinstance(t, Annotation) and t.get_text() == event_label("T")]
    assert alone.x not in {t.xy[0] for t in labels}


def test_unknown_row_has_a_remedy(diagram: Any) -> None:
    for draw in (plot_diagram_row, lambda d, row: plot_diagram(d, rows=(row,))):
        with pytest.raises(ParameterError, match="did you mean 'x_max'"):
            draw(diagram, "xmax")


def test_an_empty_diagram_is_drawn() -> None:
    empty = SimpleNamespace(parameter="p", range=(0.0, 1.0), branches=(), nodes=(), bifurcations=())
    assert len(plot_diagram(empty)) == 3
    assert isinstance(plot_branch_graph(empty), Axes)


def test_methods_draw(orbit: Any, branch: Any, diagram: Any) -> None:
    fig = new_figure()
    ax = fig.add_subplot()
    assert branch.plot(ax=ax, row="psi") is ax
    assert diagram.plot(ax=ax) is ax
    assert orbit.plot(ax=fig.add_subplot()) is fig.axes[-1]


# ------------------------------------------------------------------------------------ orbits


def test_orbit_is_cut_where_it_changes_domain(orbit: Any) -> None:
    pieces = pieces_of(orbit)
    names = [p.domain for p in pieces]
    walk = list(orbit.signature.segments)
    assert names in [walk[k:] + walk[:k] for k in range(len(walk))]
    for piece in pieces:
        height = orbit.flow.height(piece.exit, float(piece.times[-1]), piece.states[-1])
        assert height == pytest.approx(0.0, abs=1e-10)


def test_legends_below_a_figure_fit_its_width() -> None:
    assert _columns(["stick", "$x^+v^+$"], 9.0) == 2
    assert _columns(["stop: reverses"] * 6, 9.0) == 6
    assert _columns(["band:v2,w+"] * 12, 9.0) == 6


@pytest.mark.parametrize("points", [40, 400])
def test_impacts_are_drawn_as_jumps(points: int) -> None:
    """The wall changes the speed at one place; a sample that lies on a surface hides no crossing."""
    orbit = cf.find_orbit("impact-friction", {"k": 5.2}, state=[-0.08, 0.0], time=-1.5)
    pieces = pieces_of(orbit, points)
    walk = [name for name in orbit.signature.segments if "@" not in name]
    names = [p.domain for p in pieces]
    assert names in [walk[k:] + walk[:k] for k in range(len(walk))]
    (struck,) = [p for p in pieces if p.times[0] == p.times[1]]
    assert struck.states[0, 0] == struck.states[1, 0] and struck.states[0, 1] == 0.0
    assert struck.states[1, 1] == pytest.approx(orbit.begins[struck.segment, 2]) and (
        struck.states[1, 1] > 1.0
    )


def test_orbit_is_coloured_by_domain(orbit: Any) -> None:
    ax = plot_orbit(orbit)
    assert isinstance(ax, Axes)
    colours = domain_colours(orbit.model)
    known = entries(ax.get_legend())
    for domain in set(orbit.signature.segments):
        lines = curves(ax, domain)
        assert {line.get_color() for line in lines} == {colours[domain]}
        assert orbit.model.domain_by_name[domain].label in known
    assert {"stop: sticks", "stop: reverses"} <= set(known)
    assert {"$F^{+}$", "$F^{-}$", "$v$ = 0"} <= set(texts(ax))


def test_surfaces_are_lines_in_the_plane_of_the_observables(orbit: Any) -> None:
    ax = plot_orbit(orbit, plane=("u", "v"))
    for name, value in (("F+", 0.4), ("F-", -0.4)):
        (line,) = curves(ax, name)
        assert set(line.get_xdata()) == {value}
    with pytest.raises(ParameterError, match="no state or observable 'w'"):
        plot_orbit(orbit, plane=("w", "v"))


def test_observables_in_time_with_their_levels(orbit: Any) -> None:
    load, velocity = plot_orbit_in_time(orbit)
    assert [set(line.get_ydata()) for line in curves(load, "F-")] == [{-0.4}]
    assert [set(line.get_ydata()) for line in curves(velocity, "v")] == [{0.0}]
    fig = new_figure()
    own = list(fig.subplots(2, 1))
    assert plot_orbit_in_time(orbit, own) == own
    with pytest.raises(ParameterError, match="2 axes"):
        plot_orbit_in_time(orbit, own[:1])


def test_holds_are_dotted(orbit: Any, diagram: Any) -> None:
    (bridge,) = (b for b in diagram.branches if b.bridge and not b.mirrored)
    held = bridge[len(bridge) // 2]
    ax = plot_orbit(held)
    sticks = curves(ax, "stick")
    assert [is_dashed(line) for line in sticks].count(True) == 1
    assert entries(ax.get_legend()).count("hold") == 1
    assert len(plot_orbit_panels(held)) == 4
    ax = plot_orbit(orbit)
    assert not any(is_dashed(line) for line in curves(ax, "stick"))
    assert "hold" not in entries(ax.get_legend())


def test_orbit_panels(orbit: Any) -> None:
    fig = new_figure(9, 6)
    axes = plot_orbit_panels(orbit, fig)
    assert [(ax.get_xlabel(), ax.get_ylabel()) for ax in axes] == [
        ("$x$", "$v$"),
        ("$u$", "$v$"),
        ("", "$u$"),
        ("time / period of the orbit", "$v$"),
    ]
    assert all(ax.figure is fig for ax in axes)


# ------------------------------------------------------------------------------------ graphs


def test_transition_graph_draws_all_transitions() -> None:
    model = cf.load_model("coulomb")
    ax = plot_transition_graph(model)
    drawn = {patch.get_gid() for patch in ax.patches}
    assert len(ax.patches) == len(drawn) == 14
    assert drawn == {f"{source} -> {to}" for (source, _), to in model.transitions.items()}
    assert {domain.label for domain in model.domains} <= set(texts(ax))
    assert texts(ax).count(surface_label("F+")) == 5


def test_transition_graph_highlights_a_walk(orbit: Any) -> None:
    walk = orbit.signature.segments
    ax = plot_transition_graph(orbit.model, signature=orbit.signature)
    bold = {patch.get_gid() for patch in ax.patches if patch.get_linewidth() > 1.5}
    assert bold == {f"{a} -> {b}" for a, b in zip(walk, (*walk[1:], walk[0]), strict=True)}
    assert len(ax.patches) == 14


def test_branch_graph_has_every_branch_and_every_joint_once(diagram: Any) -> None:
    ax = plot_branch_graph(diagram)
    originals = [b for b in diagram.branches if not b.mirrored]
    shown = texts(ax)
    for branch in originals:
        assert shown.count(branch.name.replace(", ", ",\n")) == 1
    for label, value in (("BP_2s", "0.48874"), ("SS_a", "0.49175"), ("SS_a", "0.49182")):
        assert shown.count(f"{event_label(label)}\n$\\Omega$ = {value}") == 1
    assert len(shown) == len(originals) + 4  # and CS_s; folds and tangencies join nothing
    edges = [line for line in ax.lines if line.get_marker() == "None"]
    assert len(edges) == 3 + 3, "CS_s has an arm to each of three branches"
    marks = [line.get_xydata()[0] for line in ax.lines if line.get_marker() != "None"]
    assert min(np.hypot(*(a - b)) for a, b in combinations(marks, 2)) > 0.2


def test_a_mark_lies_on_its_own_edge_only() -> None:
    """Two edges that cross in their middles have two marks, neither of them where they cross."""
    places = [(0.0, 0.0), (2.0, 2.0), (0.0, 2.0), (2.0, 0.0)]
    joints: Any = [SimpleNamespace(nodes=(0, 1)), SimpleNamespace(nodes=(2, 3))]
    middles = np.array(_middles(joints, places))
    assert np.all(np.hypot(*(middles - 1.0).T) > 0.25)
    assert middles[0, 0] == pytest.approx(middles[0, 1])
    assert middles[1].sum() == pytest.approx(2.0)
    assert _middles(joints[:1], places) == [(1.0, 1.0)]


def test_branch_graph_of_separate_parts(diagram: Any) -> None:
    apart = SimpleNamespace(parameter="Omega", branches=diagram.branches, nodes=())
    ax = plot_branch_graph(apart)
    places = {tuple(line.get_xydata()[0]) for line in ax.lines}
    assert len(places) == len([b for b in diagram.branches if not b.mirrored])


# ------------------------------------------------------------------------- look, axes and files


def test_own_axes_are_used_and_nothing_else(
    orbit: Any, diagram: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pyplot, "figure", None)
    monkeypatch.setattr(pyplot, "subplots", None)
    fig = new_figure()
    one, two, three = fig.subplots(1, 3)
    assert plot_orbit(orbit, one) is one
    assert plot_diagram_row(diagram, "psi", two) is two
    assert plot_transition_graph(orbit.model, three) is three
    assert two.get_legend() is not None
    assert len(fig.axes) == 3


def test_subfigures_are_honoured(diagram: Any) -> None:
    fig = new_figure(9, 4)
    left, _ = fig.subfigures(1, 2)
    ax = left.subplots()
    assert plot_diagram_row(diagram, "psi", ax) is ax


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_files_are_reproducible(branch: Any, tmp_path: Path, suffix: str) -> None:
    content = []
    for name in "ab":
        fig = new_figure(4, 3)
        plot_branches([branch], "psi", fig.add_subplot())
        path = save_figure(fig, tmp_path / f"{name}.{suffix}", dpi=60)
        content.append(path.read_bytes())
    assert content[0] == content[1]
    assert not any(
        itinerary in content[0] for itinerary in (b"CreationDate", b"dc:date", b"Software")
    )


@pytest.mark.parametrize("facecolor", ["white", "none"])
def test_pixels_are_those_of_matplotlib(branch: Any, tmp_path: Path, facecolor: str) -> None:
    """A figure that is drawn once, as it is saved, against ``savefig``, which draws twice."""
    with rc_context({"figure.facecolor": facecolor}):
        fig = new_figure(4, 3)
        plot_branches([branch], "psi", fig.add_subplot())
        written = save_figure(fig, tmp_path / "a.png")
        fig.savefig(tmp_path / "b.png", dpi="figure")
    found, expected = (pyplot.imread(path) for path in (written, tmp_path / "b.png"))
    assert np.array_equal(found, expected[:, :, : found.shape[2]])
    assert found.shape[2] == (3 if facecolor == "white" else 4)


def test_what_the_user_asks_matplotlib_for_is_saved(branch: Any, tmp_path: Path) -> None:
    fig = new_figure(4, 3)
    plot_branches([branch], "psi", fig.add_subplot())
    with rc_context({"savefig.facecolor": "red"}):
        red = pyplot.imread(save_figure(fig, tmp_path / "a.png"))
    assert red[0, 0, :3].tolist() == [1.0, 0.0, 0.0]


def test_saving_needs_no_pyplot() -> None:
    code = (
        "import sys, io, contfric as cf, contfric.plot\nassert 'matplotlib' not in sys.modules, "
        "'contfric.plot loads matplotlib at once'\nfrom contfric.plot import new_figure, "
        "plot_transition_graph\nfig = new_figure()\nplot_transition_graph(cf.load_model('coulomb'), "
        "fig.add_subplot())\nfig.savefig(io.BytesIO())\nassert 'matplotlib.pyplot' not in sys.modules\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_names_as_mathematics() -> None:
    assert parameter_label("S0") == "$S_{0}$"
    assert parameter_label("zeta") == r"$\zeta$"
    assert parameter_label("sigma_0") == r"$\sigma_{0}$"
    assert parameter_label("rate") == r"$\mathrm{rate}$"
    assert parameter_label("v_rel") == r"$v_{\mathrm{rel}}$"
    assert event_label("CS_s") == r"$\mathrm{CS}_{s}$"
    assert event_label("GS_2a, 14seg") == r"$\mathrm{GS}_{2a,\,14\mathrm{seg}}$"


def test_colours_tell_apart() -> None:
    names = ["1a", "2s", "0s", "2a", "1a, 9seg", "2a, 14seg", "4a"]
    assert len(set(branch_colours(names).values())) == len(names)
    assert branch_colours(names) == branch_colours([*names, "1a"])
    assert len(set(domain_colours(cf.load_model("coulomb")).values())) == 7
    many = [
        f"0a, {k}seg" for k in range(2, 42, 2)
    ]  # more than the palette has: further ones are darker
    assert len(set(branch_colours(many).values())) == len(many)
    assert len(set(domain_colours(cf.load_model("popp")).values())) == 10
    assert isinstance(UNSTABLE, tuple)


@pytest.mark.parametrize(("width", "millimetres"), [("single", 88.0), ("double", 180.0)])
def test_figures_are_as_wide_as_a_journal_asks_for(
    diagram: Any, tmp_path: Path, width: str, millimetres: float
) -> None:
    with journal(width):
        figures = [diagram.plot().figure, plot_diagram(diagram, ("x_max", "psi"))[0].figure]
    for number, figure in enumerate(figures):
        assert figure.get_figwidth() * 25.4 == pytest.approx(millimetres)
        figure.canvas.draw()
        (legend,) = figure.legends
        axes = [ax.get_tightbbox() for ax in figure.axes]
        assert legend.get_window_extent().y1 <= min(box.y0 for box in axes) + 1.0  # below them
        assert legend.get_window_extent().width <= figure.bbox.width
        for text in figure.findobj(Text):
            assert text.get_fontsize() <= 9.0 or not text.get_text()
        written = save_figure(figure, tmp_path / f"{number}.pdf").read_bytes()
        assert b"/Type0" in written and b"/Type3" not in written  # text is text, no drawing
    assert diagram.plot().figure.get_figwidth() == 7.0


def test_a_width_that_no_journal_has() -> None:
    with (
        pytest.raises(
            cf.ParameterError, match="no width 'singel' of a journal; did you mean 'single'"
        ),
        journal("singel"),
    ):
        pass


def test_sizes_follow_the_user(diagram: Any) -> None:
    plain = diagram.plot()
    with rc_context({"font.size": 15.0}):
        large = diagram.plot()
    for one, other in ((plain.xaxis.label, large.xaxis.label), (plain.texts[0], large.texts[0])):
        assert other.get_fontsize() == pytest.approx(1.5 * one.get_fontsize())
    assert large.lines[0].get_linewidth() == pytest.approx(1.5 * plain.lines[0].get_linewidth())


def test_names_and_colours_of_the_user(diagram: Any) -> None:
    ax = diagram.plot(names={"1a": "asymmetric"}, colours={"1a": "#123456"})
    entries = [text.get_text() for text in ax.get_legend().get_texts()]
    assert "asymmetric" in entries and "1a" not in entries
    drawn = {to_hex(line.get_color()) for line in ax.lines if line.get_gid() == "1a"}
    assert "#123456" in drawn
    assert diagram.plot(legend=False).get_legend() is None
    with pytest.raises(cf.ParameterError, match="no branch '1b' here; did you mean '1a'"):
        diagram.plot(names={"1b": "x"})
    with pytest.raises(cf.ParameterError, match="is no colour of matplotlib"):
        diagram.plot(colours={"1a": "no colour"})


def test_labels_without_a_place_are_left_out() -> None:
    """Of a hundred labels in one corner only those are written that hide no other."""
    ax = new_figure(3.0, 2.0).add_subplot()
    ax.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    anchors = [Anchor(0.5 + 1e-3 * k, 0.5, f"event {k}") for k in range(100)]
    placed = place_labels(ax, anchors)
    FigureCanvasAgg(ax.figure).draw()
    boxes = [Text.get_window_extent(label) for label in placed]  # without their lines
    assert 3 < len(placed) < 60
    assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))


def test_a_study_has_one_title(diagram: Any) -> None:
    title = "Bifurcations in Omega at S = 0.32, S0 = 0.4"
    fig = Figure(figsize=(8, 6), layout="constrained")
    axes = plot_diagram(diagram, ("x_max",), fig, None, title)
    assert axes[0].get_title() == r"Bifurcations in $\Omega$ at $S$ = 0.32, $S_{0}$ = 0.4"
    assert fig.get_suptitle() == ""
    fig = Figure(figsize=(8, 6), layout="constrained")
    (other,) = plot_diagram(diagram, ("x_max",), fig, None, "At S = 0.32")
    assert other.get_title() == "At $S$ = 0.32\n$S_{0}$ = 0.4"


def random_axes(seed: int) -> list[Axes]:
    """Return axes in a layout, with limits of any size, that share limits or align labels or do neither."""
    rng = np.random.default_rng(seed)
    fig = new_figure(float(rng.uniform(3.0, 9.0)), float(rng.uniform(2.0, 8.0)))
    rows, columns = rng.integers(1, 4, size=2)
    axes = fig.subplots(rows, columns, squeeze=False, sharex=bool(rng.integers(2))).ravel()
    for ax in axes:
        low, width = rng.normal(size=2) * 10.0 ** rng.integers(-4, 5, size=2)
        ax.set(xlim=(low, low + abs(width)), ylim=(0.0, 10.0 ** rng.integers(-4, 7)))
        ax.set(xlabel=r"$\Omega$", ylabel="displacement")
        if rng.integers(2):
            ax.set_aspect(float(np.ptp(ax.get_xlim()) / np.ptp(ax.get_ylim())))
    if rng.integers(2):
        fig.align_ylabels(axes)
    return list(axes)


@pytest.mark.parametrize("seed", range(4))
def test_ticks_that_are_measured_once_give_the_same_layout(seed: int) -> None:
    plain, kept = random_axes(seed), random_axes(seed)
    plain[0].figure.get_layout_engine().execute(plain[0].figure)
    lay_out(kept[0])
    for a, b in zip(plain, kept, strict=True):
        assert np.array_equal(a.get_position().extents, b.get_position().extents)
        assert all(not vars(axis).keys() & {_UPDATE, _MEASURE} for axis in (b.xaxis, b.yaxis))
    images = []
    for ax in (plain[0], kept[0]):
        canvas = FigureCanvasAgg(ax.figure)
        canvas.draw()
        images.append(np.asarray(canvas.buffer_rgba()))
    assert np.array_equal(*images)


def test_an_axis_measures_its_ticks_once_where_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three rows with aligned labels, laid out twice: each axis at two or three places."""
    axes = new_figure(7.0, 6.0).subplots(3, 1)
    axes[0].figure.align_ylabels(axes)
    measured: list[object] = []
    plain = getattr(Axis, _MEASURE)
    monkeypatch.setattr(Axis, _MEASURE, lambda a, *rest: measured.append(a) or plain(a, *rest))
    lay_out(axes[0])
    assert 0 < len(measured) <= 3 * 6


@pytest.mark.parametrize("seed", range(20))
def test_lines_of_stops_go_on_where_two_of_them_appear_or_vanish(seed: int) -> None:
    """Smooth curves of which two neighbours meet, listed in the order of the orbit, from any of them on.

    Each line of the drawing stays on one curve: it was drawn by its place in the list, across all of them.
    """
    rng = np.random.default_rng(seed)
    count, across = int(rng.integers(2, 6)), np.linspace(0.0, 1.0, 400)
    curves = [2.0 * k + 0.3 * np.sin(rng.uniform(1, 4) * across + k) for k in range(count)]
    fold = rng.uniform(0.2, 0.8)
    half = np.sqrt(np.maximum(fold - across, 0.0))
    at = int(rng.integers(0, count + 1))
    pair = [2.0 * count + 2.0 + half, 2.0 * count + 2.0 - half]
    ordered = [*curves[:at], *pair, *curves[at:]]
    rows, first = np.full((len(across), count + 2), np.nan), 0
    for k, x in enumerate(across):
        listed = [c[k] for c in (ordered if x < fold else curves)]
        first = int(rng.integers(0, len(listed))) if k % 50 == 0 else first
        rows[k, : len(listed)] = np.roll(listed, first)
    found = threaded(rows)
    assert found.shape == (len(across), count + 2)
    steps = np.abs(np.diff(found, axis=0))
    assert np.nanmax(steps) < 0.1  # a root moves by sqrt(1/400)
    np.testing.assert_array_equal(np.sort(found, axis=1), np.sort(rows, axis=1))


def test_an_integral_over_a_doubled_orbit_is_counted_twice_at_its_doubling() -> None:
    """The orbit of the event has half the period of the branch there: the line fell to half its value."""
    start = cf.find_orbit("bouncing-ball", {"a": 1.2, "e": 0.5}, state=[5.0, 2.0])
    diagram = cf.explore(start, "a", (1.1, 1.6), max_branches=4)
    once, twice = diagram.branches
    (doubling,) = diagram.of_kind("PD")
    assert (once.system.periods, twice.system.periods) == (1, 2)
    for row, cycles in (("period", 2.0), ("integral(v**2)", 2.0), ("mean(v**2)", 1.0)):
        own = float(doubling.orbit.quantity(row))
        values = np.concatenate([run.y[:, 0] for run in stability_runs(twice, row)])
        assert np.min(np.abs(values - cycles * own)) < 1e-9 * own
        assert np.max(np.abs(np.diff(values))) < 0.1 * own
        (mark,) = marks_of(diagram.bifurcations, diagram.branches, row, "a")
        np.testing.assert_allclose(mark.y, [own, 2.0 * own] if cycles == 2.0 else [own], rtol=1e-6)


@pytest.mark.parametrize("seed", range(8))
def test_lines_are_sampled_inside_of_the_axes_only(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ax = Figure().subplots()
    ax.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    x, y = np.sort(rng.uniform(-0.5, 1.5, 30)), rng.uniform(-0.5, 1.5, 30)
    y[rng.integers(30, size=4)] = 10.0 ** rng.uniform(0.5, [1.0, 2.0, 8.0, 16.0])
    ax.plot(x, y)
    pixels, box = line_pixels(ax), ax.bbox.padded(1.001)  # matplotlib clips a pixel outside
    assert np.all((pixels > box.min) & (pixels < box.max))
    found = ax.transData.inverted().transform(pixels)
    # brute force: 5,000 points of each segment, those inside of the axes
    share = np.linspace(0.0, 1.0, 5_001)[:, None]
    inside = np.concatenate(
        [
            part[np.all((part > 0.0) & (part < 1.0), axis=1)]
            for part in (a + share * (b - a) for a, b in pairwise(np.column_stack([x, y])))
        ]
    )
    gaps = [np.abs(found - point).max(axis=1).min() for point in inside[::50]]
    assert max(gaps) < 0.02  # a spacing is 0.008 of the width


def test_a_branch_that_grows_without_bound_leaves_the_axes() -> None:
    orbit = cf.find_orbit("coulomb", {"Omega": 0.9, "S": 0.1, "S0": 0.1})
    branch = cf.continue_orbit(orbit, "Omega", (0.7, 1.3))  # x_max grows to 1e6 at resonance
    assert branch.x_max.max() > 1e5
    for row in ("x_max", "stops"):
        low, high = branch.plot(row=row).get_ylim()
        far = branch.x_max[np.abs(branch.values - 1.0) > 0.05 * np.ptp(branch.values)]
        assert far.max() < high < 3.0 * far.max() and low < far.min()
    phases = branch.quantity("phase(x, 1)")  # they change most there, and stay small
    low, high = branch.plot(row="phase(x, 1)").get_ylim()
    assert low < phases.min() and phases.max() < high


def test_multipliers_jump_where_a_branch_ends(diagram: Any) -> None:
    """At a CS the multipliers are those of the orbit on each side: no line leads from one to the other."""
    (event,) = diagram.of_kind("CS")
    ends = [
        (branch.quantity("multiplier")[-side], stability_runs(branch, "multiplier")[-side])
        for branch in diagram.branches
        for side, end in enumerate(branch.ends)
        if end.bifurcation is not None and end.bifurcation.kind is event.kind
    ]
    assert len(ends) == 4 and np.ptp([value for value, _ in ends]) > 0.1
    for value, run in ends:
        assert np.min(np.abs(run.y[[0, -1]] - value)) == 0.0
        assert np.max(np.abs(np.diff(run.y[:, 0]))) < 0.2  # the jump is 0.7 or more
    (mark,) = marks_of([event], diagram.branches, "multiplier", "Omega")
    for value, _ in ends:
        assert np.min(np.abs(mark.y - value)) < 1e-9


def test_multipliers_that_grow_without_bound_leave_the_axes() -> None:
    fixed = {"w": 1.0, "k": 1.0, "c": 0.1, "d": 1.0, "e": 0.8}
    orbit = cf.find_orbit("impact", {"A": 0.9, **fixed})
    branch = cf.continue_orbit(orbit, "A", (0.01, 1.0))  # ends at a grazing impact
    sizes = branch.quantity("multiplier")
    assert sizes.max() > 1e9
    ax = branch.plot(row="multiplier")
    assert 0.0 <= ax.get_ylim()[0] < sizes.min()
    assert np.sort(sizes)[-2] < ax.get_ylim()[1] < 100.0
    assert [text.get_text()[:12] for text in ax.texts] == [r"$\mathrm{SN}"]
