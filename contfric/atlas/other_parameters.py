"""A diagram with other fixed parameters: what is asked for stays, the start is simulated again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict

from contfric.atlas.diagram import Diagram
from contfric.atlas.explore import explore
from contfric.errors import AperiodicError, ConvergenceError
from contfric.orbit.finding.find import find_orbit

#: Where in the range a start is looked for, in this order: where one orbit attracts, another may not.
_STARTS = (0.5, 0.25, 0.75, 0.1, 0.9)


def anew(diagram: Diagram, params: Mapping[str, float]) -> Diagram:
    """Explore the parameter of a diagram again, over the same range, with other parameters fixed.

    Raises
    ------
    ParameterError
        If the model does not allow the parameters.
    AperiodicError, ConvergenceError
        If no periodic orbit attracts anywhere that one is looked for.
    """
    low, high = diagram.range
    asked = asdict(diagram.settings)
    asked["stop_at"] = dict(asked["stop_at"])
    for share in _STARTS:
        value = low + share * (high - low)
        try:
            start = find_orbit(diagram.model, {**params, diagram.parameter: value})
        except (AperiodicError, ConvergenceError):
            if share == _STARTS[-1]:
                raise
            continue
        return explore(start, diagram.parameter, diagram.range, **asked)
    raise AssertionError("unreachable")
