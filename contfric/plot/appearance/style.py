"""Colours, markers, line styles and axis names of figures."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib import rcParams
from matplotlib.colors import to_hex, to_rgb

from contfric.errors import ParameterError, did_you_mean
from contfric.models import Model
from contfric.plot.appearance.names import parameter_label
from contfric.quantities.registry import NAMED, QuantityLike, quantity_of

#: Palette that stays distinguishable to colour-blind readers (M. Okabe and K. Ito, 2008).
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILLION, PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"
GREY = "#6E6E6E"

#: Colours of the four typical branches; the others take `_OTHERS` in the order of their names. These four
#: differ in lightness, too, and the first three others from them to every kind of colour blindness.
_TYPICAL = {"2s": "#005A9C", "0s": BLACK, "1a": VERMILLION, "2a": "#3DBE95"}
#: The grey, from black to white, that the colour of a branch of unknown stability is mixed with, and its
#: share. A thin solid line in it is not taken for one of a stable branch, and its hue is still seen.
_UNKNOWN_GREY, _UNKNOWN_SHARE = 0.6, 0.55
#: Brightness of a colour that is used a second time.
_DARKER = 0.6
_OTHERS = ("#8000E6", "#66331A", "#CC99FF", ORANGE, "#1A1A8C", "#A50F15", SKY)

#: Dark and light of one hue for a domain and its mirror image.
_DOMAIN_PAIRS = ((BLUE, SKY), (VERMILLION, "#F2A45C"), (GREEN, "#7BCBA9"), (PURPLE, "#EBC3D8"))

#: Where no domain has an image, the light ones follow the dark ones.
_SINGLES = tuple(pair[k] for k in (0, 1) for pair in _DOMAIN_PAIRS)

STABLE, UNSTABLE, UNKNOWN = "-", (0, (4.0, 2.2)), "-"
LINE_WIDTH, MIRROR_WIDTH, UNKNOWN_WIDTH = 1.7, 1.1, 0.9
#: Bridges lie apart: finely dotted, thin, of one colour, beneath the branches of motions without holds.
BRIDGE, BRIDGE_COLOUR, BRIDGE_WIDTH = (0, (1.4, 1.4)), "#8C8C8C", 1.0
BRIDGE_NAME = "bridge (orbits with a hold)"
#: Sizes of text where ``font.size`` of matplotlib is 10, its default; see :func:`sized`.
SMALL, TEXT = 8.0, 10.0

#: Where a legend next to the axes stands.
NEXT_TO: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0), "borderaxespad": 0.0}


def sized(size: float) -> float:
    """Return a size of text or of a marker, in points, in proportion to matplotlib's ``font.size``.

    Examples
    --------
    >>> sized(SMALL)
    8.0
    """
    return size * float(rcParams["font.size"]) / 10.0


@dataclass(frozen=True)
class Marker:
    """How one kind of event is marked: bifurcations of smooth systems are black."""

    shape: str
    face: str = BLACK
    size: float = 6.0
    edge: str = BLACK

    def look(self) -> dict[str, Any]:
        """Return matplotlib's arguments for points that are drawn with it, without a line."""
        return {
            "linestyle": "none",
            "marker": self.shape,
            "markersize": sized(self.size),
            "markerfacecolor": self.face,
            "markeredgecolor": self.edge,
            "markeredgewidth": 0.8,
        }


MARKERS = {
    "SN": Marker("o", size=5.5),
    "BP": Marker("D", size=5.5),
    "PD": Marker("s", size=5.5),
    "NS": Marker("p", size=6.5),
    "CS": Marker("^", face="white", size=6.5),
    "SS": Marker("v", face=YELLOW, size=6.5),
    "AS": Marker("<", face=YELLOW, size=6.5),
    "GS": Marker(">", face=YELLOW, size=6.5),
    "T": Marker("|", face=GREY, edge=GREY, size=6.0),
}
OTHER_MARKER = Marker("*", face="white", size=7.0)


@dataclass(frozen=True)
class DiagramRow:
    """One quantity of a diagram: the name on the axis, in which %s is the displacement as mathematics."""

    label: str
    even: bool = False  # the same for an orbit and its mirror image

    def name(self, displacement: str) -> str:
        """Return the name on the axis, by that of the displacement."""
        symbol = parameter_label(displacement).strip("$")
        name, index, below = symbol.partition("_{")
        if index and "%s_{" in self.label:  # one index for both: q_{1,max}
            return self.label.replace("%s_{", f"{name}_{{{below.rstrip('}')},")
        return self.label.replace("%s", symbol)


