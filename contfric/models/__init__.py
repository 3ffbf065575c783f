"""Models by name, by file or by class: bundled ones, those of installed packages, and the user's.

A package offers models by the entry point group ``contfric.models``; an entry is a
:class:`~contfric.models.definition.Model`, a class of
:class:`~contfric.models.reading.oscillator.OscillatorModel`, the path of a YAML file, the path of a folder
of such files, or a function that returns one of these.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from contfric.base.lazy import lazily

if TYPE_CHECKING:
    from collections.abc import Mapping

    from contfric.models.definition import Model as Model
    from contfric.models.reading.oscillator import OscillatorModel

__all__ = ["DEFAULT_MODEL", "Model", "ModelSource", "Parameters", "load_model", "model_names"]

#: What :func:`load_model`, and with it whatever takes a model, accepts.
ModelSource: TypeAlias = "str | Path | Model | type[OscillatorModel] | OscillatorModel"

#: What functions take as parameters: names to numbers, or to what they follow (``{"S0": {"tie": "S"}}``).
Parameters: TypeAlias = "Mapping[str, float | Mapping[str, str]]"

#: The model of the command line where none is named.
DEFAULT_MODEL = "coulomb"


def model_names() -> list[str]:
    """Return the names that :func:`load_model` knows.

    Examples
    --------
    >>> "belt" in model_names()
    True
    """
    from contfric.models.library import names

    return names()


def load_model(model: ModelSource) -> Model:
    """Return a model by its name, its YAML file or its class; a model is returned as it is.

    Parameters
    ----------
    model : str, Path, Model or class
        A bundled name, the name of an entry point, the path of a YAML file (a text that ends in
        ``.yaml`` or ``.yml``, or has a folder in it), or a class that declares a model.

    Returns
    -------
    Model

    Raises
    ------
    ParameterError
        If no model has that name.
    ModelError
        If the file or the class is wrong: where, what, and what would be valid.

    Examples
    --------
    >>> load_model("coulomb").states
    ('x', 'v')
    """
    from contfric.models.definition import Model as Model
    from contfric.models.library import find

    if isinstance(model, Model):
        return model

    return find(model)


# the command line asks for the name of the default model and for nothing else
__getattr__ = lazily(__name__)[1]
