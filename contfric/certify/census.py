r"""Prove that no other period-1 orbit with a stick exists than those that are listed.

Such an orbit is released: at some phase t it has ``u = S0`` (or its symmetry image has), and a period T
later the same release comes again. Where what follows a release is a smooth function of its phase, let
``g(t) = t' - t - T``, t' the time of that later release. So orbits are the zeros of g. All phases of a
period are covered with intervals (branch and bound). On each of them

* no release is possible, as the load at rest falls; or
* of all solutions that are released in it (:mod:`contfric.certify.releases.following`) none is released again
  T later; or
* there is one such release, smooth in the phase, and g' has a sign: g has one zero if its signs at the ends
  differ, and none if they do not.

An interval with none of these is halved, down to a strip that is listed as undecided. At a jump of the map no
derivative exists. There the map is filled: it has all values that may follow on either side, and the
second of the three suffices. Interval Newton on g narrows each zero. Two zeros are releases of one orbit if
the one is found on the way of the other: each interval holds one zero only, so which one it is known.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from contfric.base.extras import need_flint
from contfric.errors import ParameterError
from contfric.models import ModelSource, Parameters
from contfric.models.tied import tied

if TYPE_CHECKING:
    from contfric.certify.census_result import CensusCertificate


def certify_census(model: ModelSource, params: Parameters | None = None) -> CensusCertificate:
    """Prove which period-1 orbits with a stick exist at given parameters, and that no other one does.

    Counted are solutions that stick until ``|u| = S0`` and return after one period of the excitation. Not
    counted are orbits that never stick, that are never released, and those of a delayed release (bridges).

    Parameters
    ----------
    params : of the model; defaults fill in

    Returns
    -------
    CensusCertificate
        The orbits that exist, and ``proved``: whether it is proved that no other one does.

    Raises
    ------
    ParameterError
        If the checker does not know the law of the model, or the parameters are not valid.

    Examples
    --------
    >>> import contfric as cf
    >>> found = cf.certify_census("coulomb", {"Omega": 0.5, "S": 0.8, "S0": 0.9})
    >>> found.proved, [one.orbit.name for one in found.orbits]
    (True, ['2s'])
    """
    need_flint()
    from contfric.verify.file import CHECKED_MODELS

    model, params = tied(model, params)
    if model.name not in CHECKED_MODELS:
        raise ParameterError(
            f"certify_census is offered for the model '{', '.join(CHECKED_MODELS)}', not for "
            f"'{model.name}': its law at stops and releases is written down for that one"
        )
    from contfric.certify.releases.census_search import searched

    return searched(model, model.vector(params))
