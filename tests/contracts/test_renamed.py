"""Old names of attributes work, and say what the new one is."""

from __future__ import annotations

import pytest

import contfric as cf
from contfric.adding.windows import Window
from contfric.censuses.result import Census

PARAMS = {"Omega": 0.5, "S": 0.32, "S0": 0.4}


def test_words_are_itineraries() -> None:
    orbit = cf.find_orbit("coulomb", PARAMS)
    trajectory = cf.simulate("coulomb", PARAMS, state=[1.3, 0.0], periods=2)
    for found in (orbit, trajectory):
        with pytest.warns(DeprecationWarning, match="'word' is now 'itinerary'"):
            assert found.word == found.itinerary
    for kept, old in ((Window, "word"), (Census, "words")):
        assert isinstance(vars(kept)[old], property)
