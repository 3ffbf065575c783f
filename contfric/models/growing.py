"""The flow of a structure whose modes are made when they are visited."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

from contfric.models.coded import Forms
from contfric.models.coded_flow import CodedFlow
from contfric.models.composition import composition_of
from contfric.models.describe import from_text

if TYPE_CHECKING:
    from contfric.flow.interface import CompiledFlow
    from contfric.handle import Bound


class GrowingFlow:
    """The compiled flow of the modes that were visited, in that order.

    Parameters
    ----------
    definition : of the structure; its first mode is the one in which no contact acts
    modes : the names of those that were visited, that mode first
    surfaces : the names of those that came with them
    """

    def __init__(self, definition: str, modes: Sequence[str], surfaces: Sequence[str]) -> None:
        self._composition = composition_of(definition)
        self._forms = Forms(from_text(definition))
        self._coded = CodedFlow(self._forms)
        for name in surfaces:
            self.see(name)
        for name in modes[1:]:
            self.add(name)

    def add(self, name: str) -> None:
        """Add a mode."""
        for load, text in self._composition.loads_in(name).items():
            self._forms.name(load, text)
        self._coded.add(self._composition.text(name))

    def see(self, name: str) -> None:
        """Add a surface."""
        self._coded.see(*self._composition.surface(name))

    @property
    def field(self) -> Bound:
        """The field of the modes."""
        return self._coded.field

    @property
    def onto(self) -> Bound:
        """The way back onto the surfaces that a mode slides on."""
        return self._coded.onto

    @cached_property
    def flow(self) -> CompiledFlow:
        """The flow; its functions stay the same when modes are added."""
        return self._coded.flow
