"""Models on disk: what is derived from a declaration is derived once, and code belongs to formulas only."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys

import numpy as np
import pytest
import yaml

from contfric.base.resources import bundled_dir
from contfric.models.check.probe import field_of
from contfric.models.deriving import sections
from contfric.models.generated import build, symbols
from contfric.models.library import bundled, find
from contfric.models.reading import files
from contfric.models.reading.describe import describe


@pytest.fixture
def fresh_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("CONTFRIC_CACHE_DIR", str(tmp_path))
    files.model_of.cache_clear()
    build.module_path.cache_clear()
    yield tmp_path
    files.model_of.cache_clear()
    build.module_path.cache_clear()


def read(name):
    files.model_of.cache_clear()
    return find(name)


@pytest.mark.parametrize("name", ["popp", "relay-sliding", "blade-damper", "impact"])
def test_a_model_from_disk_is_the_one_that_was_derived(fresh_cache, monkeypatch, name):
    first = read(name)
    monkeypatch.setattr(files, "_model_from", None)  # derived once more, it would fail
    monkeypatch.setattr(files, "_read_as_text", None)
    second = read(name)
    assert second is not first
    assert pickle.dumps(second) == pickle.dumps(pickle.loads(pickle.dumps(first)))
    assert second.transitions == first.transitions
    vector = first.vector(first.defaults)
    assert np.array_equal(second.spread(first.defaults), first.spread(first.defaults))
    assert np.array_equal(second.vector(second.defaults), vector)


@pytest.mark.parametrize(
    "damage", [lambda b: b"", lambda b: b[:-9], lambda b: b[:99] + b"x" + b[100:]]
)
def test_what_is_damaged_is_derived_again(fresh_cache, damage):
    first = read("belt")
    kept = [p for p in fresh_cache.rglob("*") if p.suffix in (".model", ".text")]
    assert len(kept) == 2
    for path in kept:
        path.write_bytes(damage(path.read_bytes()))
    assert pickle.dumps(read("belt")) == pickle.dumps(pickle.loads(pickle.dumps(first)))


def test_no_model_needs_numba_or_sympy_to_be_loaded_again():
    """Either takes as long as everything else together."""
    code = f"""if True:
        import sys
        import contfric
        for name in {bundled()!r}:
            contfric.load_model(name)
        print([name for name in ("numba", "sympy", "scipy") if name in sys.modules])
    """
    for _ in range(2):  # the first process may have to derive them
        done = subprocess.run(
            [sys.executable, "-c", code], env=os.environ, capture_output=True, text=True, check=True
        )
    assert done.stdout.strip() == "[]"


def test_other_numbers_of_a_model_are_the_same_code():
    data = yaml.safe_load((bundled_dir("models") / "popp.yaml").read_text(encoding="utf-8"))
    path = build.module_path(describe(data).motion)
    integration = data.get("integration", {})
    assert "tolerance" not in integration
    loose = {**data, "integration": {**integration, "tolerance": 1e-9}}
    assert describe(loose).motion != describe(data).motion
    assert build.module_path(describe(loose).motion) == path
    first = next(iter(data["parameters"]))
    defaults = {**data["parameters"], first: {"default": 0.77}}
    other = describe({**data, "parameters": defaults}).motion
    assert other != describe(data).motion
    assert build.module_path(other) == path
    faster = {**data["field"], "v": f"2*({data['field']['v']})"} if "field" in data else None
    assert faster is None or build.module_path(describe({**data, "field": faster}).motion) != path


def test_a_tolerance_reaches_the_flow_of_the_same_code():
    definition = find("popp").definition
    blocks = [
        build.load_module(definition).functions(tolerance)._numbers() for tolerance in (1e-12, 1e-9)
    ]
    assert [b["relative"] for b in blocks] == [b["absolute"] for b in blocks] == [1e-12, 1e-9]


@pytest.mark.parametrize("name", ["popp", "relay-sliding", "belt"])
def test_a_model_has_one_module(fresh_cache, name):
    """Its fields are asked for before its flow is: by starts and by `check`, as the module of the flow."""
    model = read(name)
    flow = model.flow_factory
    assert flow.definition != model.definition
    assert field_of(model) is build.load_module(flow.definition).field_of
    assert len(list(fresh_cache.rglob("contfric_model_*.py"))) == 1


def test_modes_are_joined_once(fresh_cache, monkeypatch):
    """Formulas that look different are told apart by sympy, which is as slow to load as all else together."""
    data = yaml.safe_load((bundled_dir("models") / "popp.yaml").read_text(encoding="utf-8"))
    description = describe(data)
    sections._joined.cache_clear()
    first = sections.joined_modes(description)
    assert len(set(first.values())) < len(first)
    sections._joined.cache_clear()
    monkeypatch.setattr(sections, "_sought", None)
    assert sections.joined_modes(description) == first
    sections._joined.cache_clear()


def test_the_fields_of_modes_that_are_compared_are_derived_once(monkeypatch):
    """Two contacts whose friction depends on the velocity have many pairs of modes with one field."""
    friction = {"kind": "friction", "kinetic": "S/(1 + abs(v{0} - 0.2))", "velocity": "v{0} - 0.2"}
    pads = {
        f"pad{k}": {key: text.format(k) for key, text in friction.items()} | {"static": "1.2*S"}
        for k in (1, 2)
    }
    description = describe(
        {
            "name": "two-pads",
            "coordinates": ["q1", "q2"],
            "parameters": {"Omega": 0.9, "S": 0.2},
            "period": "2*pi/Omega",
            "mass": "identity",
            "damping": [[0.03, 0.0], [0.0, 0.03]],
            "stiffness": [[2.0, -0.5], [-0.5, 2.0]],
            "force": {"q1": "cos(Omega*t)"},
            "contacts": pads,
        }
    )
    made = []

    class Counted(symbols.Formulas):
        def __init__(self, description):
            made.append(description.name)
            super().__init__(description)

    monkeypatch.setattr(symbols, "Formulas", Counted)
    first = sections._sought(description)
    assert len(first) - len(set(first.values())) > 2
    assert made == ["two-pads"]
