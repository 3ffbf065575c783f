"""A model in balls, whichever way it is defined."""

from __future__ import annotations

from collections.abc import Mapping

from flint import arb

from contfric.errors import ParameterError
from contfric.models.balls.model import BallModel
from contfric.models.definition import Model


def ball_model(
    model: Model,
    params: Mapping[str, float],
    free: str | None = None,
    value: arb | None = None,
    slopes: bool = True,
) -> BallModel:
    """Return a model's matrices in balls, at parameters that are the exact binary numbers given.

    Parameters
    ----------
    free, value : a parameter that is free, and the ball that it is in
    slopes : whether derivatives by the free parameter are asked for

    Raises
    ------
    ParameterError
        If the model moves in no closed form: the message names the modes; or has modes of chatter.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> model = load_model("coulomb")
    >>> ball_model(model, model.defaults).states
    2
    """
    if model.chatters:
        raise ParameterError(
            f"proofs are not offered for '{model.name}': infinitely many impacts have no enclosure here"
        )
    balls = {name: arb(float(number)) for name, number in params.items()}
    if free is not None and value is not None:
        balls[free] = value
    free = free if slopes else None
    if model.ball_factory is not None:
        return model.ball_factory(balls, free)
    from contfric.models.balls.declared import declared_balls

    return declared_balls(model, balls, free)