#: The rows that need the joints of orbits only; any other quantity is measured when it is asked for.
ROWS = {
    name: DiagramRow(NAMED[name].label, NAMED[name].even)
    for name in ("x_max", "x_min", "stops", "psi", "period")
}


#: Rows that are times; those that are states; a diagram of other rows has no unit of the model in it.
_TIMES, _STATES = frozenset({"period"}), frozenset({"x_max", "x_min", "stops"})


def _in_units(row: DiagramRow, name: str, model: Model | None) -> DiagramRow:
    """Return a row whose label says in what unit of the model it is, and from where it is measured."""
    units = dict(model.units) if model is not None else {}
    label = row.label
    if model is not None and name in _STATES:
        unit, origin = units.get(model.states[0], 1.0), dict(model.origins).get(model.states[0])
        label += f" from {origin}" if origin else ""
    else:
        unit = units.get("t", 1.0) if name in _TIMES else 1.0
    return DiagramRow(label if unit == 1.0 else f"{label} / {unit:g}", row.even)


def row_of(asked: QuantityLike, model: Model | None) -> DiagramRow:
    """Return a row: any quantity of the model; without a model, one of :data:`ROWS`.

    Raises
    ------
    ParameterError
        If there is no such quantity.
    """
    if isinstance(asked, str) and asked in ROWS:
        return _in_units(ROWS[asked], asked, model)
    names = [*NAMED, *(n for n, _ in model.quantities)] if model is not None else [*ROWS]
    word = isinstance(asked, str) and asked.isidentifier()
    if model is None or (word and asked not in names):
        if model is not None and {asked, str(asked).rpartition("_")[0]} & {*model.states}:
            quantity_of(asked, model)  # a state: it says how to ask for its extremum
        raise ParameterError(f"no row '{asked}' in a diagram{did_you_mean(asked, names)}")
    found = quantity_of(asked, model)
    label = found.name.rpartition(":")[-1] if found.named is None else found.named.label
    return DiagramRow(label, found.even)


def lighter(colour: str, share: float = 0.45) -> str:
    """Return a colour mixed with white."""
    return _mixed(colour, 1.0, share)


def greyish(colour: str) -> str:
    """Return a colour mixed with grey: that of a branch whose stability is not known."""
    return _mixed(colour, _UNKNOWN_GREY, _UNKNOWN_SHARE)


def _mixed(colour: str, other: float, share: float) -> str:
    red, green, blue = (c + (other - c) * share for c in to_rgb(colour))
    return to_hex((red, green, blue))


def _nth(palette: Sequence[str], k: int) -> str:
    """Return the k-th colour; each further round of a palette is darker."""
    return _mixed(palette[k % len(palette)], 0.0, 1.0 - _DARKER ** (k // len(palette)))


def _simplest_first(name: str) -> tuple[list[int], str]:
    """Return what sorts names by their numbers: orbits of few segments have the colours that differ most."""
    return [int(digits) for digits in re.findall(r"\d+", name)], name


def branch_colours(names: Iterable[str]) -> dict[str, str]:
    """Return a colour for each name of a branch, the same in every row of a diagram.

    Examples
    --------
    >>> branch_colours(["1a", "2s"])
    {'1a': '#D55E00', '2s': '#005A9C'}
    """
    distinct = list(dict.fromkeys(names))
    others = sorted(set(distinct) - set(_TYPICAL), key=_simplest_first)
    cycle = {name: _nth(_OTHERS, k) for k, name in enumerate(others)}
    return {name: _TYPICAL.get(name) or cycle[name] for name in distinct}


#: Domains that a legend can tell apart.
_MANY = 24


def domain_colours(model: Model) -> dict[str, str]:
    """Return a colour for each domain: dark and light of one hue for mirror images.

    A domain that is its own mirror image, such as the stick, is black.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> domain_colours(load_model("coulomb"))["stick"]
    '#000000'
    """
    labels = domain_labels(model)
    images = {labels[name]: labels[image] for name, image in model.mirror_domain.items()}
    found: dict[str, str] = {}
    hues = iter(range(len(model.domains)))
    for label in dict.fromkeys(labels.values()):
        image = images.get(label)
        if label in found:
            continue
        if image == label:
            found[label] = BLACK
            continue
        k = next(hues)
        if image is None:
            found[label] = _nth(_SINGLES, k)
            continue
        dark, light = zip(*_DOMAIN_PAIRS, strict=True)
        found[label], found[image] = _nth(dark, k), _nth(light, k)
    return {domain.name: found[labels[domain.name]] for domain in model.domains}


def domain_labels(model: Model) -> dict[str, str]:
    """Return what each domain is called in a legend: by its mode where a model has too many domains."""
    many = len(model.domains) > _MANY
    return {d.name: d.mode if many else d.label or d.name for d in model.domains}
