"""Two-folds of normal forms, and of friction with a normal force that vanishes, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
import yaml

import contfric as cf
from contfric.models.reading.files import from_data
from contfric.models.two_folds import TwoFoldKind


def typed(text: str) -> cf.Model:
    return from_data(yaml.safe_load(text))


def normal_form(up: int, down: int, extra: str = "") -> cf.Model:
    """f+ = (-up y, 1, a), f- = (down z, b, 1) (Jeffrey and Colombo 2009): L+L+ x = -up, L-L- x = down."""
    states = "x, y, z" + (", w" if extra else "")
    more = ", w: -w" if extra else ""
    return typed(
        f"""
name: normal
states: [{states}]
parameters: {{a: 0.3, b: 0.4, s: 0.2}}
autonomous: true
surfaces: {{h: {{observable: x, level: 0, sliding: filippov}}}}
modes:
  plus: {{in: {{h: "+"}}, field: {{x: "-({up})*(y - s{extra})", y: 1, z: a{more}}}}}
  minus: {{in: {{h: "-"}}, field: {{x: "({down})*(z + 2*s)", y: b, z: 1{more}}}}}
"""
    )


@pytest.mark.parametrize(
    ("up", "down", "kind"),
    [(1, 1, "INVISIBLE"), (-1, -1, "VISIBLE"), (1, -1, "MIXED"), (-1, 1, "MIXED")],
)
def test_normal_forms_are_named(up: int, down: int, kind: str) -> None:
    (fold,) = cf.find_two_folds(normal_form(up, down))
    assert fold.kind is TwoFoldKind[kind] and fold.dimension == 0
    assert np.allclose(fold.state, [0.0, 0.2, -0.4], atol=1e-12)
    assert fold.curvatures == pytest.approx((-up, down))
    assert (fold.surface, fold.above, fold.below) == ("h", "plus", "minus")


def test_in_four_states_they_are_a_set() -> None:
    """Their kind changes where w = 2: L+L+ x = -(1 - w/2) with w' = -w."""
    found = cf.find_two_folds(normal_form(1, 1, " + 0.5*w"))
    assert {fold.kind.name for fold in found} == {"INVISIBLE", "MIXED"}
    for fold in found:
        assert fold.dimension == 1
        x, y, z, w = fold.state
        assert abs(x) + abs(y - 0.2 + 0.5 * w) + abs(z + 0.4) < 1e-11
        assert fold.curvatures == pytest.approx((-(1 - 0.5 * w), 1.0))
        assert fold.kind.name == ("INVISIBLE" if w < 2 else "MIXED")


def test_check_says_what_they_are() -> None:
    report = cf.check_model(normal_form(1, 1))
    notes = [f.message for f in report.findings if "two-fold" in f.message]
    assert len(notes) == 1 and "Teixeira" in notes[0] and "y = 0.2, z = -0.4" in notes[0]
    assert report.ok


def test_friction_without_normal_force() -> None:
    """v' = -x + F cos t - (N + cos(t + 1)) sgn v, with two-folds where N + cos(t + 1) = 0 and x = F cos t.

    There v'' = -v - F sin t +- sin(t + 1) = up, down.
    """
    model = typed(
        """
name: pressed
states: [x, v]
parameters: {N: 0.4, F: 2.0}
period: 2*pi
define: {press: N + cos(t + 1)}
surfaces: {v: {observable: v, level: 0, sliding: filippov}}
field: {x: v, v: -x + F*cos(t) - press*sign(v)}
modes: {forward: {in: {v: "+"}}, backward: {in: {v: "-"}}}
"""
    )
    found = cf.find_two_folds(model)
    times = [(s * math.acos(-0.4) - 1) % (2 * math.pi) for s in (1, -1)]
    assert sorted(fold.time for fold in found) == pytest.approx(sorted(times), abs=1e-10)
    for fold in found:
        t = fold.time
        assert fold.state == pytest.approx([2 * math.cos(t), 0.0], abs=1e-10)
        up, down = (-2 * math.sin(t) + s * math.sin(t + 1) for s in (1, -1))
        assert fold.curvatures == pytest.approx((up, down), abs=1e-9)
        visible = (up > 0) + (down < 0)
        assert fold.kind is [TwoFoldKind.INVISIBLE, TwoFoldKind.MIXED, TwoFoldKind.VISIBLE][visible]


def test_what_is_no_two_fold_is_not_named() -> None:
    """A field that is continuous at its surface is tangent on both sides at once, and is one field there."""
    kinked = typed(
        """
name: kinked
states: [x, v]
parameters: {k: 3.0}
period: 2*pi
surfaces: {x: {observable: x, level: 0.5}}
modes:
  free: {in: {x: "-"}, field: {x: v, v: -x + cos(t)}}
  pressed: {in: {x: "+"}, field: {x: v, v: -x - k*(x - 0.5) + cos(t)}}
"""
    )
    assert cf.find_two_folds(kinked) == ()
    for name in ("belt", "popp", "relay-sliding", "stribeck"):
        assert cf.find_two_folds(name) == (), name
    with pytest.raises(cf.ParameterError, match="not declared by formulas"):
        cf.find_two_folds("coulomb")
