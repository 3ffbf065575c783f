"""Sliding modes on both sides of a wall: each is left at its own limits, to the side to which fields lead."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typed import typed

import contfric as cf
from contfric.models.view import FlowView


class Capsule:
    """A capsule on dry ground, driven by a mass inside that hits a spring; ground and wall are random.

    Its sliding modes are derived, or typed with limits that are ``static`` times the kinetic ones.
    """

    def __init__(self, seed: int, static: float = 1.0) -> None:
        rng, self.static = np.random.default_rng(seed), static
        self.params = {
            name: float(rng.uniform(*ends))
            for name, ends in {
                "be": (12.0, 18.0), "de": (0.01, 0.03), "ga": (4.5, 5.5), "up": (0.95, 1.05)
            }.items()
        }  # fmt: skip

    def load(self, x: float, v: float) -> float:
        """Return the force on the capsule, without friction."""
        return x + 0.1 * v + max(self.params["be"] * (x - self.params["de"]), 0.0)

    @property
    def text(self) -> str:
        """The file: a mode for each side of the wall and each way, and nothing of sliding."""
        numbers = ", ".join(f"{name}: {value!r}" for name, value in self.params.items())
        forces = {"free": "spring", "hit": "(spring + be*(x - de))"}
        modes = "\n".join(
            f"  {name}{way}: {{in: {{stop: {'+' if name == 'hit' else '-'}, still: {way}}}, "
            f"field: {{x: v, vc: ({load} {limit})/ga, v: P*cos(0.95*t) - {load} - ({load} {limit})/ga}}}}"
            for name, load in forces.items()
            for way, limit in (("+", "- up"), ("-", "+ 1"))
        )
        sliding, limits = ", sliding: filippov", ""
        if self.static > 1.0:
            sliding = ""
            for name, load in forces.items():
                levels = (("up", "up", "-"), ("down", "-1", "+"))
                limits += "".join(
                    f", {name}_{end}: {{observable: {name}, level: {self.static!r}*({level})}}"
                    for end, level, _ in levels
                )
                inside = ", ".join(f"{name}_{end}: {side}" for end, _, side in levels)
                modes += (
                    f"\n  rest_{name}: {{in: {{stop: {'+' if name == 'hit' else '-'}, still: 0, {inside}}}, "
                    f"field: {{x: v, vc: 0, v: P*cos(0.95*t) - {load}}}}}"
                )
        return f"""
name: capsule
states: [x, v, vc]
parameters: {{P: 1.6, {numbers}}}
period: 2*pi/0.95
define: {{spring: x + 0.1*v}}
observables: {{gap: x, free: spring, hit: spring + be*(x - de)}}
surfaces: {{stop: {{observable: x, level: de}}, still: {{observable: vc{sliding}}}{limits}}}
modes:
{modes}
"""


@pytest.mark.parametrize(("seed", "static"), [(0, 1.0), (1, 1.0), (2, 1.4)])
def test_sliding_is_left_to_the_side_to_which_both_fields_lead(
    tmp_path: Path, seed: int, static: float
) -> None:
    """Whatever the load would do on the other side of the wall; far beyond the speeds of starts, too."""
    own, rng = Capsule(seed, static), np.random.default_rng(seed)
    model = typed(tmp_path, own.text)
    view, seen = FlowView(model, model.vector({})), set()
    for x, v in zip(rng.uniform(-0.5, 0.5, 200), rng.uniform(-40.0, 40.0, 200), strict=True):
        state, load, hit = np.array([x, v, 0.0]), own.load(x, v), x > own.params["de"]
        heights = {s.name: view.height(s.name, 0.5, state) for s in model.surfaces}
        signs = {n: int(np.sign(h)) for n, h in heights.items()} | {"still": 0}
        wanted = 1 if load > static * own.params["up"] else -1 if load < -static else 0
        found = model.domain_by_name[model.domain_at(signs)]
        assert found.signs["still"] == wanted, (x, v, load)
        seen.add((hit, wanted))
    assert len(seen) == 6


@pytest.mark.parametrize("seed", range(2))
def test_an_event_is_the_same_from_both_sides(tmp_path: Path, seed: int) -> None:
    """A stop at the limit of rest is a CS, reached with the stick that vanishes there or without it."""
    model = typed(tmp_path, Capsule(seed).text)
    diagram = cf.explore(cf.find_orbit(model), "P", (1.5, 1.75))
    crossing = [e for e in diagram.bifurcations if e.kind is cf.Kind.CS]
    assert crossing
    for event in crossing:
        branches = [
            b
            for b in diagram.branches
            if any(
                e.bifurcation is not None
                and abs(e.bifurcation.params["P"] - event.params["P"]) < 1e-9
                for e in b.ends
            )
        ]
        assert len(branches) == 2
        for branch in branches:
            again = cf.explore(branch[len(branch) // 2], "P", (1.5, 1.75))
            near = [e for e in again.bifurcations if abs(e.params["P"] - event.params["P"]) < 1e-8]
            assert [e.kind for e in near] == [event.kind]
            assert len(again.branches) == len(diagram.branches)
    assert diagram.verify().passed
