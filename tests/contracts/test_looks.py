"""Figures for papers: colours that everybody can tell apart, insets, labels that thin out."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Annotation, Text

import contfric as cf
from contfric.plot import new_figure, plot_diagram
from contfric.plot.appearance.labels import Anchor, line_pixels, marker_pixels, place_labels
from contfric.plot.appearance.style import _OTHERS, _TYPICAL, MARKERS, STABLE, UNSTABLE
from contfric.plot.diagrams.inset import add_inset, crowd

#: Severe colour blindness, in linear RGB (Machado, Oliveira and Fernandes, 2009).
BLIND = {
    "none": np.eye(3),
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritanopia": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
}
#: sRGB to CIE XYZ, and its white.
XYZ = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
WHITE = [0.9505, 1.0, 1.089]
#: The branches that most diagrams have, and the first of those that they have besides.
FIRST = [*_TYPICAL.values(), *_OTHERS[:3]]


def linear(colour: str) -> np.ndarray:
    c = np.array(to_rgb(colour))
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def lab(rgb: np.ndarray) -> np.ndarray:
    """Return CIE L*a*b*, in which a distance of 2 is just noticed."""
    xyz = np.asarray(XYZ) @ np.clip(rgb, 0.0, 1.0) / WHITE
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16.0 / 116.0)
    return np.array([116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])])


def test_the_measure_knows_red_from_green() -> None:
    """The check itself: what looks the same to the colour-blind is near."""
    seen = {
        name: [lab(np.asarray(m) @ linear(c)) for c in ("#D55E00", "#8B6B00")]
        for name, m in BLIND.items()
    }
    assert np.linalg.norm(np.subtract(*seen["protanopia"])) < 5.0
    assert np.linalg.norm(np.subtract(*seen["none"])) > 30.0


@pytest.mark.parametrize("kind", BLIND)
def test_branches_are_told_apart_by_the_colour_blind(kind: str) -> None:
    seen = {c: lab(np.asarray(BLIND[kind]) @ linear(c)) for c in FIRST}
    for one, other in combinations(FIRST, 2):
        assert np.linalg.norm(seen[one] - seen[other]) > 25.0, (one, other)


def test_the_typical_branches_are_told_apart_without_colours() -> None:
    grey = sorted(lab(linear(c))[0] for c in _TYPICAL.values())
    assert min(np.diff(grey)) > 14.0
    assert max(grey) < 75.0  # and seen on white paper


def test_what_matters_is_told_by_more_than_colour() -> None:
    """Stability by dashes, kinds of events by shapes."""
    assert STABLE != UNSTABLE
    assert len({look.shape for look in MARKERS.values()}) == len(MARKERS)


# ------------------------------------------------------------------------------- line styles


def test_line_styles_are_those_that_are_given(diagram: cf.Diagram) -> None:
    given = {"unstable": ":", "bridge": "-."}
    for draw in (diagram.plot, lambda **look: plot_diagram(diagram, ("psi",), **look)[0]):
        ax = draw(linestyles=given)
        seen = {line.get_linestyle() for line in ax.lines if line.get_gid()}
        assert seen - {"None"} == {"-", ":", "-."}
        legend = ax.get_legend() or ax.figure.legends[0]
        shown = {
            t.get_text(): h for t, h in zip(legend.get_texts(), legend.legend_handles, strict=True)
        }
        assert shown["unstable"].get_linestyle() == ":"
        assert shown["stable"].get_linestyle() == "-"


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            {"unstabel": ":"},
            "linestyles are of stable, unstable, unknown, bridge.*'unstabel'.*did you mean",
        ),
        ({"unstable": "wavy"}, r"linestyles\['unstable'\]: 'wavy' is no line style"),
        ({"bridge": 3}, r"linestyles\['bridge'\]: 3 is no line style"),
    ],
)
def test_line_styles_that_are_none(diagram: cf.Diagram, given: Any, message: str) -> None:
    with pytest.raises(cf.ParameterError, match=message):
        diagram.plot(linestyles=given)


# ------------------------------------------------------------------------------------ insets


def labels(ax: Any) -> set[str]:
    return {t.get_text() for t in ax.texts if isinstance(t, Annotation) and t.get_text()}


@pytest.mark.parametrize("row", ["x_max", "psi"])
def test_an_inset_has_the_labels_of_its_part_and_hides_little(
    diagram: cf.Diagram, row: str
) -> None:
    ax = diagram.plot(row=row, inset=(0.4875, 0.4935))
    (inner,) = ax.child_axes
    assert inner.get_xlim() == (0.4875, 0.4935)
    assert {t[9:11] for t in labels(inner)} == {"BP", "SS"}
    assert {t[9:11] for t in labels(ax)} == {"SN", "CS"}
    ax.figure.canvas.draw()
    frame = inner.get_window_extent()
    frame_and_numbers = inner.get_tightbbox()
    texts = [Text.get_window_extent(t) for t in ax.texts if isinstance(t, Annotation)]
    assert not any(frame_and_numbers.overlaps(box) for box in texts)
    points = np.vstack([ax.transData.transform(line.get_xydata()) for line in ax.lines])
    assert not any(frame.contains(x, y) for x, y in points)
    for line in inner.lines:
        if line.get_gid() == "2a" and line.get_marker() == "None":
            low, high = inner.get_ylim()
            assert low < np.nanmin(line.get_ydata()) and np.nanmax(line.get_ydata()) < high


@pytest.mark.parametrize("seed", range(8))
def test_an_inset_stands_where_nothing_is_drawn(seed: int) -> None:
    """Whatever is drawn: lines through all of the axes leave no corner, and the axes grow."""
    draw = np.random.default_rng(seed)
    ax = new_figure(6.0, 4.0).add_subplot()
    x = np.linspace(0.0, 1.0, 400)
    for _ in range(int(draw.integers(1, 7))):
        ax.plot(x, np.cumsum(draw.normal(size=400)), marker="o" if seed % 2 else "")
    inner, _ = add_inset(ax, [], (0.4, 0.5), lambda inner: inner.plot(x, x))
    ax.figure.canvas.draw()
    assert inner is not None
    frame = inner.get_tightbbox()
    points = np.vstack([line_pixels(ax), marker_pixels(ax)])
    assert len(points) > 400
    assert not any(frame.contains(*point) for point in points)


def test_where_events_crowd_is_found(diagram: cf.Diagram) -> None:
    marks = _marks(diagram)
    assert crowd(marks, 0.2) is None  # there are three, and tangencies do not count
    wide = crowd(marks, 1.0)
    assert wide is not None and wide[0] < 0.4887 and wide[1] > 0.5419
    assert plot_diagram(diagram, ("psi",), inset=True)[0].child_axes == []


def _marks(diagram: cf.Diagram) -> Any:
    from contfric.plot.diagrams.events import marks_of

    return marks_of(diagram.bifurcations, diagram.branches, "psi", "Omega")


@pytest.mark.parametrize(
    ("inset", "more"),
    [
        ((0.4875, 0.4935), set()),  # the bridge, 7e-5 long, lies beneath the markers there, too
        ((0.4916, 0.4919), {"bridge"}),
        ((0.49170, 0.49185), {"bridge", "T"}),
        ((0.53, 0.55), set()),  # it is elsewhere
        (True, set()),
    ],
)
def test_the_legend_names_what_an_inset_shows(
    diagram: cf.Diagram, inset: Any, more: set[str]
) -> None:
    def known(ax: Any) -> set[str]:
        return {t.get_text().split(":")[0].split()[0] for t in ax.get_legend().get_texts()}

    assert known(diagram.plot(inset=inset)) - known(diagram.plot()) == more


@pytest.mark.parametrize("inset", [3, "x", (0.5,), (0.6, 0.5), (0.4, float("nan")), None])
def test_insets_that_are_none(diagram: cf.Diagram, inset: Any) -> None:
    with pytest.raises(cf.ParameterError, match="inset is True, False, or"):
        diagram.plot(inset=inset)


# ------------------------------------------------------------------------------------ labels


@pytest.mark.parametrize("dpi", [50, 200, 300])
def test_labels_stand_in_the_same_places_at_any_resolution(dpi: int) -> None:
    """Places are chosen in points: the texts themselves are a little larger or smaller in whole pixels."""
    offsets = []
    for resolution in (100, dpi):
        ax = Figure(figsize=(4, 3), dpi=resolution).add_subplot(xlim=(0, 1), ylim=(0, 1))
        ax.plot([0, 1], [0.5, 0.5])
        ax.plot([0.3, 0.8], [0.5, 1.0], marker="o")
        placed = place_labels(ax, [Anchor(0.3, 0.5, "SN"), Anchor(0.32, 0.5, "CS")])
        offsets.append([label.xyann for label in placed])
    assert len(offsets[0]) == 2
    np.testing.assert_allclose(offsets[1], offsets[0], atol=1.5)


def test_many_labels_stand_near_their_points_and_are_not_repeated() -> None:
    """A thicket: forty events along a line, of three names."""
    ax = new_figure(7.0, 4.0).add_subplot()
    ax.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    anchors = [Anchor(0.02 + k / 41, 0.5, f"event {k % 3}") for k in range(40)]
    placed = place_labels(ax, anchors)
    FigureCanvasAgg(ax.figure).draw()
    assert 10 < len(placed) < 40
    boxes = [Text.get_window_extent(label) for label in placed]
    assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))
    pixels = ax.figure.dpi / 72.0
    for label in placed:
        assert np.hypot(*label.xyann) < 45.0  # points
        same = [o for o in placed if o is not label and o.get_text() == label.get_text()]
        gaps = [abs(np.subtract(*ax.transData.transform([o.xy, label.xy]))[0]) for o in same]
        assert min(gaps) > 60.0 * pixels


def test_numbers_that_differ_by_rounding_are_drawn_as_one() -> None:
    """The multiplier of a converter does not depend on its voltage: the axis has no digits of rounding."""
    orbit = cf.find_orbit("buck")
    branch = cf.continue_orbit(orbit, "E", (19.0, 21.0))
    mu = branch.quantity("multiplier")
    assert 0.0 < np.ptp(mu) < 1e-11 * mu.mean()
    low, high = branch.plot(row="multiplier").get_ylim()
    assert low < 0.9995 * mu.mean() and high > 1.0005 * mu.mean()
    low, high = branch.plot(row="x_max").get_ylim()
    assert high - low < 2.0 * np.ptp(branch.x_max)


def test_a_phase_is_drawn_with_a_gap_where_it_passes_half_a_turn() -> None:
    branch = cf.continue_orbit(cf.find_orbit("impact", {"c": 0.3}), "w", (0.9, 1.6))
    ax = branch.plot(row="phase(x, 2)")
    heights = [np.asarray(line.get_ydata(), dtype=float) for line in ax.lines]
    assert min(np.nanmin(y) for y in heights) < -3.0 and max(np.nanmax(y) for y in heights) > 3.0
    steps = np.concatenate([np.abs(np.diff(y)) for y in heights])
    assert np.nanmax(steps) < np.pi


def test_a_row_without_a_finite_value_says_so() -> None:
    branch = cf.continue_orbit(cf.find_orbit("relay"), "h", (0.15, 0.25))
    assert np.all(np.isnan(branch.quantity("phase(x, 2)")))
    assert "no finite value" in [text.get_text() for text in branch.plot(row="phase(x, 2)").texts]
    assert "no finite value" not in [text.get_text() for text in branch.plot(row="psi").texts]


@pytest.mark.parametrize("model", ["belt", "coulomb", "impact"])
def test_the_legend_of_an_orbit_hides_no_name_of_a_level(model: str) -> None:
    ax = cf.find_orbit(model).plot()
    ax.figure.canvas.draw()
    legend = ax.get_legend().get_window_extent()
    texts = [text.get_window_extent() for text in ax.texts if text.get_text()]
    beyond = [box for box in texts if box.x0 >= ax.bbox.x1]
    assert beyond and not any(legend.overlaps(box) for box in beyond)
