"""Mappings that a user indexes by name: one that is not there is answered with those that are."""

from __future__ import annotations

import copy
import json
import pickle
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.base.named import Named
from contfric.remember.stored import Reader, Writer

PARAMS = {"Omega": 0.5, "S": 0.32, "S0": 0.4}


def _results() -> dict[str, Mapping[str, Any]]:
    orbit = cf.solve_orbit("coulomb", "1a", PARAMS)
    branch = cf.continue_orbit(orbit, "Omega", (0.5, 0.545))
    fold = next(b for b in branch.bifurcations if b.kind is cf.Kind.SN)
    swept = cf.sweep("coulomb", "S", np.linspace(0.3, 0.34, 3), PARAMS)
    grid = {"x": np.linspace(-1, 1, 2), "v": np.linspace(-1, 1, 2)}
    fit = cf.fit("coulomb", [cf.Measured("x_max", 1.42, 0.01, {"Omega": 0.5})], PARAMS, ["S"])
    box = {"Omega": (0.53, 0.55), "S": (0.31, 0.33)}
    curve = cf.continue_bifurcation(fold, ("Omega", "S"), box)
    return {
        "model": cf.load_model("coulomb").defaults,
        "orbit": orbit.params,
        "branch": branch.params,
        "event": fold.params,
        "event's gradient": fold.gradient(),
        "gradient": orbit.gradient("x_max"),
        "its other side": orbit.gradient("x_max").behind,
        "sweep": swept.params,
        "basins": cf.basins("coulomb", grid, PARAMS).params,
        "trajectory": cf.simulate("coulomb", PARAMS, periods=2).params,
        "points": cf.poincare("coulomb", PARAMS).params,
        "fit": fit.params,
        "curve": curve.params,
        "its meanings": curve.meanings,
    }


def test_names_are_suggested() -> None:
    for what, names in _results().items():
        for wrong, right in (("omega", "Omega"), ("s0", "S0")):
            if right not in names:
                continue
            with pytest.raises(KeyError, match=f"did you mean '{right}'") as raised:
                names[wrong]
            assert isinstance(raised.value, cf.ParameterError), what
            assert str(raised.value).startswith("there is no"), what
            assert names.get(wrong) is None and wrong not in names
            assert f"Valid: {', '.join(names)}" in str(raised.value)
        with pytest.raises(cf.ParameterError, match=r"there is no 7\. Valid"):
            names[7]  # type: ignore[index]


def test_gradients_and_directions_are_found_by_name() -> None:
    several = cf.solve_orbit("coulomb", "1a", PARAMS).gradients(["x_max", "energy"])
    with pytest.raises(cf.ParameterError, match="did you mean 'energy'"):
        several["enrgy"]
    swept = cf.sweep("coulomb", "S", np.linspace(0.3, 0.34, 3), PARAMS)
    with pytest.raises(cf.ParameterError, match="did you mean 'up'"):
        swept.periods["Up"]


def test_they_are_dictionaries(tmp_path: Path) -> None:
    names = Named(Omega=0.5, S=0.3)
    writer = Writer()
    for same in (
        copy.deepcopy(names),
        pickle.loads(pickle.dumps(names)),
        Reader(writer.bytes_of(names)).value(),
    ):
        assert type(same) is Named and same == names and list(same) == ["Omega", "S"]
    assert json.loads(json.dumps(names)) == dict(names)
    orbit = cf.solve_orbit("coulomb", "1a", PARAMS)
    cf.save(orbit, tmp_path / "orbit.npz")
    with pytest.raises(cf.ParameterError, match="did you mean"):
        cf.load(tmp_path / "orbit.npz").params["omega"]
