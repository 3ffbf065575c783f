"""Closed itineraries of the transition graph up to a number of stops: those that a census asks for.

A **stop** is the end of a slide on a switching surface. The closed itineraries with up to N stops are
generated as necklaces (least rotations), by the recursion of H. Fredricksen, I. J. Kessler and J. Maiorana
(Discrete Math. 23 (1978) 207-210) in the form of F. Ruskey: an itinerary ``a_1 .. a_t`` whose longest
Lyndon prefix has length p can be continued by the letters ``>= a_{t+1-p}``, and is a necklace if p
divides t. Of an itinerary and its mirror image one is kept. Itineraries that repeat a shorter one are kept:
an orbit born at a period doubling follows the itinerary of its parent twice, and is not its repetition.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache

from contfric.errors import ParameterError
from contfric.models.definition import Model
from contfric.orbit.itinerary.itineraries import mirror_pairs
from contfric.signature import ReducedItinerary
from contfric.signature.cyclic import least_rotation, rotated
from contfric.signature.reduced import ReducedPair, fuses
from contfric.signature.walks import entered, show


@cache
def letters_of(model: Model) -> tuple[ReducedPair, ...]:
    """Return the (mode, exit) pairs that can be a segment of a reduced itinerary, in canonical order.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> letters_of(load_model("coulomb"))
    (('slide+', 'v'), ('slide-', 'v'), ('stick', 'F+'), ('stick', 'F-'))
    """
    return tuple(
        (mode.name, surface.name)
        for mode in model.modes
        for surface in model.surfaces
        if modes_after(model, (mode.name, surface.name))
    )


def modes_after(model: Model, pair: ReducedPair) -> set[str]:
    """Return the modes that can follow a segment."""
    mode, surface = pair
    targets = {
        model.domain_by_name[target].mode
        for (domain, through), target in model.transitions.items()
        if through == surface and model.domain_by_name[domain].mode == mode
    }
    return {after for after in targets if not fuses(model, mode, surface, after)}


def is_stop(model: Model, pair: ReducedPair) -> bool:
    """Return whether a segment is a slide that ends at a stop."""
    mode, surface = pair
    return not model.mode_by_name[mode].sliding and model.surface_by_name[surface].switching


def canonical_pair(model: Model, itinerary: ReducedItinerary) -> ReducedItinerary:
    """Return the itinerary that stands for an itinerary and its mirror image in a census."""
    letters = letters_of(model)
    least = _least([letters.index(pair) for pair in itinerary], _mirror_letters(model))
    return tuple(letters[k] for k in least)


def closed_itineraries(model: Model, stops: int) -> list[ReducedItinerary]:
    """Return the closed itineraries with up to ``stops`` stops, one of each mirror pair, canonical.

    Raises
    ------
    ParameterError
        If the model has closed itineraries without a stop: the number of stops does not bound them.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> [len(closed_itineraries(load_model("coulomb"), n)) for n in (1, 2, 3)]
    [1, 5, 10]
    """
    letters, graph = letters_of(model), _Graph(model)
    weights = [int(is_stop(model, pair)) for pair in letters]
    _check_bounded(model, graph, weights)
    images = _mirror_letters(model)
    found = [w for w in _necklaces(graph, weights, stops) if _least(w, images) == w]
    found.sort(key=lambda w: (sum(weights[k] for k in w), len(w), w))
    return [tuple(letters[k] for k in itinerary) for itinerary in found]


@cache
def _mirror_letters(model: Model) -> tuple[int, ...] | None:
    """Return the mirror image of each letter, as indices."""
    if model.symmetry is None:
        return None
    letters = letters_of(model)
    return tuple(letters.index(pair) for pair in mirror_pairs(model, letters))


def _least(itinerary: Sequence[int], images: tuple[int, ...] | None) -> tuple[int, ...]:
    """Return the least rotation of an itinerary or of its mirror image."""
    itineraries = [tuple(itinerary)]
    if images is not None:
        itineraries.append(tuple(images[k] for k in itinerary))
    return min(rotated(w, least_rotation(w)) for w in itineraries)


class _Graph:
    """The transition graph as itineraries pass it: sets of domains as bits.

    A letter is entered in some domains of its mode, and leads from them, across transparent surfaces
    inside of the mode and then through its exit, into domains of the next letter's mode.
    """

    def __init__(self, model: Model) -> None:
        self.letters = letters_of(model)
        self.names = [domain.name for domain in model.domains]
        self.entries = {
            mode.name: [i for i, d in enumerate(model.domains) if d.mode == mode.name]
            for mode in model.modes
        }
        #: domains of a mode that are reached by one letter from one domain, as bits
        self.steps: dict[tuple[int, int, str], int] = {}
        for k, pair in enumerate(self.letters):
            for entry in self.entries[pair[0]]:
                for after in modes_after(model, pair):
                    reached = entered([self.names[entry]], pair[1], model, pair[0], after)
                    self.steps[k, entry, after] = sum(1 << self.names.index(d) for d in reached)

    def start(self, letter: int) -> tuple[tuple[int, int], ...]:
        """Return (entry, where it has led to) for each entry of a letter."""
        return tuple((entry, 1 << entry) for entry in self.entries[self.letters[letter][0]])

    def step(
        self, reached: tuple[tuple[int, int], ...], letter: int, after: int
    ) -> tuple[tuple[int, int], ...]:
        """Walk one letter into the mode of the next one; what leads nowhere is left out."""
        mode = self.letters[after][0]
        moved = ((entry, self._moved(bits, letter, mode)) for entry, bits in reached)
        return tuple((entry, bits) for entry, bits in moved if bits)

    def _moved(self, bits: int, letter: int, mode: str) -> int:
        found = 0
        for domain in self.entries[self.letters[letter][0]]:
            if bits >> domain & 1:
                found |= self.steps.get((letter, domain, mode), 0)
        return found

    def closes(self, reached: tuple[tuple[int, int], ...], last: int, first: int) -> bool:
        """Return whether some entry is reached again."""
        return any(bits >> entry & 1 for entry, bits in self.step(reached, last, first))


def _necklaces(graph: _Graph, weights: Sequence[int], most: int) -> Iterator[tuple[int, ...]]:
    """Yield the closed necklaces of letters whose weights sum to at most ``most``."""
    count = len(weights)

    def extended(
        itinerary: tuple[int, ...], lyndon: int, weight: int, reached: tuple[tuple[int, int], ...]
    ) -> Iterator[tuple[int, ...]]:
        if len(itinerary) % lyndon == 0 and graph.closes(reached, itinerary[-1], itinerary[0]):
            yield itinerary
        least = itinerary[len(itinerary) - lyndon]
        for letter in range(least, count):
            if weight + weights[letter] > most:
                continue
            following = graph.step(reached, itinerary[-1], letter)
            if following:
                longer = lyndon if letter == least else len(itinerary) + 1
                yield from extended(
                    (*itinerary, letter), longer, weight + weights[letter], following
                )

    for first in range(count):
        if weights[first] <= most:
            yield from extended((first,), 1, weights[first], graph.start(first))


def _check_bounded(model: Model, graph: _Graph, weights: Sequence[int]) -> None:
    """Refuse a model whose graph has a cycle without a stop."""
    letters = graph.letters
    left = {k for k in range(len(letters)) if weights[k] == 0}
    while left:
        ending = {
            k
            for k in left
            if not any(letters[q][0] in modes_after(model, letters[k]) for q in left)
        }
        if not ending:
            names = ", ".join(show([letters[k]]) for k in sorted(left))
            raise ParameterError(
                f"model '{model.name}' has closed itineraries without a stop ({names}): their number is "
                "not bounded by stops, so that a census cannot list them"
            )
        left -= ending
