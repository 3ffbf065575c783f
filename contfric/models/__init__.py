"""Models by name: bundled ones and those of installed packages (entry point ``contfric.models``)."""

from __future__ import annotations

from importlib.metadata import entry_points

from contfric.errors import ParameterError, did_you_mean
from contfric.models.definition import Model

__all__ = ["DEFAULT_MODEL", "Model", "load_model", "model_names"]

#: The model of the command line where none is named.
DEFAULT_MODEL = "coulomb"


def model_names() -> list[str]:
    """Return the names that :func:`load_model` knows."""
    return ["coulomb", *sorted(e.name for e in entry_points(group="contfric.models"))]


def load_model(model: str | Model) -> Model:
    """Return a model by its bundled name or entry point; a model is returned as it is.

    Raises
    ------
    ParameterError
        If no model has that name.

    Examples
    --------
    >>> load_model("coulomb").states
    ('x', 'v')
    """
    if isinstance(model, Model):
        return model
    if model == "coulomb":
        from contfric.models.coulomb import coulomb

        return coulomb
    for entry in entry_points(group="contfric.models"):
        if entry.name == model:
            loaded = entry.load()
            if not isinstance(loaded, Model):
                raise ParameterError(f"entry point '{model}' is no contfric.models.Model")
            return loaded
    raise ParameterError(f"unknown model '{model}'{did_you_mean(str(model), model_names())}")
