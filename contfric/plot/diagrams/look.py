"""Options for the appearance of a diagram's branches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from matplotlib.colors import is_color_like
from matplotlib.lines import Line2D

from contfric.errors import ParameterError, did_you_mean
from contfric.plot.appearance.style import BRIDGE, STABLE, UNKNOWN, UNSTABLE, branch_colours
from contfric.plot.diagrams.inset import Inset, checked_inset

if TYPE_CHECKING:
    from contfric.continuation.branch import Branch

#: A line style of matplotlib: ``"--"``, ``"dashdot"`` or ``(0, (4, 2))``.
LineStyle: TypeAlias = str | tuple[float, Sequence[float]]

#: What a line style tells, and which it is where the user wants no other.
_STYLES: dict[str, LineStyle] = {
    "stable": STABLE,
    "unstable": UNSTABLE,
    "unknown": UNKNOWN,
    "bridge": BRIDGE,
}


@dataclass(frozen=True)
class Look:
    """How a diagram is drawn: legend, insets, names and colours by signature, line styles by stability.

    ``overlay`` tells whether points of a sweep are drawn, too.
    """

    legend: bool
    names: Mapping[str, str]
    colours: Mapping[str, str]
    styles: Mapping[str, LineStyle]
    inset: Inset = False
    overlay: bool = False

    @classmethod
    def of(
        cls,
        branches: Sequence[Branch],
        names: Mapping[str, str] | None,
        colours: Mapping[str, str] | None,
        linestyles: Mapping[str, LineStyle] | None = None,
        *,
        legend: bool,
        inset: Inset = False,
        overlay: bool = False,
    ) -> Look:
        """Return the look of some branches; bridges have one colour and one name.

        Raises
        ------
        ParameterError
            If a name or a colour is given for a branch that there is not, something is no colour or no
            line style, or a line style is given for what has none.
        """
        regular = dict.fromkeys(b.name for b in branches if not b.bridge)
        for given in (names, colours):
            for name in given or ():
                if name not in regular:
                    raise ParameterError(f"no branch '{name}' here{did_you_mean(name, [*regular])}")
        for name, colour in (colours or {}).items():
            if not is_color_like(colour):
                raise ParameterError(f"colours['{name}']: {colour!r} is no colour of matplotlib")
        own = branch_colours(regular)
        shown = {name: (colours or {}).get(name, own[name]) for name in regular}
        called = {name: (names or {}).get(name, name) for name in regular}
        styles = _styles(linestyles or {})
        return cls(legend, called, shown, styles, checked_inset(inset), overlay)


def _styles(given: Mapping[str, Any]) -> Mapping[str, LineStyle]:
    """Return all line styles, from those that are given."""
    for name, style in given.items():
        if name not in _STYLES:
            raise ParameterError(
                f"linestyles are of {', '.join(_STYLES)}; there is no '{name}'"
                f"{did_you_mean(name, [*_STYLES])}"
            )
        try:
            Line2D([], [], linestyle=style)
        except (ValueError, TypeError):
            raise ParameterError(
                f"linestyles['{name}']: {style!r} is no line style of matplotlib"
            ) from None
    return {**_STYLES, **given}
