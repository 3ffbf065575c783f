"""From the description of a structure with many contacts to its model (:mod:`contfric.models.composed`)."""

from __future__ import annotations

from dataclasses import replace

from contfric.models.composed import ComposedModel
from contfric.models.composition import composition_of
from contfric.models.derive import as_described, level_of
from contfric.models.description import Description
from contfric.models.entries import EntryError
from contfric.models.evaluate import Sampler, defaults, floats
from contfric.models.not_affine import NotAffineError
from contfric.models.regions import ordered_surfaces


def composed_from(description: Description) -> ComposedModel:
    """Build the model of a structure whose modes are made when they are visited.

    Raises
    ------
    EntryError
        If its modes are not affine: only these are made one by one.
    """
    composition = composition_of(description.text)
    try:
        composition.check()
    except (NotAffineError, ArithmeticError) as reason:
        raise EntryError(
            ("contacts",),
            "contacts that share their loads, and more than can be listed, need affine forces, and "
            f"here is {reason}. Four friction contacts (five contacts of three states) or fewer on masses "
            "of their own may have any law",
        ) from None
    params, evaluator = defaults(description), floats(description)
    sampler = Sampler(evaluator, params)
    levels = {s.name: level_of(evaluator, s, params) for s in description.surfaces}
    surfaces = [
        replace(s, switching=s.name in composition.switching)
        for s in ordered_surfaces(description, levels)
    ]
    quiet = description.modes[0].name
    return ComposedModel(
        **as_described(description, sampler, surfaces),
        modes=(composition.mode(quiet),),
        domains=(composition.domain(quiet),),
        departures=(),
        filippov=composition.leaves_at_rest,
        phase=description.phase,
    )
