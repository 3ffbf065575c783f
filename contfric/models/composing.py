"""From the description of a structure with many contacts to its model (:mod:`contfric.models.composed`)."""

from __future__ import annotations

from dataclasses import replace

from contfric.models.build import GeneratedFlow
from contfric.models.composed import ComposedModel
from contfric.models.composition import composition_of
from contfric.models.derive import Spread, constraint_of, level_of, stop_surface_of, symmetry_of
from contfric.models.description import Description
from contfric.models.entries import EntryError
from contfric.models.evaluate import Sampler, defaults, floats
from contfric.models.measuring import displacement_of, extrema_at_joints
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
        name=description.name,
        title=description.title or description.name,
        states=description.states,
        parameters=description.parameters,
        constraints=tuple(
            constraint_of(("constraints", i), text, why, params)
            for i, (text, why) in enumerate(description.constraints)
        ),
        observables=description.observables,
        surfaces=tuple(surfaces),
        modes=(composition.mode(quiet),),
        domains=(composition.domain(quiet),),
        departures=(),
        symmetry=symmetry_of(sampler, surfaces),
        stop_surface=description.stop_surface or stop_surface_of(sampler),
        displacement="" if extrema_at_joints(sampler, surfaces) else displacement_of(description),
        flow_factory=GeneratedFlow(description.motion),
        spread=Spread(description.spread, description.text),
        references=description.references,
        autonomous=not description.period,
        filippov=composition.leaves_at_rest,
        max_step=description.max_step,
        quantities=description.quantities,
        units=description.units,
        definition=description.text,
    )
