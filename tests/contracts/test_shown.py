"""Every public result has a short repr, and a table for notebooks that says what its attributes say."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import contfric as cf
from contfric.base.shown import _FACTS, Shown

PARAMS = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
CHAOS = {"Omega": 0.35, "S": 0.05, "S0": 0.4}
NEAR = {"Omega": (0.49, 0.51), "S": (0.31, 0.33)}
RANGES = {"Omega": (0.53, 0.55), "S": (0.31, 0.33)}


@pytest.fixture(scope="module")
def found(orbit: cf.Orbit, diagram: cf.Diagram, tmp_path_factory: Any) -> dict[str, Any]:
    """Return one object of every class that is shown, by the name of its class."""
    pytest.importorskip("flint")
    fold = diagram.of_kind("SN")[0]
    short = cf.continue_orbit(orbit, "Omega", (0.4999, 0.5001))
    tiny = cf.explore(orbit, "Omega", (0.4999, 0.5001))
    curve = cf.continue_bifurcation(
        fold, ("Omega", "S"), {"Omega": (0.53, 0.56), "S": (0.31, 0.38)}
    )
    inside = cf.find_orbit("coulomb", {**PARAMS, "Omega": 0.54})
    plane = cf.explore_plane(inside, ("Omega", "S"), RANGES, max_sections=1)
    starts = {"x": np.linspace(-1, 1, 3), "v": np.linspace(-1, 1, 3)}
    grid = {"Omega": [0.5], "S": [0.3, 0.32]}
    data = [cf.Measured("x_max", 1.424, 0.005, {"Omega": 0.5})]
    rests = cf.find_equilibria("belt", starts=8)
    rest = cf.explore_equilibria("belt", "vb", (0.1, 1.0), starts=8, values=1)
    folder = tmp_path_factory.mktemp("study") / "out"
    scene = folder.with_name("scene.yaml")
    scene.write_text("model: coulomb\nparams: {Omega: 0.5, S: 0.32, S0: 0.4}\n", encoding="utf-8")
    everything = [
        *(orbit, orbit.signature, orbit.model, orbit.gradient("x_max"), orbit.certify()),
        *(short, diagram, fold, tiny.certify(), fold.certify(), short.certify()),
        *(curve, curve.special[0], plane, plane.regions[0]),
        cf.continue_quantity(orbit, "x_max", 1.42, ("Omega", "S"), NEAR),
        cf.census("coulomb", {"Omega": 0.55}, stops=1),
        *(cf.lyapunov_exponent("coulomb", PARAMS), cf.lyapunov_map("coulomb", grid, {"S0": 0.4})),
        cf.sweep("coulomb", "Omega", [0.5, 0.51], {"S": 0.32, "S0": 0.4}),
        *(cf.poincare("coulomb", PARAMS), cf.release_map("coulomb", CHAOS, count=60)),
        cf.basins("coulomb", starts, {"Omega": 0.541, "S": 0.32, "S0": 0.4}),
        cf.stable_set(
            cf.solve_orbit("coulomb", "2s", PARAMS), {"x": (-2, 2), "v": (-1, 1)}, max_points=3
        ),
        cf.ensemble("coulomb", "Omega", (0.5, 0.55), {"S": (0.3, 0.34)}, {"S0": 0.4}, samples=3),
        *(rests, rests.points[0], rest, rest.branches[0]),
        cf.fit("coulomb", data, PARAMS, ["S"]),
        cf.check_model("coulomb"),
        cf.simulate("coulomb", PARAMS, periods=3),
        cf.run_study(scene, out=folder),
    ]
    return {type(x).__name__: x for x in everything}


#: Classes whose objects take long to compute, or need a model of their own: only their names are checked.
LONG = {"Window": cf.Window, "EquilibriumEvent": cf.EquilibriumEvent, "TwoFold": cf.TwoFold}


def test_every_class_is_tried(found: dict[str, Any]) -> None:
    bases = {c.__name__ for x in found.values() for c in type(x).__mro__}
    assert set(_FACTS) - set(LONG) - bases == set()
    public = [getattr(cf, name) for name in cf.__all__ if name[0].isupper()]
    results = {c.__name__ for c in public if isinstance(c, type) and issubclass(c, Shown)}
    assert results >= set(_FACTS) & {c.__name__ for c in public if isinstance(c, type)}


def test_classes_that_are_not_tried_have_what_is_asked_of_them() -> None:
    for name, kind in LONG.items():
        assert issubclass(kind, Shown) and "__repr__" in vars(kind)
        there = {f.name for f in fields(kind)} | set(dir(kind))
        assert set(_FACTS[name].split()) <= there, name


def test_reprs_are_short(found: dict[str, Any]) -> None:
    for name, x in found.items():
        lines = 3 if name == "Model" else 1  # a model tells its states and parameters, too
        assert len(repr(x)) <= 300 and len(repr(x).splitlines()) <= lines, name
        assert " at 0x" not in repr(x), name


def test_tables_are_well_formed_and_say_something(found: dict[str, Any]) -> None:
    for name, x in found.items():
        html = x._repr_html_()
        page = ElementTree.fromstring(f"<div>{html}</div>")  # every < of a repr is escaped
        rows = page.findall("table/tr")
        assert len(rows) >= 1, name
        assert all("".join(row.itertext()).strip() for row in rows), name
        assert len(html) < 20_000 and " at 0x" not in html, name


def test_tables_say_what_attributes_say(found: dict[str, Any]) -> None:
    def facts(name: str) -> dict[str, str]:
        rows = ElementTree.fromstring(f"<div>{found[name]._repr_html_()}</div>").findall("table/tr")
        return {row[0].text or "": " / ".join(row[1].itertext()) for row in rows}

    orbit = facts("Orbit")
    assert orbit["signature"] == str(found["Orbit"].signature)
    assert orbit["stable"] == "yes" and float(orbit["x max"]) == pytest.approx(found["Orbit"].x_max)
    assert "SN_1a" in facts("Diagram")["bifurcations"]
    assert f"{found['Bifurcation'].params['Omega']:.8g}" in facts("Bifurcation")["params"]
    assert facts("Certificate")["proved"] == "yes"
    assert "SN-CS" in facts("Curve")["special"]


def test_long_lists_are_cut(diagram: cf.Diagram) -> None:
    class Many(Shown):
        branches = diagram.branches * 5

    Many.__name__ = "Diagram"
    Many.bifurcations = Many.loose_ends = Many.notes = ()  # type: ignore[attr-defined]
    Many.complete = Many.verified = None  # type: ignore[attr-defined]
    html = Many()._repr_html_()
    more = 5 * len(diagram.branches) - 12
    assert html.count("Branch") == 12 and f"… and {more} more" in html


def test_nothing_heavy_is_needed() -> None:
    source = (Path(cf.__file__).parent / "base" / "shown.py").read_text(encoding="utf-8")
    assert "import numpy" not in source and "matplotlib" not in source
