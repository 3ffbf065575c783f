"""Random parameters: distributions as a user gives them, and samples, each of seed and number only.

Samples come in blocks of d + 2, for d parameters: two independent draws A and B, and d points AB_i, which
are A with the i-th parameter of B (A. Saltelli et al., Comput. Phys. Commun. 181 (2010) 259-270). Every
sample has the distribution asked for, blocks are independent of each other, and Sobol indices need no
further samples.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.errors import ParameterError, mapping_of, shown
from contfric.models.definition import Model

_VALID = "(low, high), or a frozen distribution of scipy.stats (in a study {norm: [0.4, 0.005]})"


@dataclass(frozen=True)
class Uniform:
    """The uniform distribution from ``low`` to ``high``."""

    low: float
    high: float

    def ppf(self, share: FloatArray) -> FloatArray:
        """Return the quantiles of some shares."""
        return self.low + (self.high - self.low) * share


@dataclass(frozen=True, eq=False)
class Varied:
    """Parameters that vary, each with its distribution.

    Attributes
    ----------
    names : their names
    distributions : what has their quantiles, ``ppf``
    texts : the distributions in words
    """

    names: tuple[str, ...]
    distributions: tuple[Any, ...]
    texts: tuple[str, ...]

    @property
    def block(self) -> int:
        """Samples in a block."""
        return len(self.names) + 2

    def draw(self, seed: int, count: int) -> FloatArray:
        """Return samples, shape (count, parameters); sample i is the same for every count.

        Examples
        --------
        >>> one = Varied(("S",), (Uniform(0.0, 1.0),), ("",))
        >>> bool((one.draw(1, 7)[:4] == one.draw(1, 4)).all())
        True
        """
        d = len(self.names)
        shares = np.empty((-(-count // self.block), self.block, d))
        for number, block in enumerate(shares):
            one, other = np.random.default_rng([seed, number]).random((2, d))
            block[:] = one
            block[1] = other
            block[np.arange(2, d + 2), np.arange(d)] = other
        drawn = shares.reshape(-1, d)[:count]
        columns = [x.ppf(u) for x, u in zip(self.distributions, drawn.T, strict=True)]
        return np.ascontiguousarray(np.stack(columns, axis=1), dtype=np.float64)


def checked_distributions(model: Model, given: object, parameter: str) -> Varied:
    """Return the distributions that a user gave.

    Raises
    ------
    ParameterError
        If a name is no parameter of the model or the one that the diagrams are along, or what stands there
        is no distribution.
    """
    found = mapping_of("distributions", given, "{'S': (0.3, 0.34)}")
    if not found:
        raise ParameterError("distributions names no parameter: such as {'S': (0.3, 0.34)}")
    for name in found:
        model.index_of(name)
        if name == parameter:
            raise ParameterError(f"the diagrams are along '{name}': it has no distribution")
    pairs = [_distribution(name, value) for name, value in found.items()]
    return Varied(tuple(found), tuple(x for x, _ in pairs), tuple(text for _, text in pairs))


def _distribution(name: str, value: Any) -> tuple[Any, str]:
    if callable(getattr(value, "ppf", None)):
        return value, _frozen(name, value)
    ends = tuple(value) if isinstance(value, Iterable) and not isinstance(value, Mapping) else ()
    numbers = all(isinstance(e, Real) and not isinstance(e, bool) for e in ends)
    if len(ends) != 2 or not numbers or not np.isfinite(ends).all() or not ends[0] < ends[1]:
        raise ParameterError(f"the distribution of '{name}' is {_VALID}; got {shown(value)}")
    low, high = (float(end) for end in ends)
    return Uniform(low, high), f"uniform from {low:g} to {high:g}"


def _frozen(name: str, value: Any) -> str:
    """Describe a frozen distribution; one whose quantiles are no numbers is refused."""
    try:
        middle = np.asarray(value.ppf(np.array([0.25, 0.5, 0.75])), dtype=np.float64)
    except (
        Exception
    ):  # a distribution that is not frozen lacks its shapes, and anything may have a ppf
        middle = np.full(3, np.nan)
    if middle.shape != (3,) or not np.isfinite(middle).all():
        raise ParameterError(
            f"the distribution of '{name}' is {_VALID}; the quantiles of {shown(value)} are no numbers"
        )
    if not hasattr(value, "dist"):
        return type(value).__name__
    arguments = [f"{x:g}" for x in value.args] + [f"{k}={x:g}" for k, x in value.kwds.items()]
    return f"{value.dist.name}({', '.join(arguments)})"
