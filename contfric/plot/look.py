"""How the branches of a diagram are drawn, where the user wants it otherwise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from matplotlib.colors import is_color_like

from contfric.errors import ParameterError, did_you_mean
from contfric.plot.inset import Inset, checked_inset
from contfric.plot.style import branch_colours

if TYPE_CHECKING:
    from contfric.continuation.branch import Branch


@dataclass(frozen=True)
class Look:
    """How a diagram is drawn: with a legend, with insets, and names and colours by signature."""

    legend: bool
    names: Mapping[str, str]
    colours: Mapping[str, str]
    inset: Inset = False

    @classmethod
    def of(
        cls,
        branches: Sequence[Branch],
        names: Mapping[str, str] | None,
        colours: Mapping[str, str] | None,
        *,
        legend: bool,
        inset: Inset = False,
    ) -> Look:
        """Return the look of some branches; bridges have one colour and one name.

        Raises
        ------
        ParameterError
            If a name or a colour is given for a branch that there is not, or something is no colour.
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
        return cls(legend, called, shown, checked_inset(inset))
