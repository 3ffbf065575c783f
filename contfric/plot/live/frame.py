"""A live diagram in a notebook: its page in a frame, so that nothing of it meets the notebook's own."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING

from contfric.plot.live.page import page_of

if TYPE_CHECKING:
    from contfric.atlas.diagram import Diagram


@dataclass(frozen=True, repr=False)
class Frame:
    """What a notebook shows of a live diagram.

    Attributes
    ----------
    page : the whole page, as :meth:`contfric.Diagram.to_html` writes it
    height : of the frame, in pixels
    name : what it shows, where no page can be shown
    """

    page: str
    height: int
    name: str

    @classmethod
    def of(cls, diagram: Diagram, height: int) -> Frame:
        """Return the frame of a diagram."""
        return cls(page_of(diagram), height, f"live view of {diagram!r}")

    def _repr_html_(self) -> str:
        return (
            f'<iframe srcdoc="{escape(self.page)}" width="100%" height="{self.height}" '
            'style="border: 0" sandbox="allow-scripts allow-downloads"></iframe>'
        )

    def __repr__(self) -> str:
        return f"<{self.name}: shown in a notebook; to_html() writes a file>"
